"""Built-in shapes in 2D."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, radians
from typing import Annotated

import numpy as np

from fsci.shapes import lattice
from fsci.shapes.declaration import (
    MeshPlan,
    Part,
    Shapes,
    Start,
    counts,
    meshed,
    number,
    positive,
    require_part,
    require_wall,
)


@meshed
def rectangle(
    size: Annotated[Sequence[float], positive("extent along x and y", entries=2)],
    cells: Annotated[Sequence[int], counts(2, "number of cells along x and y")],
    origin: Annotated[Sequence[float], number("lower left corner", entries=2)] = (0.0, 0.0),
    *,
    order: int = 1,
    cell: str = "quad",
) -> MeshPlan:
    """Rectangle with the surfaces left, right, bottom, top."""
    x, y = lattice.line(cells[0], order, ("left", "right")), lattice.line(cells[1], order, ("bottom", "top"))
    nodes = lattice.product(x, y).mapped(lambda s, t: (origin[0] + size[0] * s, origin[1] + size[1] * t))
    return MeshPlan(nodes, cells, cell, size, min(size), flat=True)


@meshed
def disc(
    radius: Annotated[float, positive("radius")],
    cells: Annotated[
        Sequence[int],
        counts(2, "number of cells around (a multiple of 4) and through the shell", {0: (4, "around")}),
    ],
    *,
    order: int = 1,
    cell: str = "quad",
) -> MeshPlan:
    """Disc about the origin, a square core in a round shell, with the surface outer."""
    nodes = lattice.disc(cells[0], cells[1], order).mapped(lambda x, y: (radius * x, radius * y))
    return MeshPlan(nodes, cells, cell, (2 * pi * radius, radius), 2 * radius, edges=(1.0,))


@meshed
def ring(
    inner_radius: Annotated[float, positive("inner radius")],
    outer_radius: Annotated[float, positive("outer radius")],
    cells: Annotated[Sequence[int], counts(2, "number of cells around and through the thickness")],
    angle: Part = 360.0,
    start: Start = 0.0,
    *,
    order: int = 1,
    cell: str = "quad",
) -> MeshPlan:
    """Ring about the origin or a part of it, with the surfaces inner, outer and, unless closed, start, end."""
    require_wall(inner_radius, outer_radius)
    require_part(angle, cells)
    nodes, wall = ring_lattice(inner_radius, outer_radius, cells, angle, start, order), outer_radius - inner_radius
    return MeshPlan(nodes, cells, cell, (radians(angle) * (inner_radius + outer_radius) / 2, wall), wall)


def ring_lattice(
    inner_radius: float, outer_radius: float, cells: Sequence[int], angle: float, start: float, order: int
) -> lattice.Lattice:
    """Nodes of a ring; see there."""
    around = lattice.line(cells[0], order, None if angle == 360 else ("start", "end"))
    nodes = lattice.product(lattice.line(cells[1], order, ("inner", "outer")), around)

    def polar(s: lattice.Array, t: lattice.Array) -> tuple[lattice.Array, lattice.Array]:
        radius = inner_radius + (outer_radius - inner_radius) * s
        turn = np.radians(start + angle * t)
        return radius * np.cos(turn), radius * np.sin(turn)

    return nodes.mapped(polar)


PLANE_SHAPES: Shapes = {
    "rectangle": (rectangle, "size: [2, 0.5], cells: [8, 2], order: 2"),
    "disc": (disc, "radius: 0.5, cells: [32, 4], translate: [0, 1]"),
    "ring": (ring, "inner_radius: 0.9, outer_radius: 1, angle: 90, cells: [16, 2]"),
}
