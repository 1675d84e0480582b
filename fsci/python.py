"""Cases from Python: read them, run them, take their steps, and have results as arrays."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fsci.case import Case, load_case
from fsci.running.results import Results, read_results
from solvers.api import Snapshot, StepFailed, StepInfo


class RunFailed(Exception):
    """A run that found no solution of a step; `results` are those until then."""

    def __init__(self, message: str, results: Results):
        super().__init__(message)
        self.results = results


class Steps:
    """A case whose steps are taken one after the other, in this process; nothing is written.

    Iterating takes them to the end of the case and yields the time after each, with the results of `fsci run`.
    """

    def __init__(self, case: Case, comm: Any = None):
        """comm: the processes that compute it together, by default all. Raises CaseError."""
        from mpi4py import MPI

        from fsci.builder.build import build
        from fsci.running.memory import require_memory
        from fsci.running.steps import clock_of, initialise
        from fsci.running.watch import Watched
        from solvers.timing import Timer

        self._comm = MPI.COMM_WORLD if comm is None else comm
        require_memory(case, self._comm)
        self.case = case
        timer = Timer()
        self._simulation = build(case, self._comm, timer)
        self._scheme = Watched(self._simulation.scheme, self._simulation.sentinels, timer, case.worded)
        self._clock = clock_of(case)
        initialise(case, self._simulation, self._scheme, self._clock.nominal)
        self.info: StepInfo | None = None  #: of the last step: iterations, residuals, what sentinels found

    @property
    def time(self) -> float:
        """Present time [s]."""
        return self._clock.time

    def __iter__(self) -> Iterator[float]:
        while not self._clock.done:
            self.take()
            yield self.time
            if self.info is not None and any(finding.ends_run for finding in self.info.findings):
                return

    def take(self) -> None:
        """Take one step, halved where it fails (collective). Raises StepFailed, with the state as it was."""
        from fsci.running.cause import with_cause
        from fsci.running.steps import take_step

        begin = self._clock.time

        def explained(failure: StepFailed) -> StepFailed:
            return with_cause(failure, self.case, begin, self._comm)

        def ignore(failure: StepFailed) -> None:
            pass

        self.info = take_step(self._scheme, self._clock, self._scheme.save(), explained, ignore, ignore)
        self._clock.accept()

    def probes(self) -> dict[str, float]:
        """Column -> value of the present state (collective)."""
        return dict(self._simulation.probes())

    def fields(self) -> dict[str, Snapshot]:
        """Name of a body, or fluid -> the present state, on the first process (collective)."""
        return {snapshot.name: snapshot for snapshot in self._simulation.snapshots()}


def load(case: str | Path, settings: Mapping[str, Any] | None = None, *, trust: bool = False) -> Case:
    """Read a case from its file or folder; `settings` are dotted names with values in place of those in the file.

    With `trust` code of files that the case names may run. Raises CaseError with all mistakes.
    """
    return load_case(case, [(name, _yaml(value)) for name, value in (settings or {}).items()], trust=trust)


def build(case: Case, comm: Any = None) -> Steps:
    """What computes a case, at its start (collective); `comm` are its processes. Raises CaseError."""
    return Steps(case, comm)


def run(case: Case, out: str | Path, *, force: bool = False) -> Results:
    """Compute a case into the folder `out`, as `fsci run` does (collective). Raises CaseError and RunFailed.

    A run that has been stopped has the status "stopped" in its summary.
    """
    from mpi4py import MPI

    from fsci.running.run import run_case

    run_case(case, Path(out), force=force)
    MPI.COMM_WORLD.barrier()
    found = results(out)
    if found.summary["status"] == "failed":
        raise RunFailed(found.summary["message"], found)
    return found


def results(out: str | Path) -> Results:
    """The results in a folder. Raises CaseError if there are none."""
    return read_results(Path(out))


def _yaml(value: Any) -> str:
    """A value as YAML text; a text is what the case file would have between quotes."""
    return json.dumps(value, default=_plain)


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else str(value)
