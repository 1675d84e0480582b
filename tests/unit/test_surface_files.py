"""Rigid bodies and obstacles from closed surfaces in files: STL and OBJ."""

from pathlib import Path
from types import SimpleNamespace

import meshio  # noqa: TID253
import numpy as np
import pytest
from case_mistakes import load, refused

from fsci import shapes
from fsci.check.meshes import check_meshes
from fsci.meshes.mesh import MeshError, build_mesh
from fsci.meshes.of_case import read_body, read_obstacle, read_rigid_body
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case
from solvers.mesh.tessellation import is_closed, tessellate
from solvers.mesh.topology import signed_volumes
from solvers.rigid.inertia import inertia_of_surface

BALL = shapes.sphere(0.5, (3, 3))
CUBE = shapes.box((1, 1, 1), (2, 2, 2))


def facets_of(mesh):
    """(points, triangles) of the boundary."""
    facets, nodes = tessellate(mesh)
    return mesh.points[nodes], facets


def write(path, points, *blocks, binary=False, **more):
    settings = {"binary": binary} if str(path).endswith(".stl") else {}
    meshio.Mesh(points, list(blocks), **more).write(path, **settings)


def put(folder, name, points, facets):
    """A file with these triangles; the surface that is read from it."""
    write(folder / name, points, ("triangle", facets))
    return build_rigid(folder, name)


def build_rigid(folder, name, **settings):
    return build_mesh(SimpleNamespace(file=name, **settings), folder, rigid=True)


def inertia(points, facets):
    found = inertia_of_surface(points, facets, 3.0)
    return np.concatenate([[found.mass], found.centre, found.tensor.ravel()])


@pytest.mark.parametrize("name", ["ascii.stl", "binary.stl", "quads.obj", "triangles.obj", "surface.vtu"])
def test_inertia_is_that_of_the_same_facets(name, tmp_path):
    """Of the built-in ball, off the origin, to 1e-10: a binary STL has its positions in single precision."""
    points, triangles = facets_of(BALL)
    points = points + np.array([0.3, -0.2, 0.7])
    if name == "binary.stl":
        points = points.astype(np.float32).astype(float)
    if name == "quads.obj":
        facets = np.array(triangles).reshape(-1, 2, 3)
        assert (facets[:, 0, [0, 2]] == facets[:, 1, :2]).all()
        write(tmp_path / name, points, ("quad", np.column_stack([facets[:, 0], facets[:, 1, 2]])))
    else:
        write(tmp_path / name, points, ("triangle", triangles), binary=name.startswith("binary"))
    mesh = build_rigid(tmp_path, name)
    assert is_closed(tessellate(mesh)[0])
    assert np.array_equal(*(np.sort(x.view([("", float)] * 3).ravel()) for x in (facets_of(mesh)[0], points)))
    exact = inertia(points, triangles)
    assert inertia(*facets_of(mesh)) == pytest.approx(exact, rel=1e-10, abs=1e-10 * exact[0])
    assert signed_volumes(mesh).sum() == pytest.approx(exact[0] / 3.0, rel=1e-12)
    assert mesh.note == ""


def test_pieces_hollows_and_unused_points(tmp_path):
    """Two balls of which one has a cavity: volumes add up. Facets that all face inwards are turned, with a note."""
    points, facets = facets_of(BALL)
    volume = inertia(points, facets)[0] / 3.0
    count = len(points)
    both = np.vstack([points, 0.5 * points, points + np.array([2, 0, 0]), [[9, 9, 9]]])
    all_facets = np.vstack([facets, facets[:, ::-1] + count, facets + 2 * count])
    for turned, note in ((False, ""), (True, "its facets face inwards: they were turned round")):
        mesh = put(tmp_path, "parts.obj", both, all_facets[:, ::-1] if turned else all_facets)
        assert signed_volumes(mesh).sum() == pytest.approx((2.0 - 0.125) * volume, rel=1e-12)
        assert mesh.points.max() < 3.0
        assert mesh.note == note


def test_both_zeros_are_one_point(tmp_path):
    """STL has the corners of each facet: a cube at the origin, with minus zero in every other one of them."""
    points, facets = facets_of(CUBE)
    corners = points[facets]
    corners[::2] = np.where(corners[::2] == 0.0, -0.0, corners[::2])
    for binary in (False, True):
        apart = np.arange(3 * len(facets)).reshape(-1, 3)
        write(tmp_path / "zeros.stl", corners.reshape(-1, 3), ("triangle", apart), binary=binary)
        write(tmp_path / "zeros.obj", corners.reshape(-1, 3), ("triangle", apart))
        for name in ("zeros.stl", "zeros.obj"):
            mesh = build_rigid(tmp_path, name)
            assert len(mesh.points) == len(points) + 1
            assert inertia(*facets_of(mesh)) == pytest.approx(inertia(points, facets), rel=1e-12, abs=1e-12)


def test_named_groups_are_surfaces_and_facets_are_halved(tmp_path):
    points, facets = facets_of(CUBE)
    top = (points[facets][:, :, 2] == 1).all(axis=1)
    named = {"field_data": {"top": [1, 2], "rest": [2, 2]}}
    data = {"gmsh:physical": [np.where(top, 1, 2)], "gmsh:geometrical": [np.where(top, 1, 2)]}
    mesh = meshio.Mesh(points, [("triangle", facets)], cell_data=data, **named)
    meshio.write(tmp_path / "cube.msh", mesh, file_format="gmsh22")
    for times in (0, 1):
        mesh = build_rigid(tmp_path, "cube.msh", refine=times, mirror="z", translate=[0, 0, 5])
        assert {name: len(of) for name, of in mesh.surfaces.items()} == {"top": 8 * 4**times, "rest": 40 * 4**times}
        facets, nodes = tessellate(mesh, ["top"])
        assert np.allclose(mesh.points[nodes][:, 2], 4.0)
        assert inertia(*facets_of(mesh))[:4] == pytest.approx([3, 0.5, 0.5, 4.5], rel=1e-12)


def test_what_encloses_no_body_is_refused_with_the_place(tmp_path):
    points, facets = facets_of(CUBE)
    corner = (points[facets] == 0).all(axis=2).any(axis=1) & (points[facets][:, :, 2] == 0).all(axis=1)
    open_ = facets[~corner]
    with pytest.raises(
        MeshError, match=r"^open.stl: the surface is open: a hole with \d edges around \(0.\d+, 0.\d+, 0\)"
    ):
        put(tmp_path, "open.stl", points, open_)
    twice = (points[facets][:, :, 2] == 1).all(axis=1)
    with pytest.raises(MeshError, match=r"a hole with \d edges around .* and 1 more; close it"):
        put(tmp_path, "open.stl", points, facets[~corner & ~twice])
    flipped = np.array(facets)
    flipped[7] = flipped[7][::-1]
    place = r", ".join(f"{x:.6g}" for x in points[facets[7]].mean(axis=0))
    with pytest.raises(MeshError, match=rf"^turned.stl: facet 8 at \({place}\) faces the other way than its neigh"):
        put(tmp_path, "turned.stl", points, flipped)
    flipped[: len(facets) // 4] = facets[: len(facets) // 4, ::-1]
    with pytest.raises(MeshError, match=r"turned.stl: facet \d+ at \(.*\) \(and \d+ more\) faces the other way"):
        put(tmp_path, "turned.stl", points, flipped)
    wall = np.vstack([facets, facets[:1]])
    with pytest.raises(MeshError, match=r"wall.obj: 3 facets meet in the edge at \("):
        put(tmp_path, "wall.obj", points, wall)
    count = len(points)
    for shift, size, turn, words in (
        (0.2, 0.5, False, r"the part of 48 facets with one at \(.*\) lies in another one: join them, or move it"),
        (2.0, 0.5, True, r"the part of 48 facets with one at \(.*\) faces inwards, but it is no cavity of another one"),
        (0.4, 1.0, False, "lies in another one"),
    ):
        more = np.vstack([facets, (facets[:, ::-1] if turn else facets) + count])
        with pytest.raises(MeshError, match=words):
            put(tmp_path, "parts.stl", np.vstack([points, size * points + shift]), more)
    sliver = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0]], dtype=float)
    with pytest.raises(MeshError, match=r"sliver.obj: facet 5 at \(0.5, 0.5, 0\) has no area"):
        put(tmp_path, "sliver.obj", sliver, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 4, 3], [1, 2, 4], [4, 2, 3]])


def test_files_that_are_no_surface(tmp_path):
    (tmp_path / "end.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf -4 -2 -3\n")
    with pytest.raises(MeshError, match=r"end.obj: cells name nodes that are not there, or count them from the end"):
        build_rigid(tmp_path, "end.obj")
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 1]])
    (tmp_path / "five.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in points) + "f 1 2 3 4 5\n")
    with pytest.raises(MeshError, match=r"five.obj: the facets are polygon; those of a surface are triangle and quad"):
        build_rigid(tmp_path, "five.obj")
    (tmp_path / "text.stl").write_text("hello")
    with pytest.raises(MeshError, match=r"text.stl: .*"):
        build_rigid(tmp_path, "text.stl")


#: A ball and a block of elastic material above a floor.
CASE = """\
title: a ball from a file falls beside a pressed block
time: {step: 0.02, end: 0.1}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    block:
      mesh: {shape: box, size: [1, 1, 1], cells: [2, 2, 2], order: 1, translate: [2, 0, 0.01]}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}
      supports: [{on: top, displacement: [0, 0, "-0.02*t/0.1"]}]
rigid:
  bodies:
    ball:
      mesh: {MESH_OF_BALL}
      density: 3
      gravity: [0, 0, -10]
      initial_angular_velocity: [10, 20, 30]
      springs: [{at: [0.3, 0, 0.7], stiffness: 20}]
contact:
  obstacles:
    floor: {MESH_OF_FLOOR}
  pairs:
    down: {slave: {body: block, on: bottom}, master: {obstacle: floor}}
probes:
  centre: {body: ball, quantity: centre}
  spin: {body: ball, quantity: angular_momentum}
"""
FILES = CASE.replace("{MESH_OF_BALL}", "{file: ball.stl, translate: [0, 0, 0.501]}").replace(
    "{MESH_OF_FLOOR}", "{mesh: {file: floor.obj, translate: [-5, -5, -1]}}"
)
SHAPES = CASE.replace(
    "{MESH_OF_BALL}", "{shape: sphere, radius: 0.5, cells: [3, 3], translate: [0, 0, 0.501]}"
).replace("{MESH_OF_FLOOR}", "{mesh: {shape: box, size: [10, 10, 1], cells: [1, 1, 1], translate: [-5, -5, -1]}}")


@pytest.fixture
def _files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("ball.stl", facets_of(BALL)[0], ("triangle", facets_of(BALL)[1]))
    floor = shapes.box((10, 10, 1), (1, 1, 1))
    write("ball_in_mm.stl", 1000.0 * facets_of(BALL)[0], ("triangle", facets_of(BALL)[1]))
    write("floor.obj", facets_of(floor)[0], ("triangle", facets_of(floor)[1]))


@pytest.mark.usefixtures("_files")
def test_a_run_is_that_with_the_built_in_shapes():
    """Its history to rounding; the floor's squares are triangles in the file."""
    histories = []
    millimetres = FILES.replace("ball.stl", "ball_in_mm.stl, scale: 0.001")
    for name, text in (("shapes", SHAPES), ("files", FILES), ("millimetres", millimetres)):
        case = load(text)
        assert not (found := check_meshes(case)).problems
        assert not found.notes
        assert run_case(case, Path(name)) == FINISHED
        histories.append(read_history(Path(name, "history.csv")))
    resumed = load(millimetres, [("time.end", "0.06")])
    assert run_case(resumed, Path("resumed")) == FINISHED
    for name in Path().glob("*.stl"):
        name.unlink()
    assert resume_run(Path("resumed"), [("time.end", "0.1")]) == FINISHED
    histories.append(read_history(Path("resumed", "history.csv")))
    assert np.abs(histories[0]["contact.down.z"]).max() > 0.1
    assert {"spin.z", "centre.z"} < set(histories[0])
    for column, own in histories[0].items():
        if column.startswith(("centre.", "spin.", "contact.")):
            near = pytest.approx(own, rel=1e-8, abs=1e-8 * np.abs(own).max() + 1e-12)
            assert all(other[column] == near for other in histories[1:]), column
    assert all(np.array_equal(histories[2][column], histories[3][column]) for column in ("centre.z", "spin.z"))


@pytest.mark.usefixtures("_files")
def test_where_a_surface_is_refused():
    """An elastic body, a plane case, a surface with a hole: at the line of the mesh or its file."""
    elastic = FILES.replace("{shape: box, size: [1, 1, 1], cells: [2, 2, 2], order: 1, ", "{file: ball.stl, ")
    message = "case.yaml:7:13: ball.stl: the cells are a surface in space; an elastic body needs cells of its volume"
    assert message in str(refused(elastic, lambda case: read_body(case, "block")))
    plane = PLANE.replace("MESH", "{file: ball.stl}")
    message = "case.yaml:13:18: the mesh is 3D, but the grid is 2D"
    assert message in str(refused(plane, lambda case: read_rigid_body(case, "ball")))
    write("ball.stl", facets_of(BALL)[0], ("triangle", facets_of(BALL)[1][1:]))
    assert "case.yaml:13:13: ball.stl: the surface is open" in str(
        refused(FILES, lambda case: read_rigid_body(case, "ball"))
    )
    floor = FILES.replace("floor.obj", "ball.stl")
    assert "case.yaml:20:19: ball.stl: the surface is open" in str(
        refused(floor, lambda case: read_obstacle(case, "floor"))
    )


PLANE = """\
time: {step: 1, end: 1}
fluid:
  density: 1
  viscosity: 1
  flow: stokes
  scheme: steady
  grid: {from: [0, 0], to: [4, 2], cells: [16, 8]}
  patches:
    west: {on: x-, velocity: [1, 0]}
    east: {on: x+, outflow: true}
    rest: {on: [y-, y+], slip: true}
  bodies:
    ball: {mesh: MESH}
"""
