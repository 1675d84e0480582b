"""Jumps of prescribed motions: a displacement that is not continuous in time means an infinite velocity."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from fsci.case.case import Case
from fsci.case.expressions import MOST_TIMES, expressions, run_times
from fsci.case.messages import subject
from fsci.case.yaml_text import Keys
from fsci.expression import Expression

Array = NDArray[np.float64]

#: Times in a step at which a motion is sampled, if the run has few steps.
PER_STEP = 8

#: Halvings of an interval between two samples, as far as the numbers allow it.
HALVED = 48


def find_jump(formula: Callable[[Array], Array], times: Array) -> tuple[float, float] | None:
    """(time, size) of the largest jump of a function of time, sampled at these times; None if it is continuous."""
    found = find_jumps(formula, times)
    return max(found, key=lambda jump: abs(jump[1])) if found else None


def find_jumps(
    formula: Callable[[Array], Array], times: Array, halved: int = HALVED, noise: float = 0.0
) -> list[tuple[float, float]]:
    """(time, size) of the jumps of a function of time, at most one between two of the times at which it is sampled.

    Each interval is halved again and again, and the half with the larger change is kept. The change of a continuous
    function goes to zero: in the second half of the halvings it shrinks, if only by a half. That of a jump stays.
    noise: size of values that are rounding errors.
    """
    begin, end = times[:-1].copy(), times[1:].copy()
    first, last = formula(begin), formula(end)
    earlier = np.abs(last - first)
    # where the numbers end, so do the halvings
    possible = np.floor(np.log2((end - begin) / np.spacing(np.maximum(np.abs(begin), np.abs(end))))).clip(0, halved)
    for count in range(halved):
        earlier = np.where(count == possible // 2, np.abs(last - first), earlier)
        middle = 0.5 * (begin + end)
        at = formula(middle)
        left = np.abs(at - first) > np.abs(last - at)
        on = count < possible
        begin, first = np.where(on & ~left, middle, begin), np.where(on & ~left, at, first)
        end, last = np.where(on & left, middle, end), np.where(on & left, at, last)
    margin = 8.0 * np.spacing(np.maximum(np.abs(begin), np.abs(end)))  # the value between may be a third one
    change = formula(np.minimum(end + margin, times[-1])) - formula(np.maximum(begin - margin, times[0]))
    size = float(np.abs(np.concatenate([first, last])).max())
    noise = max(noise, 1e3 * float(np.finfo(float).eps) * size)
    found = np.flatnonzero((np.abs(change) > 0.5 * earlier) & (np.abs(change) > noise) & (possible >= 8))
    return [(float(end[k]), float(change[k])) for k in found]


def jump_warnings(case: Case) -> Iterator[tuple[Keys, str]]:
    """Displacements of bodies, supports and obstacles that jump, in runs that go through time."""
    structure, fluid = case.structure, case.fluid
    dynamic = structure is not None and structure.dynamics is not None
    flows = fluid is not None and fluid.scheme != "steady"
    moved: list[tuple[Keys, Expression]] = []
    if fluid is not None and flows:
        for name, body in fluid.bodies.items():
            moved += expressions(body.motion, ("fluid", "bodies", name, "motion"))
    if dynamic or flows:
        for name, elastic in case.elastic_bodies.items():
            moved += expressions(elastic.supports, ("structure", "bodies", name, "supports"))
        for name, obstacle in ({} if case.contact is None else case.contact.obstacles).items():
            moved += expressions(obstacle.motion, ("contact", "obstacles", name, "motion"))
    if dynamic:
        yield from _starts(case)
    for keys, formula in moved:
        if "t" in formula.uses and not {"velocity", "angular_velocity"} & set(keys):
            yield from _warn(case, keys, formula)


def _starts(case: Case) -> Iterator[tuple[Keys, str]]:
    """Supports in dynamics that are displaced at the start where the body is not."""
    for name, body in case.elastic_bodies.items():
        for index, support in enumerate(body.supports):
            for keys, formula in expressions(support.displacement, ("structure", "bodies", name, "supports", index)):
                by_axis = isinstance(support.displacement, tuple)
                own = None if body.initial_displacement is None else body.initial_displacement
                if formula.uses - {"t"} or (own is not None and not by_axis):
                    continue
                begins = own[keys[-1]] if own is not None and isinstance(keys[-1], int) else None
                if begins is not None and begins.uses - {"t"}:
                    continue
                t = case.time.start
                jump = float(formula.at_times(t)) - (0.0 if begins is None else float(begins.at_times(t)))
                if abs(jump) > 1e-9 * abs(float(formula.at_times(t))):
                    path = (*keys[:5], "displacement", *keys[5:])
                    yield (
                        path,
                        f"{subject(path)}: jumps by {jump:.4g} {case.units.length} at the start, t = {t:g}: the body "
                        "is not displaced there; let it grow from zero, or give an 'initial_displacement'",
                    )


def _warn(case: Case, keys: Keys, formula: Expression) -> Iterator[tuple[Keys, str]]:
    whole = run_times(case, MOST_TIMES // PER_STEP + 1)
    times = np.interp(np.arange((len(whole) - 1) * PER_STEP + 1) / PER_STEP, np.arange(len(whole)), whole)
    found = find_jump(lambda t: formula.at_times(t, (0.37, 0.61, 0.83)), times)  # any point where they depend on it
    if found is None:
        return
    unit = "degrees" if "angle" in keys else case.units.length
    yield (
        keys,
        f"{subject(keys)}: jumps by {found[1]:.4g} {unit} at t = {found[0]:.6g}: its velocity is infinite there, and "
        "the run does not see it; let it move in a short time, as with ramp(t, begin, end)",
    )
