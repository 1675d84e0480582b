"""The values of a PETSc matrix of dense blocks where they are: petsc4py has no name for that."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array


@dataclass(frozen=True)
class BlockRows:
    """Owned rows of blocks of a matrix on one process."""

    start: NDArray[np.int32]
    columns: NDArray[np.int32]
    values: Array  #: of the matrix itself, shape (blocks, n, n), each transposed


def block_rows(matrix: PETSc.Mat) -> BlockRows | None:
    """A view of a matrix of the type seqbaij; None of any other, or if PETSc's functions are not found."""
    library = _library()
    if matrix.getType() != PETSc.Mat.Type.SEQBAIJ or library is None or PETSc.IntType != np.int32:
        return None
    start, columns = matrix.getRowIJ(compressed=True)
    pointer, size = ctypes.POINTER(ctypes.c_double)(), matrix.getBlockSize()
    handle = ctypes.c_void_p(matrix.handle)
    if library.MatSeqBAIJGetArray(handle, ctypes.byref(pointer)) != 0:
        return None
    values = np.ctypeslib.as_array(pointer, shape=(len(columns), size, size))
    library.MatSeqBAIJRestoreArray(handle, ctypes.byref(pointer))
    return BlockRows(start, columns, values)


@cache
def _library() -> Any:
    """PETSc as petsc4py has loaded it."""
    try:
        library = ctypes.CDLL(PETSc.__file__)
        functions = library.MatSeqBAIJGetArray, library.MatSeqBAIJRestoreArray
    except (OSError, AttributeError):
        return None
    for function in functions:
        function.restype, function.argtypes = ctypes.c_int, [ctypes.c_void_p, ctypes.c_void_p]
    return library
