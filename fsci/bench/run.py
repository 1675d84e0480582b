"""Run benchmarks, print their tables, write them as JSON, draw and compare them: the command `fsci bench`."""

from __future__ import annotations

import json
import os
import platform
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from fsci.bench import (
    contact,
    cook,
    cost,
    flag,
    fluid,
    hertz,
    idle,
    linear,
    moments,
    processes,
    profile,
    resolution,
    small,
    static,
)
from fsci.bench.compare import compare
from fsci.bench.families import FAMILIES
from fsci.bench.front_plot import plot_front
from fsci.bench.table import Row, show
from fsci.case.errors import did_you_mean
from fsci.run.summary import plain, versions

#: Name -> (what it measures, how). One column of a row is one number or word.
BENCHMARKS: dict[str, tuple[str, Callable[[], list[Row]]]] = {
    "small": ("one time step of small problems: milliseconds of the processor", small.run),
    "idle": ("one Newton step with and without a part that the scene does not need", idle.run),
    "cost": ("one time step by kind of problem and size: what `fsci check` estimates from", cost.run),
    "static": ("one load step of a neo-Hookean cube, 25 x 25 x 25 hex8, as `fsci run` computes it", static.run),
    "linear": ("one linear system of a body under load: direct against iterative, by size", linear.run),
    "cook": ("Cook's membrane, nearly incompressible: error against time, by element and mesh", cook.run),
    "flag": ("CSM3: milliseconds of one time step, by mesh", flag.run_steps),
    "flag_accuracy": ("CSM3, 2 s: error against wall time, by mesh and time step", flag.run_accuracy),
    "kernel": ("mortar integrals of a pair of facets, by their types", contact.run_kernel),
    "search": ("contact search on two wavy sheets of quads, 3D", contact.run_search),
    "moments": ("moments of a torus in the cells of a box, 3D", moments.run),
    "hertz": ("a ball pressed onto a plane in one load step, by cells per radius of contact", hertz.run),
    "tori": ("two tori collide, 200 steps: seconds by part", contact.run_tori),
    "cylinder_2d1": ("Schaefer-Turek 2D-1: error against time, four meshes of both elements", fluid.run_steady),
    "cut_stokes": ("Stokes flow around a disc by the direct solver: seconds by size", fluid.run_stokes),
    "profile": ("one Newton step of flows by part: microseconds per unknown, and what memory allows", profile.run),
    "processes": ("a flow on 1 to 16 processes: cells, neighbours and exchanged bytes of each", processes.run),
    "resolution": ("error of forces by the cells in boundary layers and gaps: what a run warns from", resolution.run),
    "channel": ("a ring moves through a channel in 3D: seconds of one time step by part", fluid.run_channel),
    **{name: (f"{family.words}: error against time", family.run) for name, family in FAMILIES.items()},
}


class BenchmarkError(Exception):
    """A benchmark that cannot be run."""


def describe() -> str:
    """The benchmarks there are."""
    return "\n".join(f"{name:15} {words}" for name, (words, _) in BENCHMARKS.items())


def run(names: Sequence[str], out: Path | None, against: Path | None, plots: Path | None) -> None:
    """Run benchmarks by name and show what they give. Raises BenchmarkError."""
    names = list(BENCHMARKS) if list(names) == ["all"] else names
    for name in names:
        if name not in BENCHMARKS:
            raise BenchmarkError(f"there is no benchmark '{name}'{did_you_mean(name, BENCHMARKS)}")
    before = {} if against is None else _results(against)
    results: dict[str, list[Row]] = {}
    for name in names:
        words, function = BENCHMARKS[name]
        print(f"\n{name}: {words}", flush=True)
        results[name] = function()
        print(show(results[name]), flush=True)
        if plots is not None and name in FAMILIES:
            plots.mkdir(parents=True, exist_ok=True)
            plot_front(results[name], FAMILIES[name].words, plots / f"{name}.png")
    if rows := compare(results, before):
        print(f"\nagainst {against}:\n{show(rows)}", flush=True)
    if out is not None:
        machine = {"cores": os.cpu_count(), "machine": platform.machine(), "processor": processor()}
        data = {"machine": machine, "versions": versions(), "commit": commit(), "results": results}
        out.write_text(json.dumps(plain(data), indent=2) + "\n")


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
