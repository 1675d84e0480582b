"""The command `fsci diff`: what differs between the cases of runs, and between their values."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsci.case import Case, load_case
from fsci.case.settings import differences, dotted, in_words, settings_of
from fsci.plot.lines import plot_lines
from fsci.plot.units import label, measured
from fsci.running.history import History
from fsci.running.kept_case import copies
from fsci.running.results import read_results
from fsci.twin.compare import changes, values

UNCHANGED = 1e-12  #: changes relative to the largest value of a probe that are none


@dataclass(frozen=True)
class Kept:
    """What the folder of a run holds."""

    name: str
    case: Case
    files: Mapping[str, bytes]  #: those that the case names
    summary: Mapping[str, Any]
    history: History

    @property
    def columns(self) -> list[str]:
        """Those of probes, and the forces of contact."""
        forces = [name for name in self.history if re.fullmatch(r"contact\..+\.[xyz]", name)]
        return [*self.summary.get("probes", ()), *forces]


def diff(folders: Sequence[Path], out: Path) -> list[str]:
    """Lines on what the runs in `folders` differ in from the first one; draws out/diff_<probe>.png.

    Raises CaseError for a folder without results.
    """
    runs = [_read(folder, name) for folder, name in zip(folders, _names(folders), strict=True)]
    first, *others = runs
    lines: list[str] = []
    for other in others:
        lines += [f"{first.name} -> {other.name}", *(f"  {line}" for line in _differences(first, other)), ""]
    return lines + [str(path) for path in _draw(runs, out)]


def _read(folder: Path, name: str) -> Kept:
    found = read_results(folder)
    case = load_case(folder)
    files = {str(kept): file.read_bytes() for file, kept in copies(case)}
    return Kept(name, case, files, {"status": "not finished", **found.summary}, found.history)


def _names(folders: Sequence[Path]) -> list[str]:
    """The last parts of paths, as many as tell them apart."""
    parts = [folder.resolve().parts for folder in folders]
    for length in range(1, max(map(len, parts)) + 1):
        names = ["/".join(one[-length:]) for one in parts]
        if len(set(names)) == len(names):
            return names
    return [str(folder) for folder in folders]


def _differences(first: Kept, other: Kept) -> Iterator[str]:
    """Settings, files, ends of the runs, then a table of values."""
    found = False
    for keys, old, new in differences(settings_of(first.case), settings_of(other.case)):
        found = True
        yield f"{dotted(keys)}: {in_words(old)} -> {in_words(new)}"
    for name in sorted(first.files.keys() | other.files.keys()):
        if first.files.get(name) != other.files.get(name):
            found = True
            yield f"{name}: {_presence(name, first.files, other.files)}"
    if not found:
        yield "the cases are the same"
    for run in (first, other):
        if run.summary["status"] != "finished":
            yield f"{run.name}: {run.summary.get('message') or run.summary['status']}"
    yield from _table(first, other)


def _presence(name: str, first: Mapping[str, bytes], other: Mapping[str, bytes]) -> str:
    if name in first and name in other:
        return "other content"
    return "in the first one only" if name in first else "in the second one only"


def _table(first: Kept, other: Kept) -> Iterator[str]:
    own, others = (
        values(run.history, {**run.summary, "probes": run.columns}) if len(run.history.get("time", ())) else {}
        for run in (first, other)
    )
    if not own or not others:
        return
    change = changes(own, others)
    width = max(map(len, own)) + 2
    yield f"{'':{width}}{'first':>14}{'second':>14}{'change':>11}{'largest':>11}"
    for name, value in own.items():
        second = f"{others[name].value:14.6g}" if name in others else f"{'-':>14}"
        last, largest = _percent(change[name].value, "+"), _percent(change[name].curve)
        yield f"{name:{width}}{value.value:14.6g}{second}{last:>11}{largest:>11}"
    yield "at the end, and the largest over time, relative to the largest value of the probe"
    if new := [name for name in others if name not in own]:
        yield f"in the second one only: {', '.join(new)}"


def _percent(share: float, sign: str = "-") -> str:
    if not math.isfinite(share):
        return "-"
    return "0" if abs(share) <= UNCHANGED else f"{100.0 * share:{sign}.3g} %"


def _draw(runs: Sequence[Kept], out: Path) -> Iterator[Path]:
    """A picture for each probe and each pair in contact: a panel for each column, with a line for each run."""
    families: dict[str, list[str]] = {}
    for run in runs:
        for name in run.columns:
            columns = families.setdefault(name.rpartition(".")[0] or name, [])
            if name not in columns:
                columns.append(name)
    case = runs[0].case
    units, flat = case.units.model_dump(), case.dimension == 2
    quantities = {name: probe.quantity for name, probe in case.probes.items()}
    for family, columns in families.items():
        curves = {
            column: {run.name: (run.history["time"], run.history[column]) for run in runs if column in run.history}
            for column in columns
        }
        if any(len(times) > 1 for lines in curves.values() for times, _ in lines.values()):
            out.mkdir(parents=True, exist_ok=True)
            quantity = "force" if family.startswith("contact.") else measured(family, quantities)
            named = {label(column, quantity, units, flat=flat): curves[column] for column in columns}
            yield plot_lines(out / f"diff_{family}.png", named, label("time", "time", units))
