"""Backward differentiation formulas for the time derivative of the velocity."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Difference:
    """u_t at t_{n+1} = alpha u_{n+1} - (beta_0 u_n + beta_1 u_{n-1}); all in 1/s."""

    alpha: float
    beta_0: float
    beta_1: float


STEADY = Difference(0.0, 0.0, 0.0)


def backward_euler(dt: float) -> Difference:
    """(u_{n+1} - u_n) / dt."""
    return Difference(1.0 / dt, 1.0 / dt, 0.0)


def bdf2(dt: float, dt_before: float) -> Difference:
    """Derivative of the parabola through three values; with r = dt / dt_before

    u_t = ((1 + 2 r) / (1 + r) u_{n+1} - (1 + r) u_n + r^2 / (1 + r) u_{n-1}) / dt.
    Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, III.5.
    """
    r = dt / dt_before
    return Difference((1.0 + 2.0 * r) / (1.0 + r) / dt, (1.0 + r) / dt, -(r**2) / (1.0 + r) / dt)
