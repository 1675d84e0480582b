"""The run loop: time steps with retries, checkpoints and output; clean stop and resumption."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fsci.builder.on_first import on_first, shared
from fsci.case import Case, CaseError, load_case
from fsci.case.flow_element import flow_element
from fsci.case.resume import changed, end_error, meshes_changed
from fsci.case.settings import settings_of
from fsci.resolution.words import resolved, worst_by_body
from fsci.running.cause import with_cause
from fsci.running.checkpoint import list_checkpoints, read_checkpoint, write_checkpoint
from fsci.running.files import LOCK, make_folder, require_own, write_text
from fsci.running.finite import not_numbers
from fsci.running.history import HistoryWriter, read_history
from fsci.running.jump import require_continuous
from fsci.running.kept_case import keep_case, kept_case
from fsci.running.lock import Lock
from fsci.running.memory import require_memory
from fsci.running.monitor import Monitor
from fsci.running.output import FieldWriter
from fsci.running.processes import describe
from fsci.running.results_folder import prepare_folder
from fsci.running.steps import clock_of, initialise, take_step
from fsci.running.stop import StopWatch
from fsci.running.summary import RunRecord, memory_mb, shares, summarize, write_summary
from fsci.running.verify import evaluate
from fsci.running.vtkhdf import VtkHdfWriter
from fsci.running.watch import Watched
from solvers.api import Finding, Snapshot, State, StepFailed, StepInfo

if TYPE_CHECKING:
    from fsci.builder.build import Simulation

FINISHED, FAILED, BAD_CASE, STOPPED = 0, 1, 2, 3  #: exit codes

#: Settings that decide where rigid bodies are, and those that decide which forces and energies a state has.
SETTINGS_OF_MOTION = ("fluid.bodies.*.motion", "curves", "time.step")
MATERIALS = ("structure.bodies.*.material", "structure.bodies.*.springs")


def run_case(case: Case, out: Path, *, force: bool = False) -> int:
    """Compute a case from its start into the folder `out`; returns the exit code. Raises CaseError.

    `force`: take a folder that has files of others, see `prepare_folder`.
    """
    from mpi4py import MPI

    comm = MPI.COMM_WORLD
    require_memory(case, comm)
    lock = on_first(comm, lambda: prepare_folder(case, out, force=force))
    with closing(lock) if lock else nullcontext():
        return Run(kept_case(case, out), out, comm, lock=lock).from_start()


def resume_run(out: Path, changes: Sequence[tuple[str, str]] = ()) -> int:
    """Continue a run from the newest checkpoint of its folder; returns the exit code. Raises CaseError.

    `changes` are dotted names and values as YAML text; the case file of the folder is rewritten with them.
    """
    from mpi4py import MPI

    comm = MPI.COMM_WORLD
    on_first(comm, lambda: require_own(out))
    case = load_case(out / "case.yaml", changes)
    lock = on_first(comm, lambda: _lock_to_resume(out))
    with closing(lock) if lock else nullcontext():
        state, _ = shared(comm, lambda: read_checkpoint(out / "checkpoint"))
        if (early := end_error(case, changes, state["clock"]["time"])) is not None:
            raise early
        return Run(case, out, comm, lock=lock).from_checkpoint(state)


def _lock_to_resume(out: Path) -> Lock:
    """The lock of a folder. Raises FileNotFoundError for one that no run has written, which stays as it is."""
    if not (out / LOCK).exists() and not list_checkpoints(out / "checkpoint"):
        raise FileNotFoundError(f"no usable checkpoint in {out / 'checkpoint'}")
    return Lock(out)


@dataclass
class Run:
    """One run of a case on all processes; files are written by rank 0."""

    case: Case
    out: Path
    comm: Any
    record: RunRecord = field(default_factory=RunRecord)
    probes: dict[str, float] = field(default_factory=dict)  #: latest values
    balances: dict[str, float] = field(default_factory=dict)  #: latest values
    state: State = field(default_factory=dict)  #: after the last accepted step
    good: State = field(default_factory=dict)  #: the same as a checkpoint keeps it, whole on rank 0
    good_at: State = field(default_factory=dict)  #: its step and time
    lock: Lock | None = None  #: of the folder, on rank 0
    before: State = field(default_factory=dict)  #: settings and meshes of the checkpoint, if the run is resumed
    simulation: Simulation = field(init=False)  #: what is computed, from when it is built
    scheme: Watched = field(init=False)  #: its scheme, with the sentinels
    ended_by: Finding | None = field(init=False, default=None)  #: what ends it after the step it was found in
    described: str = field(init=False)  #: settings and meshes as text, for checkpoints
    history: HistoryWriter = field(init=False)  #: on rank 0
    fields: FieldWriter | VtkHdfWriter = field(init=False)  #: on rank 0
    obstacles: Callable[[float], list[Snapshot]] = field(init=False)  #: at a time, on rank 0

    def __post_init__(self) -> None:
        self.root = self.comm.rank == 0
        self.clock = clock_of(self.case)
        self.record.residual_steps = self.case.output.residuals
        self.stop = StopWatch(self._give_up if self.root else None)
        self.monitor = Monitor(enabled=self.root, live=self.comm.size == 1, log=self.out / "log.txt")

    # ------------------------------------------------------------------------------------------------- start

    def from_start(self) -> int:
        """Compute from the initial state."""
        with self._shown():
            simulation = self._build()
            self._initialise(simulation)
            if self.root:
                self.history = HistoryWriter(self.out / "history.csv")
                self._start_fields(self._writer(self.out / "fields"))
            self._write_fields()
            return self._watched_loop()

    def _initialise(self, simulation: Simulation) -> None:
        """Set the state at the first time. Raises CaseError if it cannot be computed."""
        with self.record.timer("start"):
            initialise(self.case, simulation, self.scheme, self.clock.nominal)

    def from_checkpoint(self, state: State) -> int:
        """Compute from a checkpoint. Raises OSError for one of another version of fsci."""
        from solvers.mesh.distributed import scatter

        with self._shown():
            self.before = json.loads(_entry(state, "case"))
            changes = changed(self.case, self.before["settings"])
            if any(change.concerns(*SETTINGS_OF_MOTION) for change in changes):
                on_first(self.comm, lambda: require_continuous(self.case, state))
            self._initialise(self._build())
            with self.record.timer("start"):
                try:
                    self.record.restore(state["record"])
                    self.clock.restore(state["clock"])
                    self.scheme.restore(scatter(self.comm, state["scheme"], self.scheme.save()))
                except KeyError as missing:
                    raise _of_another_version(missing) from None
            if any(change.concerns(*MATERIALS) for change in changes):
                self.simulation.take_materials()
            for change in changes:
                self.monitor.say(f"changed: {change}")
            if self.root:
                keep_case(self.case, self.out)
                (self.out / "STOP").unlink(missing_ok=True)
                self.history = HistoryWriter(self.out / "history.csv", resume_after=self.clock.step)
                self._start_fields(self._writer.resume(self.out / "fields", self.clock.time))
            return self._watched_loop()

    @contextmanager
    def _shown(self) -> Iterator[None]:
        """Show messages to the user and write them to the log."""
        from solvers import fem

        with self.monitor, fem.listening(self.monitor.say):
            yield

    def _build(self) -> Simulation:
        from fsci.builder.build import build

        with self.record.timer("start"):
            self.simulation = build(self.case, self.comm, self.record.timer)
        self.scheme = Watched(self.simulation.scheme, self.simulation.sentinels, self.record.timer, self.case.worded)
        on_first(self.comm, self._require_meshes)
        self.described = json.dumps({"settings": settings_of(self.case), "meshes": self.case.meshes})
        return self.simulation

    def _require_meshes(self) -> None:
        """Raises CaseError if the checkpoint is of other meshes."""
        if problems := list(meshes_changed(self.case, self.before.get("meshes", {}), self.case.meshes)):
            raise CaseError(problems)

    # -------------------------------------------------------------------------------------------------- loop

    def _watched_loop(self) -> int:
        """The loop with signals caught."""
        clock, title, dofs, notes = self.clock, self.case.title, self.simulation.dofs, self.simulation.notes
        begin, end, now = clock.start, clock.end, clock.time
        self.monitor.start(title, dofs, self.comm.size, begin=begin, end=end, time=now, notes=notes)
        self._keep()
        with self.stop:
            try:
                return self._loop()
            except OSError as error:
                raise OSError(error.errno, f"{describe(error)}. {self._rescue()}") from error
            except Exception as error:
                error.add_note(self._rescue())
                raise

    def _rescue(self) -> str:
        """Try to write the state of the last accepted step after an error; what to say about it."""
        if not self.root:
            return "Process 0 writes the state of the last good step if it can; continue with fsci resume."
        step, own = self.good_at["step"], self.out / "checkpoint"
        elsewhere = f"fsci_{self.out.resolve().name}_"
        for folder_of in (lambda: own, lambda: Path(tempfile.mkdtemp(prefix=elsewhere))):
            try:
                folder = folder_of()
                path = write_checkpoint(folder, self.good | {"record": self.record.save()}, self.good_at)
            except (OSError, MemoryError, CaseError):
                continue
            where = "" if folder == own else f"; move it into {own}"
            return f"The state after step {step} is in {path}{where}; continue with fsci resume."
        return f"The state after step {step} could not be written either."

    def _asked_to_stop(self) -> bool:
        """Whether any process got a signal, or the results folder has a file STOP (collective)."""
        requested = self.stop.requested or (self.root and (self.out / "STOP").exists())
        return bool(self.comm.allreduce(int(requested)))

    def _loop(self) -> int:
        every = self.case.output.checkpoint_every
        while not self.clock.done:
            if self._asked_to_stop():
                return self._end("stopped", f"stopped at time {self.clock.time:g}; continue with fsci resume")
            try:
                self.take_step()
            except StepFailed as failure:
                return self._fail(failure)
            if self.ended_by is not None:
                return self._end("finished", f"{self.ended_by.message}, at time {self.clock.time:g}")
            if every and self.clock.step % every == 0:
                with self.stop.files:
                    self._write_checkpoint()
        return self._end("finished", "")

    def take_step(self) -> None:
        """Take one accepted step. Raises StepFailed if it fails after all halvings."""
        before, clock = self.record.wall(), self.clock
        info = take_step(self.scheme, clock, self.state, self._explained, self._repeat, self._keep_failure)
        dt = clock.dt
        with self.stop.files:
            clock.accept()
            self.ended_by = next((finding for finding in info.findings if finding.ends_run), None)
            self.record.accept(clock.step, info)
            self._note(dt, info, before)
            if _is_power_of_two(clock.step):
                self._measure_resolution()
            every = self.case.output.fields_every
            if clock.done or self.ended_by is not None or (every and clock.step % every == 0):
                self._write_fields()
            self._keep()

    def _explained(self, failure: StepFailed) -> StepFailed:
        return with_cause(failure, self.case, self.clock.time, self.comm)

    def _repeat(self, failure: StepFailed) -> None:
        """Note that a step is taken again."""
        self.record.retry()
        self.monitor.retry(failure, self.clock.dt)

    def _keep(self) -> None:
        """Store the state of the last accepted step, for retries and checkpoints."""
        from solvers.mesh.distributed import gather

        with self.record.timer("checkpoint"):
            self.state = self.scheme.save()
            clock = self.clock
            self.good = {"scheme": gather(self.comm, self.state), "clock": clock.save(), "case": self.described}
            self.good_at = {"step": clock.step, "time": clock.time, "title": self.case.title}

    def _note(self, dt: float, info: StepInfo, before: float) -> None:
        """Write one line to the history and to the screen."""
        with self.record.timer("probes"):
            self.probes, self.balances = self.simulation.probes(), self.simulation.balances()
        wall = self.record.wall() - before
        numbers = {"residual": info.residuals[-1], **self.probes, **info.numbers, **self.balances}
        if self.root:
            clock = self.clock
            self.history.write(clock.step, clock.time, dt, info.iterations, wall, numbers)
            self.monitor.step(clock.step, clock.time, dt, info, wall)
            for note in info.notes:
                self.monitor.say(note)
            for finding in self.record.warn(clock.time, [*info.findings, *not_numbers(self.case, numbers)]):
                self.monitor.warn(finding.message)

    def _measure_resolution(self) -> None:
        """Note how well the grid resolves the present flow: at steps 1, 2, 4, 8, ... and at the end (collective)."""
        if self.case.fluid is None:
            return
        with self.record.timer("resolution"):
            found = self.simulation.resolution()
        if found:
            self.record.note_resolution(resolved(found, flow_element(self.case).element))

    # ------------------------------------------------------------------------------------------------- files

    @property
    def _writer(self) -> type[FieldWriter] | type[VtkHdfWriter]:
        return VtkHdfWriter if self.case.output.format == "vtkhdf" else FieldWriter

    def _start_fields(self, writer: FieldWriter | VtkHdfWriter) -> None:
        from fsci.builder.obstacles import obstacle_snapshots

        self.fields, self.obstacles = writer, obstacle_snapshots(self.case)

    def _write_fields(self) -> None:
        with self.record.timer("output"):
            snapshots = self.simulation.snapshots()
            if self.root:
                parts = [*snapshots, *self.obstacles(self.clock.time)]
                self.fields.write(self.clock.step, self.clock.time, parts)

    def _write_checkpoint(self) -> None:
        """Write the state of the last accepted step."""
        if self.root:
            with self.record.timer("checkpoint"):
                state = self.good | {"record": self.record.save()}
                write_checkpoint(self.out / "checkpoint", state, self.good_at)

    def _keep_failure(self, failure: StepFailed) -> None:
        """Write the folder `failure`: the case, the position of the failure, and the fields of the last iterate."""
        snapshots = self.simulation.snapshots()
        if not self.root:
            return
        folder = self.out / "failure"
        make_folder(folder)
        FieldWriter(folder / "fields").write(self.clock.step + 1, self.clock.time + self.clock.dt, snapshots)
        keep_case(self.case, folder)
        what = {
            "field": failure.field,
            "kind": failure.kind.value,
            "reason": failure.reason,
            "iteration": failure.iteration,
            "where": failure.where,
            "residuals": failure.history,
            "step": self.clock.step + 1,
            "time": self.clock.time,
            "dt": self.clock.dt,
        }
        write_text(folder / "failure.json", json.dumps(what, indent=2) + "\n")

    # --------------------------------------------------------------------------------------------------- end

    def _fail(self, failure: StepFailed) -> int:
        clock = self.clock
        if failure.finding is not None:
            self.record.warn(clock.time + clock.dt, [failure.finding])
        if self.root:
            with self.stop.files:
                state = self.good | {"clock": clock.save(), "record": self.record.save()}
                write_checkpoint(self.out / "failure", state, self.good_at)
        message = f"step {clock.step + 1} from time {clock.time:g} failed with dt = {clock.dt:.3g}: {failure}"
        return self._end("failed", message)

    def _end(self, status: str, message: str) -> int:
        """Checkpoint, summary and verification; the exit code is the same on all processes."""
        with self.stop.files:
            self.stop.ended()
            if status != "failed" and not _is_power_of_two(self.clock.step):
                self._measure_resolution()
            self._write_checkpoint()
            memory = max(self.comm.allgather(memory_mb()))
            code = None
            if self.root:
                self.history.close()
                code = self._summarize(status, message, memory)
        return self.comm.bcast(code, root=0)

    def _give_up(self) -> None:
        """End all processes within a step after a signal; results end with the last accepted step."""
        code = FAILED
        try:
            self._write_checkpoint()
            message = f"stopped within a step, at time {self.good_at['time']:g}; continue with fsci resume"
            code = self._summarize("stopped", message, memory_mb())
        finally:
            self.monitor.close()
            if self.lock is not None:
                self.lock.close()
            sys.stdout.flush()
            if self.comm.size > 1:
                self.comm.Abort(code)
            os._exit(code)

    def _summarize(self, status: str, message: str, memory: float) -> int:
        history = read_history(self.out / "history.csv")
        results = evaluate(history, self.case.verify) if status == "finished" else []
        data = summarize(
            self.record,
            history,
            status=status,
            title=self.case.title,
            processes=self.comm.size,
            dofs=self.simulation.dofs,
            memory=memory,
            probes=list(self.probes),
            balances=list(self.balances),
            verify=results,
            units=self.case.units.model_dump(),
            message=message,
            imbalance=self.simulation.imbalance(),
        )
        write_summary(self.out / "summary.json", data)
        return self._report(status, message, results)

    def _report(self, status: str, message: str, results: list[dict[str, Any]]) -> int:
        for result in results:
            word = "ok    " if result["ok"] else "MISSED"
            kind = "earlier result" if result["regression"] else "reference"
            found = f"{result['value']:.6g}, {kind} {result['reference']:.6g} +- {result['tolerance']:.2g}"
            self.monitor.say(f"verify {word} {result['name']}: {found} {result['message']}".rstrip())
        coarse = worst_by_body(self.record.resolution.values())
        for words in coarse:
            self.monitor.warn(words)
        missed = any(not result["ok"] for result in results)
        if status == "finished":
            reason = f"{message}; " if message else ""
            message = f"{reason}finished in {self.record.wall():.3g} s; results in {self.out}"
            if count := len(self.record.warnings) + len(coarse):
                message += f"; {count} warning{'s' * (count > 1)} above and in summary.json"
            message += "; the verification failed" if missed else ""
            self.monitor.say(f"time: {shares(self.record.wall(), self.record.timer.seconds)}")
        self.monitor.finish(message, ok=status == "finished" and not missed)
        return {"finished": FAILED if missed else FINISHED, "stopped": STOPPED, "failed": FAILED}[status]


def _is_power_of_two(step: int) -> bool:
    """The steps after which the resolution is measured: 1, 2, 4, 8, ..."""
    return step & (step - 1) == 0


def _entry(state: State, name: str) -> Any:
    """An entry of a checkpoint. Raises OSError if another version of fsci wrote it."""
    try:
        return state[name]
    except KeyError as missing:
        raise _of_another_version(missing) from None


def _of_another_version(missing: KeyError) -> OSError:
    reason = f"the checkpoint has no entry {missing}: another version of fsci wrote it"
    return OSError(f"{reason}; run the case again")
