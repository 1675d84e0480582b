"""Loads are integrated with their values at quadrature points: resultants and moments of cubic loads are exact."""

import numpy as np
import pytest
from structure_setup import CELL_TYPES, block, distort, make_structure

from solvers.structure.body import Pressure, Traction
from solvers.structure.loads import LineForce, PointForce
from solvers.structure.materials import NeoHooke

GRADIENT = np.array([[0.10, 0.15, 0.03], [-0.08, 0.12, 0.05], [0.04, -0.06, -0.10]])


def cubic(x, t):
    return t * (1.0 + 2.0 * x[0] ** 3)


def none(x, t):
    return np.zeros(x.shape[1])


def force_and_moment(cell_type, law=NeoHooke(3.0, 5.0, 2.0), gradient=None, **loads):
    """Sum of the nodal forces at t = 2 on the unit square or cube, and sum of x times them, by components."""
    body = make_structure(distort(block(cell_type, 2), 0.05), law, **loads).bodies[0]
    x = body.points[: body.dim, : body.owned].T
    if gradient is not None:
        body.set_displacement((x @ gradient.T).ravel())
    force = body.external_force(2.0).reshape(-1, body.dim)
    return force.sum(axis=0), x[:, 0] @ force


@pytest.mark.parametrize("cell_type", CELL_TYPES)
def test_traction(cell_type):
    """int 2 (1 + 2 x^3) = 3 over the top, int 2 x (1 + 2 x^3) = 9/5."""
    dim = 2 if cell_type[:4] in ("tria", "quad") else 3
    value = (none,) * (dim - 1) + (cubic,)
    force, moment = force_and_moment(cell_type, tractions=[Traction("top", value)])
    assert force == pytest.approx([0.0] * (dim - 1) + [3.0], abs=1e-13)
    assert moment == pytest.approx([0.0] * (dim - 1) + [1.8], abs=1e-13)


@pytest.mark.parametrize("cell_type", ["triangle", "quad9", "tetra10", "hexahedron"])
def test_volume_loads(cell_type):
    """A body force counts by volume, gravity times the density 2."""
    dim = 2 if cell_type[:4] in ("tria", "quad") else 3
    value = (cubic,) + (none,) * (dim - 1)
    force, moment = force_and_moment(cell_type, body_force=value, gravity=value)
    assert force == pytest.approx([9.0] + [0.0] * (dim - 1), abs=1e-12)
    assert moment == pytest.approx([5.4] + [0.0] * (dim - 1), abs=1e-12)


@pytest.mark.parametrize("cell_type", CELL_TYPES)
def test_pressure_on_a_deformed_surface(cell_type):
    """int p n da = cof(F) N int p dA for a homogeneous deformation."""
    dim = 2 if cell_type[:4] in ("tria", "quad") else 3
    F = np.eye(dim) + GRADIENT[:dim, :dim]
    cofactor = np.linalg.det(F) * np.linalg.inv(F).T
    for surface, normal in (("top", np.eye(dim)[-1]), ("bottom", -np.eye(dim)[-1])):
        force, moment = force_and_moment(cell_type, gradient=GRADIENT[:dim, :dim], pressures=[Pressure(surface, cubic)])
        assert force == pytest.approx(-3.0 * cofactor @ normal, abs=1e-13)
        assert moment == pytest.approx(-1.8 * cofactor @ normal, abs=1e-13)


def test_gravity_with_a_density_that_varies():
    """As much as the mass matrix: the density of a cell is that of its midpoint."""
    law = NeoHooke(3.0, 5.0, lambda x, t: 1.0 + x[0])
    structure = make_structure(block("quad", 2), law, gravity=(lambda x, t: np.ones(x.shape[1]), none))
    body = structure.bodies[0]
    x, y = structure.inertia.assemble_mass().createVecs("right"), structure.inertia.assemble_mass().createVecs("left")
    x.array[0::2] = 1.0
    structure.inertia.assemble_mass().mult(x, y)
    assert body.external_force(0.0) == pytest.approx(y.array, abs=1e-14)


@pytest.mark.parametrize("cell_type", ["tetra", "hexahedron27"])
def test_line_force(cell_type):
    """Along the edge y = z = 1, as on the lines of a surface: int 2 (1 + 2 x^3) = 3, int 2 x (1 + 2 x^3) = 9/5."""
    mesh = block(cell_type, 2)
    edge = np.flatnonzero((mesh.points[:, 1:] == 1.0).all(axis=1))
    edge = edge[np.argsort(mesh.points[edge, 0])]
    step = 1 if cell_type == "tetra" else 2
    lines = np.stack([edge[:-1:step], edge[step::step], *([edge[1::2]] if step == 2 else [])], axis=1)
    load = LineForce(lines, mesh.points[lines], (none, cubic, none))
    body = make_structure(mesh, NeoHooke(3.0, 5.0, 2.0), line_forces=[load]).bodies[0]
    force, x = body.external_force(2.0).reshape(-1, 3), body.points[0, : body.owned]
    assert (force.sum(axis=0), x @ force) == (
        pytest.approx([0, 3, 0], abs=1e-13),
        pytest.approx([0, 1.8, 0], abs=1e-13),
    )
    assert np.isin(body.nodes[: body.owned][np.abs(force).max(axis=1) > 0.0], edge).all()


def test_point_forces():
    """Each node carries the whole force, evaluated at its place."""
    mesh = block("quad9", 2)
    nodes = np.array([3, 17, 5])
    load = PointForce(nodes, (cubic, none))
    body = make_structure(mesh, NeoHooke(3.0, 5.0, 2.0), point_forces=[load]).bodies[0]
    force = body.external_force(2.0).reshape(-1, 2)[np.argsort(body.nodes[: body.owned])]
    expected = np.zeros_like(force)
    expected[nodes, 0] = 2.0 * (1.0 + 2.0 * mesh.points[nodes, 0] ** 3)
    assert np.allclose(force, expected, rtol=1e-14, atol=0.0)
