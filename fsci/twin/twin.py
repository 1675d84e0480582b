"""The command `fsci twin`: runs a case and its twins, shows what they change, and writes twin.json."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fsci.case import Case, CaseError, load_case
from fsci.case.errors import Place, Problem, did_you_mean
from fsci.running.files import write_text
from fsci.running.summary import plain
from fsci.running.verify import evaluate
from fsci.running.warm import WarmProcess
from fsci.twin.changes import Meaning, Twin, quick, twins
from fsci.twin.compare import TwinChange, Value, changes, values
from fsci.twin.grids import NO_FIELDS, Settings
from fsci.twin.runs import TwinEnded, known_runs, run_all
from fsci.twin.zero import ROUNDING, scales

TWIN_RESULTS = "twin.json"
BASE = Twin("case", "the case itself", "defect")
#: Difference, relative to the largest value of a probe, that the tolerance of solvers explains.
AGREEMENT = 1e-6

#: What a twin says that changes a value by more than AGREEMENT.
SAYINGS: dict[Meaning, str] = {
    "space": "the error of cells or facets is about as large",
    "time": "the error of the time integration is about as large",
    "scatter": "the place of cells decides so much",
    "roles": "it depends on which surface is the slave, which finer surfaces make less",
    "defect": "the answer must not depend on it",
}


def run_twins(
    path: Path, overrides: Settings, out: Path, *, only: Sequence[str] = (), quickly: bool = False, say: Any = print
) -> bool:
    """Run all twins, or those named; returns whether all of them have answers. Raises CaseError.

    Runs that are in `out` from before, of the same case, are not run again. twin.json is written anew as each run ends.
    """
    case = load_case(path, overrides)
    chosen = _chosen(twins(case), only, quickly)
    out.mkdir(parents=True, exist_ok=True)
    known = known_runs(out / TWIN_RESULTS)
    say(f"{case.path}: {len(chosen)} {'twin' if len(chosen) == 1 else 'twins'} in {out}")
    ended: dict[str, TwinEnded] = {}
    runs = [BASE, *(replace(twin, settings=(*twin.settings, *NO_FIELDS)) for twin in chosen)]
    with WarmProcess() as warm:
        for run in run_all(case, overrides, runs, out, known, warm):
            one = _in_coordinates_of(case, run)
            ended[one.twin.name] = one
            known[one.twin.name] = one.checksum
            say(_progress(one))
            write_text(out / TWIN_RESULTS, json.dumps(plain(_results(case, runs, ended, known)), indent=1) + "\n")
            if one.twin is BASE and one.message:
                return False
    say("\n" + "\n".join(_table(case, runs, ended)))
    return not any(one.message for one in ended.values())


def _chosen(found: list[Twin], only: Sequence[str], quickly: bool) -> list[Twin]:
    kinds = list(dict.fromkeys(_kind(twin) for twin in found))
    for name in only:
        if name not in kinds:
            message = f"this case has {', '.join(kinds)}, but no twin '{name}'{did_you_mean(name, kinds)}"
            raise CaseError([Problem(Place("--only"), message)])
    if quickly:
        return quick(found)
    return [twin for twin in found if not only or _kind(twin) in only]


def _in_coordinates_of(case: Case, one: TwinEnded) -> TwinEnded:
    """Results of a twin in other coordinates as those of the case."""
    if one.twin.frame is None or one.message:
        return one
    history = one.twin.frame.history(one.history, case)
    return replace(one, history=history, summary={**one.summary, "verify": evaluate(history, case.verify)})


def _kind(twin: Twin) -> str:
    """Its column in the table: all shifts have one."""
    return twin.name.split("_")[0] if twin.meaning == "scatter" else twin.name


def _progress(one: TwinEnded) -> str:
    seconds = "" if one.seconds is None else f"{one.seconds:8.1f} s"
    return f"{one.twin.name:10} {seconds:10} {one.message or one.twin.words}"


def _compared(
    case: Case, runs: Sequence[Twin], ended: Mapping[str, TwinEnded]
) -> tuple[dict[str, Value], dict[str, dict[str, TwinChange]]]:
    """Values of the case itself, and what each twin changes of them."""
    base = ended.get(BASE.name)
    if base is None or base.message:
        return {}, {}
    of_case = scales(case)
    own = values(base.history, base.summary, of_case)
    found = {}
    for twin in runs[1:]:
        one = ended.get(twin.name)
        if one is not None and not one.message:
            found[twin.name] = changes(own, values(one.history, one.summary, of_case, twin.opposite))
    return own, found


def _results(
    case: Case, runs: Sequence[Twin], ended: Mapping[str, TwinEnded], known: Mapping[str, str]
) -> dict[str, Any]:
    own, found = _compared(case, runs, ended)
    return {
        "checksums": known,
        "runs": {
            twin.name: {
                "words": twin.words,
                "settings": dict(twin.settings),
                "processes": twin.processes,
                "seconds": ended[twin.name].seconds,
                "message": ended[twin.name].message,
            }
            for twin in runs
            if twin.name in ended
        },
        "values": {
            name: {
                "value": value.value,
                "scale": value.scale,
                "changes": {twin: vars(change[name]) for twin, change in found.items()},
            }
            for name, value in own.items()
        },
    }


def _table(case: Case, runs: Sequence[Twin], ended: Mapping[str, TwinEnded]) -> list[str]:
    """Values by twins, then a sentence on each twin."""
    own, found = _compared(case, runs, ended)
    kinds: dict[str, list[Twin]] = {}
    for twin in runs[1:]:
        if twin.name in found:
            kinds.setdefault(_kind(twin), []).append(twin)
    width = max([len(name) for name in own], default=0) + 2
    lines = [" " * width + f"{'value':>12}" + "".join(f"{kind:>11}" for kind in kinds)]
    worst: dict[str, tuple[float, str]] = dict.fromkeys(kinds, (0.0, ""))
    for name, value in own.items():
        row = f"{name:{width}}{value.value:12.6g}"
        for kind, members in kinds.items():
            differences = [found[twin.name][name].curve for twin in members]
            change = differences[0] if len(members) == 1 else float(np.sqrt(np.mean(np.square(differences))))
            worst[kind] = max(worst[kind], (change, name))
            row += f"{_percent(change):>11}"
        lines.append(row)
    lines.append(
        "Largest changes over the time of the run, relative to the largest value of the probe; shifts: their mean."
    )
    for kind, members in kinds.items():
        change, name = worst[kind]
        words = members[0].words if len(members) == 1 else f"planes of the grid moved, {len(members)} times"
        saying = (
            "nothing changes"
            if change <= (AGREEMENT if members[0].frame is None else ROUNDING)
            else f"{name} {_percent(change)}: {SAYINGS[members[0].meaning]}"
        )
        lines.append(f"{kind}: {words}: {saying}")
    failed = [ended[twin.name] for twin in runs[1:] if ended[twin.name].message]
    return [*lines, *(f"{one.twin.name}: {one.twin.words}: failed: {one.message.splitlines()[0]}" for one in failed)]


def _percent(share: float) -> str:
    if math.isinf(share):
        return "no value"
    return "0" if share <= 1e-9 else f"{100 * share:.2g} %"
