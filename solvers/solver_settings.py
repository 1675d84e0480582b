"""How a field solves its equations."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.linear import Maker, Method
from solvers.newton import Tolerance


@dataclass(frozen=True)
class SolverSettings:
    """How the nonlinear and the linear systems are solved."""

    newton: Tolerance = Tolerance()
    linear: Method | Maker = "auto"  #: a function makes a solver for solids
    linear_tolerance: float = 1e-8
