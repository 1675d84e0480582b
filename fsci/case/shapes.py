"""Sections of built-in meshes: one for each shape that `fsci.shapes` declares."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from inspect import Parameter, signature, unwrap
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Union

from pydantic import create_model, model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import (
    Count,
    EntryCount,
    Name,
    NotNegative,
    Number,
    NumberVector,
    OneOrMany,
    Order,
    Positive,
)
from fsci.shapes import SHAPES
from fsci.shapes.declaration import MeshPlan, ShapeError, Takes, require_multiples, settings


class Rotation(Section):
    """A rotation about an axis through the origin; in 2D about the origin."""

    axis: Annotated[tuple[Number, ...], EntryCount(3, 3)] | None = setting(
        None, "direction of the axis (3D only)", unit="1"
    )
    angle: Number = setting(..., "angle, counterclockwise seen against the axis", unit="degrees")


#: One rotation or a list of them.
Rotations = Annotated[tuple[Rotation, ...], OneOrMany()]


class MeshSurface(Section):
    """A named surface of a mesh: the facets of its boundary with this normal, in this box, or both.

    Coordinates are those of the shape, or of the file times `scale`, before the mesh is mirrored, turned or moved.
    """

    normal: NumberVector | None = setting(None, "direction of their outward normals, of any length", unit="1")
    within: Positive = setting(10.0, "largest angle between a normal and this one", unit="degrees")
    box: Annotated[tuple[NumberVector, ...], EntryCount(2, 2)] | None = setting(
        None, "lowest and highest corner of a box around all of their corners", unit="m"
    )

    @model_validator(mode="after")
    def _some(self) -> MeshSurface:
        if self.normal is None and self.box is None:
            raise fault("a surface needs 'normal', 'box' or both")
        if self.normal is not None and not any(self.normal):
            raise fault("must not be zero", "normal")
        if self.normal is None and "within" in self.model_fields_set:
            raise fault("'within' belongs to 'normal'", "within")
        return self


class PlacedMesh(Section):
    """A mesh that is mirrored, rotated, then moved."""

    surfaces: dict[Name, MeshSurface] = setting(dict, "more surfaces by name, beside those that the mesh has")
    mirror: Literal["x", "y", "z"] | None = setting(
        None, "x: mirrored at the plane x = 0, before the rotations; surfaces keep their names"
    )
    rotate: Rotations = setting(tuple, "rotation or list of rotations, the first one first")
    translate: NumberVector | None = setting(None, "displacement after the rotations", unit="m")


class ShapeSection(PlacedMesh):
    """A built-in mesh."""

    planned: ClassVar[Callable[..., MeshPlan]]  #: of the settings
    takes: ClassVar[Mapping[str, Takes]]
    order: Order = setting(
        "auto",
        "polynomial order of the cells; auto: 2 for an elastic body, but 1 for one that is not slender where it may "
        "touch with friction, in a flow or in space, or where a support moves it in a flow",
    )
    if TYPE_CHECKING:
        shape: str
        cells: tuple[int, ...]
        cell: str

    @property
    def degree(self) -> int:
        """Of the cells; `with_order` has that of elastic bodies."""
        return 1 if self.order == "auto" else self.order

    @property
    def plan(self) -> MeshPlan:
        """Counts, extents and surfaces of the mesh, and how to make it."""
        names = signature(self.planned).parameters
        given = {name: getattr(self, name) for name in names}
        return type(self).planned(**{**given, "order": self.degree})

    @property
    def multiples(self) -> tuple[int, ...]:
        """What each number of cells must be a multiple of."""
        found = self.takes["cells"].multiples
        return tuple(found.get(at, (1, ""))[0] for at in range(len(self.cells)))

    @model_validator(mode="after")
    def _possible(self) -> ShapeSection:
        try:
            require_multiples(self.cells, self.takes["cells"])
            assert self.plan
        except ShapeError as error:
            raise fault(error.message, *error.keys) from None
        return self


class PlaneShape(ShapeSection):
    """A built-in mesh in 2D."""

    cell: Literal["quad", "tri"] = setting("quad", "type of the cells; a tri is half a quad")


class SolidShape(ShapeSection):
    """A built-in mesh in 3D."""

    cell: Literal["hex", "tet"] = setting("hex", "type of the cells; a tet is a sixth of a hex")


VALUES: dict[str, Any] = {"number": Number, "positive": Positive, "not negative": NotNegative, "count": Count}


def _section(plan: Callable[..., MeshPlan], names: list[str]) -> type[ShapeSection]:
    """The section of a shape with these names, from the signature of its function."""
    takes, parameters = settings(plan), signature(plan).parameters
    fields: dict[str, Any] = {"shape": (Literal[tuple(names)], setting(..., "kind of shape"))}
    for name, one in takes.items():
        value = VALUES[one.kind]
        if one.entries:
            value = Annotated[tuple[value, ...], EntryCount(one.entries, one.entries)]  # type: ignore[valid-type]
        default = parameters[name].default
        fields[name] = value, setting(... if default is Parameter.empty else default, one.meaning, unit=one.unit)
    base = PlaneShape if parameters["cell"].default == "quad" else SolidShape
    section = create_model(plan.__name__.title().replace("_", ""), __base__=base, __module__=__name__, **fields)
    section.__doc__ = plan.__doc__
    section.planned, section.takes = staticmethod(plan), takes
    return section


def _sections() -> list[type[ShapeSection]]:
    names: dict[Callable[..., MeshPlan], list[str]] = {}
    for name, (function, _) in SHAPES.items():
        names.setdefault(unwrap(function), []).append(name)
    return [_section(plan, called) for plan, called in names.items()]


SHAPE_SECTIONS = _sections()
globals().update({section.__name__: section for section in SHAPE_SECTIONS})  # where pickle looks for them
AnyShape: Any = Union[tuple(SHAPE_SECTIONS)]  # noqa: UP007 - of types that are made here
#: Model of a section -> an example of it.
SHAPE_EXAMPLES = {
    section.__name__: f"mesh: {{shape: {name}, {example}}}"
    for section in SHAPE_SECTIONS
    for name, (function, example) in SHAPES.items()
    if example and unwrap(function) is section.planned
}
