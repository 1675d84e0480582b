"""Newton's method as a generator of iterates, and `converge`, which applies tolerances to them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from solvers.api import StepFailed, StepInfo
from solvers.counted import counted


class System(Protocol):
    """A nonlinear system of one field or many, at its current iterate."""

    name: str

    def residual(self) -> float:
        """Assemble the residual; returns its norm over the rows that are solved for."""
        ...

    def advance(self, *, keep: bool = False, reduction: float = 0.0) -> float:
        """Linearise, solve and update; returns the norm of the increment relative to that of the solution.

        keep: the tangent of the last iterate is good enough, if the system still has it. reduction: of the residual of
        the linear system that is good enough, for systems whose linear solver iterates.
        """
        ...

    def retreat(self, fraction: float) -> None:
        """Take back a fraction of the last increment."""
        ...

    def round_off(self) -> float:
        """Norm of the residual below which it consists of rounding errors."""
        ...

    def settled(self) -> bool:
        """Whether the iterate fulfils supports, and its active set has not changed."""
        ...

    def astray(self, rises: int) -> str:
        """Why whole increments may not converge, such as an active set that cycles; empty if they may.

        rises: how often the residual has risen above all earlier ones of this solution.
        """
        ...

    def worst(self) -> tuple[float, ...] | None:
        """Position [m] of the largest residual, for messages."""
        ...


@dataclass(frozen=True)
class Iterate:
    """The state of the iteration."""

    number: int  #: count of linear solves
    residual: float
    increment: float  #: relative size of the last increment; infinite before the first
    settled: bool


@dataclass(frozen=True)
class Tolerance:
    """Tolerances for an iterate: of the residual and, if it is finite, of the increment."""

    residual: float = 1e-8  #: relative to the largest residual of the step
    residual_absolute: float = 0.0  #: [N]
    increment: float = math.inf  #: relative to the solution
    max_iterations: int = 25
    line_search: bool = False

    def small(self, largest: float) -> float:
        """Residual that is small enough [N]; largest: residual of the step [N]."""
        return max(self.residual * largest, self.residual_absolute)


def iterates(system: System, tolerance: Tolerance = Tolerance(), unmoved: float = 0.0) -> Iterator[Iterate]:
    """An endless sequence of Newton iterates; the caller applies tolerances and limits.

    The tangent is kept for an iterate that is expected to fulfil the tolerance with it. Newton's method leaves
    r_1 = f'' dx^2 / 2. With the same tangent the next residual is f'' dx dx_1 = 2 (r_1 / r_0) r_1.
    Source: C. T. Kelley, Solving Nonlinear Equations with Newton's Method, SIAM 2003, section 2.3 (chord method).

    The linear system may be solved as inexactly as `enough` says. Where a system goes astray, and with `line_search`,
    increments are halved until the residual decreases.
    """
    number, increment, residual, ratio = 0, math.inf, system.residual(), math.inf
    largest, rises = max(unmoved, residual), 0
    while True:
        yield Iterate(number, residual, increment, system.settled())
        before = residual
        imposed = system.settled()
        small = tolerance.small(largest)
        increment = system.advance(
            keep=2.0 * ratio * residual <= small, reduction=enough(residual, ratio, tolerance=small)
        )
        residual = system.residual()
        rises += (residual > largest) + 2 * (not math.isfinite(residual))  # not a number: elements are inverted
        if (tolerance.line_search and imposed) or (number > 0 and system.astray(rises)):
            increment, residual = _halve(system, before, increment, residual)
        ratio = residual / before if before > 0.0 else math.inf
        largest, number = max(largest, residual), number + 1


#: Reduction of the residual of a linear system that is enough while nothing is known of the convergence. Measured with
#: Hertz contact: 1e-2 takes as long, and another iterate on two of three meshes; 1e-4 takes 1.2 times as long.
ENOUGH = 1e-3


def enough(residual: float, ratio: float, *, tolerance: float) -> float:
    """Reduction of the residual of a linear system by which the next iterate is hardly worse than by an exact solution.

    Newton's method leaves (r_1 / r_0)^2 r_1, of which a tenth is added, or what is below the tolerance. Of that only a
    hundredth is added: errors of linear solvers are smooth, and add up in resultants. ratio: r_1 / r_0 of the last
    iterates, infinite before the second.
    Source: Eisenstat & Walker, SIAM J. Sci. Comput. 17 (1996), choice 2.
    """
    if residual == 0.0:
        return ENOUGH
    return min(ENOUGH, max(0.1 * ratio * ratio, 0.01 * tolerance / residual))


#: Largest count of halvings of an increment in a line search. With 6 a ring with Tresca friction does not converge.
HALVINGS = 14


def _halve(system: System, before: float, increment: float, residual: float) -> tuple[float, float]:
    """Line search: halve the increment until the residual decreases, or take the best of the fractions tried.

    The residual has kinks, from which it may increase in all directions; the way on is then that of the least increase.
    """
    remaining, tried = 1.0, [residual]
    while not residual < before and len(tried) <= HALVINGS:
        system.retreat(0.5 * remaining)
        remaining *= 0.5
        residual = system.residual()
        tried.append(residual)
    if not residual < before:
        best = 0.5 ** int(np.argmin(np.nan_to_num(tried, nan=math.inf)))
        system.retreat(remaining - best)
        remaining, residual = best, system.residual()
    return increment * remaining, residual


def converge(system: System, tolerance: Tolerance, unmoved: float = 0.0) -> StepInfo:
    """Iterate to the tolerance. Raises StepFailed with the residuals and the position of the largest one.

    unmoved: residual [N] before the predictor, with which the tolerance does not depend on the predictor.
    """
    history: list[float] = []
    for iterate in iterates(system, tolerance, unmoved):
        history.append(iterate.residual)
        if not math.isfinite(iterate.residual):
            reason = "the residual is not a number"
        elif iterate.settled and _accepted(iterate, max(unmoved, *history), system.round_off(), tolerance):
            return StepInfo(iterate.number, tuple(history))
        elif iterate.number == tolerance.max_iterations:
            reason = f"Newton did not converge in {counted(iterate.number, 'iteration')} (residual {history[-1]:.3g})"
            reason += f": {cycle}" if (cycle := system.astray(0)) else ""
        else:
            continue
        raise StepFailed(system.name, reason, iteration=iterate.number, where=system.worst(), history=tuple(history))
    raise AssertionError("unreachable: iterates() has no end")


def _accepted(iterate: Iterate, largest: float, round_off: float, tolerance: Tolerance) -> bool:
    if iterate.residual <= round_off:
        return True
    return iterate.residual <= tolerance.small(largest) and (
        iterate.increment <= tolerance.increment or iterate.residual == 0.0
    )
