"""Section `units`."""

from __future__ import annotations

import re
from typing import Literal

from fsci.case.section import Section, setting

LENGTHS = {"km": 1e3, "m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3, "um": 1e-6}  #: in m
MASSES = {"t": 1e3, "kg": 1.0, "g": 1e-3, "mg": 1e-6}  #: in kg
UNITS_OF_TIME = {"h": 3600.0, "min": 60.0, "s": 1.0, "ms": 1e-3, "us": 1e-6}  #: in s

Powers = tuple[int, int, int]  #: of length, mass and time

OF_FORCE, OF_ENERGY, OF_STRESS, OF_POWER = (1, 1, -2), (2, 1, -2), (-1, 1, -2), (2, 1, -3)
#: (length, mass, time) -> the names of the units of force, energy, stress and power
DERIVED = {
    ("m", "kg", "s"): ("N", "J", "Pa", "W"),
    ("mm", "t", "s"): ("N", "mJ", "MPa", "mW"),
    ("mm", "g", "ms"): ("N", "mJ", "MPa", "W"),
    ("mm", "kg", "ms"): ("kN", "J", "GPa", "kW"),
}
#: What solvers, which know no units, write behind a number in brackets -> powers, and those of length of its depth.
MARKS: dict[str, tuple[Powers, int]] = {
    "length": ((1, 0, 0), 0),
    "volume": ((3, 0, 0), 1),
    "force": (OF_FORCE, 1),
    "impulse": ((1, 1, -1), 1),
    "energy": (OF_ENERGY, 1),
    "stress": (OF_STRESS, 0),
}


class Units(Section):
    """The units of all numbers of the case, such as {length: mm, mass: t, time: s} for MPa; written to the results.

    They change no number: stresses are in mass/(length time^2), whatever these are.
    """

    length: Literal["km", "m", "dm", "cm", "mm", "um"] = setting("m", "unit of length")
    mass: Literal["t", "kg", "g", "mg"] = setting("kg", "unit of mass")
    time: Literal["h", "min", "s", "ms", "us"] = setting("s", "unit of time")

    @property
    def density(self) -> float:
        """The unit of density [kg/m^3]."""
        return MASSES[self.mass] / LENGTHS[self.length] ** 3

    @property
    def stress(self) -> float:
        """The unit of stress [Pa]."""
        return MASSES[self.mass] / LENGTHS[self.length] / UNITS_OF_TIME[self.time] ** 2

    def worded(self, text: str, dimension: int) -> str:
        """A text with units in place of [length], [volume], ...; in 2D volumes, forces and energies are per depth."""
        names = (self.length, self.mass, self.time)

        def unit(mark: re.Match[str]) -> str:
            powers, depth = MARKS[mark[1]]
            return name_of_unit(powers, depth if dimension == 2 else 0, names)

        return re.sub(rf"\[({'|'.join(MARKS)})\]", unit, text)


def name_of_unit(powers: Powers, depth: int, names: tuple[str, str, str]) -> str:
    """A unit by its powers of units with these names, such as N/mm or kg/m^3, over length to the power `depth`."""
    derived = dict(zip((OF_FORCE, OF_ENERGY, OF_STRESS, OF_POWER), DERIVED.get(names, ()), strict=False))
    length, mass, time = names
    if powers in derived:
        return f"{derived[powers]}/{length}" if depth else derived[powers]
    factors = [(mass, powers[1]), (length, powers[0] - depth), (time, powers[2])]
    above = " ".join(_raised(name, power) for name, power in factors if power > 0)
    below = " ".join(_raised(name, -power) for name, power in factors if power < 0)
    return f"{above or 1}/{below}" if below else above


def _raised(name: str, power: int) -> str:
    return name if power == 1 else f"{name}^{power}"
