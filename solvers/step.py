"""A time step."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Step:
    """The time step from t - dt to t."""

    t: float  #: its end [s]
    dt: float  #: its length [s]
