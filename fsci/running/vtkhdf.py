"""The fields of a run in one file, a series in time: VTKHDF, which ParaView and VTK read from 5.13 and 9.4 on.

The file is a collection of the parts of the run: bodies, flow, obstacles. Of each part arrays of all outputs follow one
another, and `Steps` has where those of an output begin. What is the same as at the output before is not written
again. A part that is not there at an output has no points then, and a field that is not there is nan.
Source: VTK, "VTKHDF File Format", https://docs.vtk.org.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.running.files import make_folder, refused
from fsci.running.output import Series, pad, write_vtu
from solvers.api import Snapshot

VTKHDF_FILE = "fields.vtkhdf"  #: of the file
VTKHDF_VERSION = (2, 3)  #: of the format
ROWS_OF_CHUNK = 1 << 15  #: rows that are compressed together
MESH_COUNTS = ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")  #: of each different mesh
#: where an output begins -> shape of an entry
OUTPUT_OFFSETS: dict[str, tuple[int, ...]] = {
    "PartOffsets": (),
    "NumberOfParts": (),
    "PointOffsets": (),
    "CellOffsets": (1,),
    "ConnectivityIdOffsets": (1,),
}

Root = Any  #: a group of h5py


class VtkHdfWriter:
    """Writes the snapshots of a run into folder/fields.vtkhdf, which is closed, hence readable, between outputs."""

    def __init__(self, folder: Path):
        self.path = Path(folder) / VTKHDF_FILE
        make_folder(Path(folder))
        if self.path.is_symlink() or (self.path.exists() and not self.path.is_file()):
            raise refused(self.path, "is not a plain file: remove it")
        self.path.unlink(missing_ok=True)

    @classmethod
    def resume(cls, folder: Path, time: float) -> VtkHdfWriter:
        """Continues the file in `folder` after a restart at `time`; later outputs are removed.

        Raises CaseError if the file cannot be read, as after a run that was killed while it wrote.
        """
        writer = cls.__new__(cls)
        writer.path = Path(folder) / VTKHDF_FILE
        make_folder(Path(folder))
        if writer.path.is_file() and not writer.path.is_symlink():
            with opened(writer.path, "r+") as file:
                _forget(file["VTKHDF"], sum(at <= time for at in times_of(file["VTKHDF"])))
        elif writer.path.exists() or writer.path.is_symlink():
            raise refused(writer.path, "is not a plain file: remove it")
        return writer

    def write(self, step: int, time: float, snapshots: Sequence[Snapshot]) -> None:
        """Adds the fields of all parts at one time."""
        with opened(self.path, "a") as file:
            if "VTKHDF" not in file:
                _begin(file.create_group("VTKHDF", track_order=True), "PartitionedDataSetCollection")
                file["VTKHDF"].create_group("Assembly", track_order=True)
            root = file["VTKHDF"]
            earlier = times_of(root)
            for snapshot in snapshots:
                if snapshot.name not in root:
                    _new_part(root, snapshot.name, earlier)
            there = {snapshot.name: snapshot for snapshot in snapshots}
            for name in part_names(root):
                _append_part(root[name], time, there.get(name))


def opened(path: Path, mode: str) -> Any:
    """The file as h5py has it. Raises CaseError if it is no such file."""
    import h5py

    try:
        return h5py.File(path, mode)
    except OSError as error:
        if not path.is_file() or not path.stat().st_size:
            raise
        raise refused(path, f"cannot be read, as after a run that was killed: remove it ({error})") from None


def part_names(root: Root) -> list[str]:
    """The parts, in the order in which they were first written."""
    parts = [name for name in root if "Index" in root[name].attrs]
    return sorted(parts, key=lambda name: int(root[name].attrs["Index"]))


def times_of(root: Root) -> list[float]:
    """The times of all outputs, which every part has."""
    return [float(time) for name in part_names(root)[:1] for time in root[name]["Steps/Values"][:]]


def read_times(path: Path) -> list[float]:
    """The times of all outputs."""
    with opened(path, "r") as file:
        return times_of(file["VTKHDF"])


def read_step(path: Path, number: int) -> list[Snapshot]:
    """The parts of one output, as they were written."""
    from meshio import _vtk_common as vtk

    found = []
    with opened(path, "r") as file:
        root = file["VTKHDF"]
        for name in part_names(root):
            part, steps = root[name], root[name]["Steps"]
            nodes, count, ids = (int(part[name][steps["PartOffsets"][number]]) for name in MESH_COUNTS)
            points = _rows(part["Points"], steps["PointOffsets"][number], nodes)
            if not len(points):
                continue
            cell, first = int(steps["CellOffsets"][number, 0]), int(steps["ConnectivityIdOffsets"][number, 0])
            kind = vtk.vtk_to_meshio_type[int(part["Types"][cell])]
            cells = part["Connectivity"][first : first + ids].reshape(count, -1)
            data = {
                where: {
                    field: _rows(values, steps[f"{where}Offsets"][field][number], rows)
                    for field, values in part[where].items()
                }
                for where, rows in (("PointData", len(points)), ("CellData", count))
            }
            found.append(Snapshot(name, points, cells, kind, data["PointData"], data["CellData"]))
    return found


def unpack(path: Path, folder: Path) -> list[Series]:
    """VTU files of all outputs, written into a folder: a series for each part."""
    found: dict[str, Series] = {}
    for number, time in enumerate(read_times(path)):
        for snapshot in read_step(path, number):
            file = folder / f"{snapshot.name}_{number:06d}.vtu"
            write_vtu(file, snapshot)
            found.setdefault(snapshot.name, []).append((time, file))
    return list(found.values())


# ------------------------------------------------------------------------------------------------------- structure


def _begin(group: Root, kind: str) -> None:
    group.attrs["Version"] = np.array(VTKHDF_VERSION, dtype=np.int64)
    group.attrs.create("Type", kind.encode("ascii"), dtype=f"S{len(kind)}")


def _begin_steps(group: Root) -> Root:
    steps = group.create_group("Steps", track_order=True)
    steps.attrs["NSteps"] = np.int64(0)
    _empty(steps, "Values", (), np.float64)
    return steps


def _new_part(root: Root, name: str, earlier: Sequence[float]) -> None:
    """A part that is first written after these times, at which it has no points."""
    import h5py

    number = len(part_names(root))
    part = root.create_group(name, track_order=True)
    part.attrs["Index"] = np.int64(number)
    _begin(part, "UnstructuredGrid")
    for count in MESH_COUNTS:
        _empty(part, count, (), np.int64)
    _empty(part, "Points", (3,), np.float64)
    _empty(part, "Connectivity", (), np.int64)
    _empty(part, "Offsets", (), np.int64)
    _empty(part, "Types", (), np.uint8)
    steps = _begin_steps(part)
    for offsets, shape in OUTPUT_OFFSETS.items():
        _empty(steps, offsets, shape, np.int64)
    for where in ("PointData", "CellData"):
        part.create_group(where, track_order=True)
        steps.create_group(f"{where}Offsets", track_order=True)
    root["Assembly"].create_group(name, track_order=True)[name] = h5py.SoftLink(f"/VTKHDF/{name}")
    for time in earlier:
        _append_part(part, time, None)


def _empty(group: Root, name: str, shape: tuple[int, ...], dtype: Any) -> Any:
    large = name in ("Points", "Connectivity", "Types") or group.name.endswith("Data")
    packed: dict[str, Any] = {"compression": "gzip", "compression_opts": 4, "shuffle": True} if large else {}
    rows = ROWS_OF_CHUNK if large else 1024
    return group.create_dataset(
        name, shape=(0, *shape), maxshape=(None, *shape), dtype=dtype, chunks=(rows, *shape), **packed
    )


# --------------------------------------------------------------------------------------------------------- outputs


def _append_part(part: Root, time: float, snapshot: Snapshot | None) -> None:
    """One more output of a part; None: it is not there."""
    from meshio import _vtk_common as vtk

    points = np.zeros((0, 3)) if snapshot is None else pad(snapshot.points)
    cells = np.zeros((0, 1), dtype=np.int64) if snapshot is None else np.asarray(snapshot.cells, dtype=np.int64)
    steps, counts = part["Steps"], (len(points), len(cells), cells.size)
    known = len(part["NumberOfPoints"]) > 0 and counts == tuple(int(part[name][-1]) for name in MESH_COUNTS)
    if not known or not _same(part["Connectivity"], len(part["Connectivity"]) - cells.size, cells.ravel()):
        kind = 1 if snapshot is None else vtk.meshio_to_vtk_type[snapshot.cell_type]
        for name, count in zip(MESH_COUNTS, counts, strict=True):
            _append(part[name], np.array([count]))
        _append(part["Connectivity"], cells.ravel())
        _append(part["Types"], np.full(len(cells), kind, dtype=np.uint8))
        _append(part["Offsets"], np.arange(len(cells) + 1) * cells.shape[1])
    first = _place(part["Points"], points, steps["PointOffsets"])
    places = {
        "PartOffsets": len(part["NumberOfPoints"]) - 1,
        "NumberOfParts": 1,
        "PointOffsets": first,
        "CellOffsets": len(part["Types"]) - len(cells),
        "ConnectivityIdOffsets": len(part["Connectivity"]) - cells.size,
    }
    for name, place in places.items():
        _append(steps[name], np.full((1, *OUTPUT_OFFSETS[name]), place))
    for where, given in (
        ("PointData", snapshot and snapshot.point_data),
        ("CellData", snapshot and snapshot.cell_data),
    ):
        _append_fields(part, where, given or {}, len(points) if where == "PointData" else len(cells))
    _append(steps["Values"], np.array([time]))
    steps.attrs["NSteps"] = np.int64(len(steps["Values"]))


def _append_fields(part: Root, where: str, given: Mapping[str, Any], count: int) -> None:
    data, offsets = part[where], part[f"Steps/{where}Offsets"]
    most = int(part["NumberOfPoints" if where == "PointData" else "NumberOfCells"][:].max())
    for name, values in given.items():
        if name not in data:
            shape, earlier = pad(values).shape[1:], len(part["Steps/Values"])
            missing = np.full((most if earlier else 0, *shape), np.nan)
            _append(_empty(data, name, shape, np.float64), missing)
            _append(_empty(offsets, name, (), np.int64), np.zeros(earlier, dtype=np.int64))
    for name, written in data.items():
        values = pad(given[name]) if name in given else np.full((count, *written.shape[1:]), np.nan)
        _append(offsets[name], np.array([_place(written, values, offsets[name])]))


def _place(written: Any, values: NDArray[Any], offsets: Any) -> int:
    """Where values are that were appended, or that are those of the output before."""
    if len(offsets) and _same(written, int(offsets[-1]), values):
        return int(offsets[-1])
    first = len(written)
    _append(written, values)
    return first


def _same(written: Any, first: int, values: NDArray[Any]) -> bool:
    if first < 0 or first + len(values) > len(written):
        return False
    return bool(np.array_equal(written[first : first + len(values)], values))


def _append(dataset: Any, values: NDArray[Any]) -> None:
    count = len(dataset)
    dataset.resize(count + len(values), axis=0)
    if len(values):
        dataset[count:] = values


def _rows(dataset: Any, first: Any, count: Any) -> NDArray[np.float64]:
    return np.asarray(dataset[int(first) : int(first) + int(count)], dtype=np.float64)


def _forget(root: Root, count: int) -> None:
    """Keep the first `count` outputs; of parts and fields that began later there is nothing left but their names."""
    for name in part_names(root):
        part, steps = root[name], root[name]["Steps"]
        mesh = int(steps["PartOffsets"][:count].max(initial=-1))
        points, cells, ids = (part[name][: mesh + 1] for name in MESH_COUNTS)
        ends = {**dict.fromkeys(MESH_COUNTS, mesh + 1), "Types": int(cells.sum()), "Connectivity": int(ids.sum())}
        ends["Offsets"] = ends["Types"] + mesh + 1
        of_output = steps["PartOffsets"][:count]
        ends["Points"] = _end(steps["PointOffsets"], points[of_output])
        for where, rows in (("PointData", points), ("CellData", cells)):
            for field, offsets in steps[f"{where}Offsets"].items():
                ends[f"{where}/{field}"] = _end(offsets, rows[of_output])
                offsets.resize(count, axis=0)
        for dataset, end in ends.items():
            part[dataset].resize(end, axis=0)
        for dataset in (*OUTPUT_OFFSETS, "Values"):
            steps[dataset].resize(count, axis=0)
        steps.attrs["NSteps"] = np.int64(count)


def _end(offsets: Any, counts: NDArray[np.int64]) -> int:
    """Rows that the first outputs need, with these numbers of rows."""
    return int((offsets[: len(counts)] + counts).max(initial=0))
