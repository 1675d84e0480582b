"""Objects of PETSc with contexts in Python: what a context holds is freed with it."""

from __future__ import annotations

import weakref

from petsc4py import PETSc

from solvers.algebra.petsc_python import PythonContext, free_deleted


class Copies(PythonContext):
    """A preconditioner that copies."""

    def apply(self, preconditioner: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        x.copy(y)


class Holds(Copies):
    """One that holds another."""

    def __init__(self, other: PETSc.PC):
        self.other = other


def with_context(context: PythonContext) -> PETSc.PC:
    preconditioner = PETSc.PC().create(PETSc.COMM_SELF)
    preconditioner.setType(PETSc.PC.Type.PYTHON)
    preconditioner.setPythonContext(context)
    return preconditioner


def test_what_a_freed_context_holds_is_freed():
    """PETSc alone loses objects that are deleted while it frees others: a preconditioner in each linear solve."""
    inner = Copies()
    outer = with_context(Holds(with_context(inner)))
    alive = weakref.ref(inner)
    keeps_communicator = PETSc.Vec().createSeq(1)
    del inner, outer
    for _ in range(3):
        free_deleted(keeps_communicator.comm)
    assert alive() is None
