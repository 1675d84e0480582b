"""A scheme whose steps sentinels look at before they are accepted; what both say has the units of the case."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from solvers.api import Scheme, Sentinel, State, StepFailed, StepInfo
from solvers.timing import Timer

SENTINELS = "sentinels"  #: name of their states beside those of the scheme


class Watched:
    """Takes the steps of another scheme. Worthless results fail, other findings go with the step's information."""

    def __init__(self, scheme: Scheme, sentinels: Mapping[str, Sentinel], timer: Timer, worded: Callable[[str], str]):
        """sentinels: by a name in the saved state; worded: puts units into a text, see `Case.worded`."""
        self._scheme, self._sentinels, self._timer, self._worded = scheme, dict(sentinels), timer, worded

    def start(self, t: float) -> None:
        """Show the initial state at t [s] to the sentinels."""
        for sentinel in self._sentinels.values():
            sentinel.start(t)

    def step(self, t: float, dt: float) -> StepInfo:
        """One step from t to t + dt. Raises StepFailed."""
        try:
            info = self._scheme.step(t, dt)
        except StepFailed as failure:
            raise failure.with_reason(self._worded(failure.reason)) from failure
        with self._timer("sentinels"):
            found = tuple(
                replace(finding, message=self._worded(finding.message))
                for sentinel in self._sentinels.values()
                for finding in sentinel.look(t + dt, dt)
            )
        for finding in found:
            if (kind := finding.worthless) is not None:
                history, where = info.residuals, finding.where
                raise StepFailed(finding.kind, kind, finding.message, where=where, history=history, finding=finding)
        return replace(info, findings=(*info.findings, *found)) if found else info

    def save(self) -> State:
        states = {name: sentinel.save() for name, sentinel in self._sentinels.items()}
        return self._scheme.save() | {SENTINELS: states}

    def restore(self, state: State) -> None:
        self._scheme.restore({name: value for name, value in state.items() if name != SENTINELS})
        for name, sentinel in self._sentinels.items():
            sentinel.restore(state[SENTINELS][name])
