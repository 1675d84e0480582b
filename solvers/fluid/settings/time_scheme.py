"""Backward differentiation formulas for the time derivative of the velocity.

A scheme gives the weights of the velocities for any sequence of step lengths. To add one, add a `FlowTimeScheme`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from solvers.api import Step
from solvers.exchange import STEADY, Difference


@dataclass(frozen=True)
class FlowStep(Step):
    """A step of the flow, with its difference formula."""

    difference: Difference
    scale_alpha: float | None = None  #: alpha [1/s] for the scales of the stabilisation; None: that of the difference


@dataclass(frozen=True)
class FlowTimeScheme:
    """A time scheme, defined by its difference formulas."""

    #: (dt, lengths of the steps before, newest first) [s] -> formula of a step of length dt
    difference: Callable[[float, Sequence[float]], Difference]
    times: int  #: largest count of velocities u_n, u_{n-1}, ... and of step lengths in a formula
    steady: bool = False  #: each step is a steady state


#: Part of BDF3 in the blend of BDF2 and BDF3, which is A-stable up to 1/2.
BLEND = 0.48


def backward_euler(dt: float) -> Difference:
    """(u_{n+1} - u_n) / dt."""
    return Difference(1.0 / dt, (1.0 / dt,))


def bdf2(dt: float, dt_before: float) -> Difference:
    """Derivative of the parabola through three values; with r = dt / dt_before

    u_t = ((1 + 2 r) / (1 + r) u_{n+1} - (1 + r) u_n + r^2 / (1 + r) u_{n-1}) / dt.
    Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, III.5.
    """
    r = dt / dt_before
    return Difference((1.0 + 2.0 * r) / (1.0 + r) / dt, ((1.0 + r) / dt, -(r**2) / (1.0 + r) / dt))


def bdf3(dt: float, before: Sequence[float]) -> Difference:
    """Derivative at t_{n+1} of the cubic through u_{n+1}, u_n, u_{n-1}, u_{n-2}; before: the two lengths before dt.

    The weight of u_k is the derivative of its Lagrange polynomial.
    """
    past = (dt, dt + before[0], dt + before[0] + before[1])
    beta = []
    for own in past:
        others = [other for other in past if other != own]
        beta.append(math.prod(other / (other - own) for other in others) / own)
    return Difference(sum(1.0 / time for time in past), tuple(beta))


def blended(dt: float, before: Sequence[float]) -> Difference:
    """BLEND of BDF3 and the rest of BDF2: second order, A-stable, half of the error of BDF2.

    With equal steps the leading error of the rate is (1 - BLEND) dt^2 / 3 u_ttt. An oscillation with 40 steps per
    period loses 0.03 % of its amplitude in a period, with BDF2 0.6 %.
    Source: V. N. Vatsa, M. H. Carpenter, D. P. Lockard, Re-evaluation of an optimized second order backward difference
    (BDF2OPT) scheme for unsteady flow applications, AIAA 2010-0122.
    """
    two, three = bdf2(dt, before[0]), bdf3(dt, before)
    beta = [BLEND * b3 + (1.0 - BLEND) * b2 for b3, b2 in zip(three.beta, (*two.beta, 0.0), strict=True)]
    return Difference(BLEND * three.alpha + (1.0 - BLEND) * two.alpha, tuple(beta))


def _bdf2_started(dt: float, before: Sequence[float]) -> Difference:
    """BDF2 after two steps of backward Euler.

    The order is that of BDF2. After a single step of backward Euler, BDF2 would reverse half of the velocity that an
    impulsive start gains.
    """
    return backward_euler(dt) if len(before) < 2 else bdf2(dt, before[0])


def _blended_started(dt: float, before: Sequence[float]) -> Difference:
    """The blend after a start by BDF2, and BDF2 in a step that is longer than the last one.

    The blend would be unstable if steps grew by 1.93 again and again, BDF2 only by 2.41 (`history.GROWTH_OF_STEP`).
    """
    grows = len(before) < 3 or dt > (1.0 + 1e-6) * before[0]
    return _bdf2_started(dt, before) if grows else blended(dt, before)


#: By their names in `FlowSettings`.
SCHEMES: Mapping[str, FlowTimeScheme] = {
    "steady": FlowTimeScheme(lambda dt, before: STEADY, times=0, steady=True),
    "backward_euler": FlowTimeScheme(lambda dt, before: backward_euler(dt), times=1),
    "bdf2": FlowTimeScheme(_bdf2_started, times=2),
    "bdf2_optimized": FlowTimeScheme(_blended_started, times=3),
}
