"""Periodic flows with a given rate: the force that drives it is that of exact flows, and the flow is that of the force."""

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, nodal_errors, sphere, step

from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.terms.boundary.patches import Patch
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

GRADED = Grid((np.array([0, 0.5, 0.8, 1.5, 2.2, 3.0]), np.array([0, 0.2, 0.6, 0.8, 1.0])))
WALLS = Patch("walls", ("y-", "y+"), "no_slip")


def still(x, t):
    return 0.0 * x[0]


def ends(rate, axis="x"):
    value = (lambda x, t: rate(t) + 0.0 * x[0]) if callable(rate) else rate
    return Patch("ends", (f"{axis}-", f"{axis}+"), "periodic", rate=value)


def driving(fluid):
    """G along the first period."""
    return next(iter(fluid.on_cells.driving_forces.values()))


@pytest.mark.parametrize("scheme", ["steady", "backward_euler", "bdf2", "bdf2_optimized"])
@pytest.mark.parametrize("convection", [False, True])
def test_poiseuille(scheme, convection):
    """G = 12 mu Q / H^3."""
    Q, mu = 0.7, 0.1
    profile = lambda x, t: 6.0 * Q * x[1] * (1.0 - x[1])  # noqa: E731
    fluid = make_fluid(
        GRADED, [ends(Q), WALLS], element="q2q1", mu=mu, scheme=scheme, convection=convection,
        initial_velocity=None if scheme == "steady" else (profile, still), dt=0.1,
    )  # fmt: skip
    for number in range(1 if scheme == "steady" else 4):
        info = step(fluid, 0.1 * number, 0.1)
        print(info.iterations, driving(fluid) - 12.0 * mu * Q)
    u, p = nodal_errors(fluid, (profile, still), still, 0.0, level=True)
    assert u < 1e-12
    assert p < 1e-11
    assert driving(fluid) == pytest.approx(12.0 * mu * Q, rel=1e-11)
    assert flow_rate(fluid)(["ends"]) == pytest.approx(Q, rel=1e-12)
