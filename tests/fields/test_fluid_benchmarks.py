"""Published flows: the lid-driven cavity, and Schaefer and Turek's cylinder in a channel."""

import numpy as np
import pytest
from fluid_setup import field, make_fluid, solve_steady

from fsci.bench import fluid as bench
from solvers.fluid.grid.box import Grid
from solvers.fluid.terms.boundary.patches import Patch
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

#: min u on x = 1/2, max v and min v on y = 1/2. Botella, Peyret, Computers & Fluids 27 (1998) 421-433.
CAVITY = {100: (-0.2140424, 0.1795728, -0.2538030), 1000: (-0.3885698, 0.3769447, -0.5270771)}


def cavity(re, cells, element):
    """The same three values; cells are finer towards the walls, the corners of the lid are at rest."""
    edge = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0, 1, cells + 1))
    edge = 0.5 * edge + 0.5 * np.linspace(0, 1, cells + 1)
    patches = [Patch("lid", ("y+",), "velocity", field(1, 0)), Patch("walls", ("x-", "x+", "y-"), "no_slip")]
    fluid = make_fluid(
        Grid((edge, edge)), patches, mu=1.0 / re, element=element, scheme="steady",
        solver=SolverSettings(Tolerance(1e-8)),
    )  # fmt: skip
    solve_steady(fluid)
    nodes = fluid.unknowns.velocity
    u, (x, y) = fluid.flow[nodes.dofs], nodes.points.T
    across, along = np.abs(x - 0.5) < 1e-9, np.abs(y - 0.5) < 1e-9
    return u[across, 0].min(), u[along, 1].max(), u[along, 1].min()


@pytest.mark.parametrize(("re", "element", "cells"), [(100, "q1q1", 64), (100, "q2q1", 24)])
def test_cavity(re, element, cells):
    assert cavity(re, cells, element) == pytest.approx(CAVITY[re], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("element", "cells"), [("q1q1", 128), ("q2q1", 48)])
def test_cavity_at_high_reynolds_number(element, cells):
    assert cavity(1000, cells, element) == pytest.approx(CAVITY[1000], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("element", "cells"), [("q1q1", 30), ("q2q1", 24)])
def test_steady_flow_around_a_cylinder(element, cells):
    """2D-1 with less than 100,000 unknowns."""
    found = bench.steady(element, cells)
    assert found["dofs"] <= 100_000
    assert abs(found["c_D error [%]"]) < 0.3
    assert abs(found["c_L error [%]"]) < 3.0
    assert abs(found["dp error [%]"]) < 0.5


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_newton_is_quadratic_in_the_end(element):
    """2D-1: scales of the stabilisation that follow the iterate would leave a tenth of the residual in each step."""
    fluid = bench.cylinder(bench.cylinder_grid(10), element, 0.2, tolerance=1e-10)
    fluid.initialise(0.0, 1.0)
    fluid.begin_step(0.0, 1.0)
    *_, before, last = fluid.solve().residuals
    assert last < 1e-3 * before


def test_drag_on_a_coarse_mesh():
    """2D-1, quickly."""
    found = bench.steady("q2q1", 10)
    assert abs(found["c_D error [%]"]) < 0.3
