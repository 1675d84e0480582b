"""Units of pictures: those that people use for values of a size, such as kPa, mm or, per depth in 2D, N/mm."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from fsci.case.quantities import QUANTITIES
from fsci.case.units import (
    LENGTHS,
    MASSES,
    OF_ENERGY,
    OF_FORCE,
    OF_POWER,
    OF_STRESS,
    UNITS_OF_TIME,
    Powers,
    name_of_unit,
)

#: powers of probes, of time and of fields
POWERS: dict[str, Powers] = {
    **{quantity.name: quantity.powers for quantity in QUANTITIES.values()},
    "time": (0, 0, 1),
    **dict.fromkeys(("von_mises", "stress", "principal_stress", "nominal_stress"), OF_STRESS),
    **dict.fromkeys(("contact_pressure", "contact_traction", "traction", "wall_shear_stress"), OF_STRESS),
    **dict.fromkeys(("vorticity", "strain_rate"), (0, 0, -1)),
    "q_criterion": (0, 0, -2),
    **dict.fromkeys(("contact_gap", "place"), (1, 0, 0)),
}
#: Quantities that do not grow with the depth; all others are per depth in 2D.
INTENSIVE = ("displacement", "velocity", "speed", "acceleration", "gap", "mean_gap", "overlap", "pressure",
             "mean_pressure", "outlet_pressure", "driving_force", "first_contact", "centre", "drag_coefficient",
             "lift_coefficient")  # fmt: skip

SIZES = {**LENGTHS, **MASSES, **UNITS_OF_TIME}  #: in m, kg and s
#: powers -> names of units with their size in m, kg and s, in increasing order
LADDERS: dict[Powers, tuple[tuple[str, float], ...]] = {
    (1, 0, 0): (("nm", 1e-9), ("\u00b5m", 1e-6), ("mm", 1e-3), ("m", 1.0), ("km", 1e3)),
    (1, 0, -1): (("\u00b5m/s", 1e-6), ("mm/s", 1e-3), ("m/s", 1.0)),
    OF_STRESS: (("Pa", 1.0), ("kPa", 1e3), ("MPa", 1e6), ("GPa", 1e9)),
    OF_FORCE: (("nN", 1e-9), ("\u00b5N", 1e-6), ("mN", 1e-3), ("N", 1.0), ("kN", 1e3), ("MN", 1e6)),
    (0, 1, -2): (("\u00b5N/m", 1e-6), ("mN/m", 1e-3), ("N/m", 1.0), ("N/mm", 1e3), ("kN/mm", 1e6)),
    OF_ENERGY: (("nJ", 1e-9), ("\u00b5J", 1e-6), ("mJ", 1e-3), ("J", 1.0), ("kJ", 1e3), ("MJ", 1e6)),
    OF_POWER: (("nW", 1e-9), ("\u00b5W", 1e-6), ("mW", 1e-3), ("W", 1.0), ("kW", 1e3), ("MW", 1e6)),
}


@dataclass(frozen=True)
class Unit:
    """A unit, and the number that values of the case are multiplied by to be in it."""

    text: str  #: for matplotlib; empty of pure numbers
    factor: float = 1.0

    def beside(self, text: str) -> str:
        """A text for matplotlib with the unit in brackets."""
        text = literal(text.replace("von_mises", "von Mises stress").replace("_", " "))
        return f"{text} [{self.text}]" if self.text else text


def unit_of(quantity: str, units: Mapping[str, str], largest: float = 0.0, *, flat: bool = False) -> Unit:
    """The unit in which the largest size of the values is 1 or more, of lengths 0.1 or more, of those that people use.

    units: of length, mass and time; flat: in 2D, where forces and volumes are per depth. The unit of the case where the
    largest value is zero or not finite, or the case has units of its own.
    """
    whole = POWERS.get(quantity, (0, 0, 0))
    depth = int(flat and quantity in QUANTITIES and quantity not in INTENSIVE)
    names = (units["length"], units["mass"], units["time"])
    ladder = LADDERS.get((whole[0] - depth, whole[1], whole[2]))
    if depth and whole in (OF_ENERGY, OF_POWER):
        ladder = tuple((f"{name}/m", size) for name, size in LADDERS[whole])
    if ladder and 0.0 < largest < float("inf") and all(name in SIZES for name in names):
        size = SIZES[names[0]] ** (whole[0] - depth) * SIZES[names[1]] ** whole[1] * SIZES[names[2]] ** whole[2]
        least = 1.0 if whole[1] else 0.1  # 0.4 m and 0.2 m/s are read more easily than 400 mm and 200 mm/s
        fitting = [step for step in ladder if least * step[1] <= largest * size * (1.0 + 1e-9)]
        text, scale = fitting[-1] if fitting else ladder[0]
        unit = Unit(text, size / scale)
    else:
        unit = Unit(_of_case(whole, depth, names))
    return replace(unit, text=unit.text.replace("J", "N m")) if quantity == "moment" else unit


def label(text: str, quantity: str, units: Mapping[str, str], *, flat: bool = False) -> str:
    """A text for matplotlib with the unit that a quantity has in the case, or without for unknown quantities."""
    return unit_of(quantity, units, flat=flat).beside(text)


def measured(family: str, quantities: Mapping[str, str], otherwise: str = "") -> str:
    """The quantity of the columns FAMILY.x, ... of a probe, or of the place that it has; `otherwise` of no probe."""
    return quantities.get(family, "place" if family.endswith(".place") else otherwise)


def _of_case(whole: Powers, depth: int, names: tuple[str, str, str]) -> str:
    length, mass, time = (literal(name) for name in names)
    return re.sub(r"\^(\d)", r"$^\1$", name_of_unit(whole, depth, (length, mass, time)))


def literal(text: str) -> str:
    """A text that matplotlib draws as it stands: it reads what is between two dollar signs as a formula."""
    return text.replace("$", r"\$")
