"""Accelerators and kinds of bodies that are added from outside, each compared with a known answer."""

from __future__ import annotations

import numpy as np
import pytest
from coupling_setup import bar_and_column, contraction
from fluid_setup import block, body, make_fluid, step
from mpi4py import MPI
from structure_setup import TIGHT

from coupling import Partitioned
from coupling.coupled import Coupled
from coupling.immersed import immerse
from coupling.partitioned import FixedPointTolerance
from solvers.api import StepFailed, StepInfo
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.surface import ImmersedSurface
from solvers.fluid.terms.boundary.patches import Patch
from solvers.march import march
from solvers.solver_settings import SolverSettings


class ByTurns:
    """An accelerator: factors of the correction by turns, as in Richardson's iteration for several eigenvalues."""

    finds_levels = False

    def __init__(self, *factors):
        self.factors, self.count = factors, 0

    def begin_step(self):
        self.count = 0

    def forget(self): ...

    def next(self, d, found):
        self.count += 1
        return d + self.factors[self.count % len(self.factors)] * (found - d)

    def save(self):
        return {"count": self.count}

    def restore(self, state):
        self.count = state["count"]


def test_accelerator():
    """Added mass over what resists is 0.8: a factor w leaves |1 - 1.8 w| of the residual."""
    dt, cells = 0.2, 10
    coupled = bar_and_column(1.0, density=0.8 / contraction(dt, cells), cells=cells, amplitude=1e-6)
    coupled.initialise(0.0, dt)
    scheme = Partitioned(coupled, ByTurns(0.9, 1.0), FixedPointTolerance(1e-14, 0.0, max_iterations=6))
    with pytest.raises(StepFailed) as failed:
        scheme.step(0.0, dt)
    history = np.array(failed.value.history)
    wanted = [abs(1 - 1.8 * factor) for factor in (0.9, 1.0, 0.9, 1.0)]  # the first correction leaves another mode, too
    assert history[2:] / history[1:-1] == pytest.approx(wanted, rel=1e-5)


class Still:
    """A kind of body: a block that does not move, whatever the flow does. It has no unknowns."""

    name, comm, size = "still", MPI.COMM_SELF, 0

    def __init__(self, points):
        self.surfaces, self.force = {"block": points}, np.zeros_like(points)

    def initialise(self, t, dt): ...
    def begin_step(self, t, dt): ...
    def predict(self, t): ...
    def end_step(self): ...

    def displacement(self):
        return np.zeros_like(self.force)

    def load(self, force):
        self.force = force

    def solve(self):
        return StepInfo(0, ())

    def touching(self):
        return None

    def numbers(self):
        return {}

    def reduced(self, force):
        return force.sum(axis=0)

    def taken(self):
        return self.force.sum(axis=0)

    def taken_at_start(self):
        return np.zeros(2)

    def mean_load(self, before, after):
        return after

    def moved(self):
        return np.zeros(2)


SIDES = Patch("sides", ("y-", "y+"), "slip")


def test_kind_of_body():
    """It feels what a rigid body of the flow feels."""
    points, facets = block([0.31, 0.32], [0.57, 0.66])
    patches = [Patch("in", ("x-",), "velocity", (1.0, 0.0)), SIDES, Patch("out", ("x+",), "outflow")]
    settings = {"solver": SolverSettings(TIGHT.newton, "direct"), "dt": 0.1}
    moved = [(ImmersedSurface("block", facets, len(points)), points)]
    immersed = immerse(moved, [], rigid=[surface.name for surface, _ in moved])
    still = Still(points)
    alone = make_fluid(
        uniform([0, 0], [1, 1], [10, 10]),
        patches,
        [body("block", points, facets, motion=lambda x, t: (x, 0.0 * x))],
        **settings,
    )
    flow = make_fluid(uniform([0, 0], [1, 1], [10, 10]), patches, immersed, **settings)
    scheme = Partitioned(Coupled(flow, still))
    for t, _ in march(scheme, end=0.2, steps=2):
        step(alone, t - 0.1, 0.1)
    assert np.abs(still.force).max() > 0.01
    assert still.force == pytest.approx(alone.force()["block"], abs=1e-9)
