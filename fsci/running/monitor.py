"""The output of a run: one line per step, on a terminal with a progress bar, and the same lines in a log."""

from __future__ import annotations

import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

from fsci.running.files import open_to_append
from solvers.api import StepFailed, StepInfo

ACTIVE = "contact.active"  #: the number of StepInfo that counts active contact nodes
HEADER_EVERY = 40  #: lines between two table headers
COLUMN_WIDTHS = {
    "step": 6,
    "time": 10,
    "dt": 9,
    "its": 4,
    "residual": 9,
    "last": 9,
    "active": 7,
    "wall": 9,
    "left": 9,
}  #: title and width of each column of the table


class Monitor:
    """Shows the progress of a run on `stream` and in a log file; silent unless `enabled` (rank 0).

    `live` allows colours and a progress bar on a terminal; mpirun gives its processes one that is none.
    """

    def __init__(
        self, *, enabled: bool = True, live: bool = True, log: Path | None = None, stream: TextIO | None = None
    ):
        self.enabled = enabled
        self.stream = stream or sys.stdout
        self.live = live and self.stream.isatty()
        self.log = open_to_append(log) if enabled and log else None
        self.progress: Any = None  # rich's progress bar, on a terminal
        self.task: Any = None  # that of the bar
        self.begin = self.end = 0.0
        self.lines = 0
        self.columns: Collection[str] = ()
        self.pace = 0.0  # wall time per unit of simulated time, averaged over the last steps

    def __enter__(self) -> Monitor:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def start(
        self,
        title: str,
        dofs: Mapping[str, int],
        processes: int,
        *,
        begin: float,
        end: float,
        time: float,
        notes: Sequence[str] = (),
    ) -> None:
        """The banner of a run from `begin` to `end`; `time` is later than `begin` when it is resumed."""
        self.begin, self.end = begin, end
        sizes = ", ".join(f"{name} {count:,} dofs" for name, count in dofs.items())
        self.say(title, style="bold")
        self.say(f"{sizes}; {processes} process{'es' if processes > 1 else ''}; time {time:g} to {end:g}")
        for note in notes:
            self.say(note)
        if self.enabled and self.live:
            self.progress = start_progress(self.stream)
            self.task = self.progress.add_task("", total=end - begin, completed=time - begin)

    def step(self, step: int, time: float, dt: float, info: StepInfo, wall: float) -> None:
        """The line of an accepted step; `wall` is its duration [s]."""
        self.pace = wall / dt if self.lines == 0 else 0.9 * self.pace + 0.1 * wall / dt
        left = max(self.end - time, 0.0) * self.pace
        active = info.numbers.get(ACTIVE)
        cells = {
            "step": f"{step}",
            "time": f"{time:.6g}",
            "dt": f"{dt:.3g}",
            "its": f"{info.iterations}",
            "residual": f"{info.residuals[0]:.2e}" if info.residuals else "",
            "last": f"{info.residuals[-1]:.2e}" if info.residuals else "",
            "active": "" if active is None else f"{active:g}",
            "wall": duration(wall),
            "left": duration(left),
        }
        if active is None:
            del cells["active"]
        if self.lines % HEADER_EVERY == 0 or cells.keys() != self.columns:
            self.columns = cells.keys()
            self.say(align({name: name for name in cells}), style="bold")
        self.lines += 1
        self.say(align(cells))
        if self.progress:
            self.progress.update(self.task, completed=time - self.begin, description=f"{duration(left)} left")
            self.progress.refresh()

    def retry(self, failure: StepFailed, dt: float) -> None:
        """Says that a step failed and is repeated with the smaller step `dt`."""
        self.warn(f"{failure}; repeated with dt = {dt:.3g}")

    def warn(self, text: str) -> None:
        """A note to the user."""
        self.say(f"warning: {text}", style="yellow")

    def finish(self, text: str, *, ok: bool = True) -> None:
        """The last words of a run, once the progress bar is gone."""
        self.stop_progress()
        self.say(text, style="bold green" if ok else "bold red")

    def close(self) -> None:
        """Gives the terminal back, also after an exception."""
        self.stop_progress()
        if self.log:
            self.log.close()
            self.log = None

    def stop_progress(self) -> None:
        if self.progress:
            self.progress.stop()
            self.progress = None

    def say(self, text: str, *, style: str = "") -> None:
        """Write one line, coloured on a terminal."""
        if not self.enabled:
            return
        if self.live:
            console(self.progress, self.stream).print(text, style=style, markup=False, highlight=False, soft_wrap=True)
        else:
            print(text, file=self.stream, flush=True)
        if self.log:
            print(text, file=self.log, flush=True)


def align(cells: Mapping[str, str]) -> str:
    """One line of the table."""
    return " ".join(f"{text:>{COLUMN_WIDTHS[name]}}" for name, text in cells.items())


def duration(seconds: float) -> str:
    """A time span in at most nine characters: 85 ms, 12.3 s, 4:05 min, 2:04 h, 12.5 d."""
    if seconds < 0.9995:
        return f"{1000 * seconds:.0f} ms"
    if seconds < 59.95:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes}:{rest:02d} min"
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d} h" if hours < 24 else f"{seconds / 86400:.1f} d"


def start_progress(stream: TextIO) -> Any:
    """The bar below the table; it is drawn once per step, not by a thread."""
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    columns = (BarColumn(bar_width=None), TaskProgressColumn(), TextColumn("{task.description}"))
    progress = Progress(*columns, console=console(None, stream), auto_refresh=False, transient=True)
    progress.start()
    return progress


def console(progress: Any, stream: TextIO) -> Any:
    """The stream of rich, above the progress bar if there is one."""
    from rich.console import Console

    return progress.console if progress else Console(file=stream)
