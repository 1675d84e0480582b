"""Outlets whose pressure depends on the flow through them: resistances and Windkessels of three elements."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from solvers.api import State

#: x below which 1 - (1 - e^-x) / x is summed as a series: both have less than 1e-12 of rounding and truncation there.
SERIES = 1e-3


@dataclass(frozen=True)
class Windkessel:
    """The pressure P = R_p q + P_c of an outlet with the flow rate q out of the box, C dP_c/dt = q - P_c / R_d.

    A resistance is R_p alone. In 2D the flow rate is per depth.
    Source: Westerhof, Lankhaar, Westerhof, Med. Biol. Eng. Comput. 47 (2009) 131-141.
    """

    proximal: float = 0.0  #: R_p [Pa s/m^3]
    distal: float = 0.0  #: R_d [Pa s/m^3]
    capacitance: float = 0.0  #: C [m^3/Pa]
    pressure: float = 0.0  #: P_c at the start [Pa]


@dataclass(frozen=True)
class Line:
    """P = resistance q + pressure: what an outlet is in one step."""

    resistance: float  #: [Pa s/m^3]
    pressure: float  #: [Pa]


@dataclass(frozen=True)
class Stored:
    """State of an outlet at the beginning of a step."""

    pressure: float  #: P_c [Pa]
    rate: float | None  #: q [m^3/s]; None: no step has ended yet


def line(law: Windkessel, stored: Stored, dt: float | None) -> Line:
    """The line for a step of length dt [s]; None: in steady flow.

    P_c is exact for a flow rate that is linear in the step, and in the first step for a constant one, which holds for
    an impulsive start. With x = dt / (R_d C)

        P_c = e^-x P_c,n + R_d (w_0 q_n + w q),    w = 1 - (1 - e^-x) / x,    w_0 + w = 1 - e^-x.
    """
    time = law.distal * law.capacitance
    if dt is None or time == 0.0:
        return Line(law.proximal + law.distal, 0.0)
    x = dt / time
    both = -math.expm1(-x)
    if stored.rate is None:
        return Line(law.proximal + law.distal * both, math.exp(-x) * stored.pressure)
    w = x / 2 * (1 - x / 3 * (1 - x / 4 * (1 - x / 5))) if x < SERIES else 1.0 - both / x
    past = math.exp(-x) * stored.pressure + law.distal * (both - w) * stored.rate
    return Line(law.proximal + law.distal * w, past)


class Outlets:
    """All outlets of a flow from step to step, the same on all processes."""

    def __init__(self, laws: Mapping[str, Windkessel]):
        """laws: by the names of patches."""
        self._laws = laws
        self._stored = {name: Stored(law.pressure, None) for name, law in laws.items()}
        self.lines = [Line(0.0, stored.pressure) for stored in self._stored.values()]

    def begin_step(self, dt: float | None) -> None:
        """Set the lines for a step of length dt [s]; None: in steady flow."""
        self.lines = [line(law, self._stored[name], dt) for name, law in self._laws.items()]

    def end_step(self, rates: Sequence[float]) -> None:
        """Accept a step with the flow rates [m^3/s] at its end."""
        for (name, law), line, q in zip(self._laws.items(), self.lines, rates, strict=True):
            self._stored[name] = Stored((line.resistance - law.proximal) * q + line.pressure, q)

    def save(self) -> State:
        """Names of patches, their pressures and flow rates."""
        stored = self._stored.values()
        pressures, rates = [one.pressure for one in stored], [one.rate for one in stored]
        return {"names": list(self._stored), "pressures": pressures, "rates": rates}

    def restore(self, state: State) -> None:
        """Restore a saved state; an outlet that it lacks starts."""
        for name, *values in zip(state["names"], state["pressures"], state["rates"], strict=True):
            if name in self._laws:
                self._stored[name] = Stored(*values)
