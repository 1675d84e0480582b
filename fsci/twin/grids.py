"""Other grids for the fluid of a case: coarser ones, and ones whose planes are moved by parts of a cell."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.case.grid import GridSection

Settings = tuple[tuple[str, str], ...]  #: dotted names of settings and their values as YAML text

#: Of twins only numbers are compared.
NO_FIELDS: Settings = (("output.fields_every", "0"),)

#: Layers of nested cells that stay, however large these are: fewer than three on a side of a body are refused.
LAYERS = 4


def coarser(grid: GridSection) -> Settings:
    """Cells twice as large."""
    return resized(grid, 2.0)


def resized(grid: GridSection, factor: float) -> Settings:
    """Cells `factor` times as large: so many fewer in each direction and stretch, and in the
    layers of refinements, of which LAYERS stay."""
    changes: dict[str, Any] = {}
    if grid.cells is not None:
        changes["cells"] = [None if count is None else resized_count(count, factor) for count in grid.cells]
    for name, stretches in zip("xyz", grid.graded, strict=False):
        for number, stretch in enumerate(stretches or ()):
            changes[f"{name}.{number}.cells"] = resized_count(stretch.cells, factor)
    for number, refinement in enumerate(grid.refine):
        if refinement.around is not None:
            layers = max(resized_count(refinement.layers, factor), min(refinement.layers, LAYERS))
            changes[f"refine.{number}.layers"] = layers
    return _settings(changes)


def resized_count(count: int, factor: float) -> int:
    """How many cells fill what `count` cells fill, if they are `factor` times as large: that with the nearest ratio."""
    fewer = max(1, int(count / factor))
    return fewer + (count / factor >= (1.0 - 1e-9) * math.sqrt(fewer * (fewer + 1)))


def shifted(grid: GridSection, shares: Sequence[float]) -> Settings:
    """As many cells, with the planes between them moved by `shares` of a cell in each direction; the box stays.

    A share lies between -1/2 and 1/2. The first cell grows by it and the last one shrinks, or the other way round.
    """
    changes: dict[str, Any] = {"cells": None}
    for name, planes, share in zip("xyz", grid.planes, shares, strict=False):
        changes[name] = _stretches(_moved(planes, share))
    return _settings(changes)


def low_discrepancy(dimension: int, count: int) -> NDArray[np.float64]:
    """`count` points that fill the cube from -1/2 to 1/2 evenly, of shape (count, dimension).

    They are multiples of (1/g, 1/g^2, ...) modulo 1 with the positive root g of g^(dimension + 1) = g + 1, M. Roberts'
    generalisation of the golden ratio.
    """
    g = 2.0
    for _ in range(60):  # the iteration contracts by less than a half
        g = (1.0 + g) ** (1.0 / (dimension + 1))
    steps = g ** -np.arange(1.0, dimension + 1.0)
    return (0.5 + np.outer(np.arange(1, count + 1), steps)) % 1.0 - 0.5


def _moved(planes: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Inner planes moved by a share of the mean of the cells on both sides."""
    moved = planes.copy()
    moved[1:-1] += share * (planes[2:] - planes[:-2]) / 2.0
    return moved


def _stretches(planes: NDArray[np.float64]) -> list[dict[str, Any]]:
    """The fewest stretches of equal cells with these planes."""
    sizes = np.diff(planes)
    ends = [*np.flatnonzero(np.abs(np.diff(sizes)) > 1e-9 * sizes.max()), len(sizes) - 1]
    counts = np.diff([-1, *ends])
    return [{"to": float(planes[end + 1]), "cells": int(count)} for end, count in zip(ends, counts, strict=True)]


def _settings(changes: dict[str, Any]) -> Settings:
    return tuple((f"fluid.grid.{name}", json.dumps(value)) for name, value in changes.items())
