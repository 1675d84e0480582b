"""The values of a PETSc matrix of dense blocks where they are: petsc4py has no name for that."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import kernels
from solvers.api import Array


@dataclass(frozen=True)
class BlockRows:
    """Owned rows of blocks of a matrix on one process."""

    start: NDArray[np.int32]
    columns: NDArray[np.int32]
    values: Array  #: of the matrix itself, shape (blocks, n, n), each transposed


@dataclass(frozen=True)
class SharedBlockRows:
    """Owned rows of blocks of a matrix on several processes."""

    own: BlockRows  #: in columns of this process
    others: BlockRows  #: in columns of others: column k is `ghosts[k]`
    ghosts: NDArray[np.int32]  #: numbers of columns of blocks


def block_rows(matrix: PETSc.Mat) -> BlockRows | None:
    """A view of a matrix of the type seqbaij; None of any other, or if PETSc's functions are not found."""
    if matrix.getType() != PETSc.Mat.Type.SEQBAIJ or not _available():
        return None
    return _rows(ctypes.c_void_p(matrix.handle), matrix.getBlockSize())


def shared_block_rows(matrix: PETSc.Mat) -> SharedBlockRows | None:
    """A view of a matrix of the type seqbaij or mpibaij; None of any other, or if PETSc's functions are not found."""
    if not _available():
        return None
    if (own := block_rows(matrix)) is not None:
        size = own.values.shape[1]
        nothing = BlockRows(np.zeros_like(own.start), np.empty(0, np.int32), np.empty((0, size, size)))
        return SharedBlockRows(own, nothing, np.empty(0, np.int32))
    if matrix.getType() != PETSc.Mat.Type.MPIBAIJ:
        return None
    parts, ghosts = (ctypes.c_void_p(), ctypes.c_void_p()), ctypes.POINTER(ctypes.c_int32)()
    references = [ctypes.byref(place) for place in (*parts, ghosts)]
    if _library().MatMPIBAIJGetSeqBAIJ(ctypes.c_void_p(matrix.handle), *references) != 0:
        return None
    own, others = (_rows(part, matrix.getBlockSize()) for part in parts)
    if own is None or others is None:
        return None
    return SharedBlockRows(own, others, _array(ghosts, (int(others.columns.max(initial=-1)) + 1,)))


def quick_to_multiply(matrix: PETSc.Mat) -> PETSc.Mat:
    """Let a matrix multiply vectors row by row: PETSc's way for rows of one pattern takes up to 3 times as long."""
    matrix.setOption(PETSc.Mat.Option.USE_INODES, False)
    return matrix


def has_entries_of(matrix: PETSc.Mat, *parts: BlockRows) -> bool:
    """Whether an assembled matrix of the type seqaij has as many entries as full blocks."""
    entries = sum(rows.values.size for rows in parts)
    return matrix.getType() == PETSc.Mat.Type.SEQAIJ and int(matrix.getInfo()["nz_used"]) == entries


def write_entries(matrix: PETSc.Mat, *parts: BlockRows, factor: float = 1.0) -> None:
    """Set the entries of a matrix with the pattern of full blocks, or of several such ones on its diagonal."""
    with _entries(matrix) as entries:
        ends = np.cumsum([rows.values.size for rows in parts])
        for rows, part in zip(parts, np.split(entries, ends[:-1]), strict=True):
            kernels.spread_blocks(rows.start, rows.values, part, factor)


def join_entries(matrices: Sequence[PETSc.Mat], out: PETSc.Mat) -> bool:
    """Set the entries of diag(matrices). False unless all are of the type seqaij and `out` has as many entries."""
    together = (*matrices, out)
    if any(matrix.getType() != PETSc.Mat.Type.SEQAIJ for matrix in together) or not _available():
        return False
    counts = [int(matrix.getInfo()["nz_used"]) for matrix in together]
    if sum(counts[:-1]) != counts[-1]:
        return False
    with _entries(out) as entries:
        for matrix, part in zip(matrices, np.split(entries, np.cumsum(counts[:-2])), strict=True):
            with _entries(matrix) as own:
                part[:] = own
    return True


def entry_rows(matrix: PETSc.Mat) -> tuple[NDArray[np.int32], NDArray[np.int32], Array]:
    """(start, columns, values) of the owned rows; views of the matrix, not to be changed, if its type is seqaij."""
    if matrix.getType() != PETSc.Mat.Type.SEQAIJ or not _available():
        return matrix.getValuesCSR()
    handle, values = ctypes.c_void_p(matrix.handle), ctypes.POINTER(ctypes.c_double)()
    rows = _row_pointers(handle, blocks=False)
    if rows is None or _library().MatSeqAIJGetArrayRead(handle, ctypes.byref(values)) != 0:
        return matrix.getValuesCSR()
    found = (*rows, _array(values, rows[1].shape))
    _library().MatSeqAIJRestoreArrayRead(handle, ctypes.byref(values))  # sets the pointer to zero
    return found


@contextmanager
def _entries(matrix: PETSc.Mat) -> Iterator[Array]:
    """A view of the entries of an assembled matrix of the type seqaij; PETSc notes that they may have changed."""
    handle, values = ctypes.c_void_p(matrix.handle), ctypes.POINTER(ctypes.c_double)()
    if code := _library().MatSeqAIJGetArray(handle, ctypes.byref(values)):
        raise PETSc.Error(code)
    yield _array(values, (int(matrix.getInfo()["nz_used"]),))
    _library().MatSeqAIJRestoreArray(handle, ctypes.byref(values))


def _rows(handle: ctypes.c_void_p, size: int) -> BlockRows | None:
    """A view of a matrix of the type seqbaij."""
    rows, values = _row_pointers(handle, blocks=True), ctypes.POINTER(ctypes.c_double)()
    if rows is None or _library().MatSeqBAIJGetArray(handle, ctypes.byref(values)) != 0:
        return None
    found = BlockRows(*rows, _array(values, (len(rows[1]), size, size)))
    _library().MatSeqBAIJRestoreArray(handle, ctypes.byref(values))
    return found


def _row_pointers(handle: ctypes.c_void_p, *, blocks: bool) -> tuple[NDArray[np.int32], NDArray[np.int32]] | None:
    """Views of (start, columns) of a matrix on one process; blocks: count rows and columns of blocks."""
    library, count, done = _library(), ctypes.c_int32(), ctypes.c_int()
    start, columns = ctypes.POINTER(ctypes.c_int32)(), ctypes.POINTER(ctypes.c_int32)()
    places = [ctypes.byref(place) for place in (count, start, columns, done)]
    if library.MatGetRowIJ(handle, 0, 0, int(blocks), *places) != 0 or not done.value:
        return None
    starts = _array(start, (count.value + 1,))
    found = starts, _array(columns, (int(starts[-1]),))
    library.MatRestoreRowIJ(handle, 0, 0, int(blocks), *places)  # sets the pointers to zero
    return found


def _array(pointer: Any, shape: tuple[int, ...]) -> NDArray:
    return np.ctypeslib.as_array(pointer, shape) if pointer else np.empty(shape, pointer._type_)


def _available() -> bool:
    return _library() is not None and PETSc.IntType == np.int32


@cache
def _library() -> Any:
    """PETSc as petsc4py has loaded it."""
    try:
        library = ctypes.CDLL(PETSc.__file__)
        for name, places in (
            ("MatSeqAIJGetArray", 1),
            ("MatSeqAIJRestoreArray", 1),
            ("MatSeqAIJGetArrayRead", 1),
            ("MatSeqAIJRestoreArrayRead", 1),
            ("MatSeqBAIJGetArray", 1),
            ("MatSeqBAIJRestoreArray", 1),
            ("MatMPIBAIJGetSeqBAIJ", 3),
        ):
            function = getattr(library, name)
            function.restype, function.argtypes = ctypes.c_int, [ctypes.c_void_p] * (1 + places)
        for name in ("MatGetRowIJ", "MatRestoreRowIJ"):
            function = getattr(library, name)
            function.restype = ctypes.c_int
            function.argtypes = [ctypes.c_void_p, *[ctypes.c_int] * 3, *[ctypes.c_void_p] * 4]
    except (OSError, AttributeError):
        return None
    return library
