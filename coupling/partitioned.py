"""Partitioned Dirichlet-Neumann coupling: the flow takes the motion of the surface, the solid the force of the flow.

Displacement d_k -> flow around the surface at d_k -> force f_k -> solid under f_k -> D(d_k), until D(d) = d. The
pressure levels of closed pockets are further unknowns (docs/theory_coupling.md, Partitioned).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from coupling.accelerate import Accelerator, QuasiNewton
from coupling.bracket import CouplingIterate, brackets, halved
from coupling.coupled import Coupled, suction, with_cause
from coupling.divided import lengths, step_in_parts
from coupling.impact import Impact
from coupling.start import start_again, start_at_jump, start_together
from coupling.wall_passed import WallPassed
from solvers.api import Array, FailureKind, State, StepFailed, StepInfo
from solvers.counted import counted

#: Relative error of start steps that only tell how soon the flow brakes a body: parts of the first step are halves.
ROUGH = 1e-2


@dataclass(frozen=True)
class FixedPointTolerance:
    """Tolerance of the interface residual |D(d) - d|, a root mean square over the vertices."""

    relative: float = 1e-6  #: relative to the displacement of the step
    absolute: float = 0.0  #: [m]
    max_iterations: int = 50


class Partitioned:
    """A Scheme: each step iterates over the fields until the interface residual is small."""

    def __init__(
        self,
        coupled: Coupled,
        accelerator: Accelerator | None = None,
        tolerance: FixedPointTolerance = FixedPointTolerance(),
    ):
        self.coupled, self.accelerator, self.tolerance = coupled, accelerator or QuasiNewton(0.5), tolerance
        self._pockets = 0  #: closed pockets of the last iterate

    def initialise(self, t: float, dt: float) -> None:
        """Set both fields to the first time t [s]; dt [s]: length of the first step."""
        self.coupled.initialise(t, dt)
        start_together(self.coupled, t, dt, self._iterate, roughly=partial(self._iterate, relative=ROUGH))
        self.accelerator.forget()

    def step(self, t: float, dt: float) -> StepInfo:
        """Take one, in parts if it is much longer than the last. Raises StepFailed."""
        return step_in_parts(self._take, t, lengths(dt, self.coupled.longest_step))

    divides = True  #: steps where it starts

    @property
    def can_start(self) -> bool:
        """Whether it can start in the middle of a run."""
        return self.coupled.start is not None

    def start_anew(self, t: float, dt: float) -> None:
        """Prepare a step of length dt [s] from t, at which given velocities jump (collective)."""
        self.accelerator.forget()
        start_at_jump(self.coupled, t, dt, self._iterate)
        self.accelerator.forget()

    def _start_again(self, t: float, dt: float) -> None:
        """Start anew after the step of an impulse; increments of other steps say nothing of this start."""
        if self.coupled.start is not None and self.coupled.start.solid.took_impulse:
            self.accelerator.forget()
            start_again(self.coupled, t, dt, self._iterate)
            self.accelerator.forget()

    def _take(self, t: float, dt: float) -> StepInfo:
        walls = self.coupled.walls
        waits = (walls is not None and walls.waiting) or self.coupled.impacts.possible
        before = self.save() if waits else {}
        try:
            return self._take_once(t, dt)
        except WallPassed:
            self.restore(before)
            return self._take(t, dt)
        except Impact:
            self.restore(before)
            self.coupled.impacts.start_anew(dt)
            return self._take(t, dt)

    def _take_once(self, t: float, dt: float) -> StepInfo:
        self._start_again(t, dt)
        coupled, interface = self.coupled, self.coupled.interface
        coupled.begin_step(t, dt)
        if not coupled.flow.steady:
            coupled.flow.move(interface.move(interface.past[0]))
            coupled.predict(t + dt)
        history, newton = self._iterate()
        coupled.end_step()
        numbers = {"coupling.newton": float(newton), **coupled.balance.numbers(), **coupled.solid.numbers()}
        return StepInfo(len(history), tuple(history), numbers, coupled.take_notes())

    def _iterate(self, *, relative: float | None = None) -> tuple[list[float], int]:
        """Iterate to the tolerance. Returns (residuals [m], Newton iterations of both fields). Raises StepFailed.

        relative: another one than that of the scheme.
        """
        relative = self.tolerance.relative if relative is None else relative
        coupled, interface = self.coupled, self.coupled.interface
        self.accelerator.begin_step()
        d, levels = interface.displacement(), np.zeros(self._pockets)
        history: list[float] = []
        newton = 0
        ends: tuple[CouplingIterate, CouplingIterate] | None = None
        last: CouplingIterate | None = None
        changes = 0  # of the contact between iterates
        while True:
            motions = interface.move(d)
            coupled.flow.move(motions)
            apart = interface.vertices_of(coupled.flow.outside(motions))
            newton += coupled.flow.solve().iterations
            squeezed = coupled.flow.squeezed() if self.accelerator.finds_levels else np.zeros(0)
            if len(squeezed) != len(levels):
                levels, ends, last = np.zeros(len(squeezed)), None, None
                self.accelerator.forget()
            self._pockets = len(levels)
            coupled.solid.load(coupled.force())
            newton += coupled.solid.solve().iterations
            found = interface.displacement()
            residual = max(_mean((found - d)[~apart]), float(np.abs(squeezed).max(initial=0.0)))
            history.append(residual)
            if residual <= self._small(found, apart, relative):
                if not coupled.flow.release():
                    return history, newton
                self.accelerator.forget()
                d, ends, last = found, None, None
                continue
            if not math.isfinite(residual) or len(history) == self.tolerance.max_iterations:
                taken = counted(len(history), "iteration")
                reason = f"the coupling iteration did not converge in {taken} (residual {residual:.3g})"
                failure = StepFailed(
                    "coupling", FailureKind.COUPLING, reason, iteration=len(history), history=tuple(history)
                )
                # once is a contact that closes or opens
                raise with_cause(failure, suction(coupled) if changes > 1 else 0.0)
            before = np.concatenate([d.ravel(), levels])
            now = CouplingIterate(before, np.append(found, levels + squeezed), coupled.solid.touching())
            changes += last is not None and not last.same_contact(now)
            if ends is not None:
                ends = halved(*ends, now)
            elif last is not None and brackets(last, now):
                ends = last, now
            if ends is not None and not ends[0].same_contact(ends[1]):
                after = 0.5 * (ends[0].d + ends[1].d)
            else:
                if ends is not None:
                    self.accelerator.forget()
                    self.accelerator.next(ends[0].d, ends[0].found)
                elif last is not None and not last.same_contact(now):
                    self.accelerator.forget()
                ends = None
                after = self.accelerator.next(now.d, now.found)
            d, levels = np.where(apart[:, None], found, after[: d.size].reshape(d.shape)), after[d.size :]
            if len(levels):
                coupled.flow.add_levels(levels - before[d.size :])
            last = now

    def _small(self, found: Array, apart: NDArray[np.bool_], relative: float) -> float:
        """Tolerance [m], at least a few rounding errors of positions: bodies may move by less in a step.

        apart: mask of the vertices of surfaces outside of the flow, however far they move.
        """
        interface = self.coupled.interface
        moved = _mean((found - interface.begun)[~apart])
        rounding = 4.0 * np.finfo(float).eps * _mean((interface.points + found)[~apart])
        return max(relative * moved, self.tolerance.absolute, float(rounding))

    def save(self) -> State:
        return {**self.coupled.save(), "accelerator": self.accelerator.save(), "pockets": self._pockets}

    def restore(self, state: State) -> None:
        self.coupled.restore(state)
        self.accelerator.restore(state["accelerator"])
        self._pockets = int(state["pockets"])


def _mean(vectors: Array) -> float:
    """Root mean square of the lengths of vectors, zero of none."""
    return float(np.sqrt((vectors**2).sum() / max(len(vectors), 1)))
