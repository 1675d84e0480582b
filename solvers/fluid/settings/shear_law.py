"""Viscosity that depends on the shear rate."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ShearLaw:
    """mu = mu_inf + (mu_0 - mu_inf) (1 + (time rate)^2)^((exponent - 1) / 2), with rate^2 = 2 eps(u) : eps(u).

    mu_0 is the viscosity of the fluid at rest. With mu_inf = 0 and a large time it is the power law
    mu_0 (time rate)^(exponent - 1).
    Source: R. B. Bird, R. C. Armstrong, O. Hassager, Dynamics of Polymeric Liquids 1, Wiley 1987, section 4.1.
    """

    infinite: float  #: mu_inf [Pa s]
    time: float  #: [s]
    exponent: float
