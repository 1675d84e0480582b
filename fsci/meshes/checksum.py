"""The checksum of a mesh, by which a resumed run knows that its mesh is the one of the checkpoint."""

from __future__ import annotations

import zlib

import numpy as np

from solvers.mesh.mesh import Mesh

#: Binary digits of coordinates that count, relative to the size of the mesh: rounding differs between computers.
DIGITS = 26

#: Keeps coordinates that are round numbers away from where one digit becomes another.
SHIFT = 0.381966


def mesh_checksum(mesh: Mesh) -> str:
    """Numbers of nodes and cells, and a checksum of the positions, to eight decimal digits, and of the cells."""
    size = float(np.ptp(mesh.points, axis=0).max())
    unit = 2.0 ** (np.floor(np.log2(size) + SHIFT) - DIGITS)
    digits = np.floor(mesh.points / unit + SHIFT).astype(np.int64)
    cells = np.ascontiguousarray(mesh.cells, dtype=np.int64)
    code = zlib.crc32(cells.tobytes(), zlib.crc32(digits.tobytes(), zlib.crc32(mesh.cell_type.encode())))
    return f"{len(mesh.points)} nodes, {len(cells)} cells, checksum {code:08x}"
