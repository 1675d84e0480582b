"""Checks of deformations: unbounded displacements, inverted elements, limit points of statics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median

import numpy as np
from mpi4py import MPI

from solvers.api import Array, State
from solvers.structure.body import Body

#: Displacement, relative to the size of the largest body, above which the system was singular.
FLOWN_OFF = 1e6

#: Speed of the last step relative to the usual one from which displacements run away.
RUNAWAY = 2.0

#: Count of speeds that show what is usual.
USUAL = 4


def largest_extent(comm: MPI.Comm, bodies: Sequence[Body]) -> float:
    """Size [m] of the largest body (collective)."""
    sizes = (np.ptp(body.points, axis=1).max() for body in bodies if body.points.size)
    return comm.allreduce(max(sizes, default=0.0), op=MPI.MAX)


def flown_off(comm: MPI.Comm, u: Array, extent: float) -> str | None:
    """A reason to reject displacements u [m], None if there is none; extent: size of the bodies [m] (collective)."""
    farthest = comm.allreduce(float(np.abs(u).max(initial=0.0)), op=MPI.MAX)
    if farthest > FLOWN_OFF * extent:
        return (
            f"a displacement of {farthest:.3g} is far larger than the body, {extent:.3g}: is a body not supported? "
            "One that is free until it touches needs weak 'springs', a pair with 'adjust', or 'dynamics'"
        )
    return None


def inverted(bodies: Sequence[Body]) -> tuple[str, tuple[float, ...]] | None:
    """(reason, reference position [m]) if an element is inverted, else None (collective)."""
    volume_ratio, name, place = min((body.smallest_jacobian() for body in bodies), key=lambda jacobian: jacobian[0])
    if volume_ratio > 0.0:
        return None
    return f"element of body '{name}' inverted (volume ratio {volume_ratio:.3g})", place


class LimitPoint:
    """Notes how fast a static structure moves with its load.

    Towards a limit point of the load at t* displacements grow as sqrt(t* - t), so that their speed has no bound. A
    static step that fails after such growth has most likely no equilibrium: a thin structure buckles or snaps.
    """

    def __init__(self) -> None:
        self._speeds: list[float] = []
        self._reached = math.nan

    def accept(self, t: float, speed: float) -> None:
        """Note an accepted step: its end t [s], and the norm of its displacement over its length."""
        if speed > 0.0:
            self._speeds.append(speed)
        self._reached = t

    def growth(self) -> float:
        """Speed of the last step relative to the usual one before; 1 where too few steps show what is usual."""
        return self._speeds[-1] / median(self._speeds[:-1]) if len(self._speeds) > USUAL else 1.0

    def explain(self) -> str:
        """What a step that fails now most likely means, to be added to the reason; empty if nothing points to it."""
        if self.growth() < RUNAWAY:
            return ""
        return (
            f"; most likely there is no equilibrium beyond t = {self._reached:.4g}: displacements grew ever faster "
            "up to there, as of a structure that snaps or buckles; use dynamics"
        )

    def save(self) -> State:
        return {"speeds": np.array(self._speeds), "reached": self._reached}

    def restore(self, state: State) -> None:
        self._speeds, self._reached = state["speeds"].tolist(), float(state["reached"])
