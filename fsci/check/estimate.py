"""How large a built-in mesh will be, from its settings alone."""

from __future__ import annotations

from math import pi, radians

from fsci.case.mesh import Shape
from fsci.case.shapes import (
    Beam,
    Box,
    Cylinder,
    Disc,
    HollowSphere,
    HollowTorus,
    Rectangle,
    Ring,
    SolidTorus,
    Sphere,
    Tube,
)

Size = tuple[int, int]  #: cells, nodes


def size(mesh: Shape) -> Size:
    """Number of cells and of nodes."""
    order, n = mesh.order, mesh.cells
    match mesh:
        case Rectangle() | Box() | Beam():
            cells, nodes = _product(*(_line(count, order) for count in n))
        case Ring():
            closed = mesh.angle == 360
            cells, nodes = _product(_line(n[0], order, closed=closed), _line(n[1], order))
        case Disc():
            cells, nodes = _disc(n[0], n[1], order)
        case Cylinder():
            cells, nodes = _product(_disc(n[0], n[1], order), _line(n[2], order))
        case Tube():
            cells, nodes = _product(_circle(n[0], order), _line(n[1], order), _line(n[2], order))
        case SolidTorus():
            cells, nodes = _product(_circle(n[0], order), _disc(n[1], max(1, n[1] // 8), order))
        case HollowTorus():
            cells, nodes = _product(_circle(n[0], order), _circle(n[1], order), _line(n[2], order))
        case HollowSphere():
            sphere = 6 * n[0] ** 2, 6 * (order * n[0]) ** 2 + 2
            cells, nodes = _product(sphere, _line(n[1], order))
        case Sphere():
            face, edge = 6 * n[0] ** 2, order * n[0]
            cells, nodes = n[0] ** 3 + face * n[1], (edge + 1) ** 3 + (6 * edge**2 + 2) * order * n[1]
    parts = {"quad": 1, "hex": 1, "tri": 2, "tet": 6}
    return cells * parts[mesh.cell], nodes


def aspect(mesh: Shape) -> float:
    """Longest over shortest edge of a typical cell."""
    n = mesh.cells
    match mesh:
        case Rectangle() | Box():
            extents: tuple[float, ...] = mesh.size
        case Beam():
            extents = (mesh.length, mesh.width, mesh.height)
        case Ring():
            middle = (mesh.inner_radius + mesh.outer_radius) / 2
            extents = (radians(mesh.angle) * middle, mesh.outer_radius - mesh.inner_radius)
        case Tube():
            middle = (mesh.inner_radius + mesh.outer_radius) / 2
            extents = (2 * pi * middle, mesh.outer_radius - mesh.inner_radius, mesh.height)
        case Cylinder():
            n, extents = (n[0], n[2]), (2 * pi * mesh.radius, mesh.height)
        case SolidTorus():
            extents = (2 * pi * mesh.major_radius, 2 * pi * mesh.minor_radius)
        case HollowTorus():
            middle = (mesh.inner_radius + mesh.outer_radius) / 2
            wall = mesh.outer_radius - mesh.inner_radius
            extents = (2 * pi * mesh.major_radius, 2 * pi * middle, wall)
        case HollowSphere():
            middle = (mesh.inner_radius + mesh.outer_radius) / 2
            extents = (pi / 2 * middle, mesh.outer_radius - mesh.inner_radius)
        case _:
            return 1.0
    edges = [extent / count for extent, count in zip(extents, n, strict=True)]
    return max(edges) / min(edges)


def thickness(mesh: Shape) -> float:
    """The shortest extent of the body."""
    match mesh:
        case Rectangle() | Box():
            return min(mesh.size)
        case Beam():
            return min(mesh.length, mesh.width, mesh.height)
        case Disc() | Sphere():
            return 2 * mesh.radius
        case Cylinder():
            return min(2 * mesh.radius, mesh.height)
        case SolidTorus():
            return 2 * mesh.minor_radius
        case Tube():
            return min(mesh.outer_radius - mesh.inner_radius, mesh.height)
    return mesh.outer_radius - mesh.inner_radius


def _line(cells: int, order: int, *, closed: bool = False) -> Size:
    return cells, order * cells + (not closed)


def _circle(cells: int, order: int) -> Size:
    return _line(cells, order, closed=True)


def _disc(around: int, radial: int, order: int) -> Size:
    """A square core with a quarter of the cells around on each side, in a shell of layers."""
    quarter = around // 4
    return quarter**2 + around * radial, (order * quarter + 1) ** 2 + order * around * order * radial


def _product(*sizes: Size) -> Size:
    cells, nodes = 1, 1
    for part in sizes:
        cells, nodes = cells * part[0], nodes * part[1]
    return cells, nodes
