"""Several surfaces at one place: slaves with a common edge, one slave with several masters, masters in layers."""

from dataclasses import replace

import numpy as np
import pytest
from contact_setup import brick, make_body, make_contact, solve_step
from mortar_surfaces import all_pairs, patch
from scipy.optimize import brentq
from structure_setup import constant, vector

from coupling.contact_surfaces import contact_surface
from fsci import shapes
from solvers.contact.surface import Surface
from solvers.kernels import mortar, nodal_normals
from solvers.structure.body import Support, Traction
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import NeoHooke, StVenantKirchhoff

ZERO = constant(0)
STIFF = StVenantKirchhoff(*lame(1e5, 0.0), 1.0)


def wall(dim, axis, sign=1.0):
    """A rigid plane through the origin that looks along an axis."""
    if dim == 2:
        points = np.array([[3.0, 0.0], [-3.0, 0.0]]) if axis == 1 else np.array([[0.0, -3.0], [0.0, 3.0]])
        return Surface(f"wall{axis}", points, np.array([[0, 1]]), "line", None)
    corners = np.array([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]])
    points = np.zeros((4, 3))
    points[:, (axis + 1) % 3], points[:, (axis + 2) % 3] = corners.T
    return Surface(f"wall{axis}", points, np.array([[0, 1, 2, 3]]), "quad", None)


LOW, HIGH = ("left", "bottom"), ("right", "top")
LOW_3D, HIGH_3D = ("left", "front", "bottom"), ("right", "back", "top")


@pytest.mark.parametrize("cell_type", ["quad", "triangle6", "hexahedron", "tetra", "tetra10"])
def test_a_block_pressed_into_a_corner(cell_type):
    """nu = 0: every direction carries its load p = E (s^2 - 1) s / 2 alone; nodes at the edge bear two or three."""
    dim = 2 if cell_type in ("quad", "triangle6") else 3
    low, high = (LOW, HIGH) if dim == 2 else (LOW_3D, HIGH_3D)
    loads = [Traction(on, vector(*(-np.eye(dim)[i]))) for i, on in enumerate(high)]
    body = make_body("block", brick(cell_type, 2, [1.0] * dim, [0.0] * dim, 0.0), STIFF, tractions=loads)
    structure, contact = make_contact([body], [(("block", on), wall(dim, i)) for i, on in enumerate(low)])
    info = solve_step(structure)

    stretch = brentq(lambda s: 0.5e5 * s * (s**2 - 1) + 1.0, 0.9, 1.0, xtol=1e-16, rtol=1e-14)
    exact = (stretch - 1.0) * body.points[:dim].T
    assert np.abs(structure.now.u.reshape(-1, dim) - exact).max() < 1e-10 * (1.0 - stretch)
    for i in range(dim):
        assert contact.resultant(i) == pytest.approx(np.eye(dim)[i], abs=1e-10)
    active = contact.active_set.active
    pressure = np.einsum("nd,nd->n", contact.z, contact.terms.normals)[active]
    assert len(pressure) == dim * len(contact.nodes.of_surface[0])
    assert pressure == pytest.approx(1.0 / stretch ** (dim - 1), rel=1e-8)
    assert info.iterations <= 4


def test_a_surface_given_in_two_parts_is_one():
    """Two slave surfaces that continue each other have one multiplier at their common node and the same result."""
    found = []
    for names in (("bottom",), ("bottom_left", "bottom_right")):
        mesh = shapes.rectangle([2.0, 1.0], [4, 2])
        middle = mesh.points[mesh.surfaces["bottom"]].mean(axis=1)[:, 0] < 1.0
        parts = {"bottom_left": mesh.surfaces["bottom"][middle], "bottom_right": mesh.surfaces["bottom"][~middle]}
        mesh = replace(mesh, surfaces={**mesh.surfaces, **parts})
        loads = [Traction("top", vector(0.0, -20.0))]
        body = make_body("block", mesh, tractions=loads, supports=[Support("left", (ZERO, None))])
        structure, contact = make_contact([body], [(("block", on), wall(2, 1)) for on in names])
        solve_step(structure)
        assert len(contact.z) == contact.size
        found.append((structure.now.u.copy(), sum(contact.resultant(i) for i in range(len(names)))))
    assert np.abs(found[0][0] - found[1][0]).max() < 1e-12
    assert found[0][1] == pytest.approx(found[1][1], rel=1e-10)


def sheared(base_cells, split):
    """A block pressed and dragged on a base in one piece, or in two halves."""
    top = make_body(
        "top",
        shapes.rectangle([2.0, 1.0], [7, 2], [-1.0, 0.0]),
        supports=[Support("top", (lambda x, t: 0.02 * t + ZERO(x, t), lambda x, t: -0.05 * t + ZERO(x, t)))],
    )
    halves = [("left", -2.0, 2.0), ("right", 0.0, 2.0)] if split else [("base", -2.0, 4.0)]
    bases = [
        make_body(
            name,
            shapes.rectangle([width, 1.0], [n, 2], [start, -1.0]),
            supports=[Support("bottom", (ZERO, ZERO))],
        )
        for (name, start, width), n in zip(halves, base_cells, strict=True)
    ]
    pairs = [(("top", "bottom"), (base.name, "top")) for base in bases]
    return make_contact([top, *bases], pairs)


def test_one_slave_on_two_masters():
    """As many Newton steps as on one master; each pair has its own part of the force."""
    newton = {}
    for cells, split in (((9,), False), ((4, 5), True)):
        structure, contact = sheared(cells, split)
        structure.initialise(0.0, 1.0)
        newton[split] = [solve_step(structure, float(k), first=False).iterations for k in range(2)]
    assert newton[True] == newton[False] == [4, 4]
    forces = [contact.resultant(i) for i in range(2)]
    load = np.zeros(2)
    top = structure.bodies[0]
    held = np.flatnonzero(np.abs(top.points[1, : top.owned] - 1.0) < 1e-12)
    for axis in range(2):
        load[axis] = structure.residual_force[2 * held + axis].sum()
    assert sum(forces) == pytest.approx(-load, rel=1e-9, abs=1e-9 * np.abs(load).max())
    assert forces[0][1] == pytest.approx(forces[1][1], rel=0.2)  # half each, but for the drag and unequal meshes


@pytest.mark.parametrize("cell_type", ["quad", "quad9", "hexahedron", "tetra"])
@pytest.mark.parametrize("behind", ["wider", "narrower"])
def test_the_nearest_of_masters_in_layers_counts(cell_type, behind):
    """A second master below the first one changes nothing, however far it reaches."""
    dim = 2 if cell_type.startswith("quad") else 3
    down = Support("top", (*[ZERO] * (dim - 1), constant(-0.02)))
    found = []
    for layers in (1, 2):
        body = make_body("block", brick(cell_type, 2, [1.0] * dim, [0.0] * dim, 0.0), supports=[down])
        near, far = wall(dim, dim - 1), wall(dim, dim - 1)
        scale = 2.0 if behind == "wider" else 0.25
        far = replace(far, name="far", points=far.points * scale - 0.1 * np.eye(dim)[-1])
        pairs = [(("block", "bottom"), near), (("block", "bottom"), far)][:layers]
        structure, contact = make_contact([body], pairs)
        info = solve_step(structure)
        found.append((structure.now.u.copy(), contact.resultant(0), info.iterations))
    assert found[1][0] == pytest.approx(found[0][0], abs=1e-12)
    assert found[1][1] == pytest.approx(found[0][1], rel=1e-12)
    assert np.array_equal(contact.resultant(1), np.zeros(dim))
    assert found[1][2] == found[0][2]


@pytest.mark.parametrize("cell_type", ["quad", "quad9", "hexahedron", "tetra"])
@pytest.mark.parametrize("first", [0, 1])
def test_a_master_behind_another_one_with_the_same_facets_of_the_slave_in_two_surfaces(cell_type, first):
    """It changes nothing, in either order, if its slave is another surface with some of the facets, or has them all."""
    dim = 2 if cell_type.startswith("quad") else 3
    down = Support("top", (*[ZERO] * (dim - 1), constant(-0.02)))
    found = []
    for chosen in (None, slice(None), slice(1)):
        body = make_body("block", brick(cell_type, 2, [1.0] * dim, [0.0] * dim, 0.0), supports=[down])
        slave, near, far = contact_surface([body], "block", "bottom"), wall(dim, dim - 1), wall(dim, dim - 1)
        far = replace(far, name="far", points=far.points - 0.1 * np.eye(dim)[-1])
        pairs = [(slave, near)]
        if chosen is not None:
            pairs.insert(first, (replace(slave, name="again", facets=slave.facets[chosen].copy()), far))
        structure, contact = make_contact([body], pairs)
        solve_step(structure)
        which = next(k for k, pair in enumerate(contact.pairs) if pair.master is near)
        found.append((structure.now.u.copy(), contact.resultant(which)))
    for u, force in found[1:]:
        assert u == pytest.approx(found[0][0], abs=1e-12)
        assert force == pytest.approx(found[0][1], rel=1e-12)


@pytest.mark.parametrize("integration", ["segments", "elements"])
def test_layers_by_points_and_by_segments(integration):
    """Both ways of integration choose the first master that the slave meets, also where the slave is inside it."""
    xs, fs = patch("quad4", 2, turned=True)
    front, f = patch("quad4", 1, size=3.0)
    xm = np.concatenate([front - [0, 0, -0.3], front - [0, 0, 0.2]])
    fm = np.concatenate([f, f + len(front)])
    normals, _ = nodal_normals(xs, fs, "quad4")
    result = mortar(xs, fs, "quad4", xm, fm, "quad4", normals, all_pairs(fs, fm), method=integration, reach=1.0)
    assert result.area.sum() == pytest.approx(1.0, rel=1e-12)
    assert result.gap.sum() == pytest.approx(-0.3, rel=1e-12)


def test_three_bodies_at_one_place():
    """A block on two others that also touch each other: constant pressure in all of them, Newton as quick as ever."""
    material = NeoHooke(mu=500.0, lmbda=0.0, density=1.0)
    left = [Support("left", (ZERO, None)), Support("bottom", (None, ZERO))]
    right = [Support("right", (constant(-0.1), None)), Support("bottom", (None, ZERO))]
    upper = [Support("left", (ZERO, None)), Support("top", (None, constant(-0.1)))]
    bodies = [
        make_body("left", shapes.rectangle([1.0, 1.0], [3, 3], [-1.0, -1.0]), material, supports=left),
        make_body("right", shapes.rectangle([1.0, 1.0], [2, 2], [0.0, -1.0]), material, supports=right),
        make_body("upper", shapes.rectangle([2.0, 1.0], [5, 2], [-1.0, 0.0]), material, supports=upper),
    ]
    pairs = [
        (("upper", "bottom"), ("left", "top")),
        (("upper", "bottom"), ("right", "top")),
        (("left", "right"), ("right", "left")),
    ]
    structure, contact = make_contact(bodies, pairs)
    info = solve_step(structure)
    assert info.iterations <= 8, info.residuals
    across, down = contact.resultant(2), contact.resultant(0) + contact.resultant(1)
    assert across[0] < 0.0
    assert down[1] > 0.0
    ends = zip(bodies, (-1, -1, 1), strict=True)
    held = [np.flatnonzero(np.abs(body.points[1, : body.owned] - y) < 1e-12) for body, y in ends]
    parts = structure.split(structure.residual_force)
    assert down[1] == pytest.approx(-parts[2][2 * held[2] + 1].sum(), rel=1e-9)
    assert down[1] == pytest.approx(sum(parts[i][2 * held[i] + 1].sum() for i in (0, 1)), rel=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_masters_side_by_side_that_overlap(dim):
    """Both count where they overlap: as many Newton steps as without, and a force that goes on smoothly.

    Chosen one or the other, from 0.1 % of a facet's diameter between them on, no step converges.
    """

    def block(name, size, cells, start, supports):
        if dim == 2:
            return make_body(name, shapes.rectangle(size, cells, start), supports=supports)
        size, cells, start = ([*a[:1], b, *a[1:]] for a, b in ((size, 1.0), (cells, 2), (start, 0.0)))
        return make_body(name, shapes.box(size, cells, start), supports=supports)

    forces, along = [], [ZERO] * (dim - 1)
    for overlap in (0.0, 0.02, 0.1):
        top = block("top", [2.0, 1.0], [5, 2], [-1.0, 0.0], [Support("top", (*along, constant(-0.05)))])
        held = [Support("bottom", (*along, ZERO))]
        left = block("left", [2.0 + overlap, 1.0], [4, 2], [-2.0, -1.0], held)
        right = block("right", [2.0, 1.0], [5, 2], [0.0, -1.0], held)
        structure, contact = make_contact(
            [top, left, right], [(("top", "bottom"), (b.name, "top")) for b in (left, right)]
        )
        assert solve_step(structure).iterations <= 4
        forces.append(sum(contact.resultant(i) for i in range(2))[-1])
    growth = np.diff(forces) / [0.02, 0.08]
    assert growth[0] == pytest.approx(growth[1], rel=0.05)
    assert forces[2] == pytest.approx(forces[0], rel=0.03)


@pytest.mark.parametrize(("thickness", "mean"), [(0.01, 0.005), (0.02, 0.01), (0.03, 0.0), (0.1, 0.0)])
def test_layers_thinner_than_a_twentieth_of_a_facet_count_together(thickness, mean):
    """nu = 0: the block bears E (s^2 - 1) s / 2, s its stretch, which is that of half a thickness less there."""
    down = Support("top", (ZERO, constant(-0.02)))
    body = make_body("block", brick("quad", 2, [1.0] * 2, [0.0] * 2, 0.0), STIFF, supports=[down])
    near, far = wall(2, 1), wall(2, 1)
    far = replace(far, name="far", points=2.0 * far.points - thickness * np.eye(2)[1])
    structure, contact = make_contact([body], [(("block", "bottom"), near), (("block", "bottom"), far)])
    solve_step(structure)
    stretch = 1.0 - 0.02 + mean
    assert contact.resultant(0)[1] + contact.resultant(1)[1] == pytest.approx(
        0.5e5 * (1.0 - stretch**2) * stretch, rel=1e-9
    )
