"""Comparison of two files of benchmark results: ratios of times, memory and errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fsci.bench.table import Row

#: Units of the columns that are compared; smaller is better.
COSTS = ("[s]", "[ms]", "[us]", "[MB]", "[%]")


def compare(now: Mapping[str, Sequence[Row]], before: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[Row]:
    """A row for each row that both have: the ratios now/before of all costs.

    Rows belong together if all their words, and counts that are no costs, are equal.
    """
    found: list[Row] = []
    for name in now:
        earlier = {_key(row): row for row in before.get(name, ())}
        for row in now[name]:
            if (other := earlier.get(_key(row))) is None:
                continue
            words = " ".join(str(value) for column, value in row.items() if _is_word(column, value))
            for column, value in row.items():
                was = other.get(column)
                if _is_cost(column) and isinstance(value, int | float) and isinstance(was, int | float) and was:
                    found.append(
                        {"benchmark": name, "row": words, "column": column, "before": was, "now": value,
                         "now/before": float(value / was)}
                    )  # fmt: skip
    return found


def _is_cost(column: str) -> bool:
    return column.endswith(COSTS)


def _is_word(column: str, value: object) -> bool:
    return isinstance(value, str) and value != "" and column != "front"


def _key(row: Mapping[str, Any]) -> tuple[tuple[str, Any], ...]:
    return tuple((column, value) for column, value in row.items() if _is_word(column, value) or column == "dofs")
