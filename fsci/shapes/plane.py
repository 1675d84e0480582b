"""Built-in shapes in 2D."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsci.shapes import lattice
from solvers.mesh import Mesh


def rectangle(
    size: Sequence[float],
    cells: Sequence[int],
    origin: Sequence[float] = (0, 0),
    *,
    order: int = 1,
    cell: str = "quad",
) -> Mesh:
    """Rectangle from `origin` to `origin + size` [m], cells along x, y; surfaces left, right, bottom, top."""
    x, y = lattice.line(cells[0], order, ("left", "right")), lattice.line(cells[1], order, ("bottom", "top"))
    nodes = lattice.product(x, y)
    return lattice.mesh(nodes.mapped(lambda s, t: (origin[0] + size[0] * s, origin[1] + size[1] * t)), cell)


def disc(radius: float, cells: Sequence[int], *, order: int = 1, cell: str = "quad") -> Mesh:
    """Disc about the origin: a square core in a round shell; surface outer.

    `cells` counts them around the circle (a multiple of 4) and through the shell.
    """
    nodes = lattice.disc(cells[0], cells[1], order)
    return lattice.mesh(nodes.mapped(lambda x, y: (radius * x, radius * y)), cell)


def ring(
    inner_radius: float,
    outer_radius: float,
    cells: Sequence[int],
    angle: float = 360,
    start: float = 0,
    *,
    order: int = 1,
    cell: str = "quad",
) -> Mesh:
    """Ring about the origin, or a part of it: `angle` degrees counterclockwise from `start` degrees (0 is x).

    `cells` counts them around and through the thickness; surfaces inner, outer, and start, end of a part.
    """
    return lattice.mesh(ring_lattice(inner_radius, outer_radius, cells, angle, start, order), cell)


def ring_lattice(
    inner_radius: float, outer_radius: float, cells: Sequence[int], angle: float, start: float, order: int
) -> lattice.Lattice:
    """Nodes of a ring; see there."""
    if not 0 < angle <= 360:
        raise ValueError(f"angle must be above 0 and at most 360 degrees, got {angle:g}")
    if not 0 < inner_radius < outer_radius:
        raise ValueError(f"radii must be 0 < inner < outer, got {inner_radius:g} and {outer_radius:g}")
    around = lattice.line(cells[0], order, None if angle == 360 else ("start", "end"))
    nodes = lattice.product(lattice.line(cells[1], order, ("inner", "outer")), around)

    def polar(s: lattice.Array, t: lattice.Array) -> tuple[lattice.Array, lattice.Array]:
        radius = inner_radius + (outer_radius - inner_radius) * s
        turn = np.radians(start + angle * t)
        return radius * np.cos(turn), radius * np.sin(turn)

    return nodes.mapped(polar)
