"""Solver settings of the fields from the section `solver` of a case."""

from __future__ import annotations

import math

from fsci.case import Case
from solvers.newton import Tolerance


def build_tolerance(case: Case) -> Tolerance:
    """When Newton's iterates are accepted."""
    newton = case.solver.newton
    return Tolerance(
        residual=newton.residual,
        residual_absolute=newton.residual_absolute,
        increment=math.inf if newton.increment is None else newton.increment,
        max_iterations=newton.max_iterations,
        line_search=newton.line_search,
    )
