"""Program for several processes: the rounded product of a flow's matrix is that of the matrix but for rounding."""

import numpy as np
from fluid_setup import body, field, make_fluid, sphere, wall
from mpi4py import MPI
from petsc4py import PETSc

from solvers.algebra.rounded_product import RoundedProducts
from solvers.fluid.grid.box import uniform
from solvers.solver_settings import SolverSettings


def main() -> None:
    points, facets = sphere((0.07, 0.03, -0.05), 0.5, 1)
    fluid = make_fluid(
        uniform([-1.0] * 3, [1.0] * 3, [6] * 3), [wall(field(1, 0, 0))], [body("ball", points, facets)],
        solver=SolverSettings(linear="iterative"), comm=MPI.COMM_WORLD,
    )  # fmt: skip
    fluid.begin_step(0.0, 1.0)
    fluid.residual()
    matrix, products = fluid.linearise(), RoundedProducts()
    x = matrix.createVecRight()
    x.array[:] = np.random.default_rng(MPI.COMM_WORLD.rank).standard_normal(x.getLocalSize())
    for factor in (1.0, -3.0):
        matrix.scale(factor)
        product = products.of(matrix, 1e-4)
        assert product.getType() == PETSc.Mat.Type.PYTHON
        difference = (product * x - matrix * x).norm() / (matrix * x).norm()
        assert 0.0 < difference < 1e-6, difference


main()
