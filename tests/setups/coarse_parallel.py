"""Coarse matrices of multigrid on several processes: by blocks and by PETSc's products of rows they are the same."""

from unittest.mock import patch

import numpy as np
from fluid_setup import body, field, make_fluid, sphere, wall
from mpi4py import MPI
from petsc4py import PETSc

from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.grid.nested import RefinedBox, refined
from solvers.fluid.solve.linear_systems import coarse_matrix
from solvers.fluid.solve.linear_systems.coarse_matrix import CoarseMatrix
from solvers.solver_settings import SolverSettings

comm = MPI.COMM_WORLD
points, facets = sphere((0.47, 0.52, 0.5), 0.11, 2)


def compare(grid: Grid) -> None:
    fluid = make_fluid(
        grid, [wall(field(1, 0, 0))], [body("ball", points, facets)],
        solver=SolverSettings(linear="iterative"), scheme="backward_euler", comm=comm,
    )  # fmt: skip
    fluid.begin_step(0.0, 0.1)
    fluid.residual()
    by_blocks = fluid.linearise()
    by_rows, free = by_blocks, (~fluid.iterate.held).astype(float)
    for P in fluid.iterate.solver.create_multigrid()._interpolations:
        first, second = CoarseMatrix(P), CoarseMatrix(P)
        first.mark(free)
        second.mark(free)
        for _ in range(2):  # the second one is written over the first
            found = first.update(by_blocks, free)
            with patch.object(coarse_matrix, "shared_block_rows", lambda matrix: None):
                exact = second.update(by_rows, free)
        assert "baij" in found.getType()
        assert "baij" not in exact.getType()
        difference = found.convert(PETSc.Mat.Type.AIJ, PETSc.Mat())
        difference.axpy(-1.0, exact)
        size = exact.norm(PETSc.NormType.INFINITY)
        assert difference.norm(PETSc.NormType.INFINITY) < 1e-12 * size > 0.0
        assert np.array_equal(first.free, second.free)
        by_blocks, by_rows, free = found, exact, first.free
    assert comm.allreduce(len(free)) > 0


compare(uniform([0] * 3, [1] * 3, [12] * 3))
compare(refined(uniform([0] * 3, [1] * 3, [8] * 3), [RefinedBox([0.125] * 3, [0.875] * 3, 1)]))
