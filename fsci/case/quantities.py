"""The quantities of probes, each with its locations, unit, columns and requirements."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

Field = Literal["structure", "fluid", "rigid"]
FIELDS: tuple[Field, ...] = ("structure", "fluid", "rigid")

#: Setting of a location -> its name in messages.
LOCATIONS = {
    "pair": "'pair: PAIR'",
    "at": "'at: [..]'",
    "on": "'on: SURFACE'",
    "through": "'through: PATCH'",
    "plane": "'plane: {point: [..], normal: [..]}'",
    "box": "'box: [[..], [..]]'",
}
WHOLE = ""  #: none of them: a body, or all fluid

#: What `on` names in a field.
SURFACES = {"structure": "a surface", "fluid": "a patch", "rigid": "what free bodies touch"}

ENERGIES = ("kinetic", "internal", "work", "total")


@dataclass(frozen=True)
class Quantity:
    """Something that a probe measures.

    parts: `one` column NAME; a `vector` NAME.x, NAME.y and in 3D NAME.z; the `axis` of a rotation is a vector in 3D and
    one column in 2D; `energies` are those of ENERGIES.
    """

    name: str
    powers: tuple[int, int, int]  #: of length, mass and time in its unit; in 2D per unit of thickness
    parts: Literal["one", "vector", "axis", "energies"]
    structure: tuple[str, ...] = ()  #: settings of locations in a structure
    fluid: tuple[str, ...] = ()  #: settings of locations in a fluid
    needs: tuple[str, ...] = ()  #: of a structure dynamics or density; of a fluid body or reference
    meaning: str = ""  #: explanation for the input reference
    rigid: tuple[str, ...] = ()  #: settings of locations on a free rigid body

    def locations(self, field: Field) -> tuple[str, ...]:
        """The settings of its locations in a field."""
        return {"structure": self.structure, "fluid": self.fluid, "rigid": self.rigid}[field]

    def columns(self, name: str, dimension: int) -> tuple[str, ...]:
        """The columns of history.csv of a probe with this name."""
        if self.parts == "energies":
            return tuple(f"{name}.{part}" for part in ENERGIES)
        if self.parts == "one" or (self.parts == "axis" and dimension == 2):
            return (name,)
        return tuple(f"{name}.{axis}" for axis in "xyz"[:dimension])


_LENGTH, _SPEED, _FORCE, _ENERGY, _STRESS = (1, 0, 0), (1, 0, -1), (1, 1, -2), (2, 1, -2), (-1, 1, -2)
_POWER = (2, 1, -3)
_QUANTITIES = (
    Quantity(
        "displacement", _LENGTH, "vector", ("at", "on"), meaning="of a surface the mean over its area", rigid=("at",)
    ),
    Quantity("velocity", _SPEED, "vector", ("at",), ("at", "box"), ("dynamics",), rigid=("at",)),
    Quantity(
        "speed",
        _SPEED,
        "one",
        fluid=("box", WHOLE),
        meaning="the `extreme`, and its place in columns NAME.place.x, NAME.place.y, ...",
    ),
    Quantity("acceleration", (1, 0, -2), "vector", ("at",), needs=("dynamics",)),
    Quantity("reaction", _FORCE, "vector", ("on",), meaning="force of supports and springs on the bodies"),
    Quantity("traction", _FORCE, "vector", ("on",), meaning="integral of P N over the reference surface"),
    Quantity("area", (2, 0, 0), "one", ("on",), ("plane",), meaning="of a plane its open part, between the bodies"),
    Quantity("gap", _LENGTH, "one", ("pair",), meaning="distance of the slave nodes to the master, negative behind it"),
    Quantity(
        "mean_gap",
        _LENGTH,
        "one",
        ("pair",),
        meaning="gap that contact closes: the mean around each slave node, zero in contact, nan where nothing is near",
    ),
    Quantity("overlap", _LENGTH, "one", ("pair",), meaning="largest depth of nodes of one side behind the other"),
    Quantity(
        "pressure",
        _STRESS,
        "one",
        ("pair",),
        ("at", "on", "plane", "box", WHOLE),
        meaning="of a patch or a plane the mean over its area, of all fluid the `extreme`",
    ),
    Quantity("contact_area", (2, 0, 0), "one", ("pair",), meaning="area in which a pair touches"),
    Quantity("stick_area", (2, 0, 0), "one", ("pair",), meaning="area in which it touches without slip"),
    Quantity("mean_pressure", _STRESS, "one", ("pair",), meaning="normal force over the area in contact"),
    Quantity(
        "first_contact", (0, 0, 1), "one", ("pair",), meaning="time of the end of the first step with contact, else nan"
    ),
    Quantity("energy", _ENERGY, "energies", (WHOLE,), meaning="of all bodies"),
    Quantity("momentum", (1, 1, -1), "vector", (WHOLE,), needs=("density",), rigid=(WHOLE,)),
    Quantity(
        "angular_momentum", (2, 1, -1), "axis", (WHOLE,), needs=("density",), meaning="about the origin", rigid=(WHOLE,)
    ),
    Quantity("mass", (0, 1, 0), "one", (WHOLE,), needs=("density",), rigid=(WHOLE,)),
    Quantity("volume", (3, 0, 0), "one", (WHOLE,), ("box", WHOLE)),
    Quantity("centre", _LENGTH, "vector", (WHOLE,), needs=("density",), meaning="of mass", rigid=(WHOLE,)),
    Quantity(
        "flow_rate",
        (3, 0, -1),
        "one",
        (),
        ("through", "plane"),
        meaning="volume per time, out of the box or along the normal",
    ),
    Quantity("outlet_pressure", _STRESS, "one", (), ("through",), meaning="of a `resistance` or `windkessel`"),
    Quantity(
        "driving_force",
        (-2, 1, -2),
        "one",
        (),
        ("through",),
        meaning="per volume, of the `rate` of a periodic patch: the mean pressure falls by as much per length",
    ),
    Quantity("force", _FORCE, "vector", (), ("on", WHOLE), ("body",), "of the fluid on the `body`, or on the patch"),
    Quantity(
        "contact_force",
        _FORCE,
        "vector",
        meaning="of free bodies, or of one `body`, on an obstacle, a given body or a closed patch, mean in the step; "
        "elastic bodies have columns contact.PAIR",
        rigid=("on",),
    ),
    Quantity("moment", _ENERGY, "axis", (), (WHOLE,), ("body",), "of that force"),
    Quantity("power", _POWER, "one", (), (WHOLE,), ("body",), "of that force, with the velocity of its surface"),
    Quantity("drag_coefficient", (0, 0, 0), "one", (), (WHOLE,), ("body", "reference"), "of that force"),
    Quantity("lift_coefficient", (0, 0, 0), "one", (), (WHOLE,), ("body", "reference"), "of that force"),
    Quantity("kinetic_energy", _ENERGY, "one", (), ("box", WHOLE), meaning="of all fluid"),
    Quantity("dissipation", _POWER, "one", (), (WHOLE,), meaning="power of the viscous stress in all fluid"),
)
QUANTITIES = {quantity.name: quantity for quantity in _QUANTITIES}


def described(field: Field) -> str:
    """A list with an entry for each kind of location of a field: its quantities."""
    return "\n".join(_lines(field))


def _lines(field: Field) -> Iterator[str]:
    words = {
        "at": "with `at`, at a point",
        "on": f"with `on`, on {SURFACES[field]}",
        "pair": "with `pair`, of a contact pair",
        "through": "with `through`, through a patch",
        "plane": "with `plane`, through the part of a plane, in 2D of a line, that is in the fluid",
        "box": "with `box`, of the fluid in it, of velocity and pressure the mean (or `extreme`, with its place)",
        WHOLE: "with none of them, of the whole",
    }
    for place, beginning in words.items():
        there = [q for q in _QUANTITIES if place in q.locations(field)]
        if there:
            listed = ", ".join(q.name + (f" ({q.meaning})" if q.meaning else "") for q in there)
            yield f"- {beginning}: {listed}"
