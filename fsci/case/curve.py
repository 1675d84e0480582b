"""Section `curves`: functions of one variable given by points, which expressions call by their names."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, PrivateAttr, ValidationInfo, model_validator

from fsci.case.plain_file import Unreadable, read_file
from fsci.case.section import Section, fault, setting
from fsci.case.values import EntryCount, Name, Number, Switch, Text
from fsci.distinct import distinct
from fsci.expression import RESERVED_WORDS

#: Size [bytes] of a file of points. It has a million of them, more than a run has time steps, and is read in a second.
MOST_BYTES_OF_CURVE = 30_000_000

Array = NDArray[np.float64]
Point = Annotated[tuple[Number, ...], EntryCount(2, 2)]


class Curve(Section):
    """A function that expressions call by its name: with `curves: {pulse: {table: [[0, 0], [1, 5]]}}`, `2*pulse(t)`.

    Before the first point and after the last one it keeps their values.
    """

    table: Annotated[tuple[Point, ...], EntryCount(2, None)] | None = setting(
        None, "points [t, value], one after the other"
    )
    csv: Text | None = setting(
        None, "file with the points, relative to the case file: two columns, t and value, with or without a header line"
    )
    smooth: Switch = setting(
        False, "true: monotone cubic interpolation (C1), with zero slope at extrema and at both ends; else linear"
    )

    _points: Array = PrivateAttr()

    @model_validator(mode="after")
    def _read(self, info: ValidationInfo) -> Curve:
        if (self.table is None) == (self.csv is None):
            raise fault("a curve needs either 'table' or 'csv'")
        if self.csv is not None:
            self._points = _read_csv((info.context or {}).get("folder", Path()), self.csv)
            if (late := _not_later(self._points)) is not None:
                before, after = distinct(*late)
                raise fault(f": '{self.csv}' must have increasing times, not go from {before} to {after}", "csv")
            return self
        self._points = np.array(self.table)
        if (late := _not_later(self._points)) is not None:
            row = int(np.flatnonzero(np.diff(self._points[:, 0]) <= 0.0)[0]) + 1
            words = "must be greater than {}, the one before, not {}".format(*distinct(*late))
            raise fault(words, "table", row, 0)
        return self

    @property
    def points(self) -> Array:
        """Times and values, shape (n, 2)."""
        return self._points

    def __call__(self, t: ArrayLike) -> Array:
        """Values at the times t, of the same shape."""
        times, values = self._points.T
        t = np.asarray(t, dtype=float)
        if not self.smooth:
            return np.asarray(np.interp(t, times, values))
        from scipy.interpolate import PchipInterpolator

        # one more point on both sides, so that slopes vanish at the ends, as in the constant continuation
        times, values = np.pad(times, 1, mode="reflect", reflect_type="odd"), np.pad(values, 1, mode="edge")
        return np.asarray(PchipInterpolator(times, values)(np.clip(t, times[1], times[-2])))


def _not_later(points: Array) -> tuple[float, float] | None:
    """The first two neighbours whose times do not increase."""
    wrong = np.flatnonzero(~(np.diff(points[:, 0]) > 0.0))
    return (points[wrong[0], 0], points[wrong[0] + 1, 0]) if len(wrong) else None


def _read_csv(folder: Path, name: str) -> Array:
    try:
        raw = read_file(folder / name, MOST_BYTES_OF_CURVE)
        lines = raw.decode("utf-8-sig").splitlines()
    except Unreadable as error:
        raise fault(f": '{name}' {error}", "csv") from None
    except ValueError:
        raise fault(f": '{name}' cannot be read: it is not UTF-8 text", "csv") from None
    rows = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and line.lstrip()[0] != "#"]
    if rows and not _is_number(_words(rows[0][1])[0]):  # a heading
        del rows[0]
    if len(rows) < 2:
        raise fault(f": '{name}' has {len(rows)} points, at least 2 are needed", "csv")
    if (points := _table([line for _, line in rows])) is not None:
        return points
    for number, line in rows:
        if _numbers(line) is None:
            decimals = re.search(r"\d,\d+\s*;", line)
            more = len(_words(line)) > 2 and all(map(_is_number, _words(line)))
            hint = "; decimals have a point" if decimals else "; a file has a time and one value in a line" * more
            raise fault(f": '{name}', line {number}: two numbers are expected, not '{line.strip()[:40]}'{hint}", "csv")
    return np.array([_numbers(line) for _, line in rows])


def _table(lines: list[str]) -> Array | None:
    """The numbers of lines that all have one separator, read at once; None for others, and for what is no table."""
    separator = next((mark for mark in ",;" if mark in lines[0]), None)
    try:
        table = np.loadtxt(lines, delimiter=separator, comments=None, ndmin=2)
    except ValueError:
        return None
    return table if table.shape[1] == 2 and np.isfinite(table).all() else None


def _numbers(line: str) -> tuple[float, float] | None:
    """Both numbers of a line; None if it has others."""
    try:
        first, second = map(float, _words(line))
    except ValueError:
        return None
    return (first, second) if np.isfinite([first, second]).all() else None


def _words(line: str) -> list[str]:
    return re.split(r"\s*[,;]\s*|\s+", line.strip())


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _callable(name: str) -> str:
    if name in RESERVED_WORDS:
        raise fault(f"must be another name: '{name}' is built into expressions")
    if "-" in name:
        raise fault(f"must be a name without '-', which means minus in expressions, not '{name}'")
    return name


CurveName = Annotated[Name, BeforeValidator(lambda name: _callable(name) if isinstance(name, str) else name)]


def functions(data: Any, folder: Path) -> dict[str, Callable[[ArrayLike], Array]]:
    """The curves of a case by name. Invalid ones are zero here; the case reports them at their positions."""
    found: dict[str, Callable[[ArrayLike], Array]] = {}
    for name, value in data.items() if isinstance(data, dict) else ():
        try:
            found[name] = Curve.model_validate(value, context={"folder": folder})
        except ValueError:
            found[name] = np.zeros_like
    return found
