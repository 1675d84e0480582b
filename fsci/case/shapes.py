"""Built-in meshes: one section for each shape, with the names of its surfaces."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import Count, Entries, Number, NumberVector, OneOrMany, Order, Positive


class Rotation(Section):
    """A rotation about an axis through the origin; in 2D about the origin."""

    axis: Annotated[tuple[Number, ...], Entries(3, 3)] | None = setting(
        None, "direction of the axis (3D only)", unit="1"
    )
    angle: Number = setting(..., "angle, counterclockwise seen against the axis", unit="degrees")


#: One rotation or a list of them.
Rotations = Annotated[tuple[Rotation, ...], OneOrMany()]
Cells2 = Annotated[tuple[Count, ...], Entries(2, 2)]
Cells3 = Annotated[tuple[Count, ...], Entries(3, 3)]


class Placed(Section):
    """A mesh that is rotated, then moved."""

    rotate: Rotations = setting(tuple, "rotation or list of rotations, the first one first")
    translate: NumberVector | None = setting(None, "displacement after the rotations", unit="m")


class BuiltIn(Placed):
    """A built-in mesh."""

    dimension: ClassVar[int]
    sides: ClassVar[tuple[str, ...]]  #: its surfaces, if it is complete
    order: Order = setting(1, "polynomial order of the cells")

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names that supports, loads and probes can use."""
        return self.sides


class Plane(BuiltIn):
    """A built-in mesh in 2D."""

    dimension = 2
    cell: Literal["quad", "tri"] = setting("quad", "type of the cells; a tri is half a quad")


class Solid(BuiltIn):
    """A built-in mesh in 3D."""

    dimension = 3
    cell: Literal["hex", "tet"] = setting("hex", "type of the cells; a tet is a sixth of a hex")


def _around(cells: tuple[int, ...], at: int, *, disc: bool = False) -> None:
    """A closed circle needs three cells; around a disc their number is a multiple of 4."""
    if disc and cells[at] % 4:
        raise fault(f"the number of cells around must be a multiple of 4, not {cells[at]}", "cells", at)
    if cells[at] < 3:
        raise fault(f"at least 3 cells are needed all the way around, not {cells[at]}", "cells", at)


def _wall(inner_radius: float, outer_radius: float) -> None:
    if outer_radius <= inner_radius:
        raise fault(f"must be greater than 'inner_radius', {inner_radius:g}, not {outer_radius:g}", "outer_radius")


class Rectangle(Plane):
    """Rectangle with the surfaces left, right, bottom, top."""

    sides = ("left", "right", "bottom", "top")
    shape: Literal["rectangle"] = setting(..., "kind of shape")
    size: Annotated[tuple[Positive, ...], Entries(2, 2)] = setting(..., "extent along x and y", unit="m")
    cells: Cells2 = setting(..., "number of cells along x and y")
    origin: Annotated[tuple[Number, ...], Entries(2, 2)] = setting((0.0, 0.0), "lower left corner", unit="m")


class Disc(Plane):
    """Disc about the origin, a square core in a round shell, with the surface outer."""

    sides = ("outer",)
    shape: Literal["disc"] = setting(..., "kind of shape")
    radius: Positive = setting(..., "radius", unit="m")
    cells: Cells2 = setting(..., "number of cells around (a multiple of 4) and through the shell")

    @model_validator(mode="after")
    def _possible(self) -> Disc:
        _around(self.cells, 0, disc=True)
        return self


class Ring(Plane):
    """Ring about the origin or a part of it, with the surfaces inner, outer and, unless closed, start, end."""

    sides = ("inner", "outer")
    shape: Literal["ring"] = setting(..., "kind of shape")
    inner_radius: Positive = setting(..., "inner radius", unit="m")
    outer_radius: Positive = setting(..., "outer radius", unit="m")
    cells: Cells2 = setting(..., "number of cells around and through the thickness")
    angle: Positive = setting(360.0, "angle of the part, at most 360", unit="degrees")
    start: Number = setting(0.0, "angle between the x axis and the start of the part", unit="degrees")

    @property
    def surfaces(self) -> tuple[str, ...]:
        return self.sides if self.angle == 360 else (*self.sides, "start", "end")

    @model_validator(mode="after")
    def _possible(self) -> Ring:
        _wall(self.inner_radius, self.outer_radius)
        if self.angle > 360:
            raise fault(f"must be at most 360 degrees, not {self.angle:g}", "angle")
        if self.angle == 360:
            _around(self.cells, 0)
        return self


class Box(Solid):
    """Box with the surfaces left, right (x), front, back (y), bottom, top (z)."""

    sides = ("left", "right", "front", "back", "bottom", "top")
    shape: Literal["box"] = setting(..., "kind of shape")
    size: Annotated[tuple[Positive, ...], Entries(3, 3)] = setting(..., "extent along x, y and z", unit="m")
    cells: Cells3 = setting(..., "number of cells along x, y and z")
    origin: Annotated[tuple[Number, ...], Entries(3, 3)] = setting((0.0, 0.0, 0.0), "lower corner", unit="m")


class Beam(Solid):
    """Box along the x axis, from x = 0, with the surfaces left, right (x), front, back (y), bottom, top (z)."""

    sides = ("left", "right", "front", "back", "bottom", "top")
    shape: Literal["beam"] = setting(..., "kind of shape")
    length: Positive = setting(..., "extent along x", unit="m")
    width: Positive = setting(..., "extent along y", unit="m")
    height: Positive = setting(..., "extent along z", unit="m")
    cells: Cells3 = setting(..., "number of cells along x, y and z")


class Cylinder(Solid):
    """Cylinder about the z axis, from z = 0, with the surfaces outer, bottom, top."""

    sides = ("outer", "bottom", "top")
    shape: Literal["cylinder"] = setting(..., "kind of shape")
    radius: Positive = setting(..., "radius", unit="m")
    height: Positive = setting(..., "extent along z", unit="m")
    cells: Cells3 = setting(..., "number of cells around (a multiple of 4), through the shell, and along")

    @model_validator(mode="after")
    def _possible(self) -> Cylinder:
        _around(self.cells, 0, disc=True)
        return self


class Tube(Solid):
    """Tube (or annulus) about the z axis, from z = 0, with the surfaces inner, outer, bottom, top."""

    sides = ("inner", "outer", "bottom", "top")
    shape: Literal["tube", "annulus"] = setting(..., "kind of shape")
    inner_radius: Positive = setting(..., "inner radius", unit="m")
    outer_radius: Positive = setting(..., "outer radius", unit="m")
    height: Positive = setting(..., "extent along z", unit="m")
    cells: Cells3 = setting(..., "number of cells around, through the wall, and along")

    @model_validator(mode="after")
    def _possible(self) -> Tube:
        _wall(self.inner_radius, self.outer_radius)
        _around(self.cells, 0)
        return self


class SolidTorus(Solid):
    """Torus about the y axis, with the surface outer."""

    sides = ("outer",)
    shape: Literal["solid_torus"] = setting(..., "kind of shape")
    major_radius: Positive = setting(..., "radius of the circle of section centres", unit="m")
    minor_radius: Positive = setting(..., "radius of the section", unit="m")
    cells: Cells2 = setting(..., "number of cells around the y axis, and around the section (a multiple of 4)")

    @model_validator(mode="after")
    def _possible(self) -> SolidTorus:
        if self.minor_radius >= self.major_radius:
            raise fault(
                f"must be less than 'major_radius', {self.major_radius:g}, not {self.minor_radius:g}",
                "minor_radius",
            )
        _around(self.cells, 0)
        _around(self.cells, 1, disc=True)
        return self


class HollowTorus(Solid):
    """Torus about the y axis with a wall, with the surfaces inner, outer."""

    sides = ("inner", "outer")
    shape: Literal["hollow_torus"] = setting(..., "kind of shape")
    major_radius: Positive = setting(..., "radius of the circle of section centres", unit="m")
    inner_radius: Positive = setting(..., "inner radius of the section", unit="m")
    outer_radius: Positive = setting(..., "outer radius of the section", unit="m")
    cells: Cells3 = setting(..., "number of cells around the y axis, around the section, and through the wall")

    @model_validator(mode="after")
    def _possible(self) -> HollowTorus:
        _wall(self.inner_radius, self.outer_radius)
        if self.outer_radius >= self.major_radius:
            raise fault(
                f"must be less than 'major_radius', {self.major_radius:g}, not {self.outer_radius:g}",
                "outer_radius",
            )
        _around(self.cells, 0)
        _around(self.cells, 1)
        return self


class HollowSphere(Solid):
    """Spherical shell about the origin (a cubed sphere), with the surfaces inner, outer."""

    sides = ("inner", "outer")
    shape: Literal["hollow_sphere"] = setting(..., "kind of shape")
    inner_radius: Positive = setting(..., "inner radius", unit="m")
    outer_radius: Positive = setting(..., "outer radius", unit="m")
    cells: Cells2 = setting(..., "number of cells along an edge of the cube, and through the wall")

    @model_validator(mode="after")
    def _possible(self) -> HollowSphere:
        _wall(self.inner_radius, self.outer_radius)
        return self


class Sphere(Solid):
    """Ball about the origin, a cubic core in a round shell, with the surface outer."""

    sides = ("outer",)
    shape: Literal["sphere"] = setting(..., "kind of shape")
    radius: Positive = setting(..., "radius", unit="m")
    cells: Cells2 = setting(..., "number of cells along an edge of the core, and through the shell")
