"""Section `solver`."""

from __future__ import annotations

from typing import Literal

from fsci.case.section import Section, setting
from fsci.case.values import Count, NotNegative, Positive, Switch


class Newton(Section):
    """Tolerances of the residual and, if it is given, of the increment."""

    residual: Positive = setting(1e-8, "tolerance of the residual of a body, relative to its largest force", unit="1")
    residual_absolute: NotNegative = setting(0.0, "absolute tolerance of the residual", unit="N")
    increment: Positive | None = setting(
        None, "tolerance of the increment, relative to the solution; default: none", unit="1"
    )
    max_iterations: Count = setting(25, "most iterations of a step; one that needs more has failed")
    line_search: Switch = setting(False, "halve increments that do not reduce the residual")


class Linear(Section):
    """The linear solver: method and tolerance."""

    method: Literal["auto", "direct", "iterative", "ilu"] = setting(
        "auto",
        "direct, iterative (multigrid), ilu (incomplete factors); auto: direct in 2D and for small systems, with "
        "contact in 3D ilu as long as it takes few iterations",
    )
    tolerance: Positive = setting(1e-8, "residual of iterative solvers, relative to the first", unit="1")


class Solver(Section):
    """The nonlinear and linear solvers of a step."""

    newton: Newton = setting(Newton, "nonlinear iteration")
    linear: Linear = setting(Linear, "linear solver")
