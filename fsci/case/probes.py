"""Section `probes`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from pydantic import model_validator

from fsci.case.quantities import FIELDS, LOCATIONS, QUANTITIES, Field, Quantity, described
from fsci.case.section import Section, fault, setting
from fsci.case.units import Powers
from fsci.case.values import EntryCount, Name, NumberVector, Positive, Text

#: Quantities of a pair that have no place.
OF_WHOLE_PAIRS = ("contact_area", "stick_area", "mean_pressure", "first_contact", "overlap")
#: columns of history.csv that cannot be names of probes
RESERVED_COLUMNS = ("step", "time", "dt", "iterations", "wall", "residual")

if TYPE_CHECKING:
    QuantityName: TypeAlias = str
else:
    QuantityName = Literal[tuple(QUANTITIES)]


class Reference(Section):
    """Reference of drag and lift coefficients, c = F . e / (1/2 density velocity^2 length), in 3D with the area."""

    density: Positive | None = setting(None, "mass per volume; default: that of the fluid", unit="kg/m^3")
    velocity: Positive = setting(..., "speed", unit="m/s")
    length: Positive | None = setting(None, "length across the flow, such as a diameter (2D only)", unit="m")
    area: Positive | None = setting(None, "area (3D only)", unit="m^2")
    drag: NumberVector | None = setting(None, "direction of the drag; default: x", unit="1")
    lift: NumberVector | None = setting(
        None, "direction of the lift; default: in 2D that of the drag, turned counterclockwise by 90 degrees; in 3D y",
        unit="1",
    )  # fmt: skip


class PlaneSection(Section):
    """A plane through the box of a flow, in 2D a line."""

    point: NumberVector = setting(..., "a point of it", unit="m")
    normal: NumberVector = setting(..., "direction at a right angle to it, in which a flow rate is positive", unit="1")


class Probe(Section):
    __doc__ = f"""A quantity that every step writes to history.csv.

Of the structure, points being those of the reference configuration:

{described("structure")}

Of a pair of contact it is the `extreme` of all slave nodes, or the value of the node nearest to the point `at`.

Of a free rigid `body`, points being those of the start:

{described("rigid")}

Of the fluid; at a point that a body covers it is nan, with `minus` it is a difference:

{described("fluid")}

Vectors have the columns NAME.x, NAME.y, NAME.z (the last one in 3D); energy has NAME.kinetic, NAME.internal, NAME.work
(of loads and supports) and NAME.total (kinetic + internal); all others, angular_momentum and moment in 2D too, have the
column NAME. In 2D everything is per unit of depth.
"""

    field: Field | None = setting(None, "the measured field; needed where quantity and body do not determine it")
    body: Name | None = setting(
        None, "name of the body; default: the only one, or all bodies together where neither `at` nor `on` is given"
    )
    quantity: QuantityName = setting(..., "what is measured")
    at: NumberVector | None = setting(None, "point; of a structure, in reference coordinates", unit="m")
    on: Text | None = setting(None, "name of a surface, or of a patch of the fluid")
    minus: NumberVector | None = setting(
        None, "another point of the fluid, whose value is subtracted from that of `at`", unit="m"
    )
    through: Text | None = setting(None, "name of a patch of the fluid")
    plane: PlaneSection | None = setting(None, "plane through the fluid")
    box: Annotated[tuple[NumberVector, ...], EntryCount(2, 2)] | None = setting(
        None, "lowest and highest corner of a box in the fluid", unit="m"
    )
    pair: Name | None = setting(None, "name of a contact pair")
    extreme: Literal["largest", "least"] | None = setting(
        None,
        "of all slave nodes of the pair, or of the fluid in a box or of all; default: the least gap, the largest "
        "speed, the largest pressure of all fluid",
    )
    reference: Reference | None = setting(None, "reference values of drag and lift coefficients")
    about: NumberVector | None = setting(None, "point that a moment is about; default: the origin", unit="m")

    @property
    def place(self) -> str:
        """The setting of the location: pair, at, on, through, plane, box or none."""
        return next((name for name in LOCATIONS if getattr(self, name) is not None), "")

    @property
    def fields(self) -> list[str]:
        """The fields that have this quantity at this kind of location."""
        return [field for field in FIELDS if self.place in self.measured.locations(field)]

    @property
    def measured(self) -> Quantity:
        """The record of its quantity."""
        return QUANTITIES[self.quantity]

    @model_validator(mode="after")
    def _measurable(self) -> Probe:
        given = [name for name in LOCATIONS if getattr(self, name) is not None]
        if given[:2] == ["pair", "at"]:
            given.remove("at")  # a node of the pair
        if len(given) > 1:
            raise fault(f"give either '{given[0]}' or '{given[1]}', not both", given[1])
        if self.about is not None and self.quantity != "moment":
            raise fault(f"'about' is for the quantity 'moment', not '{self.quantity}'", "about")
        self._check_extreme()
        needed = "reference" in self.measured.needs
        if needed and self.reference is None:
            raise fault(f"quantity '{self.quantity}' needs the setting 'reference'")
        if not needed and self.reference is not None:
            raise fault(f"'reference' is for coefficients of drag and lift, not for '{self.quantity}'", "reference")
        if self.minus is not None and self.place != "at":
            raise fault("'minus' is the second point of a difference: give the first one as 'at'", "minus")
        if self.fields:
            return self
        possible = [
            words for name, words in LOCATIONS.items() if any(name in self.measured.locations(f) for f in FIELDS)
        ]
        possible += ["a 'body'"] if possible and "body" in self.measured.needs else []
        whole = "body" if self.measured.structure or "body" in self.measured.needs else "fluid"
        whole = f"is measured on the whole {whole}: remove 'at' and 'on'"
        wanted = f"needs {' or '.join(possible)}" if possible else whole
        raise fault(f"quantity '{self.quantity}' {wanted}", self.place or "quantity")

    def _check_extreme(self) -> None:
        of_fluid = self.quantity in ("pressure", "speed") and self.place in ("", "box")
        if self.extreme is not None and self.place != "pair" and not of_fluid:
            words = "the nodes of a contact pair, or to pressure and speed of all fluid or of that in a box"
            raise fault(f"'extreme' applies to {words}", "extreme")
        if self.extreme is not None and self.at is not None:
            raise fault("give either 'at' or 'extreme', not both", "extreme")
        for key in ("at", "extreme"):
            if self.quantity in OF_WHOLE_PAIRS and getattr(self, key) is not None:
                raise fault(f"'{self.quantity}' is measured on the whole pair: remove '{key}'", key)

    @property
    def has_place(self) -> bool:
        """Whether it says where its value is."""
        return self.quantity == "speed" or (self.place == "box" and self.extreme is not None)

    def columns(self, name: str, dimension: int) -> tuple[str, ...]:
        """The columns of history.csv that the probe called `name` fills."""
        places = tuple(f"{name}.place.{axis}" for axis in "xyz"[:dimension]) if self.has_place else ()
        return self.measured.columns(name, dimension) + places

    def powers(self, name: str, column: str) -> Powers:
        """Powers of length, mass and time of a column of the probe called `name`."""
        return (1, 0, 0) if column.startswith(f"{name}.place.") else self.measured.powers
