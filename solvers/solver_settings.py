"""Settings of the nonlinear and linear solvers of a field."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.algebra.linear import Maker, Method
from solvers.newton import Tolerance


@dataclass(frozen=True)
class SolverSettings:
    """Tolerances of Newton's method, and the linear solver."""

    newton: Tolerance = Tolerance()
    linear: Method | Maker = "auto"  #: name of a method, or a function that creates a solver for solids
    linear_tolerance: float = 1e-8
