"""Meshes with wrong cells are refused, by check and run alike; unusual ones that are right are not."""

import time

import meshio  # noqa: TID253
import numpy as np
import pytest
from case_mistakes import load, refused

from fsci import shapes
from fsci.check.meshes import check_meshes
from fsci.meshes.folds import folded
from fsci.meshes.jacobians import inverted
from fsci.meshes.of_case import read_body
from fsci.meshes.serendipity import COMPLETE
from fsci.meshes.valid import BadMesh, require_valid
from fsci.running.run import FINISHED, run_case
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.locate import shape_functions
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import facet_ids

pytestmark = pytest.mark.usefixtures("in_new_folder")

CASE = """\
time: {step: 1, end: 1}
structure:
  bodies:
    a:
      mesh: {file: m.vtu}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{at: [0, 0], displacement: [0, 0]}]
"""
PLACE = "case.yaml:5:13: m.vtu: "

#: (cell, order) of shapes -> cell types
TYPES = {
    ("tri", 1): "triangle",
    ("quad", 1): "quad",
    ("tri", 2): "triangle6",
    ("quad", 2): "quad9",
    ("tet", 1): "tetra",
    ("hex", 1): "hexahedron",
    ("tet", 2): "tetra10",
    ("hex", 2): "hexahedron27",
}
EVERY_TYPE = pytest.mark.parametrize(("cell", "order"), list(TYPES), ids=list(TYPES.values()))


def block(cell, order, n=3):
    if cell in ("tri", "quad"):
        return shapes.rectangle((1, 1), (n, n), order=order, cell=cell)
    return shapes.box((1, 1, 1), (n, n, n), order=order, cell=cell)


def moved(mesh, node, to):
    points = mesh.points.copy()
    points[node] = to
    return Mesh(points, mesh.cells, mesh.cell_type)


def said(mesh, **options):
    with pytest.raises(BadMesh) as caught:
        require_valid(mesh, **options)
    return str(caught.value)


def write(mesh, cells=None):
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
    meshio.Mesh(points, cells or [(mesh.cell_type, mesh.cells)]).write("m.vtu")


def case(mesh):
    return CASE if mesh.points.shape[1] == 2 else CASE.replace("[0, 0]", "[0, 0, 0]")


def assert_refused(mesh, words):
    """By check and run, with the same words and the place in the case."""
    text = case(mesh)
    error = refused(text, lambda loaded: run_case(loaded, loaded.folder / "out"))
    assert str(error).startswith(PLACE + words), str(error)
    assert [str(problem) for problem in check_meshes(load(text)).problems] == [str(error)]


# --- wrong meshes


@EVERY_TYPE
def test_a_node_beyond_its_neighbours(cell, order):
    """A corner inside of the block is moved beyond the corners around it."""
    mesh = block(cell, order)
    corners = np.unique(mesh.cells[:, : CELL_TYPES[mesh.cell_type].corners])
    inner = corners[np.linalg.norm(mesh.points[corners] - 1 / 3, axis=1).argmin()]
    bad = moved(mesh, inner, mesh.points[inner] + 0.45)
    write(bad)
    words = "is concave or twisted" if order == 1 else "is turned inside out in a part"
    text = str(refused(case(bad), lambda loaded: read_body(loaded, "a")))
    assert text.startswith(f"{PLACE}cell ")
    # simplices of first order cannot be twisted: they lie on their neighbours
    assert words in text or (cell in ("tri", "tet") and order == 1 and "cover each other" in text)


@pytest.mark.parametrize("cell", ["tri", "quad", "tet", "hex"])
@pytest.mark.parametrize("serendipity", [False, True])
def test_a_mid_node_that_lies_across(cell, serendipity):
    mesh = block(cell, 2, 1)
    corners = CELL_TYPES[mesh.cell_type].corners
    cells, node = mesh.cells, mesh.cells[0, corners]
    if serendipity:
        if cell in ("tri", "tet"):
            pytest.skip("simplices have no other second-order cells")
        short = next(name for name, full in COMPLETE.items() if full == mesh.cell_type)
        used, cells = np.unique(cells[:, : int(short.lstrip("quadhexron"))], return_inverse=True)
        node, cells = int(np.searchsorted(used, node)), cells.reshape(len(mesh.cells), -1)
        mesh = Mesh(mesh.points[used], cells, short)
    one = cells[(cells == node).any(axis=1)][0]
    inward = mesh.points[one].mean(axis=0) - mesh.points[node]
    write(moved(mesh, node, mesh.points[node] + 2.0 * inward))
    assert_refused(mesh, "cell ")
    write(moved(mesh, node, mesh.points[node] + 0.1 * inward))  # a curved edge
    assert check_meshes(load(case(mesh))).problems == []


@EVERY_TYPE
def test_determinants_between_the_nodes(cell, order):
    """Random cells: refused are those whose determinant is negative at one of many points, and hardly any other."""
    rng = np.random.default_rng(5)
    mesh = block(cell, order, 1)
    dim = mesh.points.shape[1]
    one = mesh.points[mesh.cells[0]]
    size = {1: 0.6, 2: 0.2 if dim == 2 or cell == "tet" else 0.1}[order] * (
        1.3 if CELL_TYPES[mesh.cell_type].shape.simplex else 1.0
    )
    nodes = one + size * rng.uniform(-1.0, 1.0, (400, *one.shape)) * np.ptp(one, axis=0).max()
    cells = Mesh(nodes.reshape(-1, dim), np.arange(nodes.size // dim).reshape(400, -1), mesh.cell_type)
    x = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 13)] * dim, indexing="ij"), axis=-1).reshape(-1, dim)
    if CELL_TYPES[mesh.cell_type].shape.simplex:
        x = x[x.sum(axis=1) <= 1.0 + 1e-12]
    jacobian = np.einsum("cai,paj->cpij", nodes, shape_functions(mesh.cell_type, x)[1])
    least = np.linalg.det(jacobian).min(axis=1)
    found = np.isin(np.arange(400), inverted(cells))
    assert 10 < np.count_nonzero(least < 0.0) < 390
    assert found[least < 0.0].all()
    assert np.count_nonzero(found[least > 0.0]) <= (0 if order == 1 and dim == 2 else 8)


@EVERY_TYPE
def test_flat_cells(cell, order):
    """A layer of cells of 1e-13: rounding strains it. One of 1e-9 is right."""
    mesh = block(cell, order)
    for height, wrong in ((1e-13, True), (1e-9, False)):
        points = mesh.points.copy()
        layer = (points[:, 0] > 1 / 3 - 1e-9) & (points[:, 0] < 2 / 3 + 1e-9)
        points[layer, 0] = 1 / 3 + (points[layer, 0] - 1 / 3) * 3 * height
        flat = Mesh(points, mesh.cells, mesh.cell_type)
        if wrong:
            assert "is flat: it is so thin that rounding of its nodes' positions strains it; merge its nodes" in said(
                flat
            )
        else:
            require_valid(flat)


@EVERY_TYPE
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_nodes_that_are_nowhere(cell, order, value):
    mesh = block(cell, order, 1)
    dim = mesh.points.shape[1]
    write(moved(mesh, 3, [value, *[0.5] * (dim - 1)]))
    place = ", ".join(["inf" if np.isinf(value) else "nan", *["0.5"] * (dim - 1), *["0"] * (3 - dim)])
    assert_refused(mesh, f"the position of node 4 is not finite: ({place}); correct the file")


@EVERY_TYPE
@pytest.mark.parametrize("kind", ["twice", "one more", "inside", "shifted"])
def test_cells_that_cover_others(cell, order, kind):
    """All cells twice, one of them twice, a small block in a large one, and two blocks that overlap in part."""
    mesh = block(cell, order)
    if kind == "one more":
        again = mesh.cells[-1]
        points = np.concatenate([mesh.points, mesh.points[again]])
        cells = np.concatenate([mesh.cells, len(mesh.points) + np.arange(len(again))[None]])
    else:
        other = {"twice": mesh.points, "inside": 0.2 * mesh.points + 0.35, "shifted": mesh.points + 0.6}[kind]
        points = np.concatenate([mesh.points, other])
        cells = np.concatenate([mesh.cells, mesh.cells + len(mesh.points)])
    bad = Mesh(points, cells, mesh.cell_type)
    write(bad)
    text = said(bad)
    assert "cover each other: what they share would count twice; remove one of them" in text
    assert text.startswith("cell ")
    require_valid(bad, parts_meet=True)


def test_a_cell_over_all_others_with_their_nodes():
    mesh = shapes.rectangle((1, 0.2), (8, 2))
    corners = [np.linalg.norm(mesh.points - at, axis=1).argmin() for at in ((0, 0), (1, 0), (1, 0.2), (0, 0.2))]
    write(Mesh(mesh.points, np.concatenate([mesh.cells, [corners]]), "quad"))
    assert_refused(mesh, "cell 1 at (0.0625, 0.05) and cell 17 at (0.5, 0.1) cover each other")


def test_folds_are_told_from_numbering():
    """A cell that is numbered the other way is turned; one that lies on its neighbour is refused."""
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.3, 0.4]], dtype=float)
    write(Mesh(points, np.array([[0, 1, 2], [0, 3, 2]]), "triangle"))
    found = check_meshes(load(CASE))
    assert found.problems == []
    assert found.notes == ["case.yaml:5:13: 1 of its 2 cells are numbered clockwise: they were turned round"]
    points[3] = [0.9, 0.3]  # beyond the diagonal, over the first triangle
    write(Mesh(points, np.array([[0, 1, 2], [0, 2, 3]]), "triangle"))
    words = "cell 1 at (0.666667, 0.333333) and cell 2 at (0.633333, 0.433333) cover each other"
    assert_refused(Mesh(points, points, ""), words)


def test_a_mesh_that_is_numbered_the_other_way():
    for mesh, word in (
        (shapes.rectangle((1, 1), (2, 2)), "clockwise"),
        (shapes.box((1, 1, 1), (2, 2, 2)), "inside out"),
    ):
        write(Mesh(mesh.points, mesh.cells[:, CELL_TYPES[mesh.cell_type].mirror], mesh.cell_type))
        found = check_meshes(load(case(mesh)))
        assert found.problems == []
        assert found.notes == [f"case.yaml:5:13: its cells are numbered {word}: they were turned round"]


def test_a_facet_of_three_cells():
    points = np.array([[0, 0], [1, 0], [0, 1], [0, -1], [0.5, 0.6]], dtype=float)
    mesh = Mesh(points, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]), "triangle")
    assert len(folded(mesh, facet_ids(mesh))) == 2
    assert "cover each other" in said(mesh)


# --- right meshes


@EVERY_TYPE
def test_cells_of_a_boundary_layer(cell, order):
    """A million times longer than high, in a grading of 2 from layer to layer."""
    mesh = block(cell, order, 20)
    points = mesh.points.copy()
    points[:, -1] = 5e-8 * (2.0 ** (20 * points[:, -1]) - 1.0)
    require_valid(Mesh(points, mesh.cells, mesh.cell_type))
    require_valid(Mesh(points + 10.0, mesh.cells, mesh.cell_type))


@pytest.mark.parametrize("order", [1, 2])
def test_built_in_shapes(order):
    plane = [
        lambda **k: shapes.rectangle((3, 1), (3, 2), **k),
        lambda **k: shapes.disc(1, (12, 2), **k),
        lambda **k: shapes.ring(0.5, 1, (12, 2), **k),
        lambda **k: shapes.ring(0.5, 1, (6, 2), angle=200, **k),
    ]
    solid = [
        lambda **k: shapes.cylinder(1, 2, (12, 2, 3), **k),
        lambda **k: shapes.tube(0.9, 1, 2, (12, 1, 3), **k),
        lambda **k: shapes.sphere(1, (3, 1), **k),
        lambda **k: shapes.hollow_sphere(0.8, 1, (3, 1), **k),
        lambda **k: shapes.solid_torus(1, 0.3, (16, 12), **k),
        lambda **k: shapes.hollow_torus(1, 0.2, 0.3, (16, 12, 1), **k),
    ]
    for made, cells in ((plane, ("quad", "tri")), (solid, ("hex", "tet"))):
        for shape in made:
            for cell in cells:
                require_valid(shape(order=order, cell=cell))


def test_a_built_in_shape_that_is_too_coarse():
    """Second-order tetrahedra in the thick wall of a ball: their mid nodes on the sphere lie across."""
    shape = "{shape: hollow_sphere, inner_radius: 0.05, outer_radius: 1, cells: [6, 1], order: 2, cell: tet}"
    text = CASE.replace("{file: m.vtu}", shape).replace("{at: [0, 0], disp", "{on: inner, disp")
    text = text.replace("[0, 0]", "[0, 0, 0]")
    error = refused(text, lambda loaded: run_case(loaded, loaded.folder / "out"))
    words = "case.yaml:5:13: hollow_sphere: cell 7 at (-0.576398, -0.26753, -0.405415) (and 119 more) is turned inside"
    assert str(error).startswith(words), str(error)
    assert [str(problem) for problem in check_meshes(load(text)).problems] == [str(error)]


def test_collapsed_cells():
    """Quadrilaterals with a node twice are triangles; quarter points have a zero determinant at a corner."""
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    require_valid(Mesh(points, np.array([[0, 1, 2, 2], [0, 2, 3, 3]]), "quad"))
    quarter = np.array([[0, 0], [1, 0], [0, 1], [0.25, 0], [0.5, 0.5], [0, 0.25]])
    require_valid(Mesh(quarter, np.arange(6)[None], "triangle6"))
    quarter[3, 0] = 0.24
    assert "is turned inside out" in said(Mesh(quarter, np.arange(6)[None], "triangle6"))


def test_parts_that_touch():
    """Blocks side by side without common nodes, and a disc in a ring whose facets cross each other."""
    block = shapes.rectangle((1, 1), (3, 3))
    points = np.concatenate([block.points, block.points + np.array([1, 0.1])])
    require_valid(Mesh(points, np.concatenate([block.cells, block.cells + len(block.points)]), "quad"))
    disc, ring = shapes.disc(1, (24, 3)), shapes.ring(1, 1.3, (36, 2))
    points = np.concatenate([disc.points, ring.points])
    require_valid(Mesh(points, np.concatenate([disc.cells, ring.cells + len(disc.points)]), "quad"))


def test_regions_of_two_bodies_may_overlap():
    """Each body is checked by itself: a press fit in one file."""
    one = shapes.rectangle((1, 1), (3, 3))
    points = np.pad(np.concatenate([one.points, one.points + np.array([0.8, 0])]), ((0, 0), (0, 1)))
    cells = np.concatenate([one.cells, one.cells + len(one.points)])
    regions = {"first": [np.arange(9)], "second": [np.arange(9, 18)]}
    meshio.Mesh(points, [("quad", cells)], cell_sets=regions).write("m.inp")
    both = CASE.replace("m.vtu}", "m.inp}")
    assert "cover each other" in str(check_meshes(load(both)).problems[0])
    assert check_meshes(load(both.replace("m.inp}", "m.inp}\n      region: first"))).problems == []


def test_what_is_accepted_runs():
    write(shapes.disc(1, (12, 2), order=2))
    assert run_case(load(CASE), load(CASE).folder / "out") == FINISHED


@pytest.mark.slow
def test_time():
    """Of 100,000 nodes; measured 0.5 s (hexahedra) and 2.7 s (tetrahedra)."""
    for cell, most in (("hex", 4.0), ("tet", 15.0)):
        mesh = block(cell, 1, 46)
        start = time.process_time()
        require_valid(mesh)
        assert time.process_time() - start < most
