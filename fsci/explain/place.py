"""The position of a failure: body, node, cell, values of fields, and contact pairs of the body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case

#: What is written as zero: a distance relative to the extent of the body, a component relative to the largest one.
#: Single precision has a rounding error of 1e-7, double precision one of 1e-16; nodes are further apart than either.
WRITTEN_AS_ZERO = 1e-9


@dataclass(frozen=True)
class Nearest:
    """The node of the written fields nearest to a position."""

    part: str  #: body, or fluid
    node: int
    cell: int
    distance: float  #: [m]
    extent: float  #: largest edge of the box around the part [m]
    values: dict[str, NDArray[np.float64]]  #: point fields there


def nearest_node(fields: Path, where: Sequence[float]) -> Nearest | None:
    """The nearest node of all parts in a folder of fields, in the undeformed bodies; None without fields."""
    import meshio

    point = np.pad(np.asarray(where, dtype=float), (0, 3 - len(where)))
    found: list[Nearest] = []
    for path in sorted(fields.glob("*.vtu")):
        mesh = meshio.read(path)
        displacement = mesh.point_data.get("displacement", np.zeros_like(mesh.points))
        distances = np.linalg.norm(mesh.points - displacement - point, axis=1)
        if len(distances) == 0 or np.all(np.isnan(distances)):
            continue
        node = int(np.nanargmin(distances))
        cells = [row for block in mesh.cells for row in block.data]
        cell = next((number for number, nodes in enumerate(cells) if node in nodes), -1)
        values = {name: np.asarray(data[node], dtype=float) for name, data in mesh.point_data.items()}
        extent = float(np.ptp(mesh.points, axis=0).max())
        found.append(Nearest(path.stem.rpartition("_")[0], node, cell, float(distances[node]), extent, values))
    return min(found, key=lambda one: one.distance, default=None)


def pairs_of(case: Case, body: str) -> list[str]:
    """The contact pairs of the case file that a body takes part in."""
    pairs = {} if case.contact is None else case.contact.pairs
    return [name for name, pair in pairs.items() if body in (pair.sides[0][1].body, pair.sides[1][1].body)]


def describe(near: Nearest, case: Case) -> list[str]:
    """Lines of text on body, node, cell and fields at the position."""
    away = (
        "at this place"
        if near.distance <= WRITTEN_AS_ZERO * near.extent
        else f"{near.distance:.3g} {case.units.length} away"
    )
    lines = [f"nearest node   {near.node} of {near.part}, in its cell {near.cell}, {away}"]
    for name, value in near.values.items():
        components = np.atleast_1d(value)
        rounding = WRITTEN_AS_ZERO * np.abs(components).max(initial=0.0)
        numbers = ", ".join(f"{0.0 if abs(each) <= rounding else each:.4g}" for each in components)
        lines.append(f"  {name:17s} {numbers}")
    if pairs := pairs_of(case, near.part):
        lines.append(f"contact pairs  {', '.join(pairs)}")
    return lines
