"""Loads of a body, except those on its volume."""

from __future__ import annotations

from typing import TypeVar

from pydantic import model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.supports import AT, Located
from fsci.case.values import Formula, NumberVector, PositiveFormula, SpaceVector, Surfaces, Vector

T = TypeVar("T", bound="ActiveSection | PreStretchSection")


def _with_direction(section: T) -> T:
    if section.direction is not None and all(entry.constant == 0.0 for entry in section.direction):
        raise fault("must not be zero", "direction")
    return section


class TractionSection(Section):
    """A dead load: it keeps its direction and acts on the reference area."""

    on: Surfaces = setting(..., "name of a surface, or list of names")
    value: Vector = setting(..., "force per reference area", unit="Pa")


class PressureSection(Section):
    """A follower load: it stays normal to the deformed surface."""

    on: Surfaces = setting(..., "name of a surface, or list of names")
    value: Formula = setting(..., "pressure; a positive one pushes against the surface", unit="Pa")


class ActiveSection(Section):
    """A stress T a a along fibres with the unit vector a of the undeformed body, as of muscles.

    It is the second Piola-Kirchhoff stress: the force per reference area along a fibre is T times its stretch.
    """

    direction: SpaceVector = setting(..., "direction of the fibres in the undeformed body, of any length")
    stress: Formula = setting(..., "T; positive: the fibres pull", unit="Pa")

    @model_validator(mode="after")
    def _not_zero(self) -> ActiveSection:
        return _with_direction(self)


class PreStretchSection(Section):
    """A stretch that the body has in its mesh already: without supports and loads it would be shorter by `stretch`.

    The stress is that of F_e = F G, with the product G of all stretches of the list. It is there from the first step
    on: thin bodies that it bends may need `line_search: true` of Newton's method.
    """

    stretch: PositiveFormula = setting(..., "length in the mesh by free length", unit="1")
    direction: SpaceVector | None = setting(
        None, "direction in the mesh, of any length; default: all, in 2D those of the plane"
    )

    @model_validator(mode="after")
    def _not_zero(self) -> PreStretchSection:
        return _with_direction(self)


class LineForceSection(Section):
    """A dead load along lines of a mesh in space."""

    on: Surfaces = setting(..., "name of a line of a mesh file, or list of names")
    value: Vector = setting(..., "force per reference length", unit="N/m")


class PointForceSection(Located):
    """A dead load at points. Near them the deformation of a solid grows without bound as cells get smaller."""

    on: Surfaces | None = setting(
        None, "name of points of a mesh file, or list of names: each of them carries the force"
    )
    at: NumberVector | None = setting(None, AT, unit="m")
    value: Vector = setting(..., "force; in 2D per depth", unit="N")
