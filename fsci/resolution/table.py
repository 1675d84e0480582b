"""Errors of forces by the cells in boundary layers and gaps: the table of `fsci bench resolution`.

A row is a run of a scene with a known force: what the run measured (`cells`), and its error. The error at other values
lies on a curve through the rows of a scene, by powers of the number of cells, and is the geometric mean of the scenes
of its kind that have so few cells.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Literal

#: A body without edges, with some in the plane, in space: by its boundary layer; a narrow gap; one that ends at edges.
Kind = Literal["smooth", "sharp", "sharp in space", "film", "ends"]
Curve = Sequence[tuple[float, float]]  #: (cells, error [%]), by increasing cells
Table = Mapping[tuple[str, str], Sequence[Curve]]  #: (kind, element) -> a curve for each scene

PATH = Path(__file__).parent / "table.json"

#: Power of the cells with which errors fall beyond the table: that of the elements; at edges the pressure is singular.
ORDER = {"smooth": 2.0, "sharp": 1.0, "sharp in space": 1.0, "film": 2.0, "ends": 2.0}
#: Errors below this [%] are not told apart.
LEAST_ERROR = 0.01


@cache
def table(by: Literal["cells", "across"] = "cells") -> Table:
    """The table of the program, by the cells in boundary layers and gaps, or by those across bodies."""
    return curves(json.loads(PATH.read_text())["results"]["resolution"], by)


def curves(rows: Sequence[Mapping[str, float | int | str]], by: str) -> Table:
    """Rows of `fsci bench resolution` by kind and element; errors that rise with the cells are taken as they are."""
    scenes: dict[tuple[str, str], dict[str, list[tuple[float, float]]]] = {}
    for row in rows:
        points = scenes.setdefault((str(row["kind"]), str(row["element"])), {}).setdefault(str(row["scene"]), [])
        points.append((float(row[by]), max(float(row["error [%]"]), LEAST_ERROR)))
    return {key: [sorted(points) for points in found.values()] for key, found in scenes.items()}


def error(kind: Kind, element: str, cells: float) -> float:
    """Error of a force [%] at so many cells in the boundary layer or gap, along films with q2q1: mean of the scenes."""
    if not math.isfinite(cells):
        return 0.0
    scenes = table()[kind, element]
    least = min(curve[0][0] for curve in scenes)
    found = [_on_curve(curve, cells, ORDER[kind]) for curve in scenes if curve[0][0] <= max(cells, least)]
    return math.exp(sum(map(math.log, found)) / len(found))


def error_of_ends(element: str, cells: float, along: float) -> float:
    """Error [%] of a film that ends at edges, with so many cells across and along it.

    With q2q1 each end is off by a part of a cell, by the cells across: rows have the error times the cells along.
    """
    return error("ends", element, cells) / (max(along, 1.0) if element == "q2q1" else 1.0)


def least_error(kind: Kind, element: str, across: float) -> float:
    """Error of a force [%] with so many cells across the body: the least of the scenes, in which flows differ."""
    return min(_on_curve(curve, across, ORDER[kind]) for curve in table("across")[kind, element])


def cells_for(error_of: Callable[[float], float], most: float, start: float) -> float:
    """Number of cells, from a start on, from which on the error is below `most` [%]."""
    cells = start
    while error_of(cells) > most:
        cells *= 1.02
    return cells


def _on_curve(curve: Curve, cells: float, order: float) -> float:
    (first, largest), (last, least) = curve[0], curve[-1]
    if cells <= first:
        return largest
    if cells >= last:
        return max(least * (last / cells) ** order, LEAST_ERROR)
    (x0, y0), (x1, y1) = next(part for part in pairwise(curve) if cells <= part[1][0])
    return y0 * (y1 / y0) ** (math.log(cells / x0) / math.log(x1 / x0))
