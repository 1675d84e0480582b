"""Orders of convergence against exact flows around cut bodies, and their independence of the position of the cut."""

import numpy as np
import pytest
import sympy
from fluid_setup import body, circle, errors, field, loop, make_fluid, solve_steady, sphere, symbolic, wall

from solvers.fluid.grid.box import uniform
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

X, Y, Z, T = sympy.symbols("x y z t")
BARS = {"q1q1": (1.9, 0.95, 1.4), "q2q1": (2.9, 1.9, 1.9)}
ACCURATE = SolverSettings(Tolerance(residual=1e-10), linear="direct")


def on_surface(velocity, points, t=0.0):
    return np.stack([c(points.T, t) for c in velocity], axis=1)


def rates(found):
    return np.log2(found[:-1] / found[1:])


# ---------------------------------------------------------------------------------------------------------- in 2D

STOKES = ([sympy.sin(2 * X) * sympy.cos(3 * Y), -2 * sympy.cos(2 * X) * sympy.sin(3 * Y) / 3], sympy.cos(3 * X + Y))


def stokes_errors(element, cells, *, centre=(0.513, 0.478), radius=0.231):
    """Stokes flow in the unit square around a disc whose surface has the exact velocity."""
    exact = symbolic(*STOKES, (X, Y, T))
    velocity = field(*exact[0])
    points = circle(centre, radius, 16 * cells)
    disc = body("disc", points, loop(len(points)), velocity=on_surface(velocity, points))
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [cells, cells]), [wall(velocity)], [disc],
        solver=ACCURATE, element=element, scheme="steady", convection=False, body_force=field(*exact[3]),
    )  # fmt: skip
    solve_steady(fluid)
    return errors(fluid, *exact[:3])


@pytest.mark.parametrize("element", BARS)
def test_stokes_around_a_disc(element):
    found = np.array([stokes_errors(element, cells) for cells in (10, 20, 40)])
    mean = np.log2(found[0] / found[-1]) / 2
    assert np.all(mean >= BARS[element]), (found, rates(found))


def kovasznay(re=40.0):
    lam = re / 2 - sympy.sqrt(re**2 / 4 + 4 * sympy.pi**2)
    grows, turns = sympy.exp(lam * X), 2 * sympy.pi * Y
    velocity = [1 - grows * sympy.cos(turns), lam / (2 * sympy.pi) * grows * sympy.sin(turns)]
    return velocity, (1 - grows**2) / 2


def kovasznay_errors(element, cells):
    exact = symbolic(*kovasznay(), (X, Y, T), rho=1.0, mu=1.0 / 40.0)
    velocity = field(*exact[0])
    points = circle((0.261, 0.014), 0.2, 16 * cells)
    disc = body("disc", points, loop(len(points)), velocity=on_surface(velocity, points))
    fluid = make_fluid(
        uniform([-0.5, -0.5], [1.0, 0.5], [3 * cells // 2, cells]), [wall(velocity)], [disc],
        solver=ACCURATE, mu=1.0 / 40.0, element=element, scheme="steady",
    )  # fmt: skip
    solve_steady(fluid)
    return errors(fluid, *exact[:3])


@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=pytest.mark.slow)])
def test_kovasznay_around_a_disc(element):
    found = np.array([kovasznay_errors(element, cells) for cells in (16, 32, 64)])
    assert np.all(rates(found)[-1] >= BARS[element]), (found, rates(found))


@pytest.mark.parametrize("element", [pytest.param("q1q1", marks=pytest.mark.slow), "q2q1"])
def test_errors_do_not_depend_on_the_position(element):
    """A disc is shifted through one cell in twenty steps."""
    cells = 16
    shift = np.linspace(0.0, 1.0, 20, endpoint=False)[:, None] * np.array([1.0, 0.37]) / cells
    found = np.array([stokes_errors(element, cells, centre=(0.48 + d[0], 0.49 + d[1])) for d in shift])
    assert np.all(found.max(axis=0) < 1.5 * found.min(axis=0)), found.max(axis=0) / found.min(axis=0)


# ---------------------------------------------------------------------------------------------------------- in 3D


def beltrami():
    """Velocity and pressure of a steady flow with curl u parallel to u (4C's BELTRAMI)."""
    a = b = sympy.pi / 4
    k1 = sympy.exp(a * (X - Z) + b * (Y - Z))
    k2 = sympy.exp(a * (Z - Y) + b * (X - Y))
    k3 = sympy.exp(a * (Y - X) + b * (Z - X))
    return [b * k1 - a * k2, b * k3 - a * k1, b * k2 - a * k3], (a**2 + b**2 + a * b) * (1 / k1 + 1 / k2 + 1 / k3)


def beltrami_errors(cells, *, element="q1q1", centre=(0.513, 0.478, 0.502), refinements=5, linear="auto"):
    """(errors, iterations of the linear solver) in the unit cube with a spherical hole."""
    exact = symbolic(*beltrami(), (X, Y, Z, T), rho=1.0, mu=1.0)
    velocity = field(*exact[0])
    points, facets = sphere(centre, 0.225, refinements)
    ball = body("ball", points, facets, velocity=on_surface(velocity, points))
    fluid = make_fluid(
        uniform([0, 0, 0], [1, 1, 1], [cells] * 3), [wall(velocity)], [ball], element=element, scheme="steady",
        solver=SolverSettings(Tolerance(residual=1e-8), linear=linear), body_force=field(*exact[3]),
    )  # fmt: skip
    solve_steady(fluid)
    return errors(fluid, *exact[:3]), fluid.iterate.linear_iterations


@pytest.mark.slow
def test_beltrami_flow_around_a_sphere():
    found = np.array([beltrami_errors(cells)[0] for cells in (8, 16)])
    assert np.all(rates(found)[0] >= BARS["q1q1"]), (found, rates(found))


@pytest.mark.slow
def test_beltrami_flow_around_a_sphere_second_order():
    found = np.array([beltrami_errors(cells, element="q2q1", refinements=6)[0] for cells in (4, 8)])
    assert np.all(rates(found)[0] >= BARS["q2q1"]), (found, rates(found))


@pytest.mark.slow
def test_errors_and_iterations_do_not_depend_on_the_position_3d():
    """A sphere is shifted through one cell in twenty steps."""
    cells = 8
    shift = np.linspace(0.0, 1.0, 20, endpoint=False)[:, None] * np.array([1.0, 0.37, 0.61]) / cells
    found, iterations = zip(
        *(beltrami_errors(cells, centre=0.45 + d, refinements=3, linear="iterative") for d in shift), strict=True
    )
    assert np.all(np.max(found, axis=0) < 1.5 * np.min(found, axis=0))
    assert max(iterations) < 1.5 * min(iterations)
