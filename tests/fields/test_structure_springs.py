"""Springs: exact forces and displacements, energy, and the reaction they give."""

import numpy as np
import pytest
from structure_setup import block, constant, distort, load_step, make_structure, vector
from test_structure_supports import MATERIAL, rotation, turned

from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure import probes
from solvers.structure.body import Spring, Symmetry, Traction
from solvers.structure.dynamics import Dynamics
from solvers.structure.materials import NeoHooke, StVenantKirchhoff


@pytest.mark.parametrize("cell_type", ["triangle", "quad9", "tetra10", "hexahedron"])
def test_bar_on_springs(cell_type):
    """A bar without Poisson's ratio pulled by q against springs k per area: u = q/k + (stretch - 1) x.

    St. Venant-Kirchhoff: E/2 (s^2 - 1) s = q.
    """
    E, k, s = 100.0, 30.0, 1.1
    q = E / 2 * (s**2 - 1) * s
    mesh = distort(block(cell_type, 2), 0.05)
    dim = mesh.points.shape[1]
    structure = make_structure(
        mesh,
        StVenantKirchhoff(E / 2, 0.0),
        supports=[Symmetry(name) for name in (("bottom",) if dim == 2 else ("bottom", "front"))],
        springs=[Spring("left", constant(k))],
        tractions=[Traction("right", vector(q, *[0.0] * (dim - 1)))],
    )
    load_step(structure)
    body = structure.bodies[0]
    u = structure.now.u.reshape(-1, dim)
    assert u[:, 0] == pytest.approx(q / k + (s - 1) * body.points[0, : body.owned], abs=1e-11)
    assert np.abs(u[:, 1:]).max() < 1e-11
    reaction = probes.on_surface(structure, body, "reaction", "left")()
    assert reaction["x"] == pytest.approx(-q, rel=1e-11)
    elastic = E / 8 * (s**2 - 1) ** 2
    assert structure.energy.internal == pytest.approx(elastic + q**2 / (2 * k), rel=1e-11)


@pytest.mark.parametrize("kind", ["normal", "direction"])
def test_springs_in_one_direction(kind):
    """A block on a turned foundation: it sinks by q/k against the normal, and slides freely along it."""
    mesh, R, k, q = block("hexahedron", 2), rotation(3), 30.0, 3.0
    direction = None if kind == "normal" else tuple(2.0 * R[:, 2])
    structure = make_structure(
        turned(mesh, R),
        StVenantKirchhoff(5e5, 0.0),
        supports=[Symmetry("left"), Symmetry("front")],
        springs=[Spring("bottom", constant(k), direction, normal=kind == "normal")],
        tractions=[Traction("top", vector(*(-q * R[:, 2])))],
    )
    load_step(structure)
    body = structure.bodies[0]
    u, X = structure.now.u.reshape(-1, 3) @ R, body.points[:, : body.owned].T @ R
    assert u[np.abs(X[:, 2]) < 1e-9] == pytest.approx(np.broadcast_to([0.0, 0.0, -q / k], (9, 3)), abs=1e-10)


def test_springs_at_nodes():
    """Four springs hold a square: each carries a quarter of its weight 2 g."""
    mesh = block("quad", 1)
    springs = [Spring(np.array([node]), lambda x, t: 50.0 + 0.0 * x[0]) for node in range(4)]
    structure = make_structure(mesh, MATERIAL, springs=springs, gravity=vector(0.3, -10.0))
    load_step(structure)
    assert structure.now.u.reshape(-1, 2).mean(axis=0) == pytest.approx([0.6 / 200.0, -20.0 / 200.0], rel=1e-11)


def test_energy_of_a_mass_on_springs():
    """A stiff square of mass 2 on springs k swings with sqrt(k/2) and keeps its energy."""
    k, dt, start = 8.0, 0.01, 0.1
    structure = make_structure(
        block("quad", 1),
        NeoHooke(8e5, 12e5, 2.0),
        springs=[Spring("bottom", constant(k)), Spring("top", constant(k))],
        initial_displacement=vector(start, 0.0),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)),
    )
    structure.initialise(0.0, dt)
    for step in range(20):
        structure.begin_step(dt * step, dt)
        structure.solve()
        structure.end_step()
    omega = np.sqrt(2.0 * k / 2.0)
    assert structure.now.u[0::2] == pytest.approx(start * np.cos(omega * 20 * dt), rel=(omega * dt) ** 2)
    assert structure.energy.initial == pytest.approx(k * start**2, rel=1e-12)
    assert abs(structure.energy.error) < 1e-9 * structure.energy.initial


def test_tangent():
    from test_structure_tangent import tangent_error

    springs = [Spring("left", lambda x, t: 3.0 + x[1]), Spring("top", constant(2.0), normal=True)]
    springs.append(Spring(np.array([2]), constant(5.0), (1.0, 2.0)))
    structure = make_structure(distort(block("quad", 2), 0.05), MATERIAL, springs=springs)
    assert tangent_error(structure) < 1e-6
