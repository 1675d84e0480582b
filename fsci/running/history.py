"""history.csv: one line per accepted step, complete as soon as the step is."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from fsci.running.files import open_to_append, refused, write_text

COLUMNS = ("step", "time", "dt", "iterations", "wall")

History = dict[str, NDArray[np.float64]]


class HistoryWriter:
    """Appends to a history file; the first row decides which columns follow the fixed ones.

    Later rows may have more: what begins then, as contact with a wall that comes near, was zero before.

    Given `resume_after`, rows of later steps and a half-written last one are dropped and writing continues there;
    otherwise an existing file is replaced. A resumed run may have other columns: new ones are the last and nan in
    earlier rows, and those that it no longer has are nan from then on. Numbers keep full precision, lines are written
    at once.
    """

    def __init__(self, path: Path, *, resume_after: int | None = None):
        """Raises CaseError if the file that is to be continued is not a history."""
        self.path = path
        self.columns: list[str] | None = None
        self._absent: set[str] = set()  # columns of earlier rows only
        self._earlier: list[str] | None = None  # rows before a resumed run, until its first row decides the columns
        if resume_after is not None and path.exists() and (lines := complete_lines(path)):
            self.columns = column_names(path, lines[0])[len(COLUMNS) :]
            self._earlier = [line for line in lines[1:] if _step(path, line) <= resume_after]
            self.file = self._begin([*COLUMNS, *self.columns], self._earlier)
        else:
            self.file = self._begin([], [])

    def _begin(self, names: Sequence[str], rows: Sequence[str]) -> TextIO:
        """Replace the file; returns it, to append to."""
        write_text(self.path, "".join(f"{line}\n" for line in (*([",".join(names)] if names else []), *rows)))
        return open_to_append(self.path)

    def write(
        self, step: int, time: float, dt: float, iterations: int, wall: float, numbers: Mapping[str, float]
    ) -> None:
        """Adds one step that took `wall` seconds; raises ValueError if columns are missing or come back."""
        if self.columns is None:
            self.columns = list(numbers)
            print(*COLUMNS, *self.columns, sep=",", file=self.file)
        elif self._earlier is not None:
            self._continue(numbers, self._earlier)
            self._earlier = None
        if numbers.keys() & set(self.columns) != set(self.columns) - self._absent:
            different = ", ".join(sorted(numbers.keys() ^ (set(self.columns) - self._absent)))
            raise ValueError(f"history.csv: step {step} and the first one differ in the columns {different}")
        if new := [name for name in numbers if name not in self.columns]:
            self._widen(new, "0.0", complete_lines(self.path)[1:])
        fixed = [str(int(step)), repr(float(time)), repr(float(dt)), str(int(iterations)), repr(float(wall))]
        print(
            *fixed,
            *(repr(float(numbers.get(name, math.nan))) for name in self.columns),
            sep=",",
            file=self.file,
            flush=True,
        )

    def _continue(self, numbers: Mapping[str, float], earlier: Sequence[str]) -> None:
        """Let the columns be those of earlier rows and of the first new one."""
        assert self.columns is not None
        new = [name for name in numbers if name not in self.columns]
        self._absent = set(self.columns) - numbers.keys()
        if new:
            self._widen(new, "nan", earlier)

    def _widen(self, new: Sequence[str], value: str, earlier: Sequence[str]) -> None:
        """Add columns, with this value in earlier rows."""
        assert self.columns is not None
        self.columns += new
        self.file.close()
        self.file = self._begin([*COLUMNS, *self.columns], [line + f",{value}" * len(new) for line in earlier])

    def close(self) -> None:
        self.file.close()


def read_history(path: Path) -> History:
    """Reads column name -> values, shape (steps,); no columns if nothing was written yet.

    Raises CaseError for a file that is not a history.
    """
    lines = complete_lines(path)
    if not lines:
        return {}
    names = column_names(path, lines[0])
    if len(lines) == 1:
        return {name: np.empty(0) for name in names}
    try:
        table = np.loadtxt(lines[1:], delimiter=",", ndmin=2)
        return dict(zip(names, table.T, strict=True))
    except ValueError as error:
        raise refused(path, f"is not the history of a run: {error}") from None


def complete_lines(path: Path) -> list[str]:
    """The lines of a file that end as lines should; a kill may leave the last one short."""
    try:
        return path.read_text(encoding="utf-8").split("\n")[:-1]
    except UnicodeDecodeError:
        raise refused(path, "is not the history of a run: it is not UTF-8 text") from None


def column_names(path: Path, line: str) -> list[str]:
    """The columns in the first line of a history. Raises CaseError for what cannot be one: they name pictures, too."""
    names = line.split(",")
    wrong = [name for name in names if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_.-]*", name)]
    if wrong or names[: len(COLUMNS)] != list(COLUMNS) or len(set(names)) < len(names):
        what = f"'{wrong[0]}' is not the name of a column" if wrong else f"it begins with {', '.join(COLUMNS)}"
        raise refused(path, f"line 1 is not that of a history: {what}")
    return names


def _step(path: Path, line: str) -> int:
    try:
        return int(line.split(",", 1)[0])
    except ValueError:
        raise refused(path, f"is not the history of a run: '{line[:40]}' has no number of a step") from None
