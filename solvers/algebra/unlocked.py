"""PETSc's solve without Python's global lock, so that other threads run, such as the one that handles signals.

petsc4py keeps the lock. A call by ctypes releases it, and callbacks of petsc4py acquire it again.
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
    """The PETSc library that the module of petsc4py is linked to."""
    return ctypes.CDLL(PETSc.__file__)
