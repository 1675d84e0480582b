"""Results of a benchmark as an aligned table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Row = dict[str, Any]  #: column -> number or word; the rows of one table have the same columns

#: Columns of error against time
TIME, ERROR, UNKNOWNS, MEMORY, FRONT = "time [s]", "error [%]", "unknowns", "memory [MB]", "front"
LEVEL = "level"  #: of a row, what bands are made of; no column (fsci/bench/bands.py)


def show(rows: Sequence[Row]) -> str:
    """Rows under their column names; numbers with three digits, to the right."""
    columns = [column for column in rows[0] if column != LEVEL]
    table = [columns, *([text(row[column]) for column in columns] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = ("  ".join(word.rjust(width) for word, width in zip(line, widths, strict=True)) for line in table)
    return "\n".join(f"  {line}" for line in lines)


def text(value: float | int | str) -> str:
    """A value in three digits."""
    if isinstance(value, float):
        return f"{value:#.3g}".rstrip(".") if 1e-3 <= abs(value) < 1e3 or value == 0.0 else f"{value:.3g}"
    return str(value)
