"""Thin bodies that move in 3D: the unknowns of each side follow the body, and nothing passes from one to the other."""

import numpy as np
import pytest
from fluid_setup import block, body, field, step
from thin_space import SIZE, duct, plate, turn

from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

SLOW = pytest.mark.slow
THICKNESS = [pytest.param(1e-3, marks=SLOW), 0.2, pytest.param(1.0, marks=SLOW), 1.5, pytest.param(3.0, marks=SLOW)]


def pushed(points, facets, normal, element, cells, cells_per_step, **settings):
    """A plate that seals a duct and moves along it: largest errors of velocity and force in three steps."""
    dt, along, pressures = 0.1, np.array([1.0, 0.0, 0.0]), (1.0, 0.7)
    speed = cells_per_step * SIZE / dt
    moving = body("plate", points, facets, motion=lambda x, t: (x + speed * t * along, 0 * x + speed * along))
    initial = field(speed, 0.0, 0.0)
    fluid = duct([moving], element, pressures, cells=cells, mu=0.05, dt=dt, initial_velocity=initial, **settings)
    force = (pressures[0] - pressures[1]) * (SIZE * cells[1]) ** 2 / normal[0] * normal
    off = np.zeros(2)
    for number in range(3):
        step(fluid, number * dt, dt)
        nodes = fluid.unknowns.velocity.dofs
        velocity = fluid.flow[nodes][fluid.system.active_dofs[nodes[:, 0]]]
        error = np.abs(velocity - speed * along).max(), np.abs(fluid.force()["plate"].sum(axis=0) - force).max()
        off = np.maximum(off, error)
    return off, fluid


@pytest.mark.parametrize("thickness", THICKNESS)
@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=SLOW)])
def test_plate_that_moves_along_a_duct(element, thickness):
    """By a cell per step: nothing passes it, and it carries the difference of the pressures in each step."""
    points, facets, normal = plate(thickness, np.random.default_rng(0))
    off, fluid = pushed(points - [0.2, 0.0, 0.0], facets, normal, element, (8, 3, 3), 1.0)
    assert (off < 1e-9).all()
    assert fluid.moving.thin.follows


@pytest.mark.slow
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_thicker_plate_that_hardly_moves(element):
    """Parallel to a diagonal plane of the cells: strips behind both sides would meet within 6.9 cells."""
    matrix = turn(np.pi / 4, np.arcsin(1.0 / np.sqrt(3.0)))
    for thickness in (3.2, 5.0, 6.8) if element == "q1q1" else (3.1, 3.5):
        points, facets = block([-thickness * SIZE / 2, -9.0, -9.0], [thickness * SIZE / 2, 9.0, 9.0])
        points = points @ matrix.T + [2.7, 0.52, 0.47]
        off, _ = pushed(points, facets, matrix[:, 0], element, (22, 4, 4), 0.05)
        assert (off < 1e-9).all(), thickness


def test_without_a_direct_solver():
    """Incomplete factors, which q1q1 has in 3D from some size on, do not depend on the places of nodes."""
    points, facets, normal = plate(0.2, np.random.default_rng(0))
    solver = SolverSettings(Tolerance(residual=1e-12), linear="ilu", linear_tolerance=1e-12)
    off, fluid = pushed(points - [0.2, 0.0, 0.0], facets, normal, "q1q1", (8, 3, 3), 1.0, solver=solver)
    assert (off < 1e-9).all()
    assert fluid.iterative.sequence.current == "ilu"
