"""The command `fsci sweep`: runs a case at all points of a sweep, and writes a table, pictures and sweep.json."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from fsci.case import load_case
from fsci.running.files import write_text
from fsci.running.summary import plain
from fsci.running.warm import WarmProcess
from fsci.sweep.picture import draw
from fsci.sweep.points import Combination, Parameter, parameters, points, short_names
from fsci.twin.changes import Twin
from fsci.twin.compare import values
from fsci.twin.runs import TwinEnded, known_runs, run_all

SWEEP_RESULTS, SWEEP_TABLE = "sweep.json", "sweep.csv"


def sweep(path: Path, given: Sequence[tuple[str, str]], out: Path, say: Callable[[str], None]) -> bool:
    """Run a case at all points; returns whether every run has finished. Raises CaseError.

    `given` are dotted names of settings with values as YAML text; several values have commas between them. Runs that
    are in `out` from before, of the same case, are not run again. All files are written anew as each run ends.
    """
    several, single = parameters(given)
    found = points(several)
    case = load_case(path, single)
    names = [parameter.setting for parameter in several]
    load_case(path, (*single, *zip(names, found[0].values, strict=True)))  # names of settings that there are not
    out.mkdir(parents=True, exist_ok=True)
    known = known_runs(out / SWEEP_RESULTS)
    say(f"{case.path}: {len(found)} runs in {out}")
    runs = [Twin(point.name, point.name, "study", tuple(zip(names, point.values, strict=True))) for point in found]
    ended: dict[str, TwinEnded] = {}
    with WarmProcess() as warm:
        for one in run_all(case, single, runs, out, known, warm):
            ended[one.twin.name] = one
            known[one.twin.name] = one.checksum
            seconds = "" if one.seconds is None else f"{one.seconds:8.1f} s"
            say(f"{one.twin.name}  {seconds}  {one.message}".rstrip())
            _write(out, several, found, ended, known)
    columns, rows = table(several, found, ended)
    say("\n" + _aligned(rows))
    for picture in draw(out, case, several, found, columns, rows):
        say(str(picture))
    return not any(one.message for one in ended.values())


def _write(
    out: Path,
    several: Sequence[Parameter],
    found: Sequence[Combination],
    ended: Mapping[str, TwinEnded],
    known: Mapping[str, str],
) -> None:
    _, rows = table(several, found, ended)
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([list(rows[0]), *(list(row.values()) for row in rows)])
    write_text(out / SWEEP_TABLE, text.getvalue())
    results = {
        "checksums": known,
        "parameters": {parameter.setting: parameter.values for parameter in several},
        "runs": rows,
        "messages": {name: one.message for name, one in ended.items() if one.message},
    }
    write_text(out / SWEEP_RESULTS, json.dumps(plain(results), indent=1) + "\n")


def table(
    several: Sequence[Parameter], found: Sequence[Combination], ended: Mapping[str, TwinEnded]
) -> tuple[list[str], list[dict[str, Any]]]:
    """Columns of values, and a row for each point: its folder, parameters, how its run stands, its time [s], values.

    Values are the last ones of probes, and those that `verify` looks at.
    """
    short = short_names([parameter.setting for parameter in several])
    numbers = {
        name: {value: known.value for value, known in values(one.history, one.summary).items()}
        for name, one in ended.items()
        if not one.message
    }
    columns = list(dict.fromkeys(column for row in numbers.values() for column in row))
    rows = []
    for point in found:
        one = ended.get(point.name)
        status = "not run" if one is None else "failed" if one.message else "finished"
        seconds = None if one is None else one.seconds
        own = numbers.get(point.name, {})
        rows.append(
            {"run": point.name}
            | dict(zip(short, point.values, strict=True))
            | {"status": status, "seconds": seconds}
            | {column: own.get(column) for column in columns}
        )
    return columns, rows


def _aligned(rows: Sequence[Mapping[str, Any]]) -> str:
    """The table as text; folders are left out, for the parameters say the same."""
    shown = [name for name in rows[0] if name != "run"]
    cells = [shown, *([_text(row[name]) for name in shown] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return "\n".join("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in cells)


def _text(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
