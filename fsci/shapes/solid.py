"""Built-in shapes in 3D: plane sections extruded along a line or a circle, and spheres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fsci.shapes import lattice
from fsci.shapes.plane import ring_lattice
from solvers.mesh import Mesh


def box(
    size: Sequence[float],
    cells: Sequence[int],
    origin: Sequence[float] = (0, 0, 0),
    *,
    order: int = 1,
    cell: str = "hex",
) -> Mesh:
    """Box from `origin` to `origin + size` [m]; `cells` along x, y and z.

    Surfaces left, right (x), front, back (y), bottom, top (z): lower end first.
    """
    names = ("left", "right"), ("front", "back"), ("bottom", "top")
    x, y, z = (lattice.line(count, order, sides) for count, sides in zip(cells, names, strict=True))
    nodes = lattice.product(lattice.product(x, y), z)
    start, stretch = np.array(origin), np.array(size)
    return lattice.mesh(replace(nodes, points=start + stretch * nodes.points), cell)


def beam(
    length: float, width: float, height: float, cells: Sequence[int], *, order: int = 1, cell: str = "hex"
) -> Mesh:
    """Box along x from x = 0, centred in y (width) and z (height) [m]; cells and surfaces as box."""
    return box((length, width, height), cells, (0, -width / 2, -height / 2), order=order, cell=cell)


def cylinder(radius: float, height: float, cells: Sequence[int], *, order: int = 1, cell: str = "hex") -> Mesh:
    """Cylinder about the z axis from z = 0 to `height` [m]; surfaces outer, bottom, top.

    `cells` counts them around (a multiple of 4), through the shell about the square core, and along.
    """
    section = lattice.disc(cells[0], cells[1], order).mapped(lambda x, y: (radius * x, radius * y))
    return lattice.mesh(_raised(section, height, cells[2]), cell)


def tube(
    inner_radius: float,
    outer_radius: float,
    height: float,
    cells: Sequence[int],
    angle: float = 360,
    start: float = 0,
    *,
    order: int = 1,
    cell: str = "hex",
) -> Mesh:
    """Tube about the z axis from z = 0 to `height` [m], or a part of it: `angle` degrees from `start` degrees (0 is x).

    `cells` counts them around, through the wall, and along; surfaces inner, outer, bottom, top, and start, end of a
    part.
    """
    section = ring_lattice(inner_radius, outer_radius, cells[:2], angle, start, order)
    return lattice.mesh(_raised(section, height, cells[2]), cell)


def solid_torus(
    major_radius: float,
    minor_radius: float,
    cells: Sequence[int],
    angle: float = 360,
    start: float = 0,
    *,
    order: int = 1,
    cell: str = "hex",
) -> Mesh:
    """Torus about the y axis, or a part of it: `angle` degrees from `start` degrees (0 is x, 90 is z).

    A disc of `minor_radius` is led around at `major_radius` [m]. `cells` counts them around the y axis, and around the
    section (a multiple of 4); surfaces outer, and start, end of a part.
    """
    if not 0 < minor_radius < major_radius:
        raise ValueError(f"radii must be 0 < minor < major, got {minor_radius:g} and {major_radius:g}")
    around, section_around = cells
    section = lattice.disc(section_around, max(1, section_around // 8), order)
    section = section.mapped(lambda x, y: (minor_radius * x, minor_radius * y))
    return lattice.mesh(_turned(section, major_radius, around, angle, start), cell)


def hollow_torus(
    major_radius: float,
    inner_radius: float,
    outer_radius: float,
    cells: Sequence[int],
    *,
    order: int = 1,
    cell: str = "hex",
) -> Mesh:
    """Torus about the y axis with a wall from `inner_radius` to `outer_radius` [m]; surfaces inner, outer.

    X = ((R + r cos B) cos A, r sin B, (R + r cos B) sin A) with A and B in equal steps from 0.
    `cells` counts them around the y axis (A), around the section (B), and through the wall (r).
    """
    if outer_radius >= major_radius:
        raise ValueError(f"the outer radius {outer_radius:g} must be below the major radius {major_radius:g}")
    around, section_around, radial = cells
    section = ring_lattice(inner_radius, outer_radius, (section_around, radial), 360, 0, order)
    return lattice.mesh(_turned(section, major_radius, around), cell)


def sphere(radius: float, cells: Sequence[int], *, order: int = 1, cell: str = "hex") -> Mesh:
    """Ball about the origin: a cubic core in a round shell; surface outer.

    `cells` counts them along an edge of the core, and through the shell.
    """
    nodes = lattice.ball(cells[0], cells[1], order)
    return lattice.mesh(nodes.mapped(lambda x, y, z: (radius * x, radius * y, radius * z)), cell)


def hollow_sphere(
    inner_radius: float, outer_radius: float, cells: Sequence[int], *, order: int = 1, cell: str = "hex"
) -> Mesh:
    """Ball shell about the origin, a cubed sphere; surfaces inner, outer.

    `cells` counts them along an edge of the cube, and through the wall.
    """
    if not 0 < inner_radius < outer_radius:
        raise ValueError(f"radii must be 0 < inner < outer, got {inner_radius:g} and {outer_radius:g}")
    wall = lattice.line(cells[1], order, ("inner", "outer"))
    wall = wall.mapped(lambda s: [inner_radius + (outer_radius - inner_radius) * s])
    nodes = lattice.product(lattice.sphere(cells[0], order), wall)
    return lattice.mesh(nodes.mapped(lambda x, y, z, r: (r * x, r * y, r * z)), cell)


def _raised(section: lattice.Lattice, height: float, cells: int) -> lattice.Lattice:
    along = lattice.line(cells, section.order, ("bottom", "top"))
    return lattice.product(section, along).mapped(lambda x, y, s: (x, y, height * s))


def _turned(
    section: lattice.Lattice, major_radius: float, cells: int, angle: float = 360, start: float = 0
) -> lattice.Lattice:
    """The section's x leads away from the y axis, its y along it."""
    if not 0 < angle <= 360:
        raise ValueError(f"angle must be above 0 and at most 360 degrees, got {angle:g}")

    def torus(a: lattice.Array, b: lattice.Array, t: lattice.Array) -> list[lattice.Array]:
        turn = 2 * np.pi * (start / 360 + angle / 360 * t)
        return [(major_radius + a) * np.cos(turn), b, (major_radius + a) * np.sin(turn)]

    around = lattice.line(cells, section.order, None if angle == 360 else ("start", "end"))
    return lattice.product(section, around).mapped(torus)
