"""Sharp edges of slave surfaces: places on both sides of them, and what contact makes of them."""

import numpy as np
import pytest
from contact_setup import SETTINGS, brick, make_body, solve_step
from structure_setup import constant, vector
from test_contact_several import HIGH, HIGH_3D, LOW, LOW_3D, STIFF, wall

from coupling.contact_surfaces import contact_surface
from fsci import shapes
from solvers.contact.contact import Contact
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.tied import Tied
from solvers.contact.pair import Pair
from solvers.contact.sharp_edges import split_nodes
from solvers.contact.surface import Surface
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.topology import cut_out
from solvers.structure.body import Support, Traction
from solvers.structure.field import Structure
from solvers.structure.time_scheme import Statics

ZERO = constant(0)


def surface(mesh, *names):
    points, facets, _ = cut_out(mesh, names)
    return points, facets, CELL_TYPES[mesh.cell_type].facet


def sides(dim):
    return ["left", "right", "bottom", "top"] + (["front", "back"] if dim == 3 else [])


@pytest.mark.parametrize("cell_type", ["quad", "triangle6", "quad9", "hexahedron", "tetra", "tetra10", "hexahedron27"])
def test_a_box_has_one_place_for_each_face(cell_type):
    """Nodes within a face have one place, those of an edge two, corners three (2D: two); normals are those of faces."""
    dim = 2 if cell_type in ("quad", "triangle6", "quad9") else 3
    mesh = brick(cell_type, 3, [1.0] * dim, [0.0] * dim, 0.0)
    points, facets, facet_type = surface(mesh, *sides(dim))
    found = split_nodes(points, facets, facet_type)
    on_faces = (np.minimum(np.abs(points), np.abs(1.0 - points)) < 1e-12).sum(axis=1)
    assert np.array_equal(np.bincount(found.nodes), on_faces)
    assert np.array_equal(found.nodes[found.facets], facets)


def test_what_is_round_stays_whole():
    """A ring of eight facets, of first and second order, and a ball."""
    for mesh, names in (
        (shapes.ring(0.5, 1.0, [8, 1]), ["outer"]),
        (shapes.ring(0.5, 1.0, [6, 1], order=2), ["outer", "inner"]),
        (shapes.sphere(1.0, [3, 1]), ["outer"]),
    ):
        points, facets, facet_type = surface(mesh, *names)
        assert len(split_nodes(points, facets, facet_type).nodes) == len(points)


def test_an_edge_may_end_within_a_surface():
    """A sheet with a crease up to its middle: only the nodes of the crease before its end have two places."""
    x, y = np.meshgrid(np.arange(5.0), np.arange(5.0), indexing="ij")
    height = np.where(y < 2, 3.0 * np.abs(x - 2.0), 0.0)
    node = np.arange(25).reshape(5, 5)
    quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(-1, 4)
    found = split_nodes(np.stack([x, y, height], axis=-1).reshape(-1, 3), quads, "quad")
    several = np.flatnonzero(np.bincount(found.nodes) > 1)
    assert set(several) >= {node[2, 0]}
    assert node[2, 4] not in several
    assert node[2, 3] not in several


def one_surface(cell_type, names, walls, law=None, loads=(), supports=(), cells=2):
    """A block on rigid walls, of which the named sides are one slave surface; (structure, contact)."""
    dim = 2 if cell_type in ("quad", "triangle6") else 3
    body = make_body(
        "block", brick(cell_type, cells, [1.0] * dim, [0.0] * dim, 0.0), STIFF, tractions=loads, supports=supports
    )
    slave = contact_surface([body], "block", *names)
    more = {} if law is None else {"law": law}
    contact = Contact([Pair(slave, wall(dim, axis), **more) for axis in walls], comm=body.domain.comm)
    return Structure([body], Statics(), SETTINGS, contact=contact), contact


@pytest.mark.parametrize("cell_type", ["quad", "triangle6", "hexahedron", "tetra10"])
def test_a_block_in_a_corner_with_one_surface(cell_type):
    """As with a surface for each wall: each carries its load, and nodes on edges have a multiplier for each."""
    dim = 2 if cell_type in ("quad", "triangle6") else 3
    low, high = (LOW, HIGH) if dim == 2 else (LOW_3D, HIGH_3D)
    loads = [Traction(on, vector(*(-np.eye(dim)[i]))) for i, on in enumerate(high)]
    structure, contact = one_surface(cell_type, low, range(dim), loads=loads)
    info = solve_step(structure)
    for i in range(dim):
        assert contact.resultant(i) == pytest.approx(np.eye(dim)[i], abs=1e-10)
    active = contact.active_set.active
    pressure = np.einsum("nd,nd->n", contact.z, contact.terms.normals)[active]
    assert pressure == pytest.approx(pressure.mean(), rel=1e-6)
    normals = np.abs(contact.terms.normals[active])
    assert np.abs(normals.max(axis=1) - 1.0).max() < 1e-4
    assert info.iterations <= 4


@pytest.mark.parametrize("cell_type", ["quad", "hexahedron"])
@pytest.mark.parametrize("law", [None, Coulomb(0.4)])
def test_sides_that_touch_nothing_change_nothing(cell_type, law):
    """A block that is pressed down and dragged, with its bottom as the slave or with all of its sides: friction counts
    at the corners, too."""
    dim = 2 if cell_type == "quad" else 3
    move = (lambda x, t: 0.05 * t + 0.0 * x[0], *[ZERO] * (dim - 2), lambda x, t: -0.05 + 0.0 * x[0])
    found = []
    for names in (["bottom"], sides(dim)[:3] + sides(dim)[4:]):
        structure, contact = one_surface(cell_type, names, [dim - 1], law, supports=[Support("top", move)], cells=3)
        structure.initialise(0.0, 1.0)
        for step in range(2):
            solve_step(structure, float(step), first=False)
        found.append((structure.now.u.copy(), contact.resultant(0)))
    assert found[1][0] == pytest.approx(found[0][0], abs=1e-10)
    assert found[1][1] == pytest.approx(found[0][1], rel=1e-9, abs=1e-9 * np.abs(found[0][1]).max())
    if law is not None:
        assert np.abs(found[0][1][0]) == pytest.approx(0.4 * found[0][1][-1], rel=1e-6)


def test_tied_surfaces_are_not_cut():
    """A block let into another one is held by its bottom and sides; its corners have one multiplier."""
    body = make_body("block", brick("quad", 2, [1.0, 1.0], [0.0, 0.0], 0.0), STIFF)
    slave = contact_surface([body], "block", "left", "bottom", "right")
    points = np.array([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    cup = Surface("cup", points, np.array([[1, 0], [2, 1], [3, 2]]), "line", None)
    contact = Contact([Pair(slave, cup, law=Tied())], comm=body.domain.comm)
    assert len(contact.z) == contact.size
