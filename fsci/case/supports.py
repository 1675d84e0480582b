"""Settings `supports` and `springs` of a body."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Discriminator, Tag, model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import EntryCount, Formula, NotNegativeFormula, NumberVector, Surfaces, Switch

AT = "instead of 'on': position of one node, exact to a millionth of the body's size"
DIRECTION = "only the component along this direction, a vector of any length that does not turn with the body"
NORMAL = "true: only the component normal to the undeformed surface, node by node"

#: One expression, or one for each component; null leaves a component free.
Displacement = Annotated[
    Annotated[tuple[Formula | None, ...], EntryCount(2, 3), Tag("by components")]
    | Annotated[Formula, Tag("along a direction")],
    Discriminator(lambda value: "by components" if isinstance(value, list | tuple) else "along a direction"),
]


class Located(Section):
    """The location of a support or spring: a named part of the mesh, or a node."""

    @model_validator(mode="after")
    def _somewhere(self) -> Any:
        on, at = getattr(self, "on", None), getattr(self, "at", None)
        if on is not None and at is not None:
            raise fault("give either 'on' or 'at', not both", "at")
        if on is None and at is None:
            raise fault("needs 'on: NAME' or 'at: [..]'")
        if at is not None and getattr(self, "normal", False):
            raise fault("a node has no normal; name a surface with 'on', or give a 'direction'", "normal")
        if getattr(self, "direction", None) is not None:
            if not any(self.direction):  # type: ignore[attr-defined]
                raise fault("must not be zero", "direction")
            if getattr(self, "normal", False):
                raise fault("give either 'direction' or 'normal: true', not both", "normal")
        return self


class SupportSection(Located):
    """A prescribed displacement: by components, or along one direction with the other directions free.

    At a node with several supports all of them hold; of those that contradict each other the last one counts.
    """

    on: Surfaces | None = setting(None, "name of a surface, of a line or of points of a mesh file, or list of names")
    at: NumberVector | None = setting(None, AT, unit="m")
    displacement: Displacement | None = setting(
        None,
        "displacement by components, null leaving one free; with 'direction' or 'normal' one expression, 0 by default",
        unit="m",
    )
    direction: NumberVector | None = setting(None, DIRECTION, unit="1")
    normal: Switch = setting(False, NORMAL + "; a positive displacement is one outwards")
    symmetry: Switch = setting(False, "true: a plane of symmetry, zero displacement normal to it")

    @model_validator(mode="after")
    def _one_kind(self) -> SupportSection:
        along = "direction" if self.direction is not None else "normal" if self.normal else ""
        if self.symmetry:
            for name, given in (("displacement", self.displacement is not None), (along, along), ("at", self.at)):
                if given:
                    word = f"{name}: true" if name == "normal" else name
                    raise fault(f"give either '{word}' or 'symmetry: true', not both", "symmetry")
        elif along and isinstance(self.displacement, tuple):
            raise fault(f"must be one expression, the displacement along the {along}, not a list", "displacement")
        elif self.displacement is None and not along:
            raise fault("a support needs 'displacement', 'direction', 'normal: true' or 'symmetry: true'")
        elif not along and not isinstance(self.displacement, tuple):
            raise fault(
                "must be a list of components; one expression goes with 'direction' or 'normal'", "displacement"
            )
        return self


class SpringSection(Located):
    """An elastic foundation: it pulls the body back to its undeformed position."""

    on: Surfaces | None = setting(None, "name of a surface, or of points of a mesh file, or list of names")
    at: NumberVector | None = setting(None, AT, unit="m")
    stiffness: NotNegativeFormula = setting(
        ..., "force per displacement, on surfaces per area too; N/m at points", unit="N/m^3"
    )
    direction: NumberVector | None = setting(None, DIRECTION, unit="1")
    normal: Switch = setting(False, NORMAL)
