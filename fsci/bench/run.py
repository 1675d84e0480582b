"""Run benchmarks, print their tables, write them as JSON, draw and compare them: the command `fsci bench`."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fsci.bench.compare import compare
from fsci.bench.family import Family, FamilyError, read_families
from fsci.bench.front_plot import plot_front
from fsci.bench.one_percent import table
from fsci.bench.program import ProgramFailed
from fsci.bench.table import FRONT, Row, show
from fsci.case.errors import did_you_mean
from fsci.expression import ExpressionError
from fsci.running.summary import plain, versions


class BenchmarkError(Exception):
    """A benchmark that cannot be run."""


def describe() -> str:
    """The benchmarks there are."""
    return "\n".join(f"{name:15} {family.words}" for name, family in read_families().items())


def run(names: Sequence[str], out: Path | None, against: Path | None, plots: Path | None) -> None:
    """Run families by name, or those of a file NAME.yaml, and show what they give. Raises BenchmarkError.

    Those of results NAME.json are shown and not run.
    """
    before = {} if against is None else _results(against)
    results: dict[str, list[Row]] = {}
    words: dict[str, str] = {}
    for family, earlier in _families(names):
        print(f"\n{family.name}: {family.words}", flush=True)
        try:
            rows = results[family.name] = family.run() if earlier is None else earlier
        except (FamilyError, ExpressionError, ProgramFailed) as error:
            raise BenchmarkError(f"{family.name}: {error}") from None
        words[family.name] = family.words
        print(show(rows), flush=True)
        if plots is not None and FRONT in rows[0]:
            plots.mkdir(parents=True, exist_ok=True)
            plot_front(rows, family.words, plots / f"{family.name}.png")
    if costs := table({name: (words[name], rows) for name, rows in results.items()}):
        print(f"\n{costs}", flush=True)
    if rows := compare(results, before):
        print(f"\nagainst {against}:\n{show(rows)}", flush=True)
    if out is not None:
        machine = {"cores": os.cpu_count(), "machine": platform.machine(), "processor": processor()}
        data = {"machine": machine, "versions": versions(), "commit": commit(), "results": results}
        out.write_text(json.dumps(plain(data), indent=2) + "\n")


def _families(names: Sequence[str]) -> list[tuple[Family, list[Row] | None]]:
    """Families, with their rows if they have been run."""
    ours = read_families()
    found: list[tuple[Family, list[Row] | None]] = []
    for name in ours if list(names) == ["all"] else names:
        if name.endswith((".yaml", ".yml")):
            sys.path.insert(0, str(Path(name).parent.absolute()))  # functions beside the file
            try:
                found += [(family, None) for family in read_families(Path(name)).values()]
            except (FamilyError, OSError) as error:
                raise BenchmarkError(str(error)) from None
        elif name.endswith(".json"):
            found += [
                (ours.get(one, Family(one, one, {}, ())), list(rows)) for one, rows in _results(Path(name)).items()
            ]
        elif name in ours:
            found.append((ours[name], None))
        else:
            raise BenchmarkError(f"there is no benchmark '{name}'{did_you_mean(name, ours)}")
    return found


def _results(path: Path) -> Mapping[str, Any]:
    try:
        return json.loads(path.read_text())["results"]
    except (OSError, ValueError, KeyError) as error:
        raise BenchmarkError(f"{path} has no results of benchmarks ({type(error).__name__})") from None


def commit() -> str:
    """The state of the repository that these files are in, with a + if files have been changed since."""
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty=+"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def processor() -> str:
    """The name of the processor by Linux."""
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.exists() else []
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown")
