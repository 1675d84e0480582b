"""One file of fields for a run: VTK reads what was written, and a resumed run leaves what an uninterrupted one does."""

import numpy as np
import pytest
from small_cases import PLATE

import fsci
from fsci.case import CaseError
from fsci.cli import execute
from fsci.plot.render import import_pyvista
from fsci.running.output import write_vtu
from fsci.running.results import read_results
from fsci.running.vtkhdf import VTKHDF_FILE, VtkHdfWriter, read_step, read_times
from solvers.api import Snapshot

NODES = {"line": 2, "triangle": 3, "quad": 4, "quad9": 9, "triangle6": 6, "tetra": 4, "tetra10": 10, "hexahedron": 8,
         "hexahedron27": 27}  # fmt: skip


def part(name, cell_type="quad", value=0.0, **more):
    """Two cells with irregular data; only fields depend on the value."""
    count = NODES[cell_type]
    rng = np.random.default_rng(count)
    fields = {"displacement": value + rng.random((2 * count, 3)), "pressure": value * rng.random(2 * count), **more}
    cells = np.arange(2 * count).reshape(2, count)[:, ::-1].copy()
    return Snapshot(name, rng.random((2 * count, 3)), cells, cell_type, fields, {"energy": value + np.arange(2.0)})


def read_by_vtk(path):
    """At each time: name of a part -> mesh."""
    from vtkmodules.vtkIOHDF import vtkHDFReader

    pyvista = import_pyvista()
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    found = []
    for number in range(reader.GetNumberOfSteps()):
        reader.SetStep(number)
        reader.Update()
        parts = reader.GetOutputDataObject(0)
        indices = range(parts.GetNumberOfPartitionedDataSets())
        names = [parts.GetMetaData(i).Get(parts.NAME()) for i in indices]
        meshes = (pyvista.wrap(parts.GetPartition(i, 0)).copy() for i in indices)
        found.append(dict(zip(names, meshes, strict=True)))
    return found


def test_vtk_reads_every_type_of_cells_as_from_vtu(tmp_path):
    parts = [part(name, name) for name in NODES]
    VtkHdfWriter(tmp_path / "fields").write(0, 0.0, parts)
    (found,) = read_by_vtk(tmp_path / "fields" / VTKHDF_FILE)
    assert list(found) == list(NODES)
    for snapshot in parts:
        write_vtu(tmp_path / "one.vtu", snapshot)
        expected, mesh = import_pyvista().read(tmp_path / "one.vtu"), found[snapshot.name]
        assert np.array_equal(mesh.points, expected.points)
        assert np.array_equal(mesh.celltypes, expected.celltypes)
        assert np.array_equal(mesh.cells, expected.cells)
        for name in ("displacement", "pressure"):
            assert np.array_equal(mesh.point_data[name], expected.point_data[name])
        assert np.array_equal(mesh.cell_data["energy"], expected.cell_data["energy"])


def states():
    """A part of which only fields change, one that changes its cells, one that comes later and goes, a later field."""
    return [
        [part("still"), part("other", "quad")],
        [part("still", value=1.0), part("other", "triangle", 1.0), part("guest", "line", 1.0)],
        [part("still", value=2.0, gap=np.arange(8.0)), part("other", "triangle", 2.0)],
        [part("still", value=3.0), part("other", "quad", 3.0), part("guest", "line", 3.0)],
    ]


def write(writer, numbers):
    for number in numbers:
        writer.write(number, 0.5 * number, states()[number])


def test_what_changes_between_outputs(tmp_path):
    write(VtkHdfWriter(tmp_path), range(4))
    path = tmp_path / VTKHDF_FILE
    assert read_times(path) == [0.0, 0.5, 1.0, 1.5]
    for number, (by_vtk, expected) in enumerate(zip(read_by_vtk(path), states(), strict=True)):
        parts = {snapshot.name: snapshot for snapshot in read_step(path, number)}
        assert set(parts) == {snapshot.name for snapshot in expected}
        for snapshot in expected:
            mesh, found = by_vtk[snapshot.name], parts[snapshot.name]
            assert np.array_equal(mesh.points, snapshot.points)
            assert np.array_equal(mesh.cells.reshape(2, -1)[:, 1:], snapshot.cells)
            assert np.array_equal(found.cells, snapshot.cells)
            assert found.cell_type == snapshot.cell_type
            for name, values in snapshot.point_data.items():
                assert np.array_equal(mesh.point_data[name], values)
                assert np.array_equal(found.point_data[name], values)
            assert np.array_equal(found.cell_data["energy"], snapshot.cell_data["energy"])
        gap = by_vtk["still"].point_data["gap"]
        assert np.array_equal(gap, np.arange(8.0)) if number == 2 else np.isnan(gap).all()
        assert by_vtk["guest"].n_cells == (2 if number in (1, 3) else 0)
    arrays = contents(path)
    assert len(arrays["still/Points"]) == 8, "what stays is written once"
    assert len(arrays["still/Types"]) == 2
    assert len(arrays["still/PointData/displacement"]) == 4 * 8


def contents(path):
    import h5py

    found = {}
    with h5py.File(path) as file:
        file["VTKHDF"].visititems(
            lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None
        )
    return found


@pytest.mark.parametrize(
    "last", [0, pytest.param(1, marks=pytest.mark.slow), 2, pytest.param(3, marks=pytest.mark.slow)]
)
def test_a_resumed_run_leaves_the_same_numbers(tmp_path, last):
    write(VtkHdfWriter(tmp_path / "whole"), range(4))
    write(VtkHdfWriter(tmp_path / "resumed"), range(4))
    write(VtkHdfWriter.resume(tmp_path / "resumed", 0.5 * last), range(last + 1, 4))
    whole, resumed = (tmp_path / name / VTKHDF_FILE for name in ("whole", "resumed"))
    assert read_times(resumed) == read_times(whole)
    for number in range(4):
        for a, b in zip(read_step(whole, number), read_step(resumed, number), strict=True):
            assert np.array_equal(a.points, b.points)
            assert np.array_equal(a.cells, b.cells)
            assert all(
                np.array_equal(values, b.point_data[name], equal_nan=True) for name, values in a.point_data.items()
            )
    if last:  # no part begins after it
        first, second = contents(whole), contents(resumed)
        assert set(first) == set(second)
        names = [name for name in first if "gap" not in name]
        assert all(np.array_equal(first[name], second[name], equal_nan=True) for name in names)
    assert [list(parts) for parts in read_by_vtk(resumed)] == [["still", "other", "guest"]] * 4


def test_a_file_that_cannot_be_read(tmp_path):
    (tmp_path / VTKHDF_FILE).write_bytes(b"no HDF5")
    with pytest.raises(CaseError, match=r"fields\.vtkhdf: cannot be read, as after a run that was killed: remove it"):
        VtkHdfWriter.resume(tmp_path, 1.0)
    (tmp_path / VTKHDF_FILE).unlink()
    (tmp_path / VTKHDF_FILE).symlink_to(tmp_path / "elsewhere")
    for start in (VtkHdfWriter, lambda folder: VtkHdfWriter.resume(folder, 1.0)):
        with pytest.raises(CaseError, match="is not a plain file: remove it"):
            start(tmp_path)


def test_a_run_with_one_file_is_read_drawn_and_resumed(tmp_path, capsys):
    (tmp_path / "case.yaml").write_text(PLATE + "output: {format: vtkhdf}\n")
    out = tmp_path / "out"
    assert execute(["run", str(tmp_path), "-o", str(out), "--set", "time.end=0.6"]) == 0
    assert [path.name for path in (out / "fields").iterdir()] == [VTKHDF_FILE]
    assert execute(["resume", str(out), "--set", "time.end=1"]) == 0
    results = read_results(out)
    assert read_times(out / "fields" / VTKHDF_FILE) == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
    steps = fsci.build(fsci.load(tmp_path))
    for _ in range(5):
        steps.take()
    expected = steps.fields()["plate"].point_data
    assert np.array_equal(results.fields()["plate"].point_data["displacement"], expected["displacement"])
    assert results.fields(0.41)["plate"].n_points == 9
    capsys.readouterr()
    assert execute(["plot", str(out), "--time", "0.4"]) == 0
    assert capsys.readouterr().out == f"{out / 'pictures' / 'displacement_0.4.png'}\n"
    assert execute(["resume", str(out), "--set", "time.end=2", "--set", "output.format=vtu"]) == 2
    assert (
        "output.format was vtkhdf, is vtu: it cannot change when a run is resumed, the outputs so far have it"
        in capsys.readouterr().err
    )
    assert execute(["run", str(tmp_path), "-o", str(out), "--set", "output.format=vtu"]) == 0
    assert not (out / "fields" / VTKHDF_FILE).exists()
