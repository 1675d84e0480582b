"""Contact surfaces without mass, and bars that hit a wall or each other against the exact solution."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from contact_setup import make_body, make_contact
from mpi4py import MPI
from structure_setup import CELL_TYPES, block, constant

from fsci import shapes
from solvers.algebra.blocks import Layout
from solvers.contact.surface import Surface
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.body import Support
from solvers.structure.body_pieces import BodyPieces
from solvers.structure.dynamics import Dynamics
from solvers.structure.inertia import without_mass
from solvers.structure.massless import massless_dofs
from solvers.structure.materials import StVenantKirchhoff
from solvers.structure.rayleigh import Damping

TRAPEZOIDAL = GeneralisedAlpha.from_rho_inf(1.0)


def dense(matrix):
    converted = matrix.convert("dense")
    return converted.getDenseArray().copy()


def at_planes(body, *planes):
    """The owned dofs at x = ... ."""
    x = body.points[0, : body.owned]
    return np.repeat(np.min([np.abs(x - plane) for plane in planes], axis=0) < 1e-9, body.dim)


def mass_without(body, massless):
    pieces = BodyPieces(MPI.COMM_SELF, [body])
    piece = pieces.of_nodes, pieces.count
    return dense(without_mass(body.mass(), massless, *piece)), piece


@pytest.mark.parametrize("cells", [1, 2, 4])
@pytest.mark.parametrize("cell_type", CELL_TYPES)
def test_uniform_density_of_the_same_mass(cell_type, cells):
    body = make_body("block", block(cell_type, cells))
    at_left = at_planes(body, 0.0)
    before, (after, _) = dense(body.mass()), mass_without(body, at_left)
    assert not after[at_left].any()
    assert not after[:, at_left].any()
    rest, there = after[~at_left][:, ~at_left], before[~at_left][:, ~at_left]
    factor = before.sum() / there.sum()
    assert factor > 1.0
    np.testing.assert_allclose(rest, factor * there, rtol=1e-13, atol=0.0)
    np.linalg.cholesky(rest)  # exists if it is positive definite


def two_squares(apart=2.0):
    """One mesh of two unconnected squares."""
    first = block("quad", 2)
    points = np.concatenate([first.points, first.points + np.array([apart, 0.0])])
    return replace(
        first, points=points, cells=np.concatenate([first.cells, first.cells + len(first.points)]), surfaces={}
    )


def test_each_piece_keeps_its_mass():
    body = make_body("two", two_squares())
    massless = at_planes(body, 0.0)
    before, (after, (piece, count)) = dense(body.mass()), mass_without(body, massless)
    second = (body.points[0, : body.owned] > 1.5).repeat(2)
    assert count == 2
    assert np.array_equal(piece.repeat(2), second)
    assert after[~second][:, ~second].sum() == pytest.approx(before[~second][:, ~second].sum(), rel=1e-13)
    assert np.array_equal(after[second], before[second])


def surfaces(body, slave, master):
    """A structure of one body whose contact has these nodes, as far as `massless_dofs` looks."""
    of = {
        "touching_dofs": lambda: np.flatnonzero(slave | master),
        "multiplier_dofs": lambda: np.flatnonzero(slave),
    }
    layout, pieces = Layout(MPI.COMM_SELF, [body.size]), BodyPieces(MPI.COMM_SELF, [body])
    return SimpleNamespace(
        comm=MPI.COMM_SELF,
        bodies=[body],
        layout=layout,
        constraint=SimpleNamespace(**of),
        pieces=pieces,
    )


def chosen(*surfaces_of_body):
    return massless_dofs(surfaces(*surfaces_of_body))[0]


def test_nodes_with_mass_determine_the_rotation():
    """Masters are massless, too, if that leaves two nodes in 2D, three in 3D; else slaves, else none."""
    body = make_body("block", block("quad", 2))
    left, right, middle = (at_planes(body, x) for x in (0.0, 1.0, 0.5))
    assert np.array_equal(chosen(body, left, right), left | right)
    assert np.array_equal(chosen(body, left, right | middle), left)
    assert not chosen(body, left | middle | right, ~left & False).any()
    x, y = body.points[:2, : body.owned]
    one = np.repeat((x == 0.0) & (y == 0.0), 2)
    assert not chosen(body, ~one, one & False).any()


def test_nodes_with_mass_on_a_line():
    """In 3D they do not determine the rotation about it."""
    body = make_body("bar", block("hexahedron", 2))
    x, y, z = body.points[:, : body.owned]
    sides = np.repeat((abs(x - 0.5) > 0.4) | (abs(y - 0.5) > 0.4), 3)
    bottom = np.repeat(z < 0.1, 3)
    assert np.array_equal(chosen(body, bottom, sides), bottom)
    assert not chosen(body, sides, bottom).any()
    assert massless_dofs(surfaces(body, sides, bottom))[1].all()


# ----------------------------------------------------------------------------------------------- a bar and a wall

SIZE = 1e-3  #: of the displacement, so small that the problem is linear


def bar(cells, dt, *, end=3.0, damping=Damping(), scheme=TRAPEZOIDAL, wall_at=0.0):
    """Columns time, displacement of the tip, force on the wall, energy; all over SIZE (energy: over its square).

    E = rho = 1, held at x = 1, pressed to u = (1 - x) / 2 and let go; the wall is at x = 0. The tip touches from t = 1
    to t = 2 with the pressure 1/2, and at t = 3 all is as at the start (GetFEM, demo_dynamic_contact_1D).
    """
    zero = constant(0)
    held = [Support("right", (zero, zero)), Support("bottom", (None, zero)), Support("top", (None, zero))]
    pressed = (lambda x, t: 0.5 * SIZE * (1.0 - x[0]), zero)
    body = make_body(
        "bar",
        shapes.rectangle([1, 0.1], [cells, 1]),
        StVenantKirchhoff(mu=0.5, lmbda=0.0, density=1.0),
        supports=held,
        initial_displacement=pressed,
    )
    wall = Surface("wall", np.array([[wall_at, -1.0], [wall_at, 2.0]]), np.array([[0, 1]]), "line", None)
    time = Dynamics(scheme, damping=damping)
    structure, touching = make_contact([body], [(("bar", "left"), wall)], time=time)
    tip = 2 * np.flatnonzero(body.points[0, : body.owned] < 1e-9)
    structure.initialise(0.0, dt)
    rows = []
    weight = time.force_weight
    for step in range(round(end / dt)):
        structure.begin_step(step * dt, dt)
        structure.solve()
        structure.end_step()
        now, old = structure.now, structure.old
        force = (weight * now.constraint + (1 - weight) * old.constraint)[tip].sum() / 0.1
        energy = (structure.energy.kinetic + structure.energy.internal) / 0.1
        rows.append([(step + 1) * dt, now.u[tip].mean() / SIZE, force / SIZE, energy / SIZE**2])
    return np.array(rows).T, structure, touching


def exact_tip(t):
    return np.interp(t, [0, 1, 2, 3], [0.5, 0, 0, 0.5])


@pytest.mark.parametrize(
    ("steps_per_cell", "until", "most", "ringing"),
    [(1.4, 3.0, 0.515, 0.001), pytest.param(2.5, 1.6, 0.8, 0.06, marks=pytest.mark.slow)],
)
def test_bar_impact(steps_per_cell, until, most, ringing):
    """The pressure is 1/2 throughout: no overshoot, no ringing, nothing gained, hardly anything lost.

    steps_per_cell: in which a wave crosses a cell. With many, waves of a few cells' length run ahead of the one that
    comes back from the other end: `until` they arrive the bounds are sharp. Over the whole contact the pressure is at
    most `most` (measured 0.509 and 0.76), its standard deviation below `ringing` (0.0003 and 0.059).
    """
    (t, tip, force, energy), structure, _ = bar(40, 1.0 / 40.0 / steps_per_cell)
    body, touching = structure.bodies[0], (t > 1.1) & (t < 1.9)
    u = structure.now.u.reshape(-1, 2)[:, 0] / SIZE
    assert np.abs(tip - exact_tip(t)).max() < 0.03
    assert np.abs(u - 0.5 * (1 - body.points[0, : body.owned])).max() < 0.03
    assert force[t < until].max() < 0.5 * 1.03
    assert force[touching].mean() == pytest.approx(0.5, rel=0.01)
    assert force[touching & (t < until)].std() < 0.002
    assert force.max() < most
    assert force[touching].std() < ringing
    assert not force[(t < 0.9) | (t > 2.1)].any()
    # the stress at the free end is relieved at the start, and next to nothing is gained afterwards
    assert energy.max() < energy[0] * (1 + 1e-4) < 0.125
    assert energy[-1] == pytest.approx(energy[0], rel=2e-3)


@pytest.mark.slow
def test_bar_impact_converges():
    errors = []
    for cells in (10, 40):
        (t, tip, _, _), _, _ = bar(cells, 0.4 / cells)
        errors.append(np.sqrt(np.mean((tip - exact_tip(t)) ** 2)))
    assert errors[1] < 0.5 * errors[0], errors


def test_newton_with_damping_and_no_mass():
    """The tangent knows that a massless node has another velocity: quadratic convergence."""
    _, structure, _ = bar(10, 0.05, end=1.0, damping=Damping(0.1, 0.02))
    structure.begin_step(1.0, 0.05)
    info = structure.solve()
    assert info.iterations <= 3, info.residuals
    assert info.residuals[-1] < 1e-5 * info.residuals[-2]


def test_newton_with_damping_far_from_contact():
    """The tangent is not symmetric there either: one iteration leaves what is of second order in the strain, 1e-3."""
    _, structure, contact = bar(10, 0.05, end=0.1, damping=Damping(0.1, 0.02), wall_at=-9.0)
    structure.begin_step(0.1, 0.05)
    info = structure.solve()
    assert not contact.near
    assert info.residuals[1] < 1e-4 * info.residuals[0]


def test_motion_of_massless_surfaces():
    """Their velocity is the difference of positions, exactly; they have no acceleration. Others follow Newmark."""
    dt = 0.05
    _, structure, _ = bar(10, dt, end=0.5)
    structure.begin_step(0.5, dt)
    structure.solve()
    massless, moved = structure.inertia.find_massless(), structure.now.u - structure.old.u
    assert np.abs(moved[massless]).max() > 0.01 * dt * SIZE
    assert np.array_equal(structure.now.v[massless], moved[massless] / dt)
    assert not structure.now.a[massless].any()
    others = np.setdiff1d(np.arange(len(moved)), massless)
    mean = (structure.now.v + structure.old.v)[others] / 2.0
    assert mean == pytest.approx(moved[others] / dt, abs=1e-12 * SIZE)


# ------------------------------------------------------------------------------------------- two bars, non-matching


@pytest.mark.slow
@pytest.mark.parametrize("slave", [0, 1])
def test_two_bars_in_3d(slave):
    """Bars of length 1 that meet with 1/2 each: pressure 1/2 for the time 2, then they fly apart as they came.

    2 by 2 cells against 3 by 3, no lateral contraction; the pressure is the same at all nodes.
    """
    cells, side, gap = 40, 0.3, 0.05
    dt = 1.0 / cells / 1.4
    bodies = []
    for name, across, start in (("left", 2, 0.0), ("right", 3, 1.0 + gap * SIZE)):
        mesh = shapes.box([1, side, side], [cells, across, across])
        mesh = replace(mesh, points=mesh.points + np.array([start, 0.0, 0.0]))
        flies = (constant((0.5 if name == "left" else -0.5) * SIZE), constant(0), constant(0))
        bodies.append(make_body(name, mesh, StVenantKirchhoff(mu=0.5, lmbda=0.0, density=1.0), initial_velocity=flies))
    faces = [("left", "right"), ("right", "left")]
    structure, contact = make_contact(bodies, [(faces[slave], faces[1 - slave])], time=Dynamics(TRAPEZOIDAL))
    structure.initialise(0.0, dt)
    weight, x = structure.time.force_weight, bodies[0].points[0, : bodies[0].owned]
    at_end = 3 * np.flatnonzero(x > 1 - 1e-9)
    rows = []
    for step in range(round(2.4 / dt)):
        structure.begin_step(step * dt, dt)
        structure.solve()
        structure.end_step()
        force = -(weight * structure.now.constraint + (1 - weight) * structure.old.constraint)[at_end]
        energy = (structure.energy.kinetic + structure.energy.internal) / side**2
        spread = np.ptp(contact.z[contact.active_set.active, 0]) if contact.active_set.active.any() else 0.0
        rows.append([(step + 1) * dt, force.sum() / side**2 / SIZE, energy / SIZE**2, spread / SIZE])
    t, pressure, energy, spread = np.array(rows).T
    touching = (t > gap + 0.1) & (t < gap + 1.9)
    assert pressure.max() < 0.5 * 1.05
    assert pressure[touching].mean() == pytest.approx(0.5, rel=0.02)
    assert pressure[touching].std() < 0.01
    assert spread.max() < 1e-6
    assert not pressure[t > gap + 2.1].any()
    assert energy[0] == pytest.approx(0.25, rel=1e-9)
    assert energy.max() < 0.25 * 1.002
    assert energy[-1] == pytest.approx(0.25, rel=0.01)
    momentum = structure.inertia.assemble_mass().createVecs("right")
    momentum.array[:] = structure.now.v
    assert abs((structure.inertia.assemble_mass() * momentum).array[::3].sum()) < 1e-10 * side**2 * SIZE
