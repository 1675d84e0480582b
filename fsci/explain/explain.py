"""The text of `fsci explain`: for a failed run how and where the step failed, for others the time by part."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fsci.case import Case, load_case
from fsci.explain import advice
from fsci.explain.place import describe, nearest_node
from fsci.explain.replay import write_replay
from fsci.explain.residuals import convergence_of, curve
from fsci.running.files import require_own
from fsci.running.history import read_history
from fsci.running.summary import shares
from solvers.api import FailureKind
from solvers.counted import counted

SLOWEST = 3  #: steps that are named


def explain(out: Path, replay: Path | None = None) -> str:
    """The reason why the run in folder `out` failed, or its time by part; replay: a folder for the failed step.

    Raises FileNotFoundError if no run has ended there, ValueError for a replay of a run that did not fail.
    """
    require_own(out)
    path = out / "summary.json"
    if not path.is_file():
        raise FileNotFoundError(f"'{out}' has no summary.json: no run has ended there")
    summary = json.loads(path.read_text(encoding="utf-8"))
    failed = summary["status"] == "failed" and (out / "failure" / "failure.json").is_file()
    if replay is not None and not failed:
        raise ValueError("there is no failed step to replay")
    lines = [f"{summary['title']}: {summary['status']}", *_steps(summary, out)]
    if failed:
        what = json.loads((out / "failure" / "failure.json").read_text(encoding="utf-8"))
        lines += ["", *_failure(out / "failure", what, load_case(out / "failure"))]
        if replay is not None:
            write_replay(out / "failure", replay, what)
            lines += ["", f"wrote {replay}; compute the step alone with: fsci resume {replay}"]
        else:
            lines += ["", f"to compute the step alone: fsci explain {out} --replay FOLDER"]
    else:
        lines += _suggestions(advice.of_run(summary))
    return "\n".join(lines)


def _steps(summary: Mapping[str, Any], out: Path) -> Iterator[str]:
    """Steps, time by part, and the slowest steps."""
    steps, newton, wall = summary["steps"], summary["newton"], dict(summary["wall"])
    mean = newton["total"] / max(steps["accepted"], 1)
    yield f"steps          {steps['accepted']}, {steps['retried']} repeated; {mean:.1f} Newton iterations per step"
    if linear := summary.get("linear"):
        per_step = linear["total"] / max(steps["accepted"], 1)
        yield f"linear         {per_step:.1f} iterations of the linear solver per step, {linear['max']} at most"
    yield f"time           {wall['total']:.3g} s: {shares(wall.pop('total'), wall)}"
    history = read_history(out / "history.csv")
    for row in np.argsort(-history.get("wall", np.empty(0)), kind="stable")[:SLOWEST]:
        step, time, dt, iterations, seconds = (
            history[name][row] for name in ("step", "time", "dt", "iterations", "wall")
        )
        taken = counted(int(iterations), "iteration")
        yield f"slow step      {step:.0f} to time {time:.6g}, dt {dt:.3g}: {taken}, {seconds:.3g} s"


def _failure(folder: Path, what: Mapping[str, Any], case: Case) -> Iterator[str]:
    """Field, reason, position, residuals and advice."""
    residuals = tuple(float("nan") if r is None else float(r) for r in what["residuals"])
    yield f"failed step    {what['step']}, from time {what['time']:.6g} with dt {what['dt']:.3g}"
    yield f"field          {what['field']}"
    yield f"reason         {what['reason']}, at iteration {what['iteration']}"
    if what["where"] is not None:
        yield f"place          ({', '.join(f'{x:.6g}' for x in what['where'])})"
        near = nearest_node(folder / "fields", what["where"])
        yield from () if near is None else describe(near, case)
    found = convergence_of(residuals)
    if residuals and found.kind == "none":
        yield "residuals      too few to tell whether they fall"
        yield from curve(residuals)
    elif residuals:
        words = advice.OF_CONVERGENCE.get(found.kind, (f"the residuals fall by a factor of {found.rate:.2g}",))[0]
        yield f"residuals      {words if found.kind in (*advice.OF_CONVERGENCE, 'converges') else found.kind}"
        yield from curve(residuals)
    yield from _suggestions(advice.of_failure(_kind(what), residuals, case.solver.newton))


def _kind(what: Mapping[str, Any]) -> FailureKind:
    """Raises ValueError for a failure that another version of fsci wrote."""
    try:
        return FailureKind(what["kind"])
    except (KeyError, ValueError):
        raise ValueError("another version of fsci wrote failure.json: run the case again") from None


def _suggestions(words: Iterator[str]) -> list[str]:
    found = list(dict.fromkeys(words))
    return [f"try            {one}" for one in found]
