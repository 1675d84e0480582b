"""The generalised-alpha method for second-order systems."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.api import Array


@dataclass(frozen=True)
class GeneralisedAlpha:
    """Generalised-alpha method, with forces averaged as (1 - alpha_f) f_{n+1} + alpha_f f_n.

    M a_{n+1-alpha_m} + C v_{n+1-alpha_f} + f_{n+1-alpha_f} = 0 with Newmark's relations between u, v and a.
    Source: Chung & Hulbert, J. Appl. Mech. 60 (1993) 371-375.
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float

    @classmethod
    def from_rho_inf(cls, rho_inf: float) -> GeneralisedAlpha:
        """Parameters of second order with spectral radius rho_inf at infinite frequency (1: no damping)."""
        alpha_m = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0)
        alpha_f = rho_inf / (rho_inf + 1.0)
        gamma = 0.5 - alpha_m + alpha_f
        return cls(alpha_m, alpha_f, 0.25 * (1.0 - alpha_m + alpha_f) ** 2, gamma)

    def acceleration(self, du: Array, v: Array, a: Array, dt: float) -> Array:
        """a_{n+1} [m/s^2] from the displacement increment du = u_{n+1} - u_n and v, a at t_n."""
        return du / (self.beta * dt**2) - v / (self.beta * dt) - (0.5 / self.beta - 1.0) * a

    def velocity(self, du: Array, v: Array, a: Array, dt: float) -> Array:
        """v_{n+1} [m/s] from the displacement increment du = u_{n+1} - u_n and v, a at t_n."""
        ratio = self.gamma / self.beta
        return ratio / dt * du + (1.0 - ratio) * v + dt * (1.0 - 0.5 * ratio) * a

    def mass_factor(self, dt: float) -> float:
        """d(a_{n+1-alpha_m}) / d(u_{n+1}) [1/s^2]."""
        return (1.0 - self.alpha_m) / (self.beta * dt**2)

    def damping_factor(self, dt: float) -> float:
        """d(v_{n+1-alpha_f}) / d(u_{n+1}) [1/s]."""
        return (1.0 - self.alpha_f) * self.gamma / (self.beta * dt)


#: Backward Euler where the acceleration at the start of the step counts as zero.
BACKWARD_EULER = GeneralisedAlpha(alpha_m=0.0, alpha_f=0.0, beta=1.0, gamma=1.0)
