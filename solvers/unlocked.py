"""PETSc's solve without Python's global lock: other threads run meanwhile, such as the one that handles signals.

petsc4py keeps the lock. Through ctypes it is released; callbacks of petsc4py take it again.
"""

from __future__ import annotations

import ctypes
from functools import cache

from petsc4py import PETSc


def solve(ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
    """Solve A x = b with the operators of `ksp`. Raises PETSc.Error as `ksp.solve` does."""
    code = petsc_library().KSPSolve(*(ctypes.c_void_p(thing.handle) for thing in (ksp, b, x)))
    if code:
        raise PETSc.Error(code)


@cache
def petsc_library() -> ctypes.CDLL:
    """The library that petsc4py uses: what its module is linked to is found through it."""
    return ctypes.CDLL(PETSc.__file__)
