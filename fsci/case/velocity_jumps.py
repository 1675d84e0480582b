"""Times at which velocities that a case gives jump: of the boundary, of bodies in the flow, and of supports."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from fsci.case.case import Case
from fsci.case.expressions import MOST_TIMES, expressions, run_times
from fsci.case.jumps import PER_STEP, find_jumps
from fsci.expression import Expression

Array = NDArray[np.float64]

#: Interval of the difference that is the rate of a displacement, over a step of the run.
OF_STEP = 1e-5
#: Halvings of an interval between two samples. At their end it has twelve times the length of that difference.
HALVED_FOR_RATES = 10
#: Where formulas of place are evaluated: any point will do.
SOMEWHERE = (0.37, 0.61, 0.83)


def velocity_jumps(case: Case) -> tuple[float, ...]:
    """The times [s], in order, in a run with a flow that is not steady."""
    if case.fluid is None or case.fluid.scheme == "steady":
        return ()
    whole = run_times(case, MOST_TIMES // PER_STEP + 1)
    between = (np.arange((len(whole) - 1) * PER_STEP) + 0.382) / PER_STEP  # most jumps are at ends of steps
    times = np.interp(between, np.arange(len(whole)), whole)
    found: set[float] = set()
    for formula, of_rate in _given(case):
        found.update(kinks(formula, times, case.time.step) if of_rate else _jumps(formula, times))
    step = case.time.step  # to a billionth of it they do not depend on where samples are, hence on the end of the run
    return tuple(sorted({round(t / step, 9) * step for t in found}))


def kinks(formula: Expression, times: Array, step: float) -> list[float]:
    """Times [s] at which the rate of a formula jumps, sampled at some times; step: of the run [s]."""
    h = OF_STEP * step

    def value(t: Array) -> Array:
        return formula.at_times(t, SOMEWHERE)

    def rate(t: Array) -> Array:
        return (value(t + h) - value(t)) / h

    noise = 1e3 * float(np.finfo(float).eps) * float(np.abs(value(times)).max()) / h
    near = 0.5 * (times[1] - times[0]) / 2**HALVED_FOR_RATES + 2.0 * h
    return [_where_lines_meet(value, t, near) for t, _ in find_jumps(rate, times, HALVED_FOR_RATES, noise)]


def _jumps(formula: Expression, times: Array) -> list[float]:
    return [t for t, _ in find_jumps(lambda t: formula.at_times(t, SOMEWHERE), times)]


def _where_lines_meet(value: Callable[[Array], Array], t: float, near: float) -> float:
    """Where the lines through values before and after a kink meet, which is at most `near` [s] from t."""
    f = value(t + near * np.array([-2.0, -1.0, 1.0, 2.0]))
    before, after = (f[1] - f[0]) / near, (f[3] - f[2]) / near
    return float(t - near + np.clip((f[2] - f[1] - 2.0 * near * after) / (before - after), 0.0, 2.0 * near))


def _given(case: Case) -> Iterator[tuple[Expression, bool]]:
    """Formulas of time, and whether their rate is the velocity."""
    assert case.fluid is not None
    found: list[tuple[object, bool]] = [(patch.velocity, False) for patch in case.fluid.patches.values()]
    found += [(patch.rate, False) for patch in case.fluid.patches.values()]
    for motion in [body.motion for body in case.fluid.bodies.values() if body.motion is not None]:
        found += [(motion.displacement, True), (motion.velocity, False)]
        if motion.rotation is not None:
            found += [(motion.rotation.angle, True), (motion.rotation.angular_velocity, False)]
    found += [(support.displacement, True) for body in case.elastic_bodies.values() for support in body.supports]
    for section, of_rate in found:
        for _, formula in expressions(section):
            if "t" in formula.uses:
                yield formula, of_rate
