"""The velocities of earlier steps, which the rate du/dt of a step needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, State
from solvers.distributed import Nodal
from solvers.fluid.space import Unknowns
from solvers.fluid.time_scheme import Difference, FlowTimeScheme

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Past:
    """Velocities [m/s] of a time behind, at local dofs, and where a step has found them."""

    velocity: Array
    found: Mask


class History:
    """Velocities and lengths of the accepted steps, the last one first: as many as the time scheme needs."""

    def __init__(self, scheme: FlowTimeScheme, size: int):
        self.scheme = scheme
        self.past = [Past(np.zeros(size), np.ones(size, dtype=bool)) for _ in range(max(1, scheme.times))]
        self.steps: tuple[float, ...] = ()  #: lengths [s]

    def difference(self, dt: float) -> Difference:
        """The rule of a step of length dt from now on."""
        return self.scheme.difference(dt, self.steps)

    def start(self, velocity: Array) -> None:
        """The initial velocity, known everywhere."""
        self.past[0] = Past(velocity, np.ones(len(velocity), dtype=bool))

    def continue_back(self, dt: float, rate: Array, found: Mask) -> None:
        """Velocities before the start by their rate [m/s^2] there, as if steps of length dt had led to it."""
        start = self.past[0].velocity
        back = [Past(start - k * dt * rate, found) for k in range(1, len(self.past))]
        self.past = [self.past[0], *back]
        self.steps = (dt,) * self.scheme.times

    def end_step(self, dt: float, velocity: Array, found: Mask) -> None:
        """Accept a step that found the flow at some local dofs."""
        self.past = [Past(velocity, found), *self.past][: len(self.past)]
        self.steps = (dt, *self.steps)[: self.scheme.times]

    def rate(self, difference: Difference) -> Array:
        """What u_t takes from the times behind, sum_k beta_k u_{n-k} [m/s^2]."""
        total = np.zeros(len(self.past[0].velocity))
        for weight, past in zip(difference.beta, self.past, strict=False):
            total += weight * past.velocity
        return total

    def missing(self, difference: Difference) -> Mask:
        """Where that asks for a velocity that no step has found."""
        missing = np.zeros(len(self.past[0].found), dtype=bool)
        for weight, past in zip(difference.beta, self.past, strict=False):
            if weight:
                missing |= ~past.found
        return missing

    def save(self, unknowns: Unknowns) -> State:
        """Velocities of all times, where they were found, and the lengths of the steps."""
        nodes = unknowns.velocity
        found = np.stack([past.found for past in self.past], axis=1)[nodes.dofs[:, 0]]
        return {
            "velocity": {str(k): unknowns.to_nodes(past.velocity, nodes) for k, past in enumerate(self.past)},
            "found": Nodal(found[: nodes.owned].astype(float), nodes.places[: nodes.owned]),
            "steps": list(self.steps),
        }

    def restore(self, unknowns: Unknowns, state: State) -> None:
        """Back to a saved state (collective)."""
        nodes, found = unknowns.velocity, state["found"].values
        self.past = [
            Past(
                unknowns.from_nodes(state["velocity"][str(k)].values, nodes),
                unknowns.from_nodes(found[:, [k]], nodes) > 0.5,
            )
            for k in range(len(self.past))
        ]
        self.steps = tuple(state["steps"])
