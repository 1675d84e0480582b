"""A leaflet of a valve in a round tube: a third of the section, or another part of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import radians
from typing import Annotated

import numpy as np

from fsci.shapes import lattice
from fsci.shapes.declaration import MeshPlan, ShapeError, Shapes, counts, meshed, not_negative, positive


@meshed
def leaflet(
    radius: Annotated[
        float, positive("radius at which the lips end; the edge below them is one thickness farther out")
    ],
    thickness: Annotated[float, positive("thickness of the leaflet")],
    height: Annotated[float, positive("from the lowest point of the edge at the wall, z = 0, to the top of the lips")],
    lip: Annotated[float, positive("height of the upright lips")],
    post: Annotated[float, positive("height of the sides at the wall below the lips")],
    cells: Annotated[
        Sequence[int],
        counts(
            3,
            "number of cells along the wall (even), through the thickness, and up (at least 2)",
            {0: (2, "along the wall")},
        ),
    ],
    angle: Annotated[float, positive("angle of the sector, at most 180", "degrees")] = 120.0,
    gap: Annotated[float, not_negative("distance at the axis between the lips of leaflets side by side")] = 0.0,
    *,
    order: int = 1,
    cell: str = "hex",
) -> MeshPlan:
    """Leaflet of a valve in a tube about the z axis; surfaces inner, lips, outer, bottom, top, start, end.

    Lips are the upright part of the inner side, whole rows of cells. Bottom, start and end are at the wall, the middle
    is on the x axis. The lips are half of the gap away from the straight sides of the sector at the axis, nothing at
    the wall.
    """
    if angle > 180:
        raise ShapeError(f"must be at most 180 degrees, not {angle:g}", "angle")
    if cells[2] < 2:
        raise ShapeError(f"the number of cells up must be at least 2, not {cells[2]}", "cells", 2)
    if lip + post >= height:
        raise ShapeError(f"'lip' and 'post' must be lower together than 'height', {height:g}", "lip")
    if thickness + gap / 2 >= radius / 2:
        raise ShapeError(f"must be less than half of 'radius', {radius:g}, with half of 'gap'", "thickness")
    around, through, up = cells
    nodes = lattice.product(
        lattice.product(
            lattice.line(through, order, ("inner", "outer")), lattice.line(around, order, ("start", "end"))
        ),
        lattice.line(up, order, ("bottom", "top")),
    )
    half = np.radians(angle / 2)
    rows = min(max(1, round(up * lip / height)), up - 1)  # of the lips
    edge = 1 - rows / up  # the part of t below the lips
    half_row = 0.25 / (order * up)

    def place(depth: lattice.Array, s: lattice.Array, t: lattice.Array) -> list[lattice.Array]:
        side, share = np.sign(2 * s - 1), np.abs(2 * s - 1)
        x, y = _lips(share, thickness * depth + gap / 2 * (1 - share**2), radius, half)
        foot = (height - lip - post) * (1 - np.cos(np.pi / 2 * share))
        # the foot's normal is that of the straight line to the lips; at the sides it is that of the lips
        turn = np.sin(np.pi / 2 * share) * (half - np.arcsin(thickness * depth / (radius + thickness)))
        slope = np.arctan2(height - lip - foot, radius * (1 - share)) * (1 - share)
        out = thickness * (depth - 0.5) * (1 - share)
        at_wall = radius + thickness + out * np.sin(slope)
        wall = at_wall * np.cos(turn), at_wall * np.sin(turn), foot + out * np.cos(slope)
        p = np.minimum(t / edge, 1)
        middle = (foot + height - lip) / 2
        return [
            (1 - p) ** 2 * wall[0] + (1 - (1 - p) ** 2) * x,
            side * ((1 - p) ** 2 * wall[1] + (1 - (1 - p) ** 2) * y),
            np.where(
                t < edge,
                (1 - p) ** 2 * wall[2] + 2 * p * (1 - p) * middle + p**2 * (height - lip),
                height - lip + lip * (t - edge) / (1 - edge),
            ),
        ]

    def with_lips(straight: lattice.NodeBlocks) -> lattice.NodeBlocks:
        inner, height = straight.sides["inner"], straight.points[straight.sides["inner"], 2]
        lips = {"inner": inner[height < edge + half_row], "lips": inner[height > edge - half_row]}
        return replace(straight, sides=straight.sides | lips)

    sides = "inner", "lips", "outer", "bottom", "top", "start", "end"
    made = replace(nodes, sides=sides, make=lambda: with_lips(nodes.make()).mapped(place))
    return MeshPlan(made, cells, cell, (radians(angle) * radius, thickness, height), thickness)


def _lips(share: lattice.Array, distance: lattice.Array, radius: float, half: float) -> tuple[lattice.Array, ...]:
    """(x, y) of points at a distance from the side of a sector: 0 of the share on the x axis, 1 at the radius."""
    first = distance / np.tan(half)
    along = first + share * (np.sqrt(radius**2 - distance**2) - first)
    return along * np.cos(half) + distance * np.sin(half), along * np.sin(half) - distance * np.cos(half)


LEAFLET_SHAPES: Shapes = {
    "leaflet": (leaflet, "radius: 1, thickness: 0.06, height: 1.2, lip: 0.4, post: 0.2, cells: [8, 1, 6]"),
}
