"""`fsci` in which the second linear solve goes wrong on some process: it raises an error, or goes on for a minute.

Arguments: what (error, disk, sleep), the number of the process (-1: all), and those of `fsci`.
"""

import ctypes
import sys

from mpi4py import MPI

from fsci import cli
from solvers.algebra import unlocked


class Library:
    """PETSc, but for the second solve."""

    def __init__(self, what, rank):
        self.what, self.rank, self.solves, self.real = what, rank, 0, unlocked.petsc_library()

    def KSPSolve(self, *handles):
        self.solves += 1
        if self.solves == 2 and self.rank in (MPI.COMM_WORLD.rank, -1):
            if self.what == "error":
                raise RuntimeError("injected error")
            if self.what == "disk":
                raise OSError(28, "No space left on device", "history.csv")
            for _ in range(6000):  # as PETSc, called without Python's lock; a signal ends one call
                ctypes.CDLL(None).usleep(10_000)
        return self.real.KSPSolve(*handles)


if __name__ == "__main__":
    library = Library(sys.argv[1], int(sys.argv[2]))
    unlocked.petsc_library = lambda: library
    sys.argv[1:] = sys.argv[3:]
    cli.main()
