"""A flow on all processes of MPI: writes forces, and velocity and pressure at all nodes, into a file."""

import sys
from pathlib import Path

import numpy as np
from fluid_setup import SolverSettings, Tolerance, block, body, circle, field, loop, make_fluid, sphere, step
from mpi4py import MPI

from solvers.fluid.flow.conservation.regions import RegionsOfCut
from solvers.fluid.flow.conservation.volume_balance import VolumeBalance
from solvers.fluid.flow.extreme_pressure import extreme_pressure
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, RefinedSurface, refined
from solvers.fluid.terms.boundary.patches import Patch
from solvers.mesh.distributed import Nodal, gather_nodal


def scene(dim, element, comm, box="channel"):
    """A moving and a resting body in a channel, in a closed box, or in a periodic one that is open above.

    In a "film" they come closer than a cell; "nested" cells are fine around them and at the end of a longer channel.
    """
    inflow = field(*[lambda x, y, *zt: 4 * y * (1 - y), 0, 0][:dim])
    swirl = field(*[lambda x, y, *zt: y * y - 1 / 3, lambda x, y, *zt: 0.1 * x * x, 0][:dim])
    sides = ("y-", "y+", "z-", "z+")[: 2 * dim - 2]
    channel = [
        Patch("in", ("x-",), "velocity", inflow),
        Patch("out", ("x+",), "outflow"),
        Patch("sides", sides, "slip"),
    ]
    patches = {
        "channel": channel,
        "film": channel,
        "nested": channel,
        "closed": [Patch("box", ("x-", "x+", *sides), "velocity", swirl)],
        "periodic": [
            Patch("ends", ("x-", "x+"), "periodic"),
            Patch("sides", ("y-", *sides[2:]), "no_slip"),
            Patch("top", ("y+",), "pressure", (lambda x, t: 0.1 * x[0] * (1.6 - x[0]),)),
        ],
    }[box]
    disc = (circle((0.4, 0.45), 0.17, 40), loop(40)) if dim == 2 else sphere((0.4, 0.45, 0.5), 0.2, 2)
    brick = block([0.7 if box == "film" else 1.1, 0.3, 0.3][:dim], [1.3, 0.63, 0.71][:dim])
    v = np.array([0.7, 0.2, -0.1])[:dim]
    bodies = [
        body("disc", *disc, motion=lambda x, t: (x + t * v, 0 * x + v)),
        body("brick", *brick),
    ]
    grid = uniform([0] * dim, [1.6, 1, 1][:dim], [21, 13] if dim == 2 else [12, 7, 7])
    if box == "nested":
        coarse = uniform([0] * dim, [2.4, 1, 1][:dim], [24, 10] if dim == 2 else [12, 5, 5])
        at_outlet = RefinedBox([2.2, 0, 0][:dim], [2.4, 0.25, 0.4][:dim], 1)
        at_bodies = RefinedBox([0] * dim, [0.9, 0.9] if dim == 2 else [1.6, 1, 1], 1)
        grid = refined(coarse, [at_outlet, at_bodies, RefinedSurface(*brick, 4, 1)])
    return make_fluid(
        grid, patches, bodies, mu=0.01, element=element, dt=0.03, comm=comm, narrow_gaps=True,
        body_force=field(*[0.1, -0.5, 0][:dim]),
        solver=SolverSettings(Tolerance(1e-10), linear="direct" if dim == 2 else "iterative", linear_tolerance=1e-11),
    )  # fmt: skip


def everything(fluid):
    """Velocity and pressure by the numbers of nodes, on rank 0."""
    nodes = (fluid.unknowns.velocity, fluid.unknowns.pressure)
    return [gather_nodal(fluid.comm, Nodal(fluid.flow[n.dofs[: n.owned]], n.consecutive[: n.owned])) for n in nodes]


def main(dim, element, box, out):
    fluid = scene(dim, element, MPI.COMM_WORLD, box)
    for number in range(4):
        step(fluid, 0.03 * number, 0.03)
    force = fluid.force()
    balance = VolumeBalance(fluid, RegionsOfCut(fluid)).numbers()["fluid.mass"]
    extremes = [extreme_pressure(fluid, which)()[""] for which in ("largest", "least")]
    found = everything(fluid)
    if fluid.comm.rank == 0:
        np.savez(out, velocity=found[0], pressure=found[1], balance=balance, extremes=extremes, **force)


if __name__ == "__main__":
    for box in sys.argv[4:]:
        main(int(sys.argv[1]), sys.argv[2], box, Path(sys.argv[3]) / f"{box}.npz")
