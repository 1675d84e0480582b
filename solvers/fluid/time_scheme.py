"""Backward differentiation formulas for the time derivative of the velocity.

A scheme gives the weights of the velocities for any sequence of step lengths. To add one, add a `FlowTimeScheme`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from solvers import step


@dataclass(frozen=True)
class Difference:
    """u_t at t_{n+1} = alpha u_{n+1} - sum_k beta[k] u_{n-k}; all in 1/s."""

    alpha: float
    beta: tuple[float, ...] = ()


@dataclass(frozen=True)
class FlowStep(step.Step):
    """A step of the flow, with its difference formula."""

    difference: Difference


@dataclass(frozen=True)
class FlowTimeScheme:
    """A time scheme, defined by its difference formulas."""

    #: (dt, lengths of the steps before, newest first) [s] -> formula of a step of length dt
    difference: Callable[[float, Sequence[float]], Difference]
    times: int  #: largest count of velocities u_n, u_{n-1}, ... and of step lengths in a formula
    steady: bool = False  #: each step is a steady state


STEADY = Difference(0.0)


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


def _bdf2_started(dt: float, before: Sequence[float]) -> Difference:
    """BDF2 after two steps of backward Euler.

    The order is that of BDF2. After a single step of backward Euler, BDF2 would reverse half of the velocity that an
    impulsive start gains.
    """
    return backward_euler(dt) if len(before) < 2 else bdf2(dt, before[0])


#: By their names in `FlowSettings`.
SCHEMES: Mapping[str, FlowTimeScheme] = {
    "steady": FlowTimeScheme(lambda dt, before: STEADY, times=0, steady=True),
    "backward_euler": FlowTimeScheme(lambda dt, before: backward_euler(dt), times=1),
    "bdf2": FlowTimeScheme(_bdf2_started, times=2),
}
