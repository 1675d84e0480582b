"""Settings of a flow, except grid, patches and bodies: fluid, element, time scheme."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from solvers.fluid.settings.penalties import Penalties
from solvers.fluid.settings.shear_law import ShearLaw
from solvers.fluid.settings.time_scheme import SCHEMES, FlowTimeScheme
from solvers.values import Value


@dataclass(frozen=True)
class FlowSettings:
    """Properties of the fluid, element, time scheme and initial velocity."""

    density: float  #: [kg/m^3]
    viscosity: float  #: [Pa s]
    shear: ShearLaw | None = None  #: of the viscosity, which is that at rest then; None: it is constant
    element: Literal["q1q1", "q2q1"] = "q1q1"
    convection: bool = True  #: False: Stokes
    scheme: str | FlowTimeScheme = "bdf2"  #: one of `SCHEMES`, or another
    body_force: Sequence[Value] | None = None  #: [N/m^3]
    initial_velocity: Sequence[Value] | None = None  #: [m/s]
    penalties: Penalties = Penalties()
    #: first-order velocities: the parabola across gaps of a few cells is part of the continuity equation
    narrow_gaps: bool = False

    @property
    def degree(self) -> int:
        return 1 if self.element == "q1q1" else 2

    @property
    def time(self) -> FlowTimeScheme:
        return SCHEMES[self.scheme] if isinstance(self.scheme, str) else self.scheme

    @property
    def steady(self) -> bool:
        return self.time.steady

    @property
    def films(self) -> bool:
        """Whether films are detected. One cell across does not resolve a film with first-order velocities."""
        return self.degree > 1

    @property
    def with_gaps(self) -> bool:
        """Whether narrow gaps are detected."""
        return self.degree == 1 and self.narrow_gaps
