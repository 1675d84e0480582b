"""The iteration to a steady flow: Picard's method first, then Newton's, and when the stabilisation is frozen."""

from __future__ import annotations

#: Share of the largest residual of a steady flow below which Newton's method takes over from Picard's.
NEWTON_FROM = 0.02

#: Share of the largest residual of a steady flow below which the velocity that scales stabilisation stays as it is.
#: The tangent has no derivative by this velocity. While it follows the iterate, Newton's method converges linearly, or
#: not at all. Between 1e-5 and 1e-2 drag and pressure difference of 2D-1 differ by 5e-6, its lift (0.2 % of the drag)
#: by 2e-4.
SCALES_UNTIL = 1e-3


class SteadyIteration:
    """The norm of the residual, now and at its largest in the step, and what follows from their ratio."""

    def __init__(self) -> None:
        self._now = self._largest = 0.0
        self._later: float | None = None  #: the largest after the first one, None before it

    def begin(self) -> None:
        """No residual of this step is known."""
        self._largest, self._later = 0.0, None

    def record(self, size: float, change: float) -> None:
        """Note the norm of the present residual; change: of the forces in the step, which stands for the first one."""
        self._later = 0.0 if self._later is None else max(self._later, size)
        self._now, self._largest = size, max(change, self._later)

    @property
    def scales_follow(self) -> bool:
        """Whether stabilisation is scaled by the present iterate."""
        return self._now >= SCALES_UNTIL * self._largest

    @property
    def far(self) -> bool:
        """Whether the iterate is too far from the solution for Newton's method."""
        return self._now > NEWTON_FROM * self._largest
