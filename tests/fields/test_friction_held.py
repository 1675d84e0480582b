"""Friction at nodes that do not have all directions of their law: on planes of symmetry, in corners."""

from dataclasses import replace

import numpy as np
import pytest
from contact_setup import make_body, make_contact, solve_step
from structure_setup import constant
from test_contact_several import wall

from fsci import shapes
from solvers.contact.directions import find_directions
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.law import SLIP
from solvers.structure.body import Support
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import NeoHooke
from solvers.structure.supports import Symmetry

ZERO = constant(0)
SOFT, STIFF = NeoHooke(*lame(100.0, 0.4)), NeoHooke(*lame(1000.0, 0.0))


def stamp(dim, half):
    """A stiff block with a round lower side pressed onto a soft one: all of it, or the half x > 0."""
    make, depth = (shapes.rectangle, []) if dim == 2 else (shapes.box, [1.0])

    def part(width, cells, low):
        columns = cells // 2 if half else cells
        sizes, counts = [width / 2 if half else width, *depth, 0.6], [columns, *[2] * len(depth), 3]
        mesh = make(sizes, counts)
        return replace(mesh, points=mesh.points + np.array([0.0 if half else -width / 2, *[0.0] * len(depth), low]))

    lower, upper = part(2.0, 10, -0.6), part(1.2, 8, 0.0)
    points = upper.points.copy()
    points[:, -1] += points[:, 0] ** 2 / 4.0 * (1.0 - points[:, -1] / 0.6)
    sides = [Symmetry(side) for side in ["left"] * half + ["front", "back"] * (dim - 2)]
    press = Support("top", (ZERO, *[None] * len(depth), lambda x, t: np.full(x.shape[1], -0.1 * t)))
    bodies = [
        make_body("lower", lower, SOFT, supports=[*sides, Support("bottom", (ZERO,) * dim)]),
        make_body("upper", replace(upper, points=points), STIFF, supports=[*sides, press]),
    ]
    structure, contact = make_contact(bodies, [(("lower", "top"), ("upper", "bottom"))], law=Coulomb(0.1))
    structure.initialise(0.0, 0.5)
    newton = [solve_step(structure, 0.5 * k, 0.5, first=False).iterations for k in range(2)]
    assert max(newton) <= 8, newton
    u = [part.reshape(-1, dim) for part in structure.split(structure.now.u)]
    return contact, [(body.points[:dim, : body.owned].T, at) for body, at in zip(bodies, u, strict=True)]


@pytest.mark.parametrize(("dim", "tolerance"), [(2, 1e-9), (3, 1e-4)])
def test_half_of_it_with_a_plane_of_symmetry(dim, tolerance):
    """It slides as the half of the whole does; in 3D nodes on the sides can slide in two of three directions.

    In 3D facets that meet at the plane of symmetry are projected along their own normals: a strip there, of second
    order, sees the other half of the master in the whole and nothing in the half (6e-6).
    """
    contact, whole = stamp(dim, half=False)
    assert np.sum(contact.active_set.status == SLIP) > 2
    _, half = stamp(dim, half=True)
    for (places, u), (here, found) in zip(whole, half, strict=True):
        apart = np.linalg.norm(places[:, None] - here[None], axis=2)
        assert apart.min(axis=0).max() < 1e-12
        assert np.abs(found - u[apart.argmin(axis=0)]).max() < tolerance * np.abs(u).max()


@pytest.mark.parametrize("dim", [2, 3])
def test_a_corner(dim):
    """A node with multipliers of two or three surfaces has no friction, the others have; Newton's method ends."""
    mesh = (shapes.rectangle if dim == 2 else shapes.box)([1.0] * dim, [3] * dim)
    far = ("right", "top") if dim == 2 else ("right", "back", "top")

    def push(i):
        return tuple((lambda x, t: np.full(x.shape[1], -0.03 * t)) if k == i else None for k in range(dim))

    body = make_body("block", mesh, SOFT, supports=[Support(on, push(i)) for i, on in enumerate(far)])
    near = ("left", "bottom") if dim == 2 else ("left", "front", "bottom")
    walls = [(("block", on), wall(dim, i)) for i, on in enumerate(near)]
    structure, contact = make_contact([body], walls, law=Coulomb(0.3))
    assert solve_step(structure).iterations <= 8
    z, n = contact.z, contact.terms.normals
    along = np.linalg.norm(z - np.einsum("nd,nd->n", z, n)[:, None] * n, axis=1)
    several = ~contact.multipliers.only_one
    assert several.sum() >= dim
    assert along[several & contact.active_set.active].max() < 1e-9
    assert along[~several].max() > 0.1


def test_law_and_direction_of_a_node_on_a_plane_belong_together():
    """Q^T P has its large entries on the diagonal, so that the rows of the condensed system do, too."""
    rng = np.random.default_rng(0)
    for axis in range(3):
        normals = rng.normal(size=(20, 3))
        normals[:, axis] *= 0.05
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        held = np.broadcast_to(np.diag(np.eye(3)[axis]), (20, 3, 3))
        spans = np.full(20, "surface", dtype="<U7")
        found = find_directions(rng.normal(size=(20, 3)), normals, np.arange(20), held, spans)
        block = (found.node_basis.T @ found.basis).toarray()
        assert np.diag(block).min() > 0.9
        assert np.abs(block - np.diag(np.diag(block))).max() < 1e-12
