"""Built-in shapes in 3D: plane sections extruded along a line or a circle, and spheres."""

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
    require_around,
    require_less,
    require_part,
    require_wall,
)
from fsci.shapes.plane import ring_lattice


@meshed
def box(
    size: Annotated[Sequence[float], positive("extent along x, y and z", entries=3)],
    cells: Annotated[Sequence[int], counts(3, "number of cells along x, y and z")],
    origin: Annotated[Sequence[float], number("lower corner", entries=3)] = (0.0, 0.0, 0.0),
    *,
    order: int = 1,
    cell: str = "hex",
) -> MeshPlan:
    """Box with the surfaces left, right (x), front, back (y), bottom, top (z)."""
    return MeshPlan(_block(size, cells, origin, order), cells, cell, size, min(size), flat=True)


@meshed
def beam(
    length: Annotated[float, positive("extent along x")],
    width: Annotated[float, positive("extent along y")],
    height: Annotated[float, positive("extent along z")],
    cells: Annotated[Sequence[int], counts(3, "number of cells along x, y and z")],
    *,
    order: int = 1,
    cell: str = "hex",
) -> MeshPlan:
    """Box along the x axis, from x = 0, with the surfaces left, right (x), front, back (y), bottom, top (z)."""
    size = length, width, height
    nodes = _block(size, cells, (0, -width / 2, -height / 2), order)
    return MeshPlan(nodes, cells, cell, size, min(size), flat=True)


@meshed
def cylinder(
    radius: Annotated[float, positive("radius")],
    height: Annotated[float, positive("extent along z")],
    cells: Annotated[
        Sequence[int],
        counts(3, "number of cells around (a multiple of 4), through the shell, and along", {0: (4, "around")}),
    ],
    *,
    order: int = 1,
    cell: str = "hex",
) -> MeshPlan:
    """Cylinder about the z axis, from z = 0, with the surfaces outer, bottom, top."""
    section = lattice.disc(cells[0], cells[1], order).mapped(lambda x, y: (radius * x, radius * y))
    around = 2 * pi * radius
    return MeshPlan(
        _raised(section, height, cells[2]),
        cells,
        cell,
        extents=(around, radius, height),
        thickness=min(2 * radius, height),
        edges=(around / cells[0], height / cells[2]),
    )


@meshed
def tube(
    inner_radius: Annotated[float, positive("inner radius")],
    outer_radius: Annotated[float, positive("outer radius")],
    height: Annotated[float, positive("extent along z")],
    cells: Annotated[Sequence[int], counts(3, "number of cells around, through the wall, and along")],
    angle: Part = 360.0,
    start: Start = 0.0,
    *,
    order: int = 1,
    cell: str = "hex",
) -> MeshPlan:
    """Tube (or annulus) about the z axis, from z = 0, or a part of it; surfaces inner, outer, bottom, top, start, end.

    A whole one has no start and end.
    """
    require_wall(inner_radius, outer_radius)
    require_part(angle, cells)
    section = ring_lattice(inner_radius, outer_radius, cells[:2], angle, start, order)
    middle, wall = (inner_radius + outer_radius) / 2, outer_radius - inner_radius
    extents = radians(angle) * middle, wall, height
    return MeshPlan(_raised(section, height, cells[2]), cells, cell, extents, min(wall, height))


@meshed
def solid_torus(
    major_radius: Annotated[float, positive("radius of the circle of section centres")],
    minor_radius: Annotated[float, positive("radius of the section")],
    cells: Annotated[
        Sequence[int],
        counts(2, "number of cells around the y axis, and around the section (a multiple of 4)", {1: (4, "around")}),
    ],
    angle: Part = 360.0,
    start: Annotated[float, number("angle from the x axis to the start of the part, towards z", "degrees")] = 0.0,
    *,
    order: int = 1,
    cell: str = "hex",
) -> MeshPlan:
    """Torus about the y axis, or a part of it; surfaces outer, start, end. A whole one has no start and end."""
    require_less("minor_radius", minor_radius, than="major_radius", limit=major_radius)
    require_part(angle, cells)
    section = lattice.disc(cells[1], max(1, cells[1] // 8), order)
    section = section.mapped(lambda x, y: (minor_radius * x, minor_radius * y))
    nodes = _turned(section, major_radius, cells[0], angle, start)
    return MeshPlan(nodes, cells, cell, (radians(angle) * major_radius, 2 * pi * minor_radius), 2 * minor_radius)


@meshed
def hollow_torus(
    major_radius: Annotated[float, positive("radius of the circle of section centres")],
    inner_radius: Annotated[float, positive("inner radius of the section")],
    outer_radius: Annotated[float, positive("outer radius of the section")],
    cells: Annotated[
        Sequence[int], counts(3, "number of cells around the y axis, around the section, and through the wall")
    ],
    *,
    order: int = 1,
    cell: str = "hex",
) -> MeshPlan:
    """Torus about the y axis with a wall, with the surfaces inner, outer."""
    require_wall(inner_radius, outer_radius)
    require_less("outer_radius", outer_radius, than="major_radius", limit=major_radius)
    require_around(cells, 0)
    require_around(cells, 1)
    section = ring_lattice(inner_radius, outer_radius, cells[1:], 360, 0, order)
    wall = outer_radius - inner_radius
    extents = 2 * pi * major_radius, pi * (inner_radius + outer_radius), wall
    return MeshPlan(_turned(section, major_radius, cells[0]), cells, cell, extents, wall)


@meshed
def hollow_sphere(
    inner_radius: Annotated[float, positive("inner radius")],
    outer_radius: Annotated[float, positive("outer radius")],
    cells: Annotated[Sequence[int], counts(2, "number of cells along an edge of the cube, and through the wall")],
    *,
    order: int = 1,
    cell: str = "hex",
) -> MeshPlan:
    """Spherical shell about the origin (a cubed sphere), with the surfaces inner, outer."""
    require_wall(inner_radius, outer_radius)
    wall = lattice.line(cells[1], order, ("inner", "outer"))
    wall = wall.mapped(lambda s: [inner_radius + (outer_radius - inner_radius) * s])
    nodes = lattice.product(lattice.sphere(cells[0], order), wall)
    nodes = nodes.mapped(lambda x, y, z, r: (r * x, r * y, r * z))
    thickness = outer_radius - inner_radius
    return MeshPlan(nodes, cells, cell, (pi / 4 * (inner_radius + outer_radius), thickness), thickness)


@meshed
def sphere(
    radius: Annotated[float, positive("radius")],
    cells: Annotated[Sequence[int], counts(2, "number of cells along an edge of the core, and through the shell")],
    *,
    order: int = 1,
    cell: str = "hex",
) -> MeshPlan:
    """Ball about the origin, a cubic core in a round shell, with the surface outer."""
    nodes = lattice.ball(cells[0], cells[1], order).mapped(lambda x, y, z: (radius * x, radius * y, radius * z))
    return MeshPlan(nodes, cells, cell, (2 * radius, 2 * radius), 2 * radius, edges=(1.0,))


def _block(size: Sequence[float], cells: Sequence[int], origin: Sequence[float], order: int) -> lattice.Lattice:
    names = ("left", "right"), ("front", "back"), ("bottom", "top")
    x, y, z = (lattice.line(count, order, sides) for count, sides in zip(cells, names, strict=True))
    start, stretch = np.array(origin), np.array(size)
    return lattice.product(lattice.product(x, y), z).mapped(
        lambda *parts: [start[i] + stretch[i] * part for i, part in enumerate(parts)]
    )


def _raised(section: lattice.Lattice, height: float, cells: int) -> lattice.Lattice:
    along = lattice.line(cells, section.order, ("bottom", "top"))
    return lattice.product(section, along).mapped(lambda x, y, s: (x, y, height * s))


def _turned(
    section: lattice.Lattice, major_radius: float, cells: int, angle: float = 360, start: float = 0
) -> lattice.Lattice:
    """The section's x leads away from the y axis, its y along it."""

    def torus(a: lattice.Array, b: lattice.Array, t: lattice.Array) -> list[lattice.Array]:
        turn = 2 * np.pi * (start / 360 + angle / 360 * t)
        return [(major_radius + a) * np.cos(turn), b, (major_radius + a) * np.sin(turn)]

    around = lattice.line(cells, section.order, None if angle == 360 else ("start", "end"))
    return lattice.product(section, around).mapped(torus)


SOLID_SHAPES: Shapes = {
    "box": (box, "size: [1, 1, 0.2], cells: [8, 8, 2]"),
    "beam": (beam, "length: 2, width: 0.1, height: 0.1, cells: [20, 2, 2], order: 2"),
    "cylinder": (cylinder, "radius: 0.5, height: 2, cells: [16, 2, 10]"),
    "tube": (tube, "inner_radius: 0.9, outer_radius: 1, height: 2, cells: [32, 2, 10]"),
    "annulus": (tube, ""),
    "solid_torus": (solid_torus, "major_radius: 0.5, minor_radius: 0.2, cells: [24, 12]"),
    "hollow_torus": (hollow_torus, "major_radius: 76, inner_radius: 19.5, outer_radius: 24, cells: [40, 20, 1]"),
    "hollow_sphere": (hollow_sphere, "inner_radius: 9, outer_radius: 10, cells: [8, 1]"),
    "sphere": (sphere, "radius: 1, cells: [4, 3]"),
}
