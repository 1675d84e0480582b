"""Values of a sweep over its first parameter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fsci.case import Case
from fsci.plot.lines import Line, plot_lines
from fsci.plot.units import label, literal, measured
from fsci.sweep.points import Combination, Parameter, short_names

SPREAD = 30.0  #: ratio of positive parameters from which their axis is logarithmic


def draw(
    out: Path,
    case: Case,
    several: Sequence[Parameter],
    found: Sequence[Combination],
    columns: Sequence[str],
    rows: Sequence[Mapping[str, Any]],
) -> Iterator[Path]:
    """Writes out/sweep_<probe>.png with a panel for each of its columns, and yields the files.

    Each combination of the other parameters is a line. `rows` have a number or None for each column.
    """
    first, *others = short_names([parameter.setting for parameter in several])
    texts = several[0].values
    known = numbers(texts)
    at = dict(zip(texts, known if known is not None else map(float, range(len(texts))), strict=True))
    names = [
        ", ".join(f"{other} = {value}" for other, value in zip(others, point.values[1:], strict=True))
        for point in found
    ]
    quantities = {name: probe.quantity for name, probe in case.probes.items()}
    families: dict[str, list[str]] = {}
    for column in columns:
        families.setdefault(column.split(" ")[0].rpartition(".")[0] or column, []).append(column)
    for family, members in families.items():
        panels: dict[str, dict[str, Line]] = {}
        quantity = measured(family, quantities)
        for column in members:
            points: dict[str, list[tuple[float, float]]] = {}
            for point, name, row in zip(found, names, rows, strict=True):
                if row[column] is not None:
                    points.setdefault(name, []).append((at[point.values[0]], row[column]))
            beside = label(column, quantity, case.units.model_dump(), flat=case.dimension == 2)
            panels[beside] = {name: _line(some) for name, some in points.items()}
        yield plot_lines(
            out / f"sweep_{family.replace(' ', '_')}.png",
            panels,
            literal(first),
            ticks=None if known is not None else {place: literal(text) for text, place in at.items()},
            logarithmic=known is not None and min(known) > 0.0 and max(known) > SPREAD * min(known),
        )


def _line(points: Sequence[tuple[float, float]]) -> Line:
    ordered = sorted(points)
    return [x for x, _ in ordered], [y for _, y in ordered]


def numbers(texts: Sequence[str]) -> list[float] | None:
    """All of these as numbers; None if one is none."""
    try:
        return [float(text) for text in texts]
    except ValueError:
        return None
