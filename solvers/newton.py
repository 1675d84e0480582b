"""Newton's method as a generator of iterates, and `converge`, which applies tolerances to them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, FailureKind, Indices, NoResidual, StepFailed, StepInfo
from solvers.counted import counted

Flags = NDArray[np.bool_]

#: Residual [N] in the place of zero in divisions; ratios to it are numbers.
ZERO_RESIDUAL = 1e-150


class System(Protocol):
    """A nonlinear system of one field or many, at its current iterate.

    Its rows belong to parts, such as bodies, each of which has to converge: arrays by part have the shape (parts,).
    """

    name: str

    def follow(self) -> None:
        """Put to the iterate what lies where it says: surfaces, cells, numbers of unknowns; else do nothing.

        Newton's method does so for each iterate, before its residual. Raises StepFailed.
        """
        ...

    def residual(self) -> Array:
        """Assemble the residual; returns its norm [N] over the rows that are solved for, by part."""
        ...

    def forces(self) -> Array:
        """Norm [N] of the largest force on each part, which its residual is compared with."""
        ...

    def advance(self, *, keep: bool = False, reduction: float = 0.0) -> Array:
        """Linearise, solve and update; returns the norm of the increment relative to that of the solution, by part.

        keep: the tangent of the last iterate is good enough, if the system still has it. reduction: of the residual of
        the linear system that is good enough, for systems whose linear solver iterates.
        """
        ...

    def retreat(self, fraction: Array) -> None:
        """Take back fractions of the last increment, by part."""
        ...

    def linked(self) -> Indices:
        """The component of each part, by the number of its first part: parts that act on each other are in one.

        Components are solved as if each were alone.
        """
        ...

    def only_rounding(self) -> Flags:
        """Whether the residual consists of rounding errors in every row of a part, by part."""
        ...

    def settled(self) -> bool:
        """Whether the iterate fulfils supports, and its active set has not changed."""
        ...

    def cycle(self) -> str:
        """What cycles, such as an active set, for messages; empty if nothing does."""
        ...

    def astray(self, risen: Sequence[Flags]) -> Flags:
        """The parts whose whole increments may not converge, such as those of an active set that cycles.

        risen: the parts in components whose residual rose above all earlier ones, each time that one did.
        """
        ...

    def worst(self) -> tuple[float, ...] | None:
        """Position [m] of the largest residual, for messages."""
        ...


class Smooth(System, Protocol):
    """A system without an active set."""

    def settled(self) -> bool:
        return True

    def cycle(self) -> str:
        return ""

    def astray(self, risen: Sequence[Flags]) -> Flags:
        return np.zeros(len(self.linked()), dtype=bool)


@dataclass(frozen=True)
class Iterate:
    """The state of the iteration; arrays by part."""

    number: int  #: count of linear solves
    residual: Array  #: [N]
    small: Array  #: residual that is small enough [N]
    increment: Array  #: relative size of the last increment; infinite before the first
    settled: bool


@dataclass(frozen=True)
class Tolerance:
    """Tolerances for an iterate: of the residual and, if it is finite, of the increment."""

    residual: float = 1e-8  #: relative to the largest force on the part
    residual_absolute: float = 0.0  #: [N]
    increment: float = math.inf  #: relative to the solution
    max_iterations: int = 25
    line_search: bool = False

    def small(self, forces: Array) -> Array:
        """Residual that is small enough [N], by part; forces: on each [N]."""
        return np.maximum(self.residual * forces, self.residual_absolute)


def iterates(system: System, tolerance: Tolerance = Tolerance()) -> Iterator[Iterate]:
    """An endless sequence of Newton iterates; the caller applies tolerances and limits.

    The tangent is kept for an iterate that is expected to fulfil the tolerance with it (the chord method;
    docs/theory_coupling.md, Kept tangents). The linear system may be solved as inexactly as `enough` says. Where a
    system goes astray, and with `line_search`, increments are halved until the residual decreases.
    """
    number, residual = 0, _residual(system)
    increment, ratio = np.full(len(residual), math.inf), np.full(len(residual), math.inf)
    largest, risen = residual, list[Flags]()
    while True:
        small, settled = tolerance.small(system.forces()), system.settled()
        yield Iterate(number, residual, small, increment, settled)
        before = residual
        keep = number > 0 and bool((2.0 * ratio * residual <= small).all())
        increment = system.advance(keep=keep, reduction=enough(residual, ratio, tolerance=small))
        residual = _residual(system)
        infinite = ~np.isfinite(residual)  # elements are inverted; it counts twice
        rise = (residual > largest) & (residual > small)
        if rise.any():  # noise of parts that are solved must not hold up others
            rise &= ~system.only_rounding()
        risen += [in_components(mask, system.linked()) for mask in (rise, infinite, infinite) if mask.any()]
        searched = np.full(len(residual), tolerance.line_search and settled)
        if number > 0:
            searched |= system.astray(risen)
        if searched.any():
            increment, residual = _halve(system, searched, before, small, increment, residual)
        ratio = residual / np.maximum(before, ZERO_RESIDUAL)
        largest, number = np.fmax(largest, residual), number + 1


def _residual(system: System) -> Array:
    """That of a new iterate."""
    system.follow()
    return system.residual()


#: Reduction of the residual of a linear system that is enough while nothing is known of the convergence. Measured with
#: Hertz contact: 1e-2 takes as long, and another iterate on two of three meshes; 1e-4 takes 1.2 times as long.
ENOUGH = 1e-3


def in_components(parts: Flags, component: Indices) -> Flags:
    """Mask of all parts that are in a component with one of the given ones."""
    return np.isin(component, component[parts])


def enough(residual: Array, ratio: Array, *, tolerance: Array) -> float:
    """Reduction of the residual of a linear system by which the next iterate is hardly worse than by an exact solution.

    Newton's method leaves (r_1 / r_0)^2 r_1, of which a tenth is added, or what is below the tolerance. Of that only a
    hundredth is added: errors of linear solvers are smooth, and add up in resultants. ratio: r_1 / r_0 of the last
    iterates, infinite before the second. All by part; the part that needs most decides.
    Source: Eisenstat & Walker, SIAM J. Sci. Comput. 17 (1996), choice 2.
    """
    parts = zip(residual.tolist(), ratio.tolist(), tolerance.tolist(), strict=True)  # few: arrays would take longer
    return min([ENOUGH, *(max(0.1 * q * q, 0.01 * small / r) for r, q, small in parts if r > 0.0)])


#: Largest count of halvings of an increment in a line search. From 7 to 30 a belt with Tresca friction, a ring that
#: closes, a press fit and a strip on a corner take the same steps (34, 54 to 59, 10, 87).
HALVINGS_OF_INCREMENT = 14


def _halve(
    system: System, searched: Flags, before: Array, small: Array, increment: Array, residual: Array
) -> tuple[Array, Array]:
    """Line search: halve increments until the residual decreases, or take the best of the fractions tried.

    Each component has its own fraction; those without any part in `searched` keep their whole increment. Parts whose
    residual is small or rounding errors do not count. The residual has kinks, from which it may increase in all
    directions; the way on is then that of the least increase.
    """
    counts, component = ~system.only_rounding(), system.linked()

    def size(of: Array) -> Array:
        """Of the component of each part."""
        large = np.where(np.isnan(of), math.inf, np.where(counts & (of > small), of, 0.0))
        with np.errstate(over="ignore"):  # an iterate that has blown up
            return np.sqrt(np.bincount(component, large**2, len(of)))[component]

    def retreat(to: Array) -> Array:
        """The residual with other fractions of the increments."""
        system.retreat(fraction - to)
        return _residual(system)

    fraction, tried, enough_below = np.ones(len(before)), [size(residual)], size(before)
    halved = in_components(searched, component)
    while (halved := halved & (tried[-1] > 0.0) & ~(tried[-1] < enough_below)).any():
        if len(tried) > HALVINGS_OF_INCREMENT:
            best = np.where(halved, 0.5 ** np.argmin(tried, axis=0), fraction)
            return increment * best, retreat(best)
        smaller = np.where(halved, 0.5 * fraction, fraction)
        residual, fraction = retreat(smaller), smaller
        tried.append(size(residual))
    return increment * fraction, residual


def converge(system: System, tolerance: Tolerance) -> StepInfo:
    """Iterate to the tolerance. Raises StepFailed with the residuals and the position of the largest one.

    Residuals of parts whose last residual is rounding error are not reported.
    """
    history: list[Array] = []
    try:
        return _converge(system, tolerance, history)
    except NoResidual as lost:
        if lost.history or not history:
            raise
        norms = _norms(history, np.ones(len(history[0]), dtype=bool))
        number, where = len(history), lost.where
        raise NoResidual(lost.field, lost.kind, lost.reason, iteration=number, where=where, history=norms) from None


def _converge(system: System, tolerance: Tolerance, history: list[Array]) -> StepInfo:
    """The same; history: gets the residuals of the iterates."""
    for iterate in iterates(system, tolerance):
        history.append(iterate.residual)
        if not np.isfinite(iterate.residual).all():
            norms = _norms(history, np.ones(len(iterate.residual), dtype=bool))
            reason = "the residual is not a number"
            kind = FailureKind.NOT_FINITE
            raise NoResidual(system.name, kind, reason, iteration=iterate.number, where=system.worst(), history=norms)
        if iterate.settled and (within := _within(iterate, system, tolerance)) is not None:
            return StepInfo(iterate.number, _norms(history, within))
        if iterate.number < tolerance.max_iterations:
            continue
        open_parts = ~system.only_rounding()
        size = _norms(history, open_parts)[-1]
        reason = f"Newton did not converge in {counted(iterate.number, 'iteration')} (residual {size:.3g})"
        kind, norms = FailureKind.NEWTON, _norms(history, open_parts)
        if cycle := system.cycle():
            kind, reason = FailureKind.ACTIVE_SET, f"{reason}: {cycle}"
        raise StepFailed(system.name, kind, reason, iteration=iterate.number, where=system.worst(), history=norms)
    raise AssertionError("unreachable: iterates() has no end")


def _within(iterate: Iterate, system: System, tolerance: Tolerance) -> Flags | None:
    """Which parts are within their tolerance; None if neither this nor rounding errors hold for one of them.

    The first iterate is the state before the step, or a guess. It is no solution because forces have changed by less
    than the tolerance: such changes would be lost in every step.
    """
    within: Flags = iterate.residual <= (tolerance.residual_absolute if iterate.number == 0 else iterate.small)
    if math.isfinite(tolerance.increment):
        within &= (iterate.increment <= tolerance.increment) | (iterate.residual == 0.0)
    return within if within.all() or (within | system.only_rounding()).all() else None


def _norms(history: Sequence[Array], parts: Flags) -> tuple[float, ...]:
    """Norms of the residuals [N] over some parts, over all if there are none."""
    chosen = parts if parts.any() else ~parts
    return tuple(float(np.linalg.norm(residual[chosen])) for residual in history)
