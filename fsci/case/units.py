"""Section `units`."""

from __future__ import annotations

from typing import Literal

from fsci.case.section import Section, setting

LENGTHS = {"km": 1e3, "m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3, "um": 1e-6}  #: in m
MASSES = {"t": 1e3, "kg": 1.0, "g": 1e-3, "mg": 1e-6}  #: in kg
UNITS_OF_TIME = {"h": 3600.0, "min": 60.0, "s": 1.0, "ms": 1e-3, "us": 1e-6}  #: in s


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
