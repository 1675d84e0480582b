"""Rows and force of a film by the motion of its walls: against differences."""

from dataclasses import replace

import numpy as np
import pytest
import ufl
from fluid_setup import body, circle, field, loop, make_fluid, solve_steady, sphere

from solvers.fluid.grid.box import uniform
from solvers.fluid.terms import forms
from solvers.fluid.terms.boundary.patches import Patch
from solvers.fluid.terms.coupling_entries import interface_entries
from solvers.fluid.terms.shape_derivatives import film_shape
from solvers.fluid.terms.shape_derivatives.film_crossings import crossing_moments
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

CENTRE = 0.52
#: of momentum, continuity (which hardly changes) and force
LIMITS = np.array([1e-5, 0.12, 1e-6])


def disc_at_wall(kappa, slip=0.0, gap=0.03, radius=0.25):
    """A disc that approaches a wall, 0.3 cells of 0.1 in front of it, and the displacement of its vertices."""
    count = round(400 * radius)
    points, facets = circle([CENTRE, radius + gap], radius, count), loop(count)
    moved = np.zeros_like(points)
    mover = body("disc", points, facets, motion=lambda x, t: (x + moved, 0.0 * x + [0.0, -0.4]))
    patches = [Patch("wall", ("y-",), "no_slip"), Patch("ends", ("x-", "x+", "y+"), "traction", field(0, 0))]
    fluid = make_fluid(
        uniform([0, 0], [1, 0.6], [10, 6]),
        patches,
        [mover],
        element="q2q1",
        scheme="steady",
        convection=False,
        mu=0.3,
        solver=SolverSettings(Tolerance(residual=1e-11), linear="direct"),  # rounding of its factors: 4e-12
    )
    if kappa:
        fluid.system.transmissivity = np.full(len(facets), kappa)
    if slip:
        fluid.system.slip_length = np.full(len(facets), slip)
    solve_steady(fluid)
    return fluid, moved


def errors(fluid, moved, shape, direction):
    """Relative errors of the derivatives of momentum, continuity and force, near the least gap, for a wave of the wall.

    The wall crosses a plane of the grid there. Farther away it leaves the film.
    """
    x, state = fluid.moving.motions[0].x.copy(), fluid.flow.copy()
    change = np.cos(7.0 * x[:, :1]) * direction
    at, nothing_held = fluid.system.assemble_interface(), np.zeros(len(state), dtype=bool)
    found = interface_entries(at, fluid.unknowns, state, 0.0, nothing_held, np.arange(len(x)), shape)
    rows, forces = [], []
    for sign in (1.0, -1.0):
        moved[:] = sign * 1e-6 * change
        fluid.move({})
        fluid.flow[:] = state
        rows.append(fluid.system.residual())
        forces.append(fluid.system.surface_force())
    velocity, pressure = (
        nodes.dofs[(np.abs(nodes.points[:, 0] - CENTRE) < 0.09) & (nodes.points[:, 1] < 0.08)].ravel()
        for nodes in (fluid.unknowns.velocity, fluid.unknowns.pressure)
    )
    below = np.flatnonzero(np.repeat((np.abs(x[:, 0] - CENTRE) < 0.09) & (x[:, 1] < 0.1), 2))
    result = []
    for values, block, some in (
        (rows, found.into_flow.T, velocity),
        (rows, found.into_flow.T, pressure),
        (forces, found.force_by_motion, below),
    ):
        exact = ((values[0] - values[1]) / 2e-6).ravel()[some]
        result.append(np.linalg.norm((block @ change.ravel())[some] - exact) / np.linalg.norm(exact))
    return np.array(result)


@pytest.mark.parametrize("kappa", [0.0, 1e-5])
@pytest.mark.parametrize("direction", [(0.0, 1.0), (1.0, 0.0)])
def test_derivatives_of_a_film(kappa, direction):
    """Those that assume u = g and the momentum equation at the wall are wrong by several per cent."""
    fluid, moved = disc_at_wall(kappa)
    assert fluid.cut.film.min() < 1e-3
    found = errors(fluid, moved, fluid.system.shape_derivatives(improved=True), direction)
    assert (found < LIMITS).all()
    fluid, moved = disc_at_wall(kappa)
    momentum, _, force = errors(fluid, moved, (None, None), direction)
    assert min(momentum, force) > 0.005


@pytest.mark.parametrize("kappa", [0.0, 1e-5])
@pytest.mark.parametrize("slip", [1e-3, 1.0])
def test_derivatives_of_a_film_with_slip(kappa, slip):
    """Without them most of the derivative would be missing; the penalty, which moves too, is held."""
    fluid, moved = disc_at_wall(kappa, slip)
    found = errors(fluid, moved, fluid.system.shape_derivatives(improved=True), (0.0, 1.0))
    assert (found < LIMITS * [2.0, 1.0, 1.0]).all()
    fluid, moved = disc_at_wall(kappa, slip)
    momentum, _, force = errors(fluid, moved, (None, None), (0.0, 1.0))
    assert min(momentum, force) > 0.04


@pytest.mark.parametrize("kappa", [0.0, 1e-5])
@pytest.mark.parametrize("direction", [(0.0, 1.0), (1.0, 0.0)])
def test_derivatives_where_a_film_asks_for_a_larger_penalty(kappa, direction):
    """A film of 0.005 cells: the penalty of all pieces in a cell follows its fluid. Held, a third would be missing."""
    fluid, moved = disc_at_wall(kappa, gap=5e-4, radius=1.0)
    of_all, films = fluid.system.shape_derivatives(improved=True)
    assert of_all is None
    assert films.penalty is not None
    assert (errors(fluid, moved, (None, films), direction) < 1e-6).all()
    fluid, moved = disc_at_wall(kappa, gap=5e-4, radius=1.0)
    held = replace(fluid.system.shape_derivatives(improved=True)[1], penalty=None)
    momentum, _, force = errors(fluid, moved, (None, held), direction)
    assert min(momentum, force) > 0.005


@pytest.mark.parametrize("kappa", [0.0, 1e-5])
def test_without_the_jump_where_the_wall_crosses_planes_of_the_grid(kappa, monkeypatch):
    """It moves along the film: momentum and force of the nodes at these planes are wrong."""
    monkeypatch.setattr(film_shape, "crossing_moments", lambda *arguments: 0.0 * crossing_moments(*arguments))
    fluid, moved = disc_at_wall(kappa)
    momentum, _, force = errors(fluid, moved, fluid.system.shape_derivatives(improved=True), (1.0, 0.0))
    assert min(momentum, force) > 0.005


def rows_of_a_film(dim):
    """(found, by differences) of a random flow for a motion of the wall of a film, where it has no other cells."""
    middle = [0.52, 0.47, 0.28][-dim:]
    points, facets = (circle(middle, 0.25, 60), loop(60)) if dim == 2 else sphere(middle, 0.25, 3)
    moved, some = np.zeros_like(points), np.random.default_rng(4)
    mover = body("ball", points, facets, motion=lambda x, t: (x + moved, 0.0 * x - 0.4))
    faces = ("x-", "x+", "y-", "y+", "z-", "z+")[: 2 * dim]
    patches = [
        Patch("wall", faces[-2:-1], "no_slip"),
        Patch("ends", (*faces[:-2], faces[-1]), "traction", field(*[0] * dim)),
    ]
    box = uniform([0] * dim, [*[1] * (dim - 1), 0.6], [*[6] * (dim - 1), 4])
    fluid = make_fluid(box, patches, [mover], element="q2q1", scheme="backward_euler", dt=0.1, mu=0.3)
    fluid.begin_step(0.0, 0.1)
    fluid.move({})
    system, state = fluid.system, some.normal(size=len(fluid.flow))
    fluid.flow[:], system.history.x.array[:] = state, some.normal(size=len(state))
    shape, at = system.shape_derivatives(improved=True), system.assemble_interface()
    others = np.delete(np.arange(len(at.corners)), shape[1].pieces)
    change = some.normal(size=points.shape)
    change[at.corners[others].ravel()] = 0.0
    assert np.abs(change).max() > 0.1
    held = np.zeros(len(state), dtype=bool)
    found = interface_entries(at, fluid.unknowns, state, 0.0, held, np.arange(len(points)), shape)
    rows = []
    for sign in (1.0, -1.0):
        moved[:] = sign * 1e-6 * change
        fluid.move({})
        fluid.flow[:] = state
        rows.append(system.residual())
    return found.into_flow.T @ change.ravel(), (rows[0] - rows[1]) / 2e-6


@pytest.mark.parametrize("dim", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_a_term_of_the_form_of_films_alone(dim, monkeypatch):
    """A term that `forms` alone has is differentiated: what it adds to the rows is exact."""
    film = forms.film

    def with_more(flow, u, p, v, q):
        more = p * ufl.inner(ufl.grad(u), ufl.grad(v)) - ufl.dot(ufl.grad(p), ufl.grad(q))
        return film(flow, u, p, v, q) + more + ufl.dot(u, u) * (3.0 * ufl.dot(u, v) + q)

    without = rows_of_a_film(dim)
    monkeypatch.setattr(forms, "film", with_more)
    found, exact = (more - less for more, less in zip(rows_of_a_film(dim), without, strict=True))
    assert np.abs(found).max() > 1e-3
    np.testing.assert_allclose(found, exact, atol=1e-6 * np.abs(exact).max())
