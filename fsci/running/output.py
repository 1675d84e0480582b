"""The fields of a run for ParaView: one VTU file per body and output time, one PVD collection per body."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fsci.running.files import make_folder, refused, replacing, write_text
from solvers.api import Snapshot

Series = list[tuple[float, Path]]  #: (time, VTU file) of each output, in order of time


class FieldWriter:
    """Writes the snapshots of a run into `folder` as <body>_<step>.vtu, and keeps <body>.pvd up to date.

    What else `FORMATS` has stands beside it.

    A file gets its name only when it is complete, and a collection lists only such files: what a killed run
    leaves is readable.
    """

    def __init__(self, folder: Path):
        self.folder = Path(folder)
        make_folder(self.folder)
        self.series: dict[str, Series] = {}
        self._lines: dict[str, list[str]] = {}  # of the collections: made once, they are written at every output

    @classmethod
    def resume(cls, folder: Path, time: float) -> FieldWriter:
        """Continues the collections in `folder` after a restart at `time`; later outputs are removed."""
        writer = cls(folder)
        for listed in sorted(writer.folder.glob("*.pvd")):
            entries = read_collection(listed)
            kept = [entry for entry in entries if entry[0] <= time]
            writer.series[listed.stem] = kept
            writer._lines[listed.stem] = [data_set(*entry) for entry in kept]
            write_collection(listed, kept)
            for later, path in entries:
                if later > time:  # `read_collection` knows it to be an output in this folder
                    for suffix in FORMATS:
                        path.with_suffix(suffix).unlink(missing_ok=True)
        return writer

    def write(self, step: int, time: float, snapshots: Sequence[Snapshot]) -> None:
        """Adds the fields of all bodies at one time."""
        for snapshot in snapshots:
            path = self.folder / f"{snapshot.name}_{step:06d}.vtu"
            for suffix, write in FORMATS.items():
                write(path.with_suffix(suffix), snapshot)
            self.series.setdefault(snapshot.name, []).append((time, path))
            lines = self._lines.setdefault(snapshot.name, [])
            lines.append(data_set(time, path))
            write_text(self.folder / f"{snapshot.name}.pvd", collection(lines))


def write_vtu(path: Path, snapshot: Snapshot) -> None:
    """Writes one body: compressed binary, displaced points, 2D vectors padded to three components.

    50,000 nodes with two vector fields: 0.19 s and 5 MB; uncompressed 0.08 s and 10 MB, but slower to read.
    """
    import meshio

    mesh = meshio.Mesh(
        pad(snapshot.points),
        [(snapshot.cell_type, np.asarray(snapshot.cells))],
        point_data={name: pad(values) for name, values in snapshot.point_data.items()},
        cell_data={name: [pad(values)] for name, values in snapshot.cell_data.items()},
    )
    with replacing(path) as unfinished:
        meshio.write(unfinished, mesh, file_format="vtu", binary=True, compression="zlib")


#: End of the names of files -> function that writes one body. Each run writes all of them.
FORMATS: Mapping[str, Callable[[Path, Snapshot], None]] = {".vtu": write_vtu}


def write_collection(path: Path, series: Series) -> None:
    """Writes a ParaView collection; the files stand in the folder of `path`."""
    write_text(path, collection([data_set(*entry) for entry in series]))


def data_set(time: float, file: Path) -> str:
    """The line of a ParaView collection for one file."""
    return f'    <DataSet timestep="{float(time)!r}" part="0" file={quoteattr(file.name)} />\n'


def collection(lines: Sequence[str]) -> str:
    """The text of a ParaView collection."""
    begin = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
    return begin + "".join(lines) + "  </Collection>\n</VTKFile>\n"


def read_collection(path: Path) -> Series:
    """Reads a ParaView collection. Raises CaseError if it names a file that no run has written beside it."""
    try:
        entries = [(float(entry.attrib["timestep"]), entry.attrib["file"]) for entry in ET.parse(path).iter("DataSet")]
    except (ET.ParseError, KeyError, ValueError):
        raise refused(path, "is not a list of outputs as runs write them: remove it") from None
    for _, name in entries:
        if not is_output_of(path.stem, name):
            own = f"a run lists only its own files here, {path.stem}_000001.vtu and so on"
            raise refused(path, f"names the file '{name}': {own}; remove this line, or the whole file")
    return [(time, path.parent / name) for time, name in entries]


def is_output_of(part: str, name: str, formats: Iterable[str] = (".vtu",)) -> bool:
    """Whether this is the name of a file that `FieldWriter` writes for a body or the fluid in one of the formats."""
    return re.fullmatch(rf"{re.escape(part)}_\d{{6,}}({'|'.join(map(re.escape, formats))})", name) is not None


def pad(values: ArrayLike) -> NDArray[np.float64]:
    """Vectors of two components, shape (n, 2), get a third that is zero; other shapes pass."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim == 2 and array.shape[1] == 2:
        return np.column_stack([array, np.zeros(len(array))])
    return array
