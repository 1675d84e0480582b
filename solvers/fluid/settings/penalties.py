"""Factors of the stabilisation and of Nitsche's method."""

from __future__ import annotations

from dataclasses import dataclass

#: Trace constant C_T of a cell, by dimension and degree of the velocity (4C's values).
TRACE = {(2, 1): 1.43426, (2, 2): 4.19708, (3, 1): 1.59307, (3, 2): 4.27784}


@dataclass(frozen=True)
class Penalties:
    """Dimensionless factors of the stabilisation. All verification uses the default values."""

    nitsche: float = 35.0  #: gamma of the viscous Nitsche penalty, times C_T
    mass: float = 35.0 / 40.0  #: normal Nitsche penalty rho h alpha
    convection: float = 35.0 / 6.0  #: normal Nitsche penalty rho |a|
    ghost_viscous: float = 0.1
    ghost_mass: float = 3e-3
    ghost_convection: float = 0.01
    ghost_pressure: float = 0.05
    #: share of its inertia that the penalty of the mass has as friction, so that kinks decay in fluid at rest
    ghost_fading: float = 0.1
    extension: float = 0.1  #: penalty on the distance of poorly cut nodes to their extension
