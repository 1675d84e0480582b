"""The velocities of earlier steps, from which a time scheme computes the rate du/dt."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Mask, State
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.time_scheme import Difference, FlowTimeScheme
from solvers.mesh.distributed import Nodal

#: Largest length of a step over that of the last one. BDF2 with variable steps is stable up to 1 + sqrt(2): R. D.
#: Grigorieff, Numer. Math. 42 (1983) 359-377.
GROWTH_OF_STEP = 2.0

#: Largest change in a step of the length for the scales of the stabilisation, over the length of the step. The
#: divergence that the method leaves at walls is proportional to this length, so that a change acts on bodies as a force
#: that is proportional to this ratio: with 1, 8 % of the drag of a disc of five cells, with 0.5 4 %, and from 0.05 to
#: 0.0005 below 0.3 %. Half of a step takes 20.
SCALE_CHANGE = 0.05


@dataclass(frozen=True)
class Past:
    """Velocities [m/s] at an earlier time, at local dofs, and where that step had unknowns."""

    velocity: Array
    found: Mask


class History:
    """Velocities and lengths of the last accepted steps, newest first: as many as scheme and predictor need."""

    def __init__(self, scheme: FlowTimeScheme, size: int):
        self.scheme = scheme
        self.past = [
            Past(np.zeros(size), np.ones(size, dtype=bool)) for _ in range(1 if scheme.steady else max(2, scheme.times))
        ]
        self.steps: tuple[float, ...] = ()  #: lengths [s]
        self._scale_step = 0.0  #: that of the last step for the scales of the stabilisation [s]; zero: none
        #: change of the pressure in the last step [Pa], at local dofs; zero where it had none at the start or the end
        self.pressure_change = np.zeros(size)
        self._pressure: Array | None = None  #: at the beginning of the present step [Pa]; None: of other unknowns

    @property
    def longest_step(self) -> float:
        """[s]; longer ones would be too much longer than the last one for the rule."""
        asks = self.scheme.times > 1 and len(self.steps) == self.scheme.times
        return GROWTH_OF_STEP * self.steps[0] if asks else math.inf

    def scale_alpha(self, dt: float) -> float:
        """alpha [1/s] for the scales of the stabilisation in a next step of length dt [s].

        That of a step in a sequence of equal ones, whose length changes slowly.
        """
        scale = self._next_scale_step(dt)
        return self.scheme.difference(scale, (scale,) * len(self.steps)).alpha

    def _next_scale_step(self, dt: float) -> float:
        last = self._scale_step or dt
        return min(max(dt, last - SCALE_CHANGE * dt), last + SCALE_CHANGE * dt)

    def difference(self, dt: float) -> Difference:
        """The difference formula of a next step of length dt [s]."""
        return self.scheme.difference(dt, self.steps)

    def start(self, velocity: Array, found: Mask | None = None) -> None:
        """Set the initial velocity; found: local dofs at which it exists, by default all."""
        self.past[0] = Past(velocity, np.ones(len(velocity), dtype=bool) if found is None else found)

    def continue_back(self, dt: float, rate: Array, found: Mask) -> None:
        """Extrapolate velocities back before the start by their rate [m/s^2], in steps of length dt [s]."""
        start = self.past[0].velocity
        back = [Past(start - k * dt * rate, found) for k in range(1, len(self.past))]
        self.past = [self.past[0], *back]
        self.steps, self._scale_step = (dt,) * len(self.past), dt

    def forget_earlier(self) -> None:
        """Begin a new sequence of steps from the last velocity."""
        self.steps = ()

    def begin_step(self, pressure: Array) -> None:
        """Keep the pressure [Pa] at the beginning of a step, at local dofs, zero where there is none."""
        self._pressure = pressure

    def extrapolate(self, flow: Array, dt: float, fixed: NDArray[np.int64], *, with_pressure: bool) -> None:
        """Predictor: extrapolate linearly from the last two steps, where both have a velocity.

        flow: velocity [m/s] and pressure [Pa] at local dofs, changes in place; dt: length of the next step [s]; fixed:
        dofs that keep their velocity.
        """
        if len(self.steps) < 2:
            return
        old, older = self.past[:2]
        continued = old.found & older.found
        continued[fixed] = False
        flow[continued] += (dt / self.steps[0] * (old.velocity - older.velocity))[continued]
        if with_pressure:
            flow += dt / self.steps[0] * self.pressure_change

    def replace(self, past: Sequence[Past], pressure_change: Array) -> None:
        """Take velocities and change of the pressure [Pa] at other unknowns, at which no step has begun."""
        self.past, self.pressure_change, self._pressure = list(past), pressure_change, None

    def correct(self, velocity: Array) -> None:
        """Add a velocity [m/s] to those of all times."""
        self.past = [replace(past, velocity=past.velocity + velocity) for past in self.past]

    def end_step(self, dt: float, velocity: Array, found: Mask, pressure: Array) -> None:
        """Accept a step of length dt; found: local dofs at which it had a velocity; pressure [Pa]: at its end."""
        before = self._pressure
        both = False if before is None else (before != 0.0) & (pressure != 0.0)
        self.pressure_change = np.where(both, pressure - (0.0 if before is None else before), 0.0)
        self.past = [Past(velocity, found), *self.past][: len(self.past)]
        self.steps = (dt, *self.steps)[: len(self.past)]
        self._scale_step = self._next_scale_step(dt)

    def rate(self, difference: Difference) -> Array:
        """The history in u_t = alpha u - history: sum_k beta_k u_{n-k} [m/s^2], at local dofs."""
        total = np.zeros(len(self.past[0].velocity))
        for weight, past in zip(difference.beta, self.past, strict=False):
            total += weight * past.velocity
        return total

    def missing(self, difference: Difference) -> Mask:
        """Mask of the local dofs where `rate` needs a velocity that its step did not have."""
        missing = np.zeros(len(self.past[0].found), dtype=bool)
        for weight, past in zip(difference.beta, self.past, strict=False):
            if weight:
                missing |= ~past.found
        return missing

    def save(self, unknowns: Unknowns) -> State:
        """Velocities of all times, where they were found, the last change of the pressure, the lengths of the steps."""
        nodes = unknowns.velocity
        found = np.stack([past.found for past in self.past], axis=1)[nodes.dofs[:, 0]]
        return {
            "velocity": {str(k): unknowns.to_nodes(past.velocity, nodes) for k, past in enumerate(self.past)},
            "found": Nodal(found[: nodes.owned].astype(float), nodes.consecutive[: nodes.owned]),
            "pressure_change": unknowns.to_nodes(self.pressure_change, unknowns.pressure),
            "steps": list(self.steps),
            "scale_step": self._scale_step,
        }

    def restore(self, unknowns: Unknowns, state: State) -> None:
        """Restore a saved state (collective)."""
        nodes, found = unknowns.velocity, state["found"].values
        self.past = [
            Past(
                unknowns.from_nodes(state["velocity"][str(k)].values, nodes),
                unknowns.from_nodes(found[:, [k]], nodes) > 0.5,
            )
            for k in range(len(self.past))
        ]
        self.pressure_change = unknowns.from_nodes(state["pressure_change"].values, unknowns.pressure)
        self.steps, self._scale_step = tuple(state["steps"]), state["scale_step"]
