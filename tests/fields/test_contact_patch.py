"""Patch tests of contact: a homogeneous state passes through meshes that do not match.

The states are finite (5 % shortening), so that every nonlinearity takes part; they are exact for any mesh of
which the facets of the interface are integrated exactly, i.e. triangles, parallelograms and lines.
"""

from dataclasses import replace

import numpy as np
import pytest
from contact_setup import (
    brick,
    displacement_error,
    make_body,
    make_contact,
    press_blocks,
    pressed,
    pressures,
    solve_step,
    turned,
)
from mortar_surfaces import rotation
from structure_setup import CELL_TYPES, constant, distort, vector

from solvers.contact.surface import Surface
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Support, Traction

STRETCH = 0.95
TO_ROUNDING = SolverSettings(Tolerance(residual=1e-15), linear="direct")
MIXED = [
    ("quad", "triangle"),
    ("triangle6", "quad"),
    ("quad9", "triangle"),
    ("hexahedron", "tetra"),
    ("tetra", "hexahedron"),
    ("tetra10", "hexahedron"),
    ("hexahedron27", "tetra10"),
]
SIDES = [("left", 0), ("front", 1)]
ALL_SIDES = [("left", 0), ("right", 0), ("front", 1), ("back", 1)]


def dimension(cell_type):
    return 2 if cell_type in ("triangle", "triangle6", "quad", "quad9") else 3


def deformation(F, turn=None):
    """Displacement t (F - 1) x in a frame that is turned."""
    dim = len(F)
    turn = np.eye(dim) if turn is None else turn
    gradient = turn @ np.diag(F) @ turn.T - np.eye(dim)
    return tuple(lambda x, t, row=row: t * (row @ x[:dim]) for row in gradient)


def bricks(lower, upper, *, irregular=0.0, width=1.0, cells=(3, 2)):
    """Two blocks one upon the other, `irregular` also within the interface; the upper one may be narrower."""
    dim = dimension(lower)
    found = []
    for cell_type, n, size, height in ((lower, cells[0], 1.0, 0.0), (upper, cells[1], width, 0.5)):
        shape, origin = [size] * (dim - 1) + [0.5], [0.0] * (dim - 1) + [height]
        unit = brick(cell_type, n, [1] * dim, [0] * dim, irregular)
        if not irregular:
            unit = distort(unit, 0.1 / n)
        found.append(replace(unit, points=unit.points * shape + origin))
    return found


def check(structure, contact, exact, pressure, *, nodes, tolerance=1e-8):
    found = pressures(contact)
    u_error, p_error = displacement_error(structure, exact), np.abs(found / pressure - 1).max()
    tangential = np.linalg.norm(contact.z[contact.active_set.active], axis=1) - np.abs(found)
    assert len(found) == nodes
    assert u_error < tolerance, f"displacement {u_error:.2e}, pressure {p_error:.2e}"
    assert p_error < tolerance, f"displacement {u_error:.2e}, pressure {p_error:.2e}"
    assert np.abs(tangential).max() < tolerance * pressure


def slave_nodes(contact):
    return len(contact.nodes.of_surface[0])


@pytest.mark.parametrize("slave", ["upper", "lower"])
@pytest.mark.parametrize(("lower", "upper"), [*zip(CELL_TYPES, CELL_TYPES, strict=True), *MIXED])
def test_free_sides(lower, upper, slave):
    dim = dimension(lower)
    F, pressure, _ = pressed(dim, STRETCH)
    exact = deformation(F)
    meshes = bricks(lower, upper)
    structure, contact, info = press_blocks(*meshes, exact, far="normal", slave=slave, sides=SIDES[: dim - 1])
    check(structure, contact, exact, pressure, nodes=slave_nodes(contact))
    assert info.iterations <= 6, info.residuals


@pytest.mark.parametrize("cell_type", CELL_TYPES)
@pytest.mark.parametrize("slave", ["upper", "lower"])
def test_supports_with_reactions_touch_the_interface(cell_type, slave):
    """The sides press on their supports: what the supports carry at slave nodes is no contact traction."""
    dim = dimension(cell_type)
    F, pressure, _ = pressed(dim, STRETCH, sides_free=False)
    exact = deformation(F)
    meshes = bricks(cell_type, cell_type)
    structure, contact, _ = press_blocks(*meshes, exact, far="normal", slave=slave, sides=ALL_SIDES[: 2 * (dim - 1)])
    check(structure, contact, exact, pressure, nodes=slave_nodes(contact))


@pytest.mark.parametrize("slave", ["upper", "lower"])
@pytest.mark.parametrize(("lower", "upper"), [*zip(CELL_TYPES, CELL_TYPES, strict=True), *MIXED])
def test_turned_anyhow(lower, upper, slave):
    dim = dimension(lower)
    turn = rotation(np.random.default_rng(len(lower) + len(upper)), dim)
    F, pressure, _ = pressed(dim, STRETCH)
    exact = deformation(F, turn)
    meshes = [turned(mesh, turn) for mesh in bricks(lower, upper)]
    structure, contact, _ = press_blocks(*meshes, exact, far="all", slave=slave)
    check(structure, contact, exact, pressure, nodes=slave_nodes(contact))


@pytest.mark.parametrize("cell_type", ["tetra", "tetra10"])
def test_irregular_triangles(cell_type):
    F, pressure, _ = pressed(3, STRETCH)
    exact = deformation(F)
    structure, contact, _ = press_blocks(
        *bricks(cell_type, cell_type, irregular=0.15), exact, far="normal", slave="upper", sides=SIDES
    )
    check(structure, contact, exact, pressure, nodes=slave_nodes(contact))


@pytest.mark.parametrize("cell_type", ["hexahedron", "hexahedron27"])
def test_irregular_quadrilaterals(cell_type):
    """The inverse of a bilinear map is no polynomial: no quadrature of finite order is exact on such facets."""
    F, pressure, _ = pressed(3, STRETCH)
    exact = deformation(F)
    structure, contact, _ = press_blocks(
        *bricks(cell_type, cell_type, irregular=0.15), exact, far="normal", slave="upper", sides=SIDES
    )
    check(structure, contact, exact, pressure, nodes=slave_nodes(contact), tolerance=1e-6)


@pytest.mark.parametrize("cell_type", ["hexahedron", "hexahedron27"])
def test_irregular_quadrilaterals_with_more_points(cell_type):
    """What is missing is quadrature: a plane cut into ever more facets has ever more cells of integration."""
    F, pressure, _ = pressed(3, STRETCH)
    exact = deformation(F)
    supports = [Support("top", (None, None, exact[2])), Support("left", (exact[0], None, None))]
    supports += [Support("front", (None, exact[1], None))]
    errors = []
    for n in (1, 4, 16):
        body = make_body("block", brick(cell_type, 2, [1.0, 1.0, 0.5], [0.0] * 3, 0.15), supports=supports)
        x, y = np.meshgrid(np.linspace(-0.31, 1.33, n + 1), np.linspace(-0.27, 1.29, n + 1), indexing="ij")
        node = np.arange(x.size).reshape(x.shape)
        quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(-1, 4)
        plane = Surface("plane", np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3), quads, "quad", None)
        structure, contact = make_contact([body], [(("block", "bottom"), plane)], settings=TO_ROUNDING)
        solve_step(structure)
        errors.append(np.abs(pressures(contact) / pressure - 1.0).max())
    assert errors[0] < 1e-5
    assert errors[2] < 1e-8
    assert errors[2] < 0.03 * errors[0]


@pytest.mark.parametrize("cell_type", ["quad", "triangle", "hexahedron", "tetra", "quad9"])
@pytest.mark.parametrize("slave", ["upper", "lower"])
def test_slave_nodes_held_entirely(cell_type, slave):
    """Nodes on one side follow the exact displacement in all components: their pressure is that of their neighbours."""
    dim = dimension(cell_type)
    F, pressure, _ = pressed(dim, STRETCH)
    exact = deformation(F)
    one, other = (("upper", "bottom"), ("lower", "top"))
    supports = {"lower": "bottom", "upper": "top"}
    bodies = [
        make_body(name, mesh, supports=[Support(supports[name], exact), Support("left", exact)])
        for name, mesh in zip(("lower", "upper"), bricks(cell_type, cell_type), strict=True)
    ]
    structure, contact = make_contact(bodies, [(one, other) if slave == "upper" else (other, one)])
    info = solve_step(structure)
    held = contact.nodes.fixed[: slave_nodes(contact)].sum()
    assert held > 0
    check(structure, contact, exact, pressure, nodes=slave_nodes(contact) - held)
    assert info.iterations <= 6, info.residuals


def press_narrow_on_wide(cell_type, slave, width):
    """The upper body is narrower; the rest of the interface carries the same load. (structure, contact, exact, p)"""
    dim = dimension(cell_type)
    F, pressure, load = pressed(dim, STRETCH)
    exact = deformation(F)
    meshes = bricks(cell_type, cell_type, width=width, cells=(4, 3))
    sides = SIDES[: dim - 1]
    structure, contact, _ = press_blocks(
        *meshes, exact, far="normal", slave=slave, sides=sides, masters_edge=width, load=load
    )
    return structure, contact, exact, pressure


@pytest.mark.parametrize("cell_type", ["quad", "triangle", "hexahedron", "quad9", "triangle6", "hexahedron27"])
@pytest.mark.parametrize("slave", ["upper", "lower"])
def test_partly_covered_facets(cell_type, slave):
    """The last slave facets of the lower body are covered by 96 % (second order) or 80 %."""
    order = 2 if cell_type[-1].isdigit() else 1
    *found, pressure = press_narrow_on_wide(cell_type, slave, 0.74 if order == 2 else 0.7)
    along = 3 * order + 1
    check(*found, pressure, nodes=along ** (dimension(cell_type) - 1))


@pytest.mark.parametrize(("cell_type", "width"), [("quad", 0.52), ("hexahedron", 0.62), ("quad9", 0.62)])
def test_hardly_covered_nodes(cell_type, width):
    """Slave nodes with less than 2 % or a negative share of coverage bear their neighbours' pressure.

    Left out, pressures were wrong by 0.9 %, 6 % and 35 %.
    """
    *found, pressure = press_narrow_on_wide(cell_type, "lower", width)
    active = int(found[1].active_set.active.sum())
    check(*found, pressure, nodes=active)


@pytest.mark.parametrize("cell_type", ["quad", "triangle", "triangle6", "hexahedron", "tetra10"])
@pytest.mark.parametrize("overlap", [1e-4, 0.0])
def test_only_contact_carries_the_load(cell_type, overlap):
    """A dead load on a body that nothing else holds in its direction; it touches at the start, or is too deep."""
    dim = dimension(cell_type)
    F, pressure, load = pressed(dim, STRETCH)
    lower, upper = bricks(cell_type, cell_type)
    upper = replace(upper, points=upper.points - overlap * np.eye(dim)[-1])
    only = [tuple(constant(0) if k == i else None for k in range(dim)) for i in range(dim)]
    sides = [Support(side, only[i]) for side, i in SIDES[: dim - 1]]
    down = [Traction("top", vector(*[0] * (dim - 1), -load))]
    bodies = [
        make_body("lower", lower, supports=[*sides, Support("bottom", only[-1])]),
        make_body("upper", upper, supports=sides, tractions=down),
    ]
    structure, contact = make_contact(bodies, [(("upper", "bottom"), ("lower", "top"))])
    solve_step(structure)
    found = pressures(contact)
    assert len(found) == slave_nodes(contact)
    assert np.abs(found / pressure - 1).max() < 1e-8
    assert np.abs(contact.resultant(0)[-1] / load - 1) < 1e-10
    u_lower, u_upper = (u.reshape(-1, dim) for u in structure.split(structure.now.u))
    lift = overlap * np.eye(dim)[-1] * F[-1]
    for body, u, more in ((bodies[0], u_lower, 0.0), (bodies[1], u_upper, lift)):
        assert np.abs(u - ((F - 1) * body.points[:dim].T + more)).max() < 1e-8 * 0.05
