"""Limit points of statics: equilibria that end, which a smaller load step does not help against.

Towards a limit point of the load at t* displacements grow as sqrt(t* - t), so that their speed has no bound. A static
step that fails after such growth has most likely no equilibrium: a thin structure buckles or snaps.
"""

from __future__ import annotations

import math
from statistics import median

#: Speed of the last step relative to the usual one from which displacements run away.
RUNAWAY = 2.0

#: Count of speeds that show what is usual.
USUAL = 4


class LimitPoint:
    """Notes how fast a static structure moves with its load."""

    def __init__(self) -> None:
        self._speeds: list[float] = []
        self._reached = math.nan

    def accept(self, t: float, speed: float) -> None:
        """Note an accepted step: its end t [s], and the norm of its displacement over its length."""
        if speed > 0.0:
            self._speeds.append(speed)
        self._reached = t

    def explain(self) -> str:
        """What a step that fails now most likely means, to be added to the reason; empty if nothing points to it."""
        if len(self._speeds) <= USUAL or self._speeds[-1] < RUNAWAY * median(self._speeds[:-1]):
            return ""
        return (
            f"; most likely there is no equilibrium beyond t = {self._reached:.4g}: displacements grew ever faster "
            "up to there, as of a structure that snaps or buckles; use dynamics"
        )
