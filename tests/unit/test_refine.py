"""Uniform refinement: the same body in smaller cells, with the same named parts."""

from types import SimpleNamespace

import meshio  # noqa: TID253
import numpy as np
import pytest
from cell_geometry import smallest_determinant, volume

from fsci import shapes
from fsci.meshes.curved import is_curved, outward_edges
from fsci.meshes.mesh import MeshError, build_mesh
from fsci.meshes.refine import refined
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import boundary_facets, surface_facets

RING = {"inner_radius": 1.0, "outer_radius": 2.0}
MESHES = {
    "triangle": lambda: shapes.ring(**RING, cells=(12, 2), cell="tri"),
    "triangle6": lambda: shapes.ring(**RING, cells=(12, 2), cell="tri", order=2),
    "quad": lambda: shapes.ring(**RING, cells=(12, 2)),
    "quad9": lambda: shapes.ring(**RING, cells=(12, 2), order=2),
    "tetra": lambda: shapes.tube(**RING, height=1.0, cells=(12, 2, 2), cell="tet"),
    "tetra10": lambda: shapes.tube(**RING, height=1.0, cells=(12, 2, 2), cell="tet", order=2),
    "hexahedron": lambda: shapes.tube(**RING, height=1.0, cells=(12, 2, 2)),
    "hexahedron27": lambda: shapes.tube(**RING, height=1.0, cells=(12, 2, 2), order=2),
}


@pytest.mark.parametrize("name", MESHES)
def test_the_same_body_in_smaller_cells(name):
    """Volume, surfaces and their areas stay, also those of curved cells; the cells fit together."""
    mesh = MESHES[name]()
    fine = refined(mesh)
    dim = mesh.points.shape[1]
    assert fine.cell_type == mesh.cell_type == name
    assert len(fine.cells) == 2**dim * len(mesh.cells)
    assert len(boundary_facets(fine)) == 2 ** (dim - 1) * len(boundary_facets(mesh))
    assert volume(fine) == pytest.approx(volume(mesh), rel=1e-13)
    assert smallest_determinant(fine) > 0.2 * smallest_determinant(mesh) * 2.0**-dim
    assert len(np.unique(fine.points.round(9), axis=0)) == len(fine.points)
    assert set(range(len(fine.points))) == set(fine.cells.ravel())
    for surface, corners in mesh.surfaces.items():
        assert len(surface_facets(fine, surface)) == 2 ** (dim - 1) * len(corners)
        corner = fine.points[fine.surfaces[surface]]
        if surface in ("inner", "outer") and CELL_TYPES[name].degree == 2:
            assert np.linalg.norm(corner[..., :2], axis=-1) == pytest.approx(RING[f"{surface}_radius"], rel=1e-3)
        if surface == "top":
            assert (corner[..., 2] == 1.0).all()
    again = refined(fine)
    assert volume(again) == pytest.approx(volume(mesh), rel=1e-13)


@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_nodes_are_those_of_twice_as_many_cells(cell):
    mesh, fine = (shapes.rectangle(size=(2.0, 1.0), cells=(n, n), cell=cell) for n in (3, 6))
    found = refined(mesh)
    assert {tuple(x) for x in found.points.round(12)} == {tuple(x) for x in fine.points.round(12)}
    assert {name: len(facets) for name, facets in found.surfaces.items()} == dict.fromkeys(mesh.surfaces, 6)


def test_a_tetrahedron_is_divided_along_its_shortest_diagonal():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 3.0]])
    mesh = refined(Mesh(corners, np.array([[0, 1, 2, 3]]), "tetra"))
    inner = mesh.points[mesh.cells[4:]]
    lengths = np.linalg.norm(inner[:, :1] - inner[:, 1:2], axis=2)
    middles = {1: ((0, 1), (2, 3)), 2: ((0, 2), (1, 3)), 3: ((0, 3), (1, 2))}
    expected = min(
        np.linalg.norm(corners[list(a)].mean(axis=0) - corners[list(b)].mean(axis=0)) for a, b in middles.values()
    )
    assert lengths == pytest.approx(expected)


def test_parts_with_names():
    """Regions, lines and named nodes; a line that is no edge of a cell has no middle and is left out."""
    mesh = shapes.box(size=(1.0, 1.0, 1.0), cells=(2, 1, 1), order=2)
    from_origin = int(np.flatnonzero((mesh.points == 0.0).all(axis=1))[0])
    end = int(np.flatnonzero((mesh.points == [0.5, 0.0, 0.0]).all(axis=1))[0])
    middle = int(np.flatnonzero((mesh.points == [0.25, 0.0, 0.0]).all(axis=1))[0])
    far = int(np.flatnonzero((mesh.points == [1.0, 1.0, 1.0]).all(axis=1))[0])
    mesh.lines["edge"] = np.array([[from_origin, end, middle]])
    mesh.lines["across"] = np.array([[from_origin, far]])
    mesh.nodes["middle"] = np.array([middle])
    mesh.regions["second"] = np.array([1])
    fine = refined(mesh)
    assert set(fine.lines) == {"edge"}
    assert fine.points[fine.lines["edge"]][:, :, 0].tolist() == [[0.0, 0.25, 0.125], [0.25, 0.5, 0.375]]
    assert fine.points[fine.nodes["middle"]].tolist() == [[0.25, 0.0, 0.0]]
    assert fine.points[fine.cells[fine.regions["second"]]][..., 0].min() == 0.5
    assert fine.numbers.tolist() == [1] * 8 + [2] * 8


def test_the_setting(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    meshio.write(tmp_path / "one.vtu", meshio.Mesh(points, [("quad", [[0, 1, 2, 3]])]))
    mesh = build_mesh(SimpleNamespace(file="one.vtu", refine=2), tmp_path)
    assert len(mesh.cells) == 16
    with pytest.raises(MeshError, match=r"'refine: 14' would make 2.7e\+08 cells: 1e\+08 are the most"):
        build_mesh(SimpleNamespace(file="one.vtu", refine=14), tmp_path)
    with pytest.raises(MeshError, match="'refine: 99999'"):
        build_mesh(SimpleNamespace(file="one.vtu", refine=99999), tmp_path)


@pytest.mark.parametrize(
    ("mesh", "curved"),
    [
        (shapes.rectangle(size=(2.0, 1.0), cells=(3, 2)), False),
        (shapes.box(size=(1.0, 1.0, 1.0), cells=(2, 2, 2), cell="tet", order=2), False),
        (shapes.disc(radius=1.0, cells=(8, 1)), True),
        (shapes.disc(radius=1e-3, cells=(400, 1)), True),
        (MESHES["hexahedron"](), True),
        (MESHES["quad9"](), True),
    ],
)
def test_curved_surfaces(mesh, curved):
    assert is_curved(mesh) is curved


@pytest.mark.parametrize("count", [1, 5])
def test_a_blunt_corner_is_no_curve(count):
    """Cook's membrane has one of 47 degrees."""
    mesh = shapes.rectangle(size=(1.0, 1.0), cells=(count, count))
    x, y = mesh.points.T
    mesh.points[:] = np.stack([48.0 * x, 44.0 * y * (1.0 - x) + (44.0 + 16.0 * y) * x], axis=1)
    assert not is_curved(mesh)


def test_outward_edges():
    """Not those inwards, and not those of facets that stand for a circle."""
    box = outward_edges(shapes.box(size=(2.0, 1.0, 1.0), cells=(2, 1, 1)))
    assert len(box) == 16  # two for each edge along x
    assert ((np.isclose(box, 0.0) | np.isclose(box, [2.0, 1.0, 1.0])).sum(axis=1) == 2).all()
    corners = outward_edges(shapes.rectangle(size=(3.0, 1.0), cells=(3, 2)))
    assert {tuple(point) for point in corners} == {(0.0, 0.0), (3.0, 0.0), (0.0, 1.0), (3.0, 1.0)}
    ring = shapes.ring(**RING, cells=(12, 2), angle=90.0)
    assert len(outward_edges(ring)) == 4
    assert len(outward_edges(ring, ["inner", "outer"])) == 0
    # an angle bracket: five of its six corners stick out
    bracket = Mesh(
        np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2], [0, 1], [1, 0]], dtype=float),
        np.array([[0, 7, 3, 6], [7, 1, 2, 3], [6, 3, 4, 5]]),
        "quad",
    )
    assert sorted(map(tuple, outward_edges(bracket))) == [(0.0, 0.0), (0.0, 2.0), (1.0, 2.0), (2.0, 0.0), (2.0, 1.0)]


def test_curved_surfaces_of_those_that_count():
    mesh = MESHES["hexahedron"]()
    assert is_curved(mesh, ["inner"])
    assert not is_curved(mesh, ["top"])
