"""The clock of a run: steps of the case, halved where they fail, at integer multiples that rounding does not shift."""

from __future__ import annotations

from dataclasses import dataclass

from fsci.case.time import LEAST_STEP, shared
from solvers.api import State


@dataclass
class Clock:
    """Counts time in ticks: a nominal step has 2^halvings of them. All steps of one level have the same size.

    A rest shorter than a tenth of a step is shared by the steps before it: all nominal ones, or the last halved one.
    """

    start: float
    end: float
    given: float  #: step size of the case [s]
    halvings: int  #: how often a step may be halved
    recover_after: int  #: accepted steps after which a halved step is doubled
    tick: int = 0
    level: int = 0  #: the present step is nominal / 2^level
    accepted: int = 0  #: accepted steps since the level changed
    step: int = 0  #: accepted steps

    def __post_init__(self) -> None:
        self.nominal = shared(self.end - self.start, self.given)  #: size of a step that was not halved [s]

    @property
    def ticks(self) -> int:
        """Ticks of the present step."""
        return 2 ** (self.halvings - self.level)

    @property
    def size(self) -> float:
        """Size [s] of the steps of the present level."""
        return self.nominal / 2**self.level

    def at(self, tick: int) -> float:
        """Time [s] of a tick; the last step ends at `end` exactly."""
        time = self.start + self.nominal * (tick / 2**self.halvings)
        return self.end if self.end - time < LEAST_STEP * self.size else time

    @property
    def time(self) -> float:
        """Present time [s]."""
        return self.at(self.tick)

    @property
    def dt(self) -> float:
        """Size [s] of the next step."""
        left = self.end - self.time
        last = self.at(self.tick + self.ticks) == self.end
        return left if last and abs(left - self.size) > 1e-9 * self.size else self.size

    @property
    def done(self) -> bool:
        return self.time >= self.end

    def accept(self) -> None:
        """Move on by the present step; double the step if it has been halved for long enough."""
        self.tick += self.ticks
        self.step += 1
        self.accepted += 1
        on_coarser_grid = self.tick % (2 * self.ticks) == 0
        if self.level > 0 and self.accepted >= self.recover_after and on_coarser_grid:
            self.level -= 1
            self.accepted = 0

    def halve(self) -> bool:
        """Halve the present step, more than once if little is left to the end; False if it cannot be made shorter."""
        before = self.dt
        while self.level < self.halvings:
            self.level += 1
            self.accepted = 0
            if self.dt < before:
                return True
        return False

    def save(self) -> State:
        count = {"tick": self.tick, "level": self.level, "accepted": self.accepted, "step": self.step}
        grid = {"start": self.start, "nominal": self.nominal, "given": self.given, "end": self.end}
        return count | grid | {"time": self.time}

    def restore(self, state: State) -> None:
        """Restore a saved clock; with another step size or end, it begins to count at the saved time."""
        self.accepted, self.step = state["accepted"], state["step"]
        self.level = min(state["level"], self.halvings)
        self.start, self.tick = state["start"], state["tick"]
        same = (state["given"], state["end"]) == (self.given, self.end)
        self.nominal = state["nominal"] if same else shared(self.end - self.start, self.given)
        # the last step may have been shorter or longer; halvings change the ticks
        if abs(self.time - state["time"]) > 1e-9 * self.size:
            self.start, self.tick, self.level, self.accepted = state["time"], 0, 0, 0
            self.nominal = shared(self.end - self.start, self.given)
