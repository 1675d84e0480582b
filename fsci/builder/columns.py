"""Columns of the history from probes."""

from __future__ import annotations

from collections.abc import Callable

#: Column of the history -> value.
Numbers = dict[str, float]


def columns(probes: dict[str, Callable[[], Numbers]]) -> Callable[[], Numbers]:
    """All probes as one function: NAME, or NAME.x for each component of a vector."""
    return lambda: {
        f"{name}.{part}" if part else name: value for name, probe in probes.items() for part, value in probe().items()
    }
