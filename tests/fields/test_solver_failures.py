"""Steps of a structure that its solvers fail at."""

from __future__ import annotations

import pytest
from advised import require_advice
from mpi4py import MPI
from petsc4py import PETSc
from structure_setup import TIGHT
from test_contact_roles import strip_on_a_corner

from fsci.shapes import rectangle
from solvers.api import FailureKind, StepFailed
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure import Body, NeoHooke, Structure, Support


def failure(structure: Structure, t: float) -> StepFailed:
    """That of one step from 0 to t."""
    structure.initialise(0.0, t)
    with pytest.raises(StepFailed) as failed:
        structure.step(0.0, t)
    return failed.value


def test_an_active_set_that_cycles():
    """A load bends a strip far over a corner."""
    few = SolverSettings(Tolerance(residual=1e-9, max_iterations=15), linear="direct")
    found = failure(strip_on_a_corner(2, -0.5, few)[0], 8.0)
    assert "the active set cycles" in found.reason
    require_advice(found, FailureKind.ACTIVE_SET)


def test_a_linear_solver_that_stalls():
    """Two iterations are too few for 32 unknowns."""

    def short(comm, task) -> PETSc.KSP:
        ksp = PETSc.KSP().create(comm)
        ksp.setType(PETSc.KSP.Type.CG)
        ksp.setTolerances(rtol=1e-12, max_it=2)
        return ksp

    supports = [Support("left"), Support("right", (0.1, 0.0))]
    block = Body("block", rectangle([1, 1], [3, 3]), NeoHooke(5.0, 5.0), supports=supports, comm=MPI.COMM_SELF)
    found = failure(Structure([block], settings=SolverSettings(TIGHT.newton, short)), 1.0)
    assert found.reason == "the linear solver stalled after 2 iterations (it reached its limit of iterations)"
    require_advice(found, FailureKind.LINEAR_SOLVER)
