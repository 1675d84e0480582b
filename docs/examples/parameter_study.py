"""A parameter study: every process computes the tip of a beam for stiffnesses of its own (mpirun -n 4)."""

import numpy as np
from mpi4py import MPI

from fsci.shapes import rectangle
from solvers.march import march
from solvers.structure import Body, Structure, StVenantKirchhoff, Support, lame

world = MPI.COMM_WORLD
mesh = rectangle([10.0, 1.0], [20, 2], order=2)

mine = {}
for E in np.geomspace(1e4, 1e7, 8)[world.rank :: world.size]:
    material = StVenantKirchhoff(*lame(E, nu=0.3), density=1.0)
    beam = Body("beam", mesh, material, supports=[Support("left")], gravity=[0.0, -1.0], comm=MPI.COMM_SELF)
    structure = Structure([beam])
    for _ in march(structure, steps=2):
        pass
    mine[E] = structure.now.u.reshape(-1, 2)[np.argmax(beam.points[0]), 1]

everything = {E: tip for part in world.allgather(mine) for E, tip in part.items()}
if world.rank == 0:
    for E, tip in sorted(everything.items()):
        print(f"E = {E:9.3e} Pa: tip {tip:.5f} m")
