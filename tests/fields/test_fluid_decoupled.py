"""The matrix for incomplete factors of second-order flows: couplings of different velocity components are left out."""

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from programs import on_processes

from solvers.fluid.solve.linear_systems.decoupled import decoupled, without


def check(comm):
    """A full matrix of 10 unknowns: two components of the velocity and, numbered 2, the pressure."""
    component = np.array([0, 1, 0, 1, 0, 1, 2, 2, 0, 1])
    entries = 1.0 + np.arange(100.0).reshape(10, 10)
    entries[7, 7] = entries[0, 2] = 0.0
    matrix = PETSc.Mat().createAIJ((10, 10), comm=comm)
    matrix.setUp()
    rows = np.arange(*matrix.getOwnershipRange())
    matrix.setValues(rows.astype(np.int32), np.arange(10, dtype=np.int32), entries[rows])
    matrix.assemble()
    same = component[:, None] == component[None]
    expected = np.where(same | (component[:, None] == 2) | (component[None] == 2), entries, 0.0)
    found = decoupled(matrix, component[rows])
    indptr, columns, values = found.getValuesCSR()
    stays = ((expected != 0.0) | np.eye(10, dtype=bool))[rows]
    np.testing.assert_array_equal(values, expected[rows][stays])
    np.testing.assert_array_equal(columns, np.nonzero(stays)[1])
    np.testing.assert_array_equal(np.diff(indptr), np.count_nonzero(stays, axis=1))
    marked = np.isin(np.arange(10), [1, 7])
    identity = np.where(marked[:, None] | marked[None], np.eye(10), expected)
    indptr, columns, values = without(found, marked[rows]).getValuesCSR()
    whole = np.zeros((len(rows), 10))
    whole[np.repeat(np.arange(len(rows)), np.diff(indptr)), columns] = values
    np.testing.assert_array_equal(whole, identity[rows])


def test_what_is_left_out():
    check(MPI.COMM_SELF)


def test_the_same_on_two_processes():
    """Columns of the other process have their components from there."""
    on_processes(2, __file__)


if __name__ == "__main__":
    check(MPI.COMM_WORLD)
