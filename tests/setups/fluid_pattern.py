"""Several Newton steps on all processes of MPI with multigrid, around a body with cells without unknowns.

Rows of nodes in these cells are rows of the identity, also in columns of other processes.
"""

import numpy as np
from fluid_setup import SolverSettings, Tolerance, body, field, make_fluid, sphere, step, wall
from mpi4py import MPI

from solvers.fluid.grid.box import uniform

if __name__ == "__main__":
    ball = body("ball", *sphere((0.5, 0.5, 0.5), 0.33, 2))
    stirred = wall(field(lambda x, y, z, t: y * (1 - y) * z, 0, 0))
    solver = SolverSettings(Tolerance(1e-10), linear="iterative", linear_tolerance=1e-6)
    fluid = make_fluid(uniform([0] * 3, [1] * 3, [12] * 3), [stirred], [ball], solver=solver, comm=MPI.COMM_WORLD)
    inner = np.flatnonzero(~fluid.system.active_dofs[: fluid.unknowns.owned])
    assert fluid.comm.allreduce(len(inner)) > 0
    assert step(fluid, 0.0, 1.0).iterations > 2
    assert fluid.iterative.sequence.current == "multigrid"
