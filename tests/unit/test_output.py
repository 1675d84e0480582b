"""The fields of a run come back bit for bit, and a killed or resumed run leaves a readable series."""

from __future__ import annotations

import numpy as np
import pytest

from fsci.running.output import FieldWriter, read_collection, write_collection
from solvers.api import Snapshot

#: reference nodes of one cell in VTK order; any points will do, only the order must survive
CELLS = {"quad9": 9, "triangle6": 6, "tetra10": 10, "hexahedron27": 27, "hexahedron": 8, "quad": 4}


def snapshot(name: str, cell_type: str = "quad9", value: float = 1.0) -> Snapshot:
    """One cell with exactly representable but irregular data."""
    nodes = CELLS[cell_type]
    rng = np.random.default_rng(nodes)
    return Snapshot(
        name=name,
        points=rng.random((nodes, 3)),
        cells=np.arange(nodes)[None, ::-1].copy(),
        cell_type=cell_type,
        point_data={"displacement": value * rng.random((nodes, 2)), "pressure": rng.random(nodes)},
        cell_data={"energy": np.array([value])},
    )


@pytest.mark.parametrize("cell_type", CELLS)
def test_a_body_is_read_back_bit_for_bit(tmp_path, cell_type):
    import meshio

    body = snapshot("body", cell_type)
    FieldWriter(tmp_path / "fields").write(7, 0.7, [body])
    mesh = meshio.read(tmp_path / "fields/body_000007.vtu")
    assert np.array_equal(mesh.points, body.points)
    assert [block.type for block in mesh.cells] == [cell_type]
    assert np.array_equal(mesh.cells[0].data, body.cells)
    assert np.array_equal(mesh.point_data["displacement"][:, :2], body.point_data["displacement"])
    assert np.array_equal(mesh.point_data["displacement"][:, 2], np.zeros(len(body.points)))
    assert np.array_equal(mesh.point_data["pressure"], body.point_data["pressure"])
    assert np.array_equal(mesh.cell_data["energy"][0], body.cell_data["energy"])


def test_planar_points_become_spatial(tmp_path):
    import meshio

    flat = Snapshot("flat", np.eye(3)[:, :2], np.array([[0, 1, 2]]), "triangle", {})
    FieldWriter(tmp_path).write(0, 0.0, [flat])
    assert meshio.read(tmp_path / "flat_000000.vtu").points.shape == (3, 3)


def test_each_body_has_its_collection_of_all_times(tmp_path):
    writer = FieldWriter(tmp_path)
    times = [0.0, 0.1, 0.1 + 0.2]
    for step, time in enumerate(times):
        writer.write(step, time, [snapshot("left"), snapshot("right")])
        for name in ("left", "right"):
            series = read_collection(tmp_path / f"{name}.pvd")
            assert [entry for entry, _ in series] == times[: step + 1]
            assert all(path.exists() for _, path in series)
    assert not list(tmp_path.glob("*.tmp"))


def test_paraview_reads_the_collection(tmp_path):
    import pyvista

    writer = FieldWriter(tmp_path)
    writer.write(1, 0.5, [snapshot("body", value=1.0)])
    writer.write(2, 1.0, [snapshot("body", value=2.0)])
    reader = pyvista.get_reader(tmp_path / "body.pvd")
    assert reader.time_values == [0.5, 1.0]
    reader.set_active_time_value(1.0)
    assert reader.read()[0].cell_data["energy"][0] == 2.0


def test_a_write_that_breaks_leaves_the_collection_as_it_was(tmp_path, monkeypatch):
    import meshio

    writer = FieldWriter(tmp_path)
    writer.write(1, 0.1, [snapshot("body")])

    def killed(path, *arguments, **options):
        path.write_bytes(b"<VTKFile")
        raise KeyboardInterrupt

    monkeypatch.setattr(meshio, "write", killed)
    with pytest.raises(KeyboardInterrupt):
        writer.write(2, 0.2, [snapshot("body")])
    ((time, path),) = read_collection(tmp_path / "body.pvd")
    assert time == 0.1
    assert len(meshio.read(path).points) == 9


def test_resume_drops_what_is_later(tmp_path):
    first = FieldWriter(tmp_path)
    for step in range(1, 5):
        first.write(step, 0.1 * step, [snapshot("body")])
    second = FieldWriter.resume(tmp_path, 0.1 * 2)
    assert not (tmp_path / "body_000004.vtu").exists()
    second.write(5, 0.25, [snapshot("body")])
    series = read_collection(tmp_path / "body.pvd")
    assert [time for time, _ in series] == [0.1, 0.2, 0.25]
    assert [path.name for _, path in series] == ["body_000001.vtu", "body_000002.vtu", "body_000005.vtu"]


def test_names_survive_xml(tmp_path):
    path = tmp_path / 'a&b<"c>.pvd'
    write_collection(path, [(1e-300, tmp_path / 'a&b<"c>_000001.vtu')])
    assert read_collection(path) == [(1e-300, tmp_path / 'a&b<"c>_000001.vtu')]
