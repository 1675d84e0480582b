"""The command `fsci stress`: draws cases, runs them and their twins, and counts the verdicts."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fsci.stress.draw import Draw, draw
from fsci.stress.frame import Frame
from fsci.stress.judge import (
    AGAINST_GRID,
    AGREEMENT,
    NEAR,
    ROUNDING,
    Verdict,
    distance,
    failure_of,
    missing_warning,
    other_bits,
    out_of_balance,
    warnings_of,
)
from fsci.stress.mutants import run_mutant
from fsci.stress.program import Ended, run, run_killed
from fsci.stress.scene import SCENES

VERDICTS: tuple[Verdict, ...] = ("right", "edge", "refused", "wrong")
MUTANT = 5  #: every so many draws is a mutated case file


@dataclass(frozen=True)
class Outcome:
    """The verdict on a draw, with its reason."""

    seed: int
    scene: str
    twin: str
    parameters: dict[str, Any]
    verdict: Verdict
    reason: str
    seconds: float
    warnings: tuple[str, ...] = ()  #: of sentinels, in the scene's own frame


def stress(
    seeds: Sequence[int], say: Callable[[str], None], keep: Path | None = None, scenes: Path = SCENES
) -> list[Outcome]:
    """Run all draws. Wrong ones are reported at once, and their cases are written to the folder `keep`.

    Draws of a file of scenes of somebody else have no mutants among them. Raises SceneError, ExpressionError.
    """
    outcomes = []
    for seed in seeds:
        outcome = judge(seed, keep, scenes)
        if outcome.verdict == "wrong":
            say(f"{seed} {outcome.scene}, {outcome.twin}: {outcome.reason}")
        for warning in outcome.warnings:
            say(f"{seed} {outcome.scene} warns of {warning}")
        outcomes.append(outcome)
    return outcomes


def judge(seed: int, keep: Path | None = None, scenes: Path = SCENES) -> Outcome:
    """Run one draw and its twin, and judge them."""
    begin = time.perf_counter()
    with TemporaryDirectory() as folder:
        if scenes == SCENES and seed % MUTANT == MUTANT - 1:
            ended = run_mutant(seed, Path(folder))
            words = failure_of(ended)
            verdict: Verdict = "wrong" if words else "refused" if ended.code else "right"
            found = Outcome(seed, "mutant", "none", {}, verdict, words or (ended.message if ended.code else ""), 0.0)
        else:
            one = draw(seed, path=scenes)
            first, judged = _judge(one, Path(folder))
            found = Outcome(seed, one.scene.name, one.how, dict(one.scene.parameters), *judged, 0.0, warnings_of(first))
        if keep is not None and found.verdict == "wrong":
            _keep(Path(folder), keep / str(seed))
    return Outcome(**{**asdict(found), "seconds": round(time.perf_counter() - begin, 2)})


def _judge(one: Draw, folder: Path) -> tuple[Ended, tuple[Verdict, str]]:
    first = run(folder / "run", one.case(Frame()))
    return first, _verdict(one, first, folder)


def _verdict(one: Draw, first: Ended, folder: Path) -> tuple[Verdict, str]:
    if words := failure_of(first):
        return "wrong", words
    if first.code:
        return "refused", first.message
    if words := missing_warning(one, first) or out_of_balance(one, first):
        return "wrong", words
    twin = _twin(one, folder / "twin", float(first.history["wall"].mean()))
    if words := failure_of(twin):
        return "wrong", f"twin: {words}"
    if twin.code:
        return "refused", f"twin: {twin.message}"
    if one.twin == "resumed":
        words = other_bits(first, twin)
        return ("wrong", words) if words else ("right", "")
    differs, where = distance(one, first, twin, one.frame)
    if differs <= AGREEMENT:
        return "right", ""
    words = f"{where} differs by {differs:.2g}"
    return ("edge" if differs <= NEAR and _rounding_decides(one, first, folder) else "wrong"), words


def _rounding_decides(one: Draw, first: Ended, folder: Path) -> bool:
    """Whether the results jump when only rounding is different."""
    frames = [Frame(shift=(*shift, shift[0] - shift[1])) for shift in ROUNDING]
    others = [(one, frame) for frame in frames] + [(one.moved(by), Frame()) for by in AGAINST_GRID]
    for number, (same, frame) in enumerate(others):
        other = run(folder / f"rounding{number}", same.case(frame))
        if other.code == 0 and AGREEMENT < distance(one, first, other, frame)[0] <= NEAR:
            return True
    return False


def _twin(one: Draw, folder: Path, step: float) -> Ended:
    case = one.case(one.frame, twin=True)
    if one.twin == "resumed":
        return run_killed(folder, case, steps=one.kill_after, delay=one.kill_delay * step)
    return run(folder, case, processes=one.processes)


def _keep(folder: Path, to: Path) -> None:
    for path in folder.rglob("case.yaml"):
        if path.parent.name != "out":
            target = to / path.relative_to(folder)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(path.read_text())


def table(outcomes: Sequence[Outcome]) -> str:
    """Counts of verdicts by scene, and messages of rejections."""
    names = [name for name in dict.fromkeys(o.scene for o in outcomes) if name != "mutant"]
    names += ["mutant"] * any(o.scene == "mutant" for o in outcomes)
    counts = Counter((o.scene, o.verdict) for o in outcomes)
    lines = [f"{'scene':10}{'draws':>8}" + "".join(f"{verdict:>10}" for verdict in VERDICTS)]
    for name in (*names, "all"):
        row = [sum(counts[n, v] for n in (names if name == "all" else [name])) for v in VERDICTS]
        lines.append(f"{name:10}{sum(row):8}" + "".join(f"{number:10}" for number in row))
    return "\n".join(lines)


def stress_long(steps: int, out: Path | None) -> int:
    """The table of one long run; returns the exit code."""
    from fsci.stress.long_run import long_run

    try:
        rows = long_run(steps)
    except RuntimeError as failed:
        print(failed)
        return 1
    print("".join(f"{name:>17}" for name in rows[-1]))
    for row in rows:
        print("".join(f"{row[name]:17.4g}" if name in row else " " * 17 for name in rows[-1]))
    if out is not None:
        _write("steps", rows, out)
    return 0


def write(outcomes: Sequence[Outcome], path: Path) -> None:
    """All draws as JSON."""
    _write("outcomes", [asdict(outcome) for outcome in outcomes], path)


def _write(name: str, rows: Sequence[Any], path: Path) -> None:
    """With the versions that they were computed with."""
    from fsci.running.summary import plain, versions

    path.write_text(json.dumps(plain({"versions": versions(), name: rows}), indent=1) + "\n")
