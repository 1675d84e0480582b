"""Results of a benchmark as an aligned table."""

from __future__ import annotations

from collections.abc import Sequence

Row = dict[str, float | int | str]  #: column -> value; the rows of one table have the same columns


def show(rows: Sequence[Row]) -> str:
    """Rows under their column names; numbers with three digits, to the right."""
    table = [list(rows[0]), *([text(value) for value in row.values()] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = ("  ".join(word.rjust(width) for word, width in zip(line, widths, strict=True)) for line in table)
    return "\n".join(f"  {line}" for line in lines)


def text(value: float | int | str) -> str:
    """A value in three digits."""
    if isinstance(value, float):
        return f"{value:#.3g}".rstrip(".") if 1e-3 <= abs(value) < 1e3 or value == 0.0 else f"{value:.3g}"
    return str(value)
