"""Built-in meshes of three dimensions: one section for each shape."""

from __future__ import annotations

from math import pi, radians
from typing import Annotated, Literal

from pydantic import model_validator

from fsci.case.errors import distinct
from fsci.case.section import fault, setting
from fsci.case.shapes.built_in import (
    Cells2,
    Cells3,
    Counts,
    SolidBuiltIn,
    across_disc,
    along,
    product,
    require_around,
    require_part,
    require_wall,
)
from fsci.case.values import EntryCount, NotNegative, Number, Positive


class Box(SolidBuiltIn):
    """Box with the surfaces left, right (x), front, back (y), bottom, top (z)."""

    sides = ("left", "right", "front", "back", "bottom", "top")
    shape: Literal["box"] = setting(..., "kind of shape")
    size: Annotated[tuple[Positive, ...], EntryCount(3, 3)] = setting(..., "extent along x, y and z", unit="m")
    cells: Cells3 = setting(..., "number of cells along x, y and z")
    origin: Annotated[tuple[Number, ...], EntryCount(3, 3)] = setting((0.0, 0.0, 0.0), "lower corner", unit="m")

    @property
    def lattice(self) -> Counts:
        n, order = self.cells, self.order
        return product(*(along(count, order) for count in n))

    @property
    def extents(self) -> tuple[float, ...]:
        return self.size

    @property
    def thickness(self) -> float:
        return min(self.size)


class Beam(SolidBuiltIn):
    """Box along the x axis, from x = 0, with the surfaces left, right (x), front, back (y), bottom, top (z)."""

    sides = ("left", "right", "front", "back", "bottom", "top")
    shape: Literal["beam"] = setting(..., "kind of shape")
    length: Positive = setting(..., "extent along x", unit="m")
    width: Positive = setting(..., "extent along y", unit="m")
    height: Positive = setting(..., "extent along z", unit="m")
    cells: Cells3 = setting(..., "number of cells along x, y and z")

    @property
    def lattice(self) -> Counts:
        n, order = self.cells, self.order
        return product(*(along(count, order) for count in n))

    @property
    def extents(self) -> tuple[float, ...]:
        return self.length, self.width, self.height

    @property
    def thickness(self) -> float:
        return min(self.extents)


class Cylinder(SolidBuiltIn):
    """Cylinder about the z axis, from z = 0, with the surfaces outer, bottom, top."""

    sides = ("outer", "bottom", "top")
    shape: Literal["cylinder"] = setting(..., "kind of shape")
    radius: Positive = setting(..., "radius", unit="m")
    height: Positive = setting(..., "extent along z", unit="m")
    cells: Cells3 = setting(..., "number of cells around (a multiple of 4), through the shell, and along")

    @model_validator(mode="after")
    def _possible(self) -> Cylinder:
        require_around(self.cells, 0, disc=True)
        return self

    @property
    def lattice(self) -> Counts:
        n, order = self.cells, self.order
        return product(across_disc(n[0], n[1], order), along(n[2], order))

    @property
    def extents(self) -> tuple[float, ...]:
        return 2 * pi * self.radius, self.radius, self.height

    @property
    def aspect(self) -> float:
        around, high = 2 * pi * self.radius / self.cells[0], self.height / self.cells[2]
        return max(around, high) / min(around, high)

    @property
    def thickness(self) -> float:
        return min(2 * self.radius, self.height)


class Tube(SolidBuiltIn):
    """Tube (or annulus) about the z axis, from z = 0, or a part of it; surfaces inner, outer, bottom, top, start, end.

    A whole one has no start and end.
    """

    sides = ("inner", "outer", "bottom", "top")
    shape: Literal["tube", "annulus"] = setting(..., "kind of shape")
    inner_radius: Positive = setting(..., "inner radius", unit="m")
    outer_radius: Positive = setting(..., "outer radius", unit="m")
    height: Positive = setting(..., "extent along z", unit="m")
    cells: Cells3 = setting(..., "number of cells around, through the wall, and along")
    angle: Positive = setting(360.0, "angle of the part, at most 360", unit="degrees")
    start: Number = setting(0.0, "angle between the x axis and the start of the part", unit="degrees")

    @property
    def surfaces(self) -> tuple[str, ...]:
        return self.sides if self.angle == 360 else (*self.sides, "start", "end")

    @model_validator(mode="after")
    def _possible(self) -> Tube:
        require_wall(self.inner_radius, self.outer_radius)
        require_part(self.angle, self.cells)
        return self

    @property
    def lattice(self) -> Counts:
        n, order = self.cells, self.order
        return product(along(n[0], order, closed=self.angle == 360), along(n[1], order), along(n[2], order))

    @property
    def extents(self) -> tuple[float, ...]:
        middle = (self.inner_radius + self.outer_radius) / 2
        return radians(self.angle) * middle, self.outer_radius - self.inner_radius, self.height

    @property
    def thickness(self) -> float:
        return min(self.outer_radius - self.inner_radius, self.height)


class SolidTorus(SolidBuiltIn):
    """Torus about the y axis, or a part of it; surfaces outer, start, end. A whole one has no start and end."""

    sides = ("outer",)
    shape: Literal["solid_torus"] = setting(..., "kind of shape")
    major_radius: Positive = setting(..., "radius of the circle of section centres", unit="m")
    minor_radius: Positive = setting(..., "radius of the section", unit="m")
    cells: Cells2 = setting(..., "number of cells around the y axis, and around the section (a multiple of 4)")
    angle: Positive = setting(360.0, "angle of the part, at most 360", unit="degrees")
    start: Number = setting(0.0, "angle from the x axis to the start of the part, towards z", unit="degrees")

    @property
    def surfaces(self) -> tuple[str, ...]:
        return self.sides if self.angle == 360 else (*self.sides, "start", "end")

    @model_validator(mode="after")
    def _possible(self) -> SolidTorus:
        if self.minor_radius >= self.major_radius:
            raise fault(_less_than_major(self.major_radius, self.minor_radius), "minor_radius")
        require_part(self.angle, self.cells)
        require_around(self.cells, 1, disc=True)
        return self

    @property
    def lattice(self) -> Counts:
        n, order = self.cells, self.order
        around = along(n[0], order, closed=self.angle == 360)
        return product(around, across_disc(n[1], max(1, n[1] // 8), order))

    @property
    def extents(self) -> tuple[float, ...]:
        return radians(self.angle) * self.major_radius, 2 * pi * self.minor_radius

    @property
    def thickness(self) -> float:
        return 2 * self.minor_radius


class HollowTorus(SolidBuiltIn):
    """Torus about the y axis with a wall, with the surfaces inner, outer."""

    sides = ("inner", "outer")
    shape: Literal["hollow_torus"] = setting(..., "kind of shape")
    major_radius: Positive = setting(..., "radius of the circle of section centres", unit="m")
    inner_radius: Positive = setting(..., "inner radius of the section", unit="m")
    outer_radius: Positive = setting(..., "outer radius of the section", unit="m")
    cells: Cells3 = setting(..., "number of cells around the y axis, around the section, and through the wall")

    @model_validator(mode="after")
    def _possible(self) -> HollowTorus:
        require_wall(self.inner_radius, self.outer_radius)
        if self.outer_radius >= self.major_radius:
            raise fault(_less_than_major(self.major_radius, self.outer_radius), "outer_radius")
        require_around(self.cells, 0)
        require_around(self.cells, 1)
        return self

    @property
    def lattice(self) -> Counts:
        n, order = self.cells, self.order
        return product(along(n[0], order, closed=True), along(n[1], order, closed=True), along(n[2], order))

    @property
    def extents(self) -> tuple[float, ...]:
        return (
            2 * pi * self.major_radius,
            pi * (self.inner_radius + self.outer_radius),
            self.outer_radius - self.inner_radius,
        )

    @property
    def thickness(self) -> float:
        return self.outer_radius - self.inner_radius


class HollowSphere(SolidBuiltIn):
    """Spherical shell about the origin (a cubed sphere), with the surfaces inner, outer."""

    sides = ("inner", "outer")
    shape: Literal["hollow_sphere"] = setting(..., "kind of shape")
    inner_radius: Positive = setting(..., "inner radius", unit="m")
    outer_radius: Positive = setting(..., "outer radius", unit="m")
    cells: Cells2 = setting(..., "number of cells along an edge of the cube, and through the wall")

    @model_validator(mode="after")
    def _possible(self) -> HollowSphere:
        require_wall(self.inner_radius, self.outer_radius)
        return self

    @property
    def lattice(self) -> Counts:
        n, order = self.cells, self.order
        return product((6 * n[0] ** 2, 6 * (order * n[0]) ** 2 + 2), along(n[1], order))

    @property
    def extents(self) -> tuple[float, ...]:
        return pi / 4 * (self.inner_radius + self.outer_radius), self.outer_radius - self.inner_radius

    @property
    def thickness(self) -> float:
        return self.outer_radius - self.inner_radius


class Sphere(SolidBuiltIn):
    """Ball about the origin, a cubic core in a round shell, with the surface outer."""

    sides = ("outer",)
    shape: Literal["sphere"] = setting(..., "kind of shape")
    radius: Positive = setting(..., "radius", unit="m")
    cells: Cells2 = setting(..., "number of cells along an edge of the core, and through the shell")

    @property
    def lattice(self) -> Counts:
        face, edge = 6 * self.cells[0] ** 2, self.order * self.cells[0]
        layers = self.cells[1]
        return self.cells[0] ** 3 + face * layers, (edge + 1) ** 3 + (6 * edge**2 + 2) * self.order * layers

    @property
    def extents(self) -> tuple[float, ...]:
        return 2 * self.radius, 2 * self.radius

    @property
    def aspect(self) -> float:
        return 1.0

    @property
    def thickness(self) -> float:
        return 2 * self.radius


class Leaflet(SolidBuiltIn):
    """Leaflet of a valve in a tube about the z axis; surfaces inner, lips, outer, bottom, top, start, end.

    Lips are the upright part of the inner side, whole rows of cells. Bottom, start and end are at the wall, the middle
    is on the x axis. The lips are half of the gap away from the straight sides of the sector at the axis, nothing at
    the wall.
    """

    sides = ("inner", "lips", "outer", "bottom", "top", "start", "end")
    shape: Literal["leaflet"] = setting(..., "kind of shape")
    radius: Positive = setting(
        ..., "radius at which the lips end; the edge below them is one thickness farther out", unit="m"
    )
    wall: Positive = setting(..., "thickness of the leaflet", unit="m", name="thickness")
    height: Positive = setting(
        ..., "from the lowest point of the edge at the wall, z = 0, to the top of the lips", unit="m"
    )
    lip: Positive = setting(..., "height of the upright lips", unit="m")
    post: Positive = setting(..., "height of the sides at the wall below the lips", unit="m")
    angle: Positive = setting(120.0, "angle of the sector, at most 180", unit="degrees")
    gap: NotNegative = setting(0.0, "distance at the axis between the lips of leaflets side by side", unit="m")
    cells: Cells3 = setting(..., "number of cells along the wall (even), through the thickness, and up (at least 2)")

    @model_validator(mode="after")
    def _possible(self) -> Leaflet:
        if self.angle > 180:
            raise fault(f"must be at most 180 degrees, not {self.angle:g}", "angle")
        if self.cells[0] % 2:
            raise fault(f"the number of cells along the wall must be even, not {self.cells[0]}", "cells", 0)
        if self.cells[2] < 2:
            raise fault(f"the number of cells up must be at least 2, not {self.cells[2]}", "cells", 2)
        if self.lip + self.post >= self.height:
            raise fault(f"'lip' and 'post' must be lower together than 'height', {self.height:g}", "lip")
        if self.wall + self.gap / 2 >= self.radius / 2:
            raise fault(f"must be less than half of 'radius', {self.radius:g}, with half of 'gap'", "thickness")
        return self

    @property
    def lattice(self) -> Counts:
        n, order = self.cells, self.order
        return product(*(along(count, order) for count in n))

    @property
    def extents(self) -> tuple[float, ...]:
        return radians(self.angle) * self.radius, self.wall, self.height

    @property
    def thickness(self) -> float:
        return self.wall


SolidShape = Box | Beam | Cylinder | Tube | SolidTorus | HollowTorus | HollowSphere | Sphere | Leaflet


def _less_than_major(major: float, other: float) -> str:
    return "must be less than 'major_radius', {}, not {}".format(*distinct(major, other))
