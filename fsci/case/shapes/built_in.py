"""Common parts of the sections of built-in meshes: names of surfaces, counts of cells and nodes, extents."""

from __future__ import annotations

from math import prod
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from fsci.case.errors import distinct
from fsci.case.section import Section, fault, setting
from fsci.case.values import Count, EntryCount, Number, NumberVector, OneOrMany, Order


class Rotation(Section):
    """A rotation about an axis through the origin; in 2D about the origin."""

    axis: Annotated[tuple[Number, ...], EntryCount(3, 3)] | None = setting(
        None, "direction of the axis (3D only)", unit="1"
    )
    angle: Number = setting(..., "angle, counterclockwise seen against the axis", unit="degrees")


#: One rotation or a list of them.
Rotations = Annotated[tuple[Rotation, ...], OneOrMany()]
Cells2 = Annotated[tuple[Count, ...], EntryCount(2, 2)]
Cells3 = Annotated[tuple[Count, ...], EntryCount(3, 3)]


Counts = tuple[int, int]  #: cells, nodes


def along(cells: int, order: int, *, closed: bool = False) -> Counts:
    """Counts of a line or a circle."""
    return cells, order * cells + (not closed)


def across_disc(around: int, radial: int, order: int) -> Counts:
    """Counts of a square core, with a quarter of the cells around on each side, in a shell of layers."""
    quarter = around // 4
    return quarter**2 + around * radial, (order * quarter + 1) ** 2 + order * around * order * radial


def product(*parts: Counts) -> Counts:
    """Counts of the product of parts: every cell and node of one with every one of the others."""
    return prod(cells for cells, _ in parts), prod(nodes for _, nodes in parts)


class PlacedMesh(Section):
    """A mesh that is rotated, then moved."""

    rotate: Rotations = setting(tuple, "rotation or list of rotations, the first one first")
    translate: NumberVector | None = setting(None, "displacement after the rotations", unit="m")


class BuiltIn(PlacedMesh):
    """A built-in mesh."""

    dimension: ClassVar[int]
    simplices: ClassVar[int]  #: that a cell of the lattice is divided into, if they are triangles or tetrahedra
    sides: ClassVar[tuple[str, ...]]  #: its surfaces, if it is complete
    order: Order = setting(1, "polynomial order of the cells")
    if TYPE_CHECKING:
        cells: tuple[int, ...]
        cell: str

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names that supports, loads and probes can use."""
        return self.sides

    @property
    def lattice(self) -> Counts:
        """(cells, nodes) of the mesh of quadrilaterals or hexahedra."""
        raise NotImplementedError

    @property
    def extents(self) -> tuple[float, ...]:
        """Lengths [m] along the numbers in `cells`."""
        raise NotImplementedError

    @property
    def thickness(self) -> float:
        """The shortest extent of the body [m]."""
        raise NotImplementedError

    @property
    def counts(self) -> Counts:
        """(cells, nodes) of the mesh."""
        cells, nodes = self.lattice
        return cells * (self.simplices if self.cell in ("tri", "tet") else 1), nodes

    @property
    def aspect(self) -> float:
        """Longest over shortest edge of a typical cell."""
        edges = [extent / count for extent, count in zip(self.extents, self.cells, strict=True)]
        return max(edges) / min(edges)


class PlaneBuiltIn(BuiltIn):
    """A built-in mesh in 2D."""

    dimension = 2
    simplices = 2
    cell: Literal["quad", "tri"] = setting("quad", "type of the cells; a tri is half a quad")


class SolidBuiltIn(BuiltIn):
    """A built-in mesh in 3D."""

    dimension = 3
    simplices = 6
    cell: Literal["hex", "tet"] = setting("hex", "type of the cells; a tet is a sixth of a hex")


def require_around(cells: tuple[int, ...], at: int, *, disc: bool = False) -> None:
    """A closed circle needs three cells; around a disc their number is a multiple of 4."""
    if disc and cells[at] % 4:
        raise fault(f"the number of cells around must be a multiple of 4, not {cells[at]}", "cells", at)
    if cells[at] < 3:
        raise fault(f"at least 3 cells are needed all the way around, not {cells[at]}", "cells", at)


def require_part(angle: float, cells: tuple[int, ...]) -> None:
    """A ring or a part of it, with the number of cells around first."""
    if angle > 360:
        raise fault(f"must be at most 360 degrees, not {angle:g}", "angle")
    if angle == 360:
        require_around(cells, 0)


def require_wall(inner_radius: float, outer_radius: float) -> None:
    if outer_radius <= inner_radius:
        inner, outer = distinct(inner_radius, outer_radius)
        raise fault(f"must be greater than 'inner_radius', {inner}, not {outer}", "outer_radius")
