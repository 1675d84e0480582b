"""Slave nodes that supports hold in some of their components: the normal pressure acts on what is free."""

import numpy as np
import pytest
from contact_setup import make_body, make_contact, solve_step, turned
from structure_setup import constant, vector

from fsci import shapes
from solvers.contact.surface import Surface
from solvers.structure.body import Support, Symmetry
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import StVenantKirchhoff

ZERO = constant(0)
MATERIAL = StVenantKirchhoff(*lame(1e9, 0.0), 1.0)
SQUARE = 3.0 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
ANGLES = np.linspace(-76.0, 76.0, 20)  # no multiple of a right angle


def rotation(dim, angle, skew=0.0):
    """About the last but one axis (2D: in the plane), then by `skew` about the vertical one."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    if dim == 2:
        return np.array([[c, -s], [s, c]])
    a, b = np.cos(np.radians(skew)), np.sin(np.radians(skew))
    return np.array([[a, -b, 0], [b, a, 0], [0, 0, 1]]) @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])


def on_incline(dim, turn, surface, held):
    """A block with weight 1 on a frictionless incline that goes through the origin; `surface` is held sideways."""
    shape = shapes.rectangle([1, 1], [2, 2]) if dim == 2 else shapes.box([1, 1, 1], [2, 2, 2])
    plane = np.array([[3.0, 0], [-3, 0]]) if dim == 2 else SQUARE
    facets, kind = (np.array([[0, 1]]), "line") if dim == 2 else (np.array([[0, 1, 2, 3]]), "quad")
    body = make_body(
        "block",
        turned(shape, turn),
        MATERIAL,
        supports=[Support(surface, held)],
        body_force=vector(*[0.0] * (dim - 1), -1.0),
    )
    floor = Surface("floor", plane @ turn.T, facets, kind, None)
    return make_contact([body], [(("block", "bottom"), floor)])


@pytest.mark.parametrize("surface", ["left", "bottom", "top"])
def test_a_block_on_an_incline(surface):
    """The incline carries the weight with a force along its normal, wherever the block is held sideways."""
    for angle in ANGLES:
        turn = rotation(2, angle)
        structure, contact = on_incline(2, turn, surface, (ZERO, None))
        info = solve_step(structure)
        normal = turn[:, 1]
        # the block is elastic: where slave nodes are held sideways its lower side is not quite a plane
        assert contact.resultant(0) == pytest.approx(normal / normal[1], rel=1e-6), f"{angle} degrees"
        assert info.iterations <= 4


@pytest.mark.parametrize("surface", ["left", "bottom", "top"])
@pytest.mark.parametrize("angle", [-40.0, 25.0])
def test_a_block_on_an_incline_in_space(surface, angle):
    """Held in both horizontal directions."""
    turn = rotation(3, angle, 35.0)
    structure, contact = on_incline(3, turn, surface, (ZERO, ZERO, None))
    info = solve_step(structure)
    normal = turn[:, 2]
    assert contact.resultant(0) == pytest.approx(normal / normal[2], rel=1e-5, abs=1e-5)
    assert info.iterations <= 5


def test_normals_lie_in_planes_of_symmetry():
    """At a plane of symmetry normals have no part across it; at a side that is just held they do."""
    block = shapes.box([2, 2, 1], [2, 2, 1])
    for support, masked in ((Symmetry("left"), True), (Support("left", (ZERO, None, None)), False)):
        body = make_body("block", block, MATERIAL, supports=[support])
        _, contact = make_contact(
            [body], [(("block", "bottom"), Surface("floor", SQUARE, np.array([[0, 1, 2, 3]]), "quad", None))]
        )
        (patch,) = contact.multipliers.patches
        tilted = contact.nodes.points[patch.nodes].copy()
        tilted[:, 2] += 0.3 * tilted[:, 0] ** 2 + 0.1 * tilted[:, 0]
        normals, _ = patch.normals(tilted)
        at_left = np.abs(contact.nodes.points[patch.nodes, 0]) < 1e-12
        assert (np.abs(normals[at_left, 0]) < 1e-15).all() == masked
