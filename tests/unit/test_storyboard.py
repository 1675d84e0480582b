"""Pictures of a flow in space around a ring that touches the floor: what the plane cuts, what passes the hole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fsci.plot.picture import look_at, plot_run
from fsci.plot.render import import_pyvista
from fsci.plot.render_flow import connect, load_meshes, load_state, slice_plane, surrounds
from fsci.plot.storyboard import arrange, boundary, choose, largest_shown, plane_state
from fsci.running.output import FieldWriter
from solvers.api import Snapshot

HEXAHEDRON = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
INNER, OUTER, THICK = 0.3, 0.6, 0.3  #: radii and height of the ring


def bricks(shape: tuple[int, int, int], index: np.ndarray) -> np.ndarray:
    """The cells of a lattice whose points have the numbers `index`."""
    return np.array([[index[tuple(np.array(cell) + corner)] for corner in HEXAHEDRON] for cell in np.ndindex(shape)])


def channel() -> Snapshot:
    """A flow downwards through [-1, 1]^2 x [0, 2]."""
    axes = (np.linspace(-1, 1, 7), np.linspace(-1, 1, 7), np.linspace(0, 2, 6))
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    x, y, _ = points.T
    velocity = np.stack([0 * x, 0 * x, -(1 - x**2) * (1 - y**2)], -1)
    cells = bricks((6, 6, 5), np.arange(len(points)).reshape(7, 7, 6))
    data = {"velocity": velocity, "pressure": points[:, 2]}
    return Snapshot("fluid", points, cells, "hexahedron", data, {"fluid_fraction": np.ones(len(cells))})


def ring(height: float, pressure: float) -> Snapshot:
    """A flat ring around the z axis; the pressure acts on its lower face."""
    angle, radius, z = np.meshgrid(2 * np.pi * np.arange(24) / 24, [INNER, OUTER], [0.0, THICK], indexing="ij")
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height + z], -1).reshape(-1, 3)
    index = np.arange(len(points)).reshape(24, 2, 2)
    index = np.concatenate([index, index[:1]])
    acting = np.where(points[:, 2] == height, pressure, 0.0)
    data = {
        "displacement": 0 * points,
        "contact_pressure": acting,
        "contact_traction": acting[:, None] * [0.0, 0.0, 1.0],
    }
    return Snapshot("ring", points, bricks((24, 1, 1), index), "hexahedron", data)


@pytest.fixture(scope="module")
def out(tmp_path_factory) -> Path:
    """A run in which the ring sinks to the floor."""
    folder = tmp_path_factory.mktemp("ring")
    fields = FieldWriter(folder / "fields")
    for step, height in enumerate([1.0, 0.5, 0.0]):
        fields.write(step, 0.1 * step, [channel(), ring(height, 100.0 * (height == 0))])
    return folder


def files(out: Path, step: int) -> list[Path]:
    return [out / "fields" / f"{name}_{step:06d}.vtu" for name in ("fluid", "ring")]


def test_which_times_are_shown():
    assert choose(3) == [0, 1, 2]
    assert choose(13) == [2, 4, 6, 8, 10, 12]
    assert choose(13, [9]) == [2, 4, 6, 9, 10, 12]
    assert choose(13, [12]) == choose(13)


@pytest.mark.parametrize(("speeds", "largest"), [
    ([1, 2, 3, 4, 5, 6], 6), ([0.1, 0.1, 9, 0.2, 0.1], 0.2), ([0, 0, 0, 3], 3), ([0], 1), ([4], 4),
])  # fmt: skip
def test_one_fast_moment_does_not_make_the_others_dark(speeds, largest):
    assert largest_shown(speeds) == largest


def test_panels_fill_a_page():
    assert arrange(6, 2.0, 3.2) == (3, 2)
    assert arrange(6, 2.5, 0.41) == (1, 6)
    assert arrange(1, 2.0, 3.2) == (1, 1)
    assert arrange(5, 1.0, 1.0) == (3, 2)


def test_the_plane_cuts_flow_and_body(out):
    (flow, body), names, place = plane_state(files(out, 1))
    assert (names, place) == (("x", "z"), "y = 0")
    assert flow.surface.bounds == pytest.approx((-1, 1, 0, 2, 0, 0), abs=1e-6)
    assert flow.values.max() == pytest.approx(1)
    assert body.values is None
    assert body.surface.area == pytest.approx(2 * (OUTER - INNER) * THICK, rel=1e-5)
    assert np.linalg.norm(body.outline[:, 1] - body.outline[:, 0], axis=1).sum() == pytest.approx(2.4, rel=1e-5)


def test_stream_tubes_pass_through_the_hole(out):
    *_, tubes, body = load_state(files(out, 1), "velocity")
    assert body.values is None, "bodies in a flow are grey"
    at_ring = np.asarray(tubes.surface.points)
    at_ring = at_ring[np.abs(at_ring[:, 2] - 0.65) < 0.1]
    assert np.any(np.hypot(*at_ring[:, :2].T) < 0.5 * INNER)
    assert load_state(files(out, 1)[1:], "displacement")[0].values is not None


def test_the_mesh_has_the_cells_at_the_back_of_the_box(out):
    box, grid, body = load_meshes(files(out, 0))
    assert len(box.edges) == 12
    floor, side = 2 * 6 * 7, 6 * 6 + 5 * 7
    assert len(grid.edges) == floor + 2 * side - (6 + 6 + 5), "three sides that share edges of the box"
    assert len(body.edges) == 24 * 8


def test_contact_is_drawn_from_the_side_where_it_acts():
    assert look_at(np.array([0.0, 0.0, -3.0]))[2] < -0.5
    assert look_at(np.array([1.0, 0.0, 0.0]))[0] > 0.5
    for normal in np.eye(3):
        assert np.linalg.norm(look_at(normal)) == pytest.approx(1)


def test_all_pictures_of_the_run(out):
    assert [path.name for path in plot_run(out)] == [
        "final_velocity.png",
        "final_pressure.png",
        "mesh.png",
        "story_velocity.png",
        "before_contact_velocity.png",
        "final_contact_pressure.png",
    ]


def test_contact_pressure_beside_a_rigid_body_in_the_plane(tmp_path):
    """The rigid body is a line without pressure; between nodes of a second-order cell no pressure is negative."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    data = {"velocity": corners, "pressure": corners[:, 0]}
    flow = Snapshot("fluid", corners, np.array([[0, 1, 2, 3]]), "quad", data, {"fluid_fraction": np.ones(1)})
    nodes = np.array([[x, y, 0.0] for y in (0, 1, 2) for x in (0, 1, 2)]) / 4
    order = np.array([[0, 2, 8, 6, 1, 5, 7, 3, 4]])
    pressure = np.where(np.arange(9) == 5, 10.0, 0.0)
    acting = {"contact_pressure": pressure, "contact_traction": pressure[:, None] * [1.0, 0, 0]}
    body = Snapshot("body", nodes, order, "quad9", acting)
    stop = Snapshot(
        "stop", corners[:2] + np.array([0.5, 0, 0]), np.array([[0, 1]]), "line", {"velocity": np.zeros((2, 3))}
    )
    fields = FieldWriter(tmp_path / "fields")
    fields.write(1, 0.1, [flow, body, stop])
    assert "final_contact_pressure.png" in {path.name for path in plot_run(tmp_path)}


def test_specks_of_streamlines_are_left_out():
    long, speck = np.array([[0.0, 0], [1, 0], [2, 1]]), np.array([[0.0, 0], [0.01, 0], [0, 0.01]])
    lines = connect([long, speck], 0.1)
    assert lines.shape == (2, 2, 3)
    assert np.array_equal(lines[:, :, :2], [long[:2], long[1:]])
    assert len(connect([speck], 0.1)) == 0


def test_where_a_box_is_cut():
    """In the middle if a body is there, else in the side that a part of a symmetric body lies in, or through bodies.

    The middle is a plane of the grid: the cut is 1e-6 of the box beside it, and is that of all cells there.
    """
    box = import_pyvista().ImageData(dimensions=(5, 5, 9))  # 4 x 4 x 8
    sphere = import_pyvista().Sphere(radius=0.5, center=(1.0, 1.0, 4.0))
    half = sphere.clip("y", origin=(1.0, 1.0, 4.0), invert=False).translate((0, -1, 0))
    assert slice_plane(box, []) == ("y", pytest.approx([2, 2 + 4e-6, 4], abs=1e-9))
    assert slice_plane(box, [sphere]) == ("y", pytest.approx([2, 1, 4]))
    assert slice_plane(box, [half]) == ("y", pytest.approx([2, 0, 4], abs=1e-5))
    assert slice_plane(box, [half.translate((0, 1.8, 0))]) == ("y", pytest.approx([2, 2 + 4e-6, 4], abs=1e-9))


def test_a_cut_in_a_plane_of_rounded_nodes_has_no_cracks():
    grid = import_pyvista().ImageData(dimensions=(5, 5, 9)).cast_to_unstructured_grid()
    grid.points[:, 1] += 1e-13 * np.random.default_rng(3).uniform(-1, 1, grid.n_points)
    normal, origin = slice_plane(grid, [])
    assert len(boundary(grid.slice(normal=normal, origin=grid.center))) > 24
    assert len(boundary(grid.slice(normal=normal, origin=origin))) == 24


def test_the_wall_of_a_tube_does_not_hide_what_is_in_it(tmp_path):
    """Of a rigid body around the flow the part in the box behind the slice remains; other bodies stay whole."""
    pyvista = import_pyvista()
    box = pyvista.ImageData(dimensions=(5, 5, 5)).cast_to_unstructured_grid()  # 4 x 4 x 4
    box.cell_data["fluid_fraction"] = np.ones(box.n_cells)
    box.point_data["velocity"] = np.zeros((box.n_points, 3))
    wall = pyvista.Cylinder(center=(2, 2, 2), direction=(0, 0, 1), radius=2.5, height=5).triangulate()
    paths = [tmp_path / name for name in ("flow.vtu", "wall.vtu", "ball.vtu")]
    for path, mesh in zip(paths, [box, wall, pyvista.Sphere(radius=1, center=(2, 2, 2))], strict=True):
        mesh.cast_to_unstructured_grid().save(path)
    for parts in (load_state(paths, "velocity"), load_meshes(paths)):
        around, ball = (np.array(part.surface.bounds) for part in parts[-2:])
        assert ball == pytest.approx([1, 3, 1, 3, 1, 3], abs=0.01)
        assert around == pytest.approx([0, 4, 3.5, 4, 0, 4], abs=0.01)
    flow, *bodies = plane_state(paths)[0]
    assert [surrounds(body.surface, flow.surface) for body in bodies] == [True, False]
