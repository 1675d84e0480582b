"""Objects of PETSc with functions in Python. PETSc frees some of its objects after Python has ended: not these."""

from __future__ import annotations

import atexit
import ctypes

from petsc4py import PETSc

from solvers.algebra.unlocked import petsc_library

_alive: dict[int, type] = {}  # those of this process, by their addresses
_freed: list[PythonContext] = []  # contexts of objects that PETSc has freed


def free_deleted(comm: PETSc.Comm) -> None:
    """Free the objects of PETSc that Python has deleted on a communicator; PETSc does so in no other call (collective).

    Freeing may delete contexts, and what they hold is deleted with them. PETSc loses objects that are deleted within
    the call, with their memory, so they are deleted after it, and freed in the next call.
    """
    PETSc.garbage_cleanup(comm)
    _freed.clear()


class PythonContext:
    """Base of contexts, which hold the functions and data of one matrix or preconditioner."""

    def create(self, owner: PETSc.Object) -> None:
        """Called by petsc4py when the object gets this context."""
        _alive[owner.handle] = type(owner)

    def destroy(self, owner: PETSc.Object) -> None:
        """Called by petsc4py when the object is freed."""
        _alive.pop(owner.handle, None)
        _freed.append(self)


@atexit.register
def _release() -> None:
    """Give what is alive a type without functions in Python."""
    library = petsc_library()
    for handle, kind in list(_alive.items()):
        if issubclass(kind, PETSc.PC):
            library.PCSetType(ctypes.c_void_p(handle), PETSc.PC.Type.NONE.encode())
        else:
            library.MatSetType(ctypes.c_void_p(handle), PETSc.Mat.Type.SHELL.encode())
