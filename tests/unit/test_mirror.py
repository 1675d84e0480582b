"""Scenes with planes of symmetry are drawn whole."""

import numpy as np
import pytest

from fsci.plot.mirror import Mirror, Plane, read_plane, with_reflection
from fsci.plot.render import import_pyvista
from fsci.plot.render_flow import load_state


def block(low=(0.0, 0.0, 0.0), high=(1.0, 2.0, 1.0)):
    """2 x 4 x 2 cells with fields that are symmetric about y = 2: v_y and s_xy are odd there."""
    pyvista = import_pyvista()
    ends = zip(low, high, (3, 5, 3), strict=True)
    mesh = pyvista.RectilinearGrid(*(np.linspace(a, b, n) for a, b, n in ends)).cast_to_unstructured_grid()
    mesh.point_data.update(fields(mesh.points))
    return mesh


def fields(points):
    x, y, z = points.T
    odd = (y - 2) * (1 + x + z)
    return {"v": np.stack([x, odd, z * (y - 2) ** 2], axis=1), "p": (y - 2) ** 2 + x, "s_xy": odd, "s_yy": x + z}


def test_fields_on_the_other_side():
    """Both sides have the fields of the whole scene; at its nodes in the plane they are joined."""
    whole = with_reflection(block(), Plane(1, 2.0))
    assert whole.n_points == 3 * 9 * 3
    assert whole.n_cells == 2 * 2 * 4 * 2
    assert whole.volume == pytest.approx(4.0)
    assert whole.extract_surface(algorithm="dataset_surface").area == pytest.approx(2 * (1 + 4 + 4))
    for name, expected in fields(whole.points).items():
        np.testing.assert_allclose(whole.point_data[name], expected, atol=1e-12, err_msg=name)
    assert np.all(whole.compute_cell_sizes().cell_data["Volume"] > 0)


def test_two_planes():
    whole = with_reflection(with_reflection(block(), Plane(1, 2.0)), Plane(0, 0.0))
    assert whole.bounds == pytest.approx((-1, 1, 0, 4, 0, 1))
    assert whole.n_points == 5 * 9 * 3


def test_files_of_a_series(tmp_path):
    """Series with files of the same name, as those of a failed step have, are kept apart."""
    found = []
    mirror = Mirror([Plane(1, 2.0)], tmp_path)
    for number, high in enumerate((1.0, 3.0)):
        file = tmp_path / str(number) / "block_000003.vtu"
        file.parent.mkdir()
        block(high=(high, 2.0, 1.0)).save(file)
        found += mirror.whole([[(0.5, file)]])[0]
    assert [time for time, _ in found] == [0.5, 0.5]
    assert [import_pyvista().read(file).volume for _, file in found] == pytest.approx([4.0, 12.0])


def test_without_planes_files_are_those_of_the_run(tmp_path):
    series = [(0.0, tmp_path / "block_000000.vtu")]
    assert Mirror((), tmp_path).whole([series]) == [series]
    assert Mirror([Plane(1, 0.0)], tmp_path).whole([]) == []  # as of a step that failed, which there may not be


@pytest.mark.parametrize("computed", [1.0, -1.0])
def test_a_rigid_body_across_the_plane(tmp_path, computed):
    """A ball in a flow of which one side was computed, with fields of that side alone: both sides have them."""
    pyvista = import_pyvista()
    flow, ball = block((0, 0, 0), (4, 2.0 * computed, 4)), pyvista.Sphere(radius=0.7, center=(2, -0.3 * computed, 2))
    ball.point_data["traction"] = np.where(ball.points[:, 1:2] * computed >= 0, ball.points, 7e9)
    files = [tmp_path / "flow.vtu", tmp_path / "ball.vtu"]
    for mesh, file in zip((flow, ball), files, strict=True):
        mesh.cast_to_unstructured_grid().save(file)
    folder = tmp_path / "whole"
    folder.mkdir()
    (_, file), (_, drawn) = (part[0] for part in Mirror([Plane(1, 0.0)], folder).whole([[(0.0, f)] for f in files]))
    assert pyvista.read(file).bounds[2:4] == pytest.approx([-2, 2])
    drawn = pyvista.read(drawn)
    assert set(drawn.celltypes) == {5}
    assert drawn.bounds[2:4] == pytest.approx([-0.4, 0.4], abs=5e-3)
    surface = drawn.extract_surface(algorithm="dataset_surface")
    assert surface.n_open_edges == 0
    away = np.abs(drawn.points[:, 1]) > 0.05
    np.testing.assert_allclose(drawn.point_data["traction"][away], drawn.points[away], atol=1e-6)


@pytest.mark.parametrize("shift", [0.0, 0.3, 1.0])
def test_an_outline_with_corners_in_the_plane(tmp_path, shift):
    """One loop that is drawn filled; a corner of the polygon is in the plane, or none."""
    pyvista, angles = import_pyvista(), np.pi * np.arange(12) / 6
    points = np.stack([np.cos(angles), np.sin(angles) + shift, 0 * angles], axis=1)
    ends = np.stack([np.arange(12), (np.arange(12) + 1) % 12], axis=1)
    disc = pyvista.UnstructuredGrid({pyvista.CellType.LINE: ends}, points)
    disc.save(tmp_path / "disc.vtu")
    block((0, 0, 0), (4, 2, 0)).save(tmp_path / "flow.vtu")
    folder = tmp_path / "whole"
    folder.mkdir()
    _, series = Mirror([Plane(1, 0.0)], folder).whole([[(0.0, tmp_path / f"{name}.vtu")] for name in ("flow", "disc")])
    (part,) = load_state([series[0][1]], "velocity")
    assert part.surface.bounds[2:4] == pytest.approx([-1 - shift, 1 + shift])
    assert part.surface.area == pytest.approx(2 * upper_area(points))


def upper_area(points):
    """Area of the part of a convex polygon above y = 0."""
    area = 0.0
    for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
        if max(a[1], b[1]) > 0:
            ends = [p if p[1] >= 0 else p + (q - p) * p[1] / (p[1] - q[1]) for p, q in ((a, b), (b, a))]
            area += 0.5 * (ends[0][0] - ends[1][0]) * (ends[0][1] + ends[1][1])
    return area


@pytest.mark.parametrize(("text", "plane"), [("y=0", Plane(1, 0.0)), (" z = -1.5", Plane(2, -1.5))])
def test_names_of_planes(text, plane):
    assert read_plane(text) == plane


@pytest.mark.parametrize("text", ["y", "y=", "=0", "w=0", "xy=0", "y=nan", "y=middle"])
def test_what_is_no_plane(text):
    with pytest.raises(ValueError, match=f"a plane is an axis and a coordinate, such as y=0, not '{text}'"):
        read_plane(text)


def test_a_part_on_both_sides():
    with pytest.raises(ValueError, match=r"a part lies on both sides of y=0\.5, from 0 to 2"):
        with_reflection(block(), Plane(1, 0.5))
