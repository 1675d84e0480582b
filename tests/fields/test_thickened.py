"""Membranes from surfaces by thickness: exact volumes, names, what folds is refused; strips bend as beams do."""

import numpy as np
import pytest
from programs import fsci

from fsci import shapes
from fsci.case import CaseError, load_case
from fsci.case.mesh import FileMesh
from fsci.meshes.mesh import build_mesh
from fsci.meshes.of_case import read_body
from fsci.running.history import read_history
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.topology import boundary_facets, signed_volumes


def write(path, points, **cells):
    """A file of cells by type."""
    import meshio

    meshio.write(
        path, meshio.Mesh(np.asarray(points, dtype=float), [(name, np.asarray(of)) for name, of in cells.items()])
    )


def body(path, **settings):
    return build_mesh(FileMesh(file=path.name, **settings), path.parent)


def sheet_of(nx, ny, cell):
    """Nodes and cells of the unit square."""
    mesh = shapes.rectangle([1, 1], [nx, ny], cell=cell)
    return mesh.points, mesh.cells


def lifted(points, height):
    return np.column_stack([points, height(points)])


def measured(mesh):
    """Volume; the areas of the surfaces by name, of plane facets."""
    areas = {}
    for name, facets in mesh.surfaces.items():
        x = mesh.points[facets]
        if x.shape[2] == 2:
            areas[name] = np.linalg.norm(x[:, 1] - x[:, 0], axis=1).sum()
            continue
        triangles = [x[:, [0, k, k + 1]] for k in range(1, x.shape[1] - 1)]
        areas[name] = sum(
            np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum() / 2 for t in triangles
        )
    return signed_volumes(mesh).sum(), areas


@pytest.mark.parametrize(("cell", "name"), [("quad", "quad"), ("tri", "triangle")])
@pytest.mark.parametrize(("order", "layers"), [(1, 1), (2, 3)])
def test_oblique_plate(tmp_path, cell, name, order, layers):
    """In the plane z = x, of cells of which every second is turned round: top is where the first one faces."""
    points, cells = sheet_of(4, 3, cell)
    cells = np.where(np.arange(len(cells))[:, None] % 2 == 1, cells[:, ::-1], cells)
    write(tmp_path / "plate.vtk", lifted(points, lambda x: x[:, 0]), **{name: cells})
    mesh = body(tmp_path / "plate.vtk", thickness=0.05, order=order, layers=layers, scale=2.0)
    volume, areas = measured(mesh)
    area, around = 4.0 * np.sqrt(2.0), 2.0 * (2.0 + 2.0 * np.sqrt(2.0))
    assert volume == pytest.approx(0.05 * area, rel=1e-12)
    assert areas == pytest.approx({"top": area, "bottom": area, "edge": 0.05 * around}, rel=1e-12)
    across = (mesh.points[mesh.surfaces["top"]] - mesh.points.mean(axis=0)) @ np.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0)
    assert np.abs(across) == pytest.approx(0.025, rel=1e-12)
    assert CELL_TYPES[mesh.cell_type].degree == order
    assert len(boundary_facets(mesh)) == sum(map(len, mesh.surfaces.values()))
    assert len(np.unique(mesh.points, axis=0)) == len(mesh.points)


def test_roof_keeps_its_thickness(tmp_path):
    """A fold by 90 degrees: the same thickness on both sides, and half of the volume on each side of the surface."""
    points, cells = sheet_of(4, 2, "quad")
    write(tmp_path / "roof.vtk", lifted(points, lambda x: np.abs(x[:, 0] - 0.5)), quad=cells)
    mesh = body(tmp_path / "roof.vtk", thickness=0.1, layers=2)
    assert measured(mesh)[0] == pytest.approx(0.1 * np.sqrt(2.0), rel=1e-12)
    x = mesh.points
    distance = np.abs(x[:, 2] - np.abs(x[:, 0] - 0.5)) / np.sqrt(2.0)
    assert np.unique(distance.round(12)).tolist() == [0.0, 0.05]


def test_closed_surface_of_an_stl_file(tmp_path):
    """A sphere: no edge; its volume that of a shell, by the error of its facets."""
    ball = shapes.hollow_sphere(0.5, 1.0, [8, 1], cell="tet")
    write(tmp_path / "ball.stl", ball.points, triangle=ball.surfaces["outer"])
    errors = []
    for cells in (8, 16):
        ball = shapes.hollow_sphere(0.5, 1.0, [cells, 1], cell="tet")
        write(tmp_path / "ball.stl", ball.points, triangle=ball.surfaces["outer"])
        mesh = body(tmp_path / "ball.stl", thickness=0.2)
        volume, _ = measured(mesh)
        assert set(mesh.surfaces) == {"top", "bottom"}
        errors.append(volume / (4.0 / 3.0 * np.pi * (1.1**3 - 0.9**3)) - 1.0)
    assert abs(errors[1]) < 0.01
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


@pytest.mark.parametrize("order", [1, 2])
def test_polyline(tmp_path, order):
    """A quarter of a polygon, its lines running either way: the area is length times thickness."""
    angle = np.linspace(0.0, np.pi / 2.0, 9)
    points = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    lines = np.array([[i, i + 1] if i % 3 else [i + 1, i] for i in range(8)])
    write(tmp_path / "arc.vtk", points, line=lines)
    mesh = body(tmp_path / "arc.vtk", thickness=0.1, layers=2, order=order)
    area, lengths = measured(mesh)
    # lengths of a polygon whose ends are square
    assert area == pytest.approx(0.1 * 8 * 2 * np.sin(np.pi / 32), rel=1e-12)
    assert lengths["edge"] == pytest.approx(0.2, rel=1e-12)
    assert lengths["top"] + lengths["bottom"] == pytest.approx(2 * 8 * 2 * np.sin(np.pi / 32), rel=1e-12)


def test_parts_of_the_edge_keep_their_names(tmp_path):
    script = "SetFactory('OpenCASCADE'); Rectangle(1) = {0, 0, 0, 2, 1}; Physical Surface('skin') = {1};\n"
    script += "Physical Curve('clamp') = {4}; MeshSize{ :} = 0.5;\n"
    (tmp_path / "skin.geo").write_text(script.replace("'", '"'))
    mesh = body(tmp_path / "skin.geo", thickness=0.1, order=2, layers=2)
    assert mesh.cell_type == "tetra10"
    _, areas = measured(mesh)
    assert areas == pytest.approx({"top": 2.0, "bottom": 2.0, "edge": 0.6, "clamp": 0.1}, rel=1e-12)
    assert mesh.points[mesh.surfaces["clamp"], 0] == pytest.approx(0.0, abs=1e-12)


CASE = """
time: {{step: 1, end: 1}}
solver: {{newton: {{residual: 1e-12}}}}
structure:
  bodies:
    strip:
      mesh: {{file: {file}, thickness: 0.02, order: 2, surfaces: {{clamp: {{box: {clamp}}}, end: {{box: {end}}}}}}}
      material: {{law: st_venant_kirchhoff, E: 1e6, nu: 0}}
      supports: [{{on: clamp, displacement: {none}}}]
      tractions: [{{on: end, value: {load}}}]
probes: {{tip: {{body: strip, quantity: displacement, on: end}}}}
"""


def mesh_words(folder, text):
    (folder / "case.yaml").write_text(text)
    return load_case(folder)


@pytest.mark.parametrize("dim", [2, 3])
def test_strip_bends_as_a_beam(tmp_path, dim):
    """Tip of a cantilever of 1 m by 0.02 m, with shear: F L^3/(3 E I) + 6/5 F L/(G A), G = E/2, small deflection."""
    x = np.linspace(0.0, 1.0, 11)
    if dim == 2:
        write(
            tmp_path / "strip.vtk",
            np.column_stack([x, 0 * x, 0 * x]),
            line=np.column_stack([np.arange(10), np.arange(1, 11)]),
        )
    else:
        mesh = shapes.rectangle([1, 0.1], [10, 1])
        write(tmp_path / "strip.vtk", lifted(mesh.points, lambda x: 0 * x[:, 0]), quad=mesh.cells)
    low, high = [-1, -1, -1][:dim], [1, 1, 1][:dim]
    clamp, end = [low, [1e-6, *high[1:]]], [[1 - 1e-6, *low[1:]], [2, *high[1:]]]
    load = [*[0] * (dim - 1), 0.05]
    (tmp_path / "case.yaml").write_text(CASE.format(file="strip.vtk", clamp=clamp, end=end, none=[0] * dim, load=load))
    ended = fsci("run", tmp_path, "-o", tmp_path / "out")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    tip = read_history(tmp_path / "out" / "history.csv")[f"tip.{'xyz'[dim - 1]}"][-1]
    force, inertia = 0.05 * 0.02, 0.02**3 / 12.0  # by width
    exact = force / (3.0 * 1e6 * inertia) + 1.2 * force / (0.5e6 * 0.02)
    assert tip == pytest.approx(exact, rel=2e-3)


def refused(folder, points, **cells):
    write(folder / "s.vtk", points, **cells)
    text = CASE.format(
        file="s.vtk", clamp=[[0, 0, 0], [1, 1, 1]], end=[[0, 0, 0], [1, 1, 1]], none=[0, 0, 0], load=[0, 0, 0]
    )
    (folder / "case.yaml").write_text(text)
    with pytest.raises(CaseError) as error:
        read_body(load_case(folder), "strip")
    return str(error.value)


def test_what_folds_is_refused_with_its_place(tmp_path):
    """A ridge of 0.05 m over 0.004 m of width, in a sheet of 0.02 m."""
    points, cells = sheet_of(10, 2, "quad")
    bend = lifted(0.02 * points, lambda x: np.where(np.abs(x[:, 0] - 0.01) < 1e-9, 0.05, 0.0))
    message = refused(tmp_path, bend, quad=cells)
    assert "case.yaml:7:13: s.vtk: layers of this thickness fold at (0.007, 0.005, 0), where" in message
    assert "take a smaller 'thickness', or larger facets there" in message


def test_surfaces_without_two_sides_are_refused(tmp_path):
    angle = np.linspace(0.0, 2.0 * np.pi, 13)[:-1]
    out = np.stack([np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], axis=1)
    middle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    strip = np.concatenate([middle - 0.3 * out, middle + 0.3 * out])
    i = np.arange(11)
    cells = np.column_stack([i, i + 1, i + 13, i + 12])
    cells = np.vstack([cells, [[11, 12, 0, 23]]])
    assert "has one side only" in refused(tmp_path, strip, quad=cells)
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]
    message = refused(tmp_path, points, triangle=[[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    assert "3 facets meet at (0.5, 0, 0): a membrane has two sides" in message
    points, cells = shapes.box([1, 1, 1], [1, 1, 1]).points, shapes.box([1, 1, 1], [1, 1, 1]).cells
    assert "its cells: hexahedron" in refused(tmp_path, points, hexahedron=cells)


def test_layers_need_a_thickness(tmp_path):
    text = CASE.format(file="s.vtk", clamp=[[0, 0], [1, 1]], end=[[0, 0], [1, 1]], none=[0, 0], load=[0, 0])
    (tmp_path / "case.yaml").write_text(text.replace("thickness: 0.02", "layers: 2"))
    with pytest.raises(CaseError, match="'layers' belongs to 'thickness'"):
        load_case(tmp_path)
