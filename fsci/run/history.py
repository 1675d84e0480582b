"""history.csv: one line per accepted step, complete as soon as the step is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fsci.run.output import write_text

COLUMNS = ("step", "time", "dt", "iterations", "wall")

History = dict[str, NDArray[np.float64]]


class HistoryWriter:
    """Appends to a history file; the first row decides which columns follow the fixed ones.

    Given `resume_after`, rows of later steps and a half-written last one are dropped and writing continues
    there; otherwise an existing file is replaced. Numbers keep full precision, lines are written at once.
    """

    def __init__(self, path: Path, *, resume_after: int | None = None):
        self.columns: list[str] | None = None
        if resume_after is not None and path.exists() and (lines := complete_lines(path)):
            self.columns = lines[0].split(",")[len(COLUMNS) :]
            rows = [line for line in lines[1:] if int(line.split(",", 1)[0]) <= resume_after]
            write_text(path, "".join(line + "\n" for line in [lines[0], *rows]))
            self.file = path.open("a", encoding="utf-8")
        else:
            self.file = path.open("w", encoding="utf-8")

    def write(
        self, step: int, time: float, dt: float, iterations: int, wall: float, numbers: Mapping[str, float]
    ) -> None:
        """Adds one step that took `wall` seconds; raises ValueError if the columns differ from the first."""
        if self.columns is None:
            self.columns = list(numbers)
            print(*COLUMNS, *self.columns, sep=",", file=self.file)
        if numbers.keys() != set(self.columns):
            different = ", ".join(sorted(numbers.keys() ^ set(self.columns)))
            raise ValueError(f"history.csv: step {step} and the first one differ in the columns {different}")
        fixed = [str(int(step)), repr(float(time)), repr(float(dt)), str(int(iterations)), repr(float(wall))]
        print(
            *fixed,
            *(repr(float(numbers[name])) for name in self.columns),
            sep=",",
            file=self.file,
            flush=True,
        )

    def close(self) -> None:
        self.file.close()


def read_history(path: Path) -> History:
    """Reads column name -> values, shape (steps,); no columns if nothing was written yet."""
    lines = complete_lines(path)
    if not lines:
        return {}
    names = lines[0].split(",")
    if len(lines) == 1:
        return {name: np.empty(0) for name in names}
    table = np.loadtxt(lines[1:], delimiter=",", ndmin=2)
    return dict(zip(names, table.T, strict=True))


def complete_lines(path: Path) -> list[str]:
    """The lines of a file that end as lines should; a kill may leave the last one short."""
    return path.read_text(encoding="utf-8").split("\n")[:-1]
