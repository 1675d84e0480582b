"""Verdict on a draw: right, rejected with a message, or wrong."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal

import numpy as np

from fsci.stress.draw import Draw
from fsci.stress.frame import Frame
from fsci.stress.program import Ended

#: edge: rounding decides, as where a surface lies in a plane of the grid; the results on both sides are near
Verdict = Literal["right", "edge", "refused", "wrong"]

#: Difference of twins, relative to the largest value of a probe. Newton's method stops at 1e-10 of the first residual.
AGREEMENT = 1e-6
#: Error of a balance by the tolerance of the solver, relative to the largest flow or force.
BALANCE = 1e-6
#: Rounding errors in a scene at rest, relative to the volume and the momentum that would pass per time if it moved with
#: unit velocity: there are no larger flow rates and forces to compare them with. Some 5,000 units of rounding, for sums
#: over as many terms.
AT_REST = 1e-12
#: Difference of twins at an edge: the effect of another cut on these coarse grids.
NEAR = 0.05
#: Shifts [m] of the whole scene that change nothing but rounding: twins that differ although these agree are wrong.
ROUNDING = ((1.3e-9, 0.7e-9), (-1.1e-9, 2.3e-9), (1 / 3, 1 / 7), (-0.1, 0.7))

#: Shifts [m] of a body against the grid by rounding, for surfaces in planes of the grid.
AGAINST_GRID = (1e-12, -1e-12)


def failure_of(run: Ended) -> str:
    """Outcomes that are errors for every case: the run hangs, crashes, or ends without a message."""
    if run.code not in (0, 1, 2):
        return f"exit code {run.code}: {run.message[-300:]}"
    if "Traceback" in run.words:
        return f"a traceback: {run.words.strip().splitlines()[-1]}"
    if run.code and not run.message:
        return "it failed without a word"
    return ""


def missing_warning(draw: Draw, run: Ended) -> str:
    """A danger for which the run should have a warning."""
    missing = [words for words in draw.scene.must_warn if words not in run.words]
    return f"no warning that has '{missing[0]}'" if missing else ""


def warnings_of(run: Ended) -> tuple[str, ...]:
    """What its sentinels have found."""
    return tuple(f"{found['kind']} ({found['body']}): {found['message']}" for found in run.summary.get("warnings", []))


def out_of_balance(draw: Draw, run: Ended) -> str:
    """The first balance that does not hold, in the scene's own frame."""
    history = run.history
    for name, values in history.items():
        # a pocket that has opened has no volume
        if not np.isfinite(values).all() and not name.startswith("fluid.pocket_"):
            return f"{name} is not finite"
    for name, error, scale in _balances(draw, run):
        if error > scale:
            return f"{name} misses {error:.3g}, more than {scale:.3g}"
    return ""


def _balances(draw: Draw, run: Ended) -> Iterator[tuple[str, float, float]]:
    """Name, error and what is allowed."""
    history = run.history
    if "fluid.mass" in history:
        flow = max(_largest(history, "out"), _swept(draw))
        yield "fluid.mass", _largest(history, "fluid.mass"), max(BALANCE * flow, AT_REST)
    if "interface.momentum" in history:
        flux = draw.scene.parameters.get("density", 0.0)  # of momentum, with unit velocity and width
        force = max(_largest(history, f"force.{i}") for i in "xyz") or flux  # no force: the body has left the box
        solid = draw.scene.parameters.get("solid density", 0.0) * flux  # weight of a body at rest, of unit volume
        at_rest = AT_REST * max(flux, solid)
        yield "interface.momentum", _largest(history, "interface.momentum"), max(BALANCE * force, at_rest)
    if {"top", "bottom"} <= draw.scene.probes.keys():
        axes = "xyz"[: draw.scene.dim]
        sums = [history[f"top.{i}"] + history[f"bottom.{i}"] for i in axes]
        size = max(_largest(history, f"{name}.{i}") for name in ("top", "bottom") for i in axes)
        yield "the sum of reactions", float(np.abs(sums).max()), BALANCE * size


def _swept(draw: Draw) -> float:
    """Volume that a body that is moved takes from the fluid per time, at least."""
    return float(draw.scene.parameters.get("cells per step", 0.0)) / draw.scene.parameters.get("dt", 1.0) * 0.01


def _largest(history: Mapping[str, Any], name: str) -> float:
    return float(np.abs(history[name]).max(initial=0.0)) if name in history else 0.0


def other_bits(run: Ended, twin: Ended) -> str:
    """The first difference between a resumed run and an uninterrupted one."""
    for name, values in run.history.items():
        if name != "wall" and not np.array_equal(twin.history.get(name, values[:0]), values):
            return f"{name} has other bits"
    return ""


def distance(draw: Draw, run: Ended, twin: Ended, frame: Frame) -> tuple[float, str]:
    """By how much of its largest value a probe differs, and which one; infinite if the runs end at other times.

    Values below AT_REST / AGREEMENT count as this: their differences may be rounding errors.
    """
    quantities = {name: str(probe["quantity"]) for name, probe in draw.scene.probes.items()}
    dim = draw.scene.dim
    ours, theirs = Frame().back(run.history, quantities, dim), frame.back(twin.history, quantities, dim)
    rows, others = _common(ours["time"], theirs["time"])
    if not rows or abs(ours["time"][rows[-1]] / ours["time"][-1] - 1) > 1e-9:
        return np.inf, "the last time"
    worst, where = 0.0, ""
    for name in quantities:
        columns = [column for column in ours if column == name or column.startswith(f"{name}.")]
        difference = max(float(np.abs(ours[c][rows] - theirs[c][others]).max()) for c in columns)
        size = max(AT_REST / AGREEMENT, *(float(np.abs(ours[c]).max()) for c in columns))
        if difference / size > worst:
            worst, where = difference / size, name
    return worst, where


def _common(times: np.ndarray, others: np.ndarray) -> tuple[list[int], list[int]]:
    """Rows of two histories with equal times."""
    near = 1e-9 * times[-1]
    pairs = [(i, int(np.argmin(np.abs(others - t)))) for i, t in enumerate(times)]
    pairs = [(i, j) for i, j in pairs if abs(others[j] - times[i]) <= near]
    return [i for i, _ in pairs], [j for _, j in pairs]
