"""Surfaces of meshes that the case names by normal and box."""

from types import SimpleNamespace

import meshio  # noqa: TID253
import numpy as np
import pytest
from case_mistakes import load, refused

from fsci import shapes
from fsci.case.mesh import FileMesh
from fsci.meshes.mesh import MeshError, build_mesh
from fsci.meshes.of_case import read_body
from solvers.mesh.tessellation import tessellate

MESHES = {
    "triangle": shapes.rectangle((2, 1), (4, 2), cell="tri"),
    "quad9": shapes.rectangle((2, 1), (4, 2), order=2),
    "tetra": shapes.box((2, 1, 1), (4, 2, 2), cell="tet"),
    "hexahedron": shapes.box((2, 1, 1), (4, 2, 2)),
    "hexahedron27": shapes.box((2, 1, 1), (2, 1, 1), order=2),
}


def write(path, mesh, surface=False, **more):
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
    cells = [(mesh.cell_type, mesh.cells)]
    if surface:
        facets, nodes = tessellate(mesh)
        points, cells = mesh.points[nodes], [("triangle", facets)]
    meshio.Mesh(points, cells, **more).write(path)


def build(folder, name, *, rigid=False, **settings):
    return build_mesh(FileMesh(file=name, **settings), folder, rigid=rigid)


def area(mesh, name):
    facets, nodes = tessellate(mesh, [name])
    x = mesh.points[nodes][facets]
    edges = x[:, 1:] - x[:, :1]
    normals = edges[:, 0] if x.shape[2] == 2 else 0.5 * np.cross(edges[:, 0], edges[:, 1])
    return float(np.linalg.norm(normals, axis=1).sum())


@pytest.mark.parametrize("name", [*MESHES, "part.stl"])
def test_names_are_those_of_the_shape(name, tmp_path):
    """Its sides by normals, also in mm, halved, turned; a part of one by a box, whose ends count."""
    mesh = MESHES["hexahedron" if name == "part.stl" else name]
    dim, file = mesh.points.shape[1], name if name == "part.stl" else "part.vtu"
    write(tmp_path / file, mesh, surface=name == "part.stl")
    up, side = np.eye(dim)[-1].tolist(), np.eye(dim)[0].tolist()
    surfaces = {
        "up": {"normal": [3.0 * one for one in up]},
        "right": {"normal": side, "within": 89},
        "slanted": {"normal": (np.add(up, side)).tolist(), "within": 46},
        "half": {"normal": up, "box": [[-0.5e-3] * dim, [1.0000001e-3] * dim]},
        "edge": {"box": [[2e-3] + [-9.0] * (dim - 1), [2e-3] + [9.0] * (dim - 1)]},
    }
    placed = {"rotate": [{"angle": 30.0, "axis": [1, 1, 0]} if dim == 3 else {"angle": 30.0}], "translate": [5.0] * dim}
    whole = {"up": 2, "right": 1, "slanted": 3, "half": 1, "edge": 1}
    for times in (0, 1):
        found = build(tmp_path, file, rigid=True, scale=1e-3, refine=times, surfaces=surfaces, **placed)
        assert set(found.surfaces) == set(whole)
        here = build(tmp_path, file, rigid=True, refine=times, surfaces={"up": surfaces["up"]})
        assert (here.points[here.surfaces["up"]][..., -1] == 1.0).all()
        for key, size in whole.items():
            assert area(found, key) == pytest.approx(size * 1e-3 ** (dim - 1), rel=1e-9), key


def test_mistakes(tmp_path):
    top = np.unique(MESHES["tetra"].surfaces["top"])
    write(tmp_path / "part.vtu", MESHES["tetra"])
    write(tmp_path / "part.inp", MESHES["tetra"], point_sets={"top": top})
    for file, section, keys, words in (
        ("part.inp", {"normal": [0, 0, 1]}, (), r"^the mesh has a surface 'top': take another name"),
        ("part.vtu", {"normal": [0, 1]}, ("normal",), r"^it has 2 entries, but the mesh has 3 dimensions"),
        ("part.vtu", {"box": [[0, 0], [0, 1, 1]]}, ("box", 0), r"^it has 2 entries, but the mesh has 3 dimensions"),
        ("part.vtu", {"normal": [0, 1, 1]}, (), r"no facet of the boundary is there: the nearest normal is 45 deg"),
        (
            "part.vtu",
            {"box": [[0.1, 0.1, 0.1], [0.9, 0.9, 0.9]]},
            (),
            r"is in the box from \(0, 0, 0\) to \(2, 1, 1\), and",
        ),
    ):
        with pytest.raises(MeshError, match=words) as error:
            build(tmp_path, file, surfaces={"top": section})
        assert error.value.keys == ("surfaces", "top", *keys)
    assert build_mesh(SimpleNamespace(file="part.vtu"), tmp_path).surfaces == {}


CASE = """\
time: {step: 1, end: 1}
structure:
  bodies:
    block:
      mesh:
        file: part.vtu
        surfaces:
          foot: {normal: [0, 0, -1]}
      material: {law: neo_hooke, E: 1, nu: 0.3}
      supports: [{on: foot, displacement: [0, 0, 0]}]
"""


def test_places_of_mistakes(tmp_path, monkeypatch):
    """In the settings, and of what the mesh shows."""
    monkeypatch.chdir(tmp_path)
    write("part.vtu", MESHES["tetra"])
    assert area(read_body(load(CASE), "block"), "foot") == pytest.approx(2.0)
    for new, message in (
        ("{}", "case.yaml:8:17: a surface needs 'normal', 'box' or both"),
        ("{normal: [0, 0, 0]}", "case.yaml:8:26: 'normal' must not be zero"),
        ("{box: [[0, 0, 0], [1, 1, 1]], within: 3}", "case.yaml:8:55: 'within' belongs to 'normal'"),
        ("{normal: [0, 1, 1]}", "case.yaml:8:17: no facet of the boundary is there"),
        ("{normal: [0, 1]}", "case.yaml:8:26: it has 2 entries, but the mesh has 3 dimensions"),
    ):
        text = CASE.replace("{normal: [0, 0, -1]}", new)
        assert message in str(refused(text, lambda case: read_body(case, "block")))


SHAPE = """\
time: {step: 1, end: 1}
structure:
  bodies:
    wheel:
      mesh:
        shape: disc
        radius: 2
        cells: [24, 2]
        surfaces:
          foot: {normal: [0, -1], within: 45}
        rotate: {angle: 90}
      material: {law: neo_hooke, E: 1, nu: 0.3}
      supports: [{on: foot, displacement: [0, 0]}]
probes:
  foot: {quantity: reaction, on: foot}
"""


@pytest.mark.usefixtures("in_new_folder")
def test_of_built_in_shapes():
    """A quarter of the rim of a polygon with 24 corners, turned with the shape, beside the shape's own surfaces."""
    wheel = read_body(load(SHAPE.replace("radius: 2", "radius: 2\n        order: 1")), "wheel")
    assert area(wheel, "foot") == pytest.approx(6 * 2 * 2.0 * np.sin(np.pi / 24))
    assert wheel.points[wheel.surfaces["foot"]][..., 0].min() > 2.0 * np.cos(np.pi / 4) - 1e-12
    assert area(wheel, "outer") == pytest.approx(24 * 2 * 2.0 * np.sin(np.pi / 24))
    scaled = read_body(load(SHAPE.replace("radius: 2", "radius: 2e-3\n        order: 2")), "wheel")
    assert area(scaled, "foot") == pytest.approx(np.pi * 1e-3, rel=3e-3)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("on: foot}", "on: fooot}", "case.yaml:15:34: 'disc' has no surface 'fooot'; did you mean 'foot'?"),
        ("foot: {normal", "outer: {normal", "case.yaml:10:18: the mesh has a surface 'outer': take another name"),
        ("[0, -1], within: 45", "[0, -1, 0]", "case.yaml:10:26: it has 3 entries, but the mesh has 2 dimensions"),
        ("normal: [0, -1], within: 45", "box: [[3, 3], [4, 4]]", "case.yaml:10:17: no facet of the boundary is there"),
    ],
)
@pytest.mark.usefixtures("in_new_folder")
def test_mistakes_in_surfaces_of_shapes(old, new, message):
    text = SHAPE.replace(old, new)
    if "outer" in new:
        text = text.replace("on: foot", "on: outer")
    assert message in str(refused(text, lambda case: read_body(case, "wheel")))
