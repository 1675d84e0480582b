"""Secant correction of Newton increments whose tangent is not exact, for steady coupled flow.

    s = r - c (s' + r - r'),   c = argmin |d - c (d - d')|

r: increment by the tangent; s: the one that is added; d: displacement of the interface by r; prime: the iterate before.
See docs/theory_coupling.md, Correction by secants. Source: Anderson, J. ACM 12 (1965) 547-560.
"""

from __future__ import annotations

from solvers.api import Array


class Secant:
    """Corrects increments by the one before."""

    def __init__(self) -> None:
        self._before: tuple[Array, Array, Array] | None = None  #: r', d', s'
        self._share = 1.0  #: of s' that was added

    def forget(self) -> None:
        """Discard the iterate before: the map has changed."""
        self._before = None

    def retreat(self, fraction: float) -> None:
        """Take back a fraction of the last increment."""
        self._share -= fraction

    def corrected(self, increment: Array, displacement: Array) -> Array:
        """s from r, at owned unknowns; displacement [m]: d, the same on every process."""
        corrected = increment
        if self._before is not None:
            r, d, s = self._before
            change = displacement - d
            size = float(change @ change)
            if size > 0.0:
                corrected = increment - float(displacement @ change) / size * (self._share * s + increment - r)
        self._before, self._share = (increment.copy(), displacement.copy(), corrected.copy()), 1.0
        return corrected
