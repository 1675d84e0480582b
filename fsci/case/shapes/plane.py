"""Built-in meshes of two dimensions: one section for each shape."""

from __future__ import annotations

from math import pi, radians
from typing import Annotated, Literal

from pydantic import model_validator

from fsci.case.section import setting
from fsci.case.shapes.built_in import (
    Cells2,
    Counts,
    PlaneBuiltIn,
    across_disc,
    along,
    product,
    require_around,
    require_part,
    require_wall,
)
from fsci.case.values import EntryCount, Number, Positive


class Rectangle(PlaneBuiltIn):
    """Rectangle with the surfaces left, right, bottom, top."""

    sides = ("left", "right", "bottom", "top")
    shape: Literal["rectangle"] = setting(..., "kind of shape")
    size: Annotated[tuple[Positive, ...], EntryCount(2, 2)] = setting(..., "extent along x and y", unit="m")
    cells: Cells2 = setting(..., "number of cells along x and y")
    origin: Annotated[tuple[Number, ...], EntryCount(2, 2)] = setting((0.0, 0.0), "lower left corner", unit="m")

    @property
    def lattice(self) -> Counts:
        n, order = self.cells, self.order
        return product(along(n[0], order), along(n[1], order))

    @property
    def extents(self) -> tuple[float, ...]:
        return self.size

    @property
    def thickness(self) -> float:
        return min(self.size)


class Disc(PlaneBuiltIn):
    """Disc about the origin, a square core in a round shell, with the surface outer."""

    sides = ("outer",)
    shape: Literal["disc"] = setting(..., "kind of shape")
    radius: Positive = setting(..., "radius", unit="m")
    cells: Cells2 = setting(..., "number of cells around (a multiple of 4) and through the shell")

    @model_validator(mode="after")
    def _possible(self) -> Disc:
        require_around(self.cells, 0, disc=True)
        return self

    @property
    def lattice(self) -> Counts:
        n, order = self.cells, self.order
        return across_disc(n[0], n[1], order)

    @property
    def extents(self) -> tuple[float, ...]:
        return 2 * pi * self.radius, self.radius

    @property
    def aspect(self) -> float:
        return 1.0

    @property
    def thickness(self) -> float:
        return 2 * self.radius


class Ring(PlaneBuiltIn):
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
        require_wall(self.inner_radius, self.outer_radius)
        require_part(self.angle, self.cells)
        return self

    @property
    def lattice(self) -> Counts:
        n, order = self.cells, self.order
        return product(along(n[0], order, closed=self.angle == 360), along(n[1], order))

    @property
    def extents(self) -> tuple[float, ...]:
        return radians(self.angle) * (self.inner_radius + self.outer_radius) / 2, self.outer_radius - self.inner_radius

    @property
    def thickness(self) -> float:
        return self.outer_radius - self.inner_radius


PlaneShape = Rectangle | Disc | Ring
