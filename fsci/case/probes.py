"""Section `probes`."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import Name, NumberVector, Text

AT_POINT = ("displacement", "velocity", "acceleration")
ON_SURFACE = ("reaction", "traction", "displacement", "area")
OF_BODY = ("energy", "momentum", "angular_momentum", "mass", "volume", "centre")
ENERGIES = ("kinetic", "internal", "work", "total")
#: columns of history.csv that cannot be names of probes
RESERVED = ("step", "time", "dt", "iterations", "wall", "residual")


class Probe(Section):
    """A quantity that every step writes to history.csv.

    - with `at`, at a point (reference coordinates): displacement, velocity, acceleration
    - with `on`, on a surface: reaction (force of the supports), traction (integral of P N over the reference surface),
      displacement (mean over the area), area
    - with neither, of the body: energy, momentum, angular_momentum, mass, volume, centre (of mass)

    Vectors have the columns NAME.x, NAME.y, NAME.z (the last one in 3D); energy, always of all bodies, has
    NAME.kinetic, NAME.internal, NAME.work (of loads and supports) and NAME.total (kinetic + internal); all others,
    angular_momentum in 2D too, have the column NAME.
    """

    body: Name | None = setting(
        None, "name of the body; default: the only one, or all bodies together where neither `at` nor `on` is given"
    )
    quantity: Literal[
        "displacement",
        "velocity",
        "acceleration",
        "reaction",
        "traction",
        "area",
        "energy",
        "momentum",
        "angular_momentum",
        "mass",
        "volume",
        "centre",
    ] = setting(..., "what is measured")
    at: NumberVector | None = setting(None, "point, in reference coordinates", unit="m")
    on: Text | None = setting(None, "name of a surface")

    @model_validator(mode="after")
    def _measurable(self) -> Probe:
        where = {"'at: [..]'": AT_POINT, "'on: SURFACE'": ON_SURFACE}
        if self.at is not None and self.on is not None:
            raise fault("give either 'at' or 'on', not both", "on")
        given = "'at: [..]'" if self.at is not None else "'on: SURFACE'" if self.on is not None else ""
        if self.quantity in where.get(given, OF_BODY):
            return self
        possible = [word for word, quantities in where.items() if self.quantity in quantities]
        wanted = f"needs {' or '.join(possible)}" if possible else "belongs to the whole body: no 'at', no 'on'"
        key = {"'at: [..]'": "at", "'on: SURFACE'": "on"}.get(given, "quantity")
        raise fault(f"quantity '{self.quantity}' {wanted}", key)

    def columns(self, name: str, dimension: int) -> tuple[str, ...]:
        """The columns of history.csv that the probe called `name` fills."""
        match self.quantity:
            case "energy":
                return tuple(f"{name}.{part}" for part in ENERGIES)
            case "area" | "mass" | "volume":
                return (name,)
            case "angular_momentum" if dimension == 2:
                return (name,)
        return tuple(f"{name}.{axis}" for axis in "xyz"[:dimension])
