"""Meshes of a case: gmsh scripts and files, other formats, names, regions, placing."""

import re
import signal
from math import asin, pi, sqrt
from pathlib import Path
from types import SimpleNamespace

import meshio  # noqa: TID253
import numpy as np
import pytest
from cell_geometry import smallest_determinant, volume
from pydantic import TypeAdapter

from fsci import shapes
from fsci.case.shapes import AnyShape
from fsci.meshes.mesh import MeshError, build_mesh, extract_region, place, require_region, require_surface
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import boundary_facets, surface_facets

CSM3 = Path(__file__).parents[2] / "cases" / "csm3"


def build(folder, file, **settings):
    return build_mesh(SimpleNamespace(file=file, **settings), folder)


# --- gmsh scripts

# a quarter of a ring with inner radius 1, outer radius 2; its curve loop runs clockwise
QUARTER = """
DefineConstant[ n = 2 ];
Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Point(3) = {2, 0, 0}; Point(4) = {0, 2, 0}; Point(5) = {0, 1, 0};
Line(1) = {2, 3}; Circle(2) = {3, 1, 4}; Line(3) = {4, 5}; Circle(4) = {5, 1, 2};
Curve Loop(1) = {-4, -3, -2, -1}; Plane Surface(1) = {1};
Transfinite Curve {1, 3} = n + 1; Transfinite Curve {2, 4} = 2 * n + 1; Transfinite Surface {1};
"""
QUADS = "Recombine Surface {1};\n"
NAMES = """
Physical Surface("body") = {1}; Physical Curve("inner") = {4}; Physical Curve("sides") = {1, 3};
"""
EXTRUDED = """
out[] = Extrude {0, 0, 0.5} { Surface{1}; Layers{n}; %s };
Physical Volume("body") = {out[1]}; Physical Surface("bottom") = {1}; Physical Surface("top") = {out[0]};
"""
SCRIPTS = {
    "triangle6": (QUARTER + NAMES, 0.75 * pi, {"inner": 4, "sides": 4}),
    "quad9": (QUARTER + QUADS + NAMES, 0.75 * pi, {"inner": 4, "sides": 4}),
    "tetra10": (QUARTER + EXTRUDED % "", 0.375 * pi, {"bottom": 16, "top": 16}),
    "hexahedron27": (QUARTER + QUADS + EXTRUDED % "Recombine;", 0.375 * pi, {"bottom": 8, "top": 8}),
}


@pytest.mark.parametrize("cell_type", SCRIPTS)
def test_second_order_gmsh_mesh_is_positive_and_curved(cell_type, tmp_path):
    script, exact, surfaces = SCRIPTS[cell_type]
    (tmp_path / "part.geo").write_text(script)
    mesh = build(tmp_path, "part.geo", order=2, parameters={})
    assert mesh.cell_type == cell_type
    assert mesh.points.shape[1] == (2 if cell_type in ("triangle6", "quad9") else 3)
    assert smallest_determinant(mesh) > 0.3
    assert volume(mesh) == pytest.approx(exact, rel=3e-4)  # straight edges would miss 5e-3
    assert {name: len(facets) for name, facets in mesh.surfaces.items()} == surfaces
    assert set(mesh.regions) == {"body"}
    # outward
    if "top" in surfaces:
        a, b, c = np.moveaxis(mesh.points[mesh.surfaces["top"][:, :3]], 1, 0)
        assert (np.cross(b - a, c - a)[:, 2] > 0).all()
    else:
        facets = surface_facets(mesh, "inner")
        assert np.allclose(np.linalg.norm(mesh.points[facets], axis=2), 1)
        middle, (dx, dy) = mesh.points[facets[:, 2]], (mesh.points[facets[:, 1]] - mesh.points[facets[:, 0]]).T
        assert ((dy, -dx) * middle.T).sum(axis=0).max() < 0


@pytest.mark.parametrize("script", ["transfinite", "sizes", "own factor"])
@pytest.mark.parametrize("factor", [2.0, 2**0.5, 0.5])
def test_size_factor(script, factor, tmp_path):
    """Edges so many times as long, whether the script counts cells or gives sizes; its own factor stays."""
    text = {
        "transfinite": QUARTER.replace("n = 2", "n = 40"),
        "sizes": QUARTER.split("Transfinite")[0] + "MeshSize {:} = 0.05;\n",
        "own factor": QUARTER.split("Transfinite")[0] + "MeshSize {:} = 0.1;\nMesh.MeshSizeFactor = 0.5;\n",
    }[script]
    (tmp_path / "part.geo").write_text(text + QUADS * (script == "transfinite"))
    cells = [len(build(tmp_path, "part.geo", order=1, parameters={}, size_factor=f).cells) for f in (1.0, factor)]
    assert (cells[0] / cells[1]) ** 0.5 == pytest.approx(factor, rel=0.05)


def test_size_factor_of_a_mesh(tmp_path):
    meshio.write_points_cells(tmp_path / "one.vtu", np.eye(3), [("triangle", [[0, 1, 2]])])
    with pytest.raises(MeshError, match=r"'size_factor' is for .geo files, the cells of one.vtu have their sizes"):
        build(tmp_path, "one.vtu", size_factor=2.0)


@pytest.mark.parametrize("name", ["part.geo", "part.msh", "part.vtu"])
def test_scale_is_before_all_else(name, tmp_path):
    """A script, a mesh of gmsh and another file in mm, halved, mirrored, turned, moved: as one in m."""
    script = QUARTER + QUADS + EXTRUDED % "Recombine;"
    (tmp_path / "part.geo").write_text(script)
    mesh = build(tmp_path, "part.geo", order=1, parameters={})
    if name != "part.geo":
        named = {key: np.unique(facets) for key, facets in mesh.surfaces.items()}
        form = {"file_format": "gmsh22", "binary": False} if name == "part.msh" else {}
        cells = [(mesh.cell_type, mesh.cells)]
        meshio.Mesh(mesh.points, cells, point_sets={} if form else named).write(tmp_path / name, **form)
    turn = SimpleNamespace(axis=[1, 2, 3], angle=20.0)
    placed = {"mirror": "x", "rotate": [turn], "refine": 1}
    own = build(tmp_path, name, **placed, translate=[1.0, 2.0, 3.0])
    other = build(tmp_path, name, **placed, scale=1e-3, translate=[1e-3, 2e-3, 3e-3])
    assert other.points == pytest.approx(1e-3 * own.points, rel=1e-12, abs=1e-15)
    assert np.array_equal(other.cells, own.cells)
    assert other.surfaces.keys() == own.surfaces.keys()
    assert volume(other) == pytest.approx(0.375e-9 * pi, rel=0.05)


def test_parameters_reach_the_script(tmp_path):
    (tmp_path / "part.geo").write_text(QUARTER + QUADS + NAMES + "fixed = 1;\n")
    assert len(build(tmp_path, "part.geo", order=1, parameters={}).cells) == 2 * 4
    assert len(build(tmp_path, "part.geo", order=1, parameters={"n": 3}).cells) == 3 * 6
    with pytest.raises(MeshError, match=r"unknown parameter of part.geo 'm' \(available: .*n.*\)"):
        build(tmp_path, "part.geo", order=1, parameters={"m": 3})
    with pytest.raises(MeshError, match=r"part.geo sets 'fixed' itself; DefineConstant\[ fixed = "):
        build(tmp_path, "part.geo", order=1, parameters={"fixed": 3})


def test_gmsh_is_silent_and_leaves_signals_alone(tmp_path, capfd):
    (tmp_path / "part.geo").write_text(QUARTER + NAMES)
    before = signal.getsignal(signal.SIGINT)
    build(tmp_path, "part.geo", order=1, parameters={"n": 1})
    assert capfd.readouterr() == ("", "")
    assert signal.getsignal(signal.SIGINT) is before


def test_error_in_a_script_is_reported_and_does_not_disturb_the_next(tmp_path):
    (tmp_path / "wrong.geo").write_text("Point(1) = {0, 0, 0};\nPoint(2) = {0, 0, h};\n")
    (tmp_path / "part.geo").write_text(QUARTER + NAMES)
    with pytest.raises(MeshError, match=r"wrong.geo', line 2: Unknown variable 'h'"):
        build(tmp_path, "wrong.geo", order=1, parameters=None)
    assert build(tmp_path, "part.geo", order=1, parameters=None).cell_type == "triangle"


def test_mixed_cells_are_refused(tmp_path):
    mixed = """
    Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Point(3) = {1, 1, 0}; Point(4) = {0, 1, 0};
    Point(5) = {2, 0, 0}; Point(6) = {2, 1, 0};
    Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1}; Line(5) = {2, 5}; Line(6) = {5, 6};
    Line(7) = {6, 3};
    Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1}; Curve Loop(2) = {5, 6, 7, -2}; Plane Surface(2) = {2};
    Transfinite Curve {1:7} = 3; Transfinite Surface {1, 2}; Recombine Surface {1};
    """
    (tmp_path / "mixed.geo").write_text(mixed)
    with pytest.raises(MeshError, match=r"mixed.geo: the cells are quad and triangle; .* one of triangle, tri"):
        build(tmp_path, "mixed.geo", order=1, parameters=None)


# --- the flag of the Turek-Hron benchmark


@pytest.mark.parametrize(("refine", "order"), [(1, 1), (1, 2), (2, 2)])
def test_flag(refine, order):
    mesh = build(CSM3, "flag.geo", order=order, parameters={"refine": refine})
    assert mesh.cell_type == ("quad" if order == 1 else "quad9")
    assert len(mesh.cells) == 70 * refine**2
    assert len(mesh.points) == (35 * refine * order + 1) * (2 * refine * order + 1)
    sizes = {name: len(facets) // refine for name, facets in mesh.surfaces.items()}
    assert sizes == {"bottom": 35, "top": 35, "clamp": 2, "tip": 2}
    assert len(boundary_facets(mesh)) == 74 * refine
    assert list(mesh.regions) == ["flag"]
    assert np.abs(mesh.points - [0.6, 0.2]).sum(axis=1).min() < 1e-12
    clamp = mesh.points[np.unique(surface_facets(mesh, "clamp"))] - 0.2
    assert np.allclose(np.hypot(*clamp.T), 0.05, rtol=1e-12)
    assert np.allclose(mesh.points[np.unique(surface_facets(mesh, "tip")), 0], 0.6, rtol=1e-12)
    half, r = 0.01, 0.05
    exact = 0.8 * half - (half * sqrt(r**2 - half**2) + r**2 * asin(half / r))
    assert volume(mesh) == pytest.approx(exact, rel=5e-4 if order == 1 else 1e-6)
    assert smallest_determinant(mesh) > 0.7


# --- files

TWO_REGIONS = """
Point(1) = {0, 0, 1}; Point(2) = {1, 0, 1}; Point(3) = {3, 0, 1};
Point(4) = {3, 1, 1}; Point(5) = {1, 1, 1}; Point(6) = {0, 1, 1};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 1};
Line(7) = {2, 5};
Curve Loop(1) = {1, 7, 5, 6}; Plane Surface(1) = {1}; Curve Loop(2) = {2, 3, 4, -7}; Plane Surface(2) = {2};
Transfinite Curve {1:7} = 4; Transfinite Surface {1, 2}; Recombine Surface {1, 2};
Physical Surface("small") = {1}; Physical Surface("large") = {2}; Physical Surface("all") = {1, 2};
Physical Curve("bottom") = {1, 2}; Physical Curve("middle") = {7}; Physical Curve("right") = {3};
"""


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The mesh of two regions as files of several formats."""
    import gmsh

    folder = tmp_path_factory.mktemp("meshes")
    (folder / "two.geo").write_text(TWO_REGIONS)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(str(folder / "two.geo"))
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.model.mesh.generate(2)
    gmsh.write(str(folder / "new.msh"))
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(str(folder / "binary.msh"))
    gmsh.option.setNumber("Mesh.Binary", 0)
    gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
    gmsh.write(str(folder / "old.msh"))
    gmsh.finalize()
    return folder


@pytest.mark.parametrize("file", ["two.geo", "new.msh", "binary.msh", "old.msh"])
def test_regions_and_surfaces_of_gmsh_files(written, file):
    mesh = build(written, file, order=2 if file == "two.geo" else None, parameters={})
    assert (mesh.cell_type, mesh.points.shape) == ("quad9", (7 * 13, 2))
    assert volume(mesh) == pytest.approx(3)
    # the old format repeats the cells for each of their groups
    assert len(mesh.cells) == 18
    assert {name: len(cells) for name, cells in mesh.regions.items()} == {"small": 9, "large": 9, "all": 18}
    assert set(mesh.regions["small"]) | set(mesh.regions["large"]) == set(range(18))
    assert {name: len(facets) for name, facets in mesh.surfaces.items()} == {"bottom": 6, "middle": 3, "right": 3}


def test_extract_region_has_its_own_nodes_and_surfaces(written):
    mesh = build(written, "new.msh")
    small = extract_region(mesh, "small")
    assert small.points.shape == (49, 2)
    assert volume(small) == pytest.approx(1)
    assert np.array_equal(np.unique(small.cells), np.arange(49))
    assert {name: len(facets) for name, facets in small.surfaces.items()} == {"bottom": 3, "middle": 3}
    assert {name: len(cells) for name, cells in small.regions.items()} == {"small": 9, "all": 9}
    # the surface between the regions is outward of each of them
    for name, sign in (("small", 1), ("large", -1)):
        part = extract_region(mesh, name)
        facets = surface_facets(part, "middle")
        assert np.allclose(part.points[facets, 0], 1)
        assert (sign * (part.points[facets[:, 1], 1] - part.points[facets[:, 0], 1]) > 0).all()


def square(**sets):
    """Two quads above each other, two lines on the left, and a node that no cell uses."""
    points = np.array([[5, 5, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0], [1, 2, 0]], dtype=float)
    cells = [("quad", [[1, 2, 4, 3], [3, 4, 6, 5]]), ("line", [[1, 3], [3, 5]])]
    return meshio.Mesh(points, cells, **sets)


def test_sets_of_another_format(tmp_path):
    cells = {"upper": [np.array([1]), np.array([], dtype=int)], "left": [np.array([], dtype=int), np.array([0, 1, 1])]}
    square(cell_sets=cells, point_sets={"top": np.array([5, 6, 1])}).write(tmp_path / "square.inp")
    mesh = build(tmp_path, "square.inp", order=1, parameters={})
    assert (mesh.cell_type, mesh.points.shape) == ("quad", (6, 2))
    assert {name: list(cells) for name, cells in mesh.regions.items()} == {"upper": [1]}
    assert np.array_equal(mesh.points[mesh.surfaces["left"]][:, :, 0], np.zeros((2, 2)))
    assert np.array_equal(mesh.points[mesh.surfaces["top"]], [[[1, 2], [0, 2]]])


def test_named_numbers_of_netgen(tmp_path):
    box = shapes.box((2, 1, 1), (2, 1, 1), cell="tet")
    sides = np.concatenate([box.surfaces["left"], box.surfaces["right"]])
    far = (box.points[box.cells, 0].mean(axis=1) > 1).astype(int)
    numbers = {"netgen:index": [1 + far, np.array([1, 1, 2, 2])]}
    names = {"near": np.array([1, 3]), "far": np.array([2, 3]), "right": np.array([2, 2])}
    meshio.Mesh(box.points, [("tetra", box.cells), ("triangle", sides)], cell_data=numbers, field_data=names).write(
        tmp_path / "box.vol"
    )
    mesh = build(tmp_path, "box.vol")
    assert np.array_equal(mesh.regions["far"], np.flatnonzero(far))
    assert {name: len(cells) for name, cells in mesh.regions.items()} == {"near": 6, "far": 6}
    assert set(mesh.surfaces) >= {"right"}
    assert mesh.surfaces["right"].shape == (2, 3)
    assert (mesh.points[mesh.surfaces["right"], 0] == 2).all()


@pytest.mark.filterwarnings("ignore:`product` is deprecated")  # h5py's, in meshio's writer
def test_families_of_med(tmp_path):
    mesh = square(cell_data={"cell_tags": [np.array([-1, -2]), np.array([-3, 0])]})
    mesh.cell_tags = {-1: ["all"], -2: ["all", "upper"], -3: ["left"]}
    mesh.write(tmp_path / "square.med")
    mesh = build(tmp_path, "square.med")
    assert {name: list(cells) for name, cells in mesh.regions.items()} == {"all": [0, 1], "upper": [1]}
    assert np.array_equal(mesh.points[mesh.surfaces["left"]], [[[0, 1], [0, 0]]])


@pytest.mark.parametrize("order", [1, 2])
def test_groups_of_unv(order, tmp_path):
    """Written by gmsh from a box with names, which end up the same as in its own format."""
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.SaveGroupsOfElements", 1)
        gmsh.option.setNumber("Mesh.ElementOrder", order)
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1], name="body")
        top = [tag for dim, tag in gmsh.model.getEntities(2) if gmsh.model.occ.getCenterOfMass(dim, tag)[2] > 0.9]
        gmsh.model.addPhysicalGroup(2, top, name="top")
        gmsh.model.mesh.generate(3)
        for name in ("part.unv", "part.msh"):
            gmsh.write(str(tmp_path / name))
    finally:
        gmsh.finalize()
    own, other = build(tmp_path, "part.msh"), build(tmp_path, "part.unv")
    assert other.cell_type == own.cell_type == ("tetra" if order == 1 else "tetra10")
    assert volume(other) == pytest.approx(1.0, rel=1e-12)
    assert len(other.regions["body"]) == len(own.regions["body"]) == len(own.cells)
    assert other.surfaces.keys() == {"top"}
    assert len(other.surfaces["top"]) == len(own.surfaces["top"]) > 2
    assert (other.points[other.surfaces["top"], 2] == 1.0).all()
    (tmp_path / "part.unv.opt").write_text('SystemCall "touch ran";\n')
    with pytest.raises(MeshError, match=r"part.unv.opt:1: 'SystemCall' runs a program"):
        build(tmp_path, "part.unv")


def test_second_order_cells_survive_another_format(tmp_path):
    torus = shapes.hollow_torus(3, 1, 2, (6, 6, 1), order=2)
    meshio.Mesh(torus.points, [(torus.cell_type, torus.cells)]).write(tmp_path / "torus.vtu")
    mesh = build(tmp_path, "torus.vtu")
    assert np.array_equal(mesh.points[mesh.cells], torus.points[torus.cells])


def test_files_that_are_no_mesh(tmp_path):
    with pytest.raises(MeshError, match=r"there is no mesh file .*nothing.msh"):
        build(tmp_path, "nothing.msh")
    (tmp_path / "text.vtu").write_text("hello")
    with pytest.raises(MeshError, match=r"text.vtu: meshio says: .*Couldn't read file"):
        build(tmp_path, "text.vtu")
    (tmp_path / "part.step").write_text("ISO-10303-21;")
    words = 'part.step: this is a geometry without a mesh; name a file .geo with the lines SetFactory("OpenCASCADE"); '
    with pytest.raises(MeshError, match=re.escape(f'{words}Merge "part.step"; MeshSize {{:}} = 0.1;')):
        build(tmp_path, "part.step")
    (tmp_path / "text.msh").write_text("hello")
    with pytest.raises(MeshError, match=r"text.msh: gmsh says: .*syntax error"):
        build(tmp_path, "text.msh")
    with pytest.raises(MeshError, match=r"parameters are for .geo files, text.vtu has none"):
        build(tmp_path, "text.vtu", parameters={"n": 1})
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 1.0]])
    meshio.Mesh(points, [("line", [[0, 1]])]).write(tmp_path / "line.vtu")
    with pytest.raises(MeshError, match=r"line.vtu: the file has no cells of two or three dimensions"):
        build(tmp_path, "line.vtu")
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    meshio.Mesh(points, [("triangle", [[0, 1, 2], [0, 2, 3]])]).write(tmp_path / "shell.vtu")
    with pytest.raises(MeshError, match=r"shell.vtu: the cells are a surface in space"):
        build(tmp_path, "shell.vtu")
    meshio.Mesh(points, [("tetra", [[0, 1, 2, 2]])]).write(tmp_path / "flat.vtu")
    with pytest.raises(MeshError, match=r"flat.vtu: cells without volume: 1"):
        build(tmp_path, "flat.vtu")


# --- shapes, names, placing


def test_shape_takes_its_settings():
    settings = {"shape": "ring", "inner_radius": 1, "outer_radius": 2, "cells": [4, 1], "angle": 90}
    mesh = build_mesh(TypeAdapter(AnyShape).validate_python({**settings, "order": 2, "cell": "tri"}), Path())
    assert (mesh.cell_type, len(mesh.cells)) == ("triangle6", 8)
    assert set(mesh.surfaces) == {"inner", "outer", "start", "end"}


def test_unknown_names_list_those_there_are():
    mesh = shapes.rectangle((1, 1), (1, 1))
    assert require_surface(mesh, "left").shape == (1, 2)
    with pytest.raises(MeshError) as error:
        require_surface(mesh, "lefft")
    assert str(error.value) == ("unknown surface 'lefft'; did you mean 'left'? (available: bottom, left, right, top)")
    with pytest.raises(MeshError, match=r"unknown region 'left' \(available: none\)"):
        require_region(mesh, "left")


def turn(angle, axis=None):
    return SimpleNamespace(angle=angle, axis=axis)


def test_mesh_is_rotated_then_translated():
    mesh = Mesh(np.array([[1.0, 0], [0, 1], [2, 0]]), np.array([[0, 1, 2]]), "triangle")
    assert np.allclose(place(mesh, turn(90), (10, 20)).points, [[10, 21], [9, 20], [10, 22]])
    solid = Mesh(np.eye(3), np.array([[0, 1, 2]]), "tetra")
    assert np.allclose(place(solid, turn(45, (0, 0, 2))).points[0], [sqrt(0.5), sqrt(0.5), 0])
    # about x first, then about z: y goes to z and stays there; the other way it would go to -x
    moved = place(solid, [turn(90, (1, 0, 0)), turn(90, (0, 0, 1))], (0, 0, 5)).points
    assert np.allclose(moved, [[0, 1, 5], [0, 0, 6], [1, 0, 5]])
    assert np.allclose(place(solid, turn(120, (1, 1, 1))).points, np.eye(3)[[1, 2, 0]])
    assert np.array_equal(place(solid, (), None).points, solid.points)


@pytest.mark.parametrize(
    ("dim", "rotate", "translate", "message"),
    [
        (3, turn(90), None, "a mesh of three dimensions needs an axis"),
        (3, turn(90, (0, 0, 0)), None, "not all zero"),
        (3, turn(90, (0, 1)), None, "the axis must be three numbers"),
        (2, turn(90, (1, 0, 0)), None, "give the angle only"),
        (2, None, (1, 2, 3), "translate has 3 numbers, the mesh has 2 dimensions"),
    ],
)
def test_impossible_positions_are_refused(dim, rotate, translate, message):
    mesh = shapes.rectangle((1, 1), (1, 1)) if dim == 2 else shapes.box((1, 1, 1), (1, 1, 1))
    with pytest.raises(MeshError, match=message):
        place(mesh, rotate, translate)


# --- cells without middle nodes


def ring_without_middles(cell, dim):
    """A curved mesh of second order, its cells as files have them that lack the nodes in the middle."""
    mesh = shapes.ring(1, 2, (8, 2), order=2) if dim == 2 else shapes.tube(1, 2, 1, (8, 2, 2), order=2)
    nodes = {"quad8": 8, "hexahedron20": 20}[cell]
    used, cells = np.unique(mesh.cells[:, :nodes], return_inverse=True)
    return mesh, mesh.points[used], cells.reshape(-1, nodes)


@pytest.mark.parametrize(("cell", "dim"), [("quad8", 2), ("hexahedron20", 3)])
@pytest.mark.parametrize("ending", ["vtu", "msh"])
def test_serendipity_cells_are_completed(cell, dim, ending, tmp_path):
    """The new nodes are those of the serendipity map; straight and parallel cells have theirs in the middle."""
    full, points, cells = ring_without_middles(cell, dim)
    points3 = np.pad(points, ((0, 0), (0, 3 - dim)))
    mesh = meshio.Mesh(points3, [(cell, cells)])
    mesh.write(tmp_path / f"ring.{ending}", **({"file_format": "gmsh"} if ending == "msh" else {}))
    found = build(tmp_path, f"ring.{ending}")
    assert found.cell_type == full.cell_type
    assert len(found.points) == len(full.points)
    assert found.note.startswith(f"its {cell} cells became {full.cell_type}")
    assert smallest_determinant(found) > 0.3
    assert volume(found) == pytest.approx(volume(full), rel=1e-3)
    # a polynomial that serendipity functions contain is met in the new nodes: x of an affine map of the unit cell
    x = found.points[found.cells]
    middle = x[:, :4].sum(axis=1) * -0.25 + x[:, 4:8].sum(axis=1) * 0.5
    if dim == 2:
        assert np.allclose(x[:, 8], middle, atol=1e-14)
    else:
        assert np.allclose(x[:, 26], -0.25 * x[:, :8].sum(axis=1) + 0.25 * x[:, 8:20].sum(axis=1), atol=1e-14)
        bottom = [0, 1, 2, 3, 8, 9, 10, 11]
        weights = np.array([-0.25] * 4 + [0.5] * 4)
        assert np.allclose(x[:, 24], np.einsum("a,cai->ci", weights, x[:, bottom]), atol=1e-14)


def test_serendipity_cells_of_a_box_become_the_full_ones(tmp_path):
    box = shapes.box((2, 1, 1), (2, 2, 1), order=2)
    used, cells = np.unique(box.cells[:, :20], return_inverse=True)
    left = np.flatnonzero(box.points[used][:, 0] == 0.0)
    meshio.Mesh(box.points[used], [("hexahedron20", cells.reshape(-1, 20))], point_sets={"left": left}).write(
        tmp_path / "box.inp"
    )
    mesh = build(tmp_path, "box.inp")
    assert mesh.cell_type == "hexahedron27"
    assert np.allclose(mesh.points[mesh.cells], box.points[box.cells], atol=1e-12)
    assert mesh.surfaces["left"].shape == (2, 4)


@pytest.mark.parametrize(
    ("cell", "nodes", "words"),
    [("wedge", 6, "wedge"), ("pyramid", 5, "pyramid")],
)
def test_foreign_cells_are_refused(cell, nodes, words, tmp_path):
    points = np.random.default_rng(1).random((nodes, 3))
    meshio.Mesh(points, [(cell, np.arange(nodes)[None, :])]).write(tmp_path / "part.vtu")
    with pytest.raises(MeshError, match=f"part.vtu: the cells are {words}; all must be of one type, one of triangle"):
        build(tmp_path, "part.vtu")


def test_prisms_of_gmsh_are_refused(tmp_path):
    prisms = QUARTER + "out[] = Extrude {0, 0, 0.5} { Surface{1}; Layers{n}; Recombine; };"
    (tmp_path / "part.geo").write_text(prisms)
    with pytest.raises(MeshError, match=r"part.geo: the cells are Prism 6; all must be of one type"):
        build(tmp_path, "part.geo", order=1)
