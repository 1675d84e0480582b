"""How far a value may be from the exact one, by its values on other levels and with other methods. Nothing is run here.

With f_i on level i, whose cells and steps are h_i times those of the finest level, an error C h^p of order p makes

    e = |f_1 - f_j| / |h_1^p - h_j^p|

the error of the finest level 1. e is the largest of all other levels j (two coarser ones tell their own error, which
p = 2 makes too large on the finest one where the order is higher), and of the root of the sum of squares of the
sources of the error, each changed alone: they may cancel when all change together. With the scatter s of the value on
grids that are moved, the band is

    b = sqrt((1.3 e)^2 + (2 s)^2),

or 1.25 e where an order is seen: Roache's factor of three grids (J. Fluids Eng. 116, 1994). 1.3 is of docs/converge.md.
s is measured on a coarser level and falls with the first power of the size or faster (docs/converge.md). The band is
at least 1.25 times the change by another element or time scheme, and what the curve of an oscillation changes by within
the band of its time. p is 2, or less if less is known or seen. Sources and other methods are those of the case itself,
of size 1; a finer level than that has h^p of their changes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

#: Relative difference that the tolerance of solvers explains.
SOLVER_DIFFERENCE = 1e-6
SAFETY, SAFETY_WITH_ORDER, SCATTER, TWIN = 1.3, 1.25, 2.0, 1.25
#: Orders between which values are taken to follow C h^p.
LEAST_ORDER, MOST_ORDER = 0.8, 2.6
#: Order that is assumed of values below that: displacements at the end of a crack have it.
SLOWEST_ORDER = 0.5

#: Relative band that is good enough if nothing else is asked for: in it, another method may be outside of what levels
#: say.
BAND = 0.02

Verdict = Literal["resolved", "indicative", "not resolved"]


@dataclass(frozen=True)
class LevelValue:
    """A value of a run with cells and steps `size` times those of the case."""

    size: float
    value: float | None  #: None: the run has no result; nan: the run does not have this value
    message: str = ""  #: why there is no result

    @property
    def usable(self) -> bool:
        return self.value is not None and math.isfinite(self.value)


@dataclass(frozen=True)
class OscillationInstant:
    """One instant of an oscillation, at which a curve has its value."""

    period: float
    late: float | None  #: the band of the time by which the curve is late; None: a quarter of a period or more
    change: float  #: of the curve within this time


@dataclass(frozen=True)
class Evidence:
    """What is known about one value."""

    levels: Sequence[LevelValue]  #: everything finer or coarser together; the finest first, and one of size 1
    scale: float  #: what relative numbers are relative to
    sources: Mapping[str, LevelValue] = field(default_factory=dict)  #: one source alone; the rest as in the case
    shifts: Sequence[float] = ()  #: on one level, with the planes of the grid as they are and moved
    shifted: float = 1.0  #: size of that level
    twins: Mapping[str, float] = field(default_factory=dict)  #: by another element or scheme
    sampling: float = 0.0  #: what may be between the samples of a maximum
    instant: OscillationInstant | None = None
    first_order: Sequence[str] = ()  #: reasons for p = 1
    indicative: Sequence[str] = ()  #: reasons of the case to trust no band of a value that levels change
    unseen: Sequence[str] = ()  #: reasons that no level shows: to trust no band at all
    tolerance: float = BAND  #: relative band that is good enough


@dataclass(frozen=True)
class Estimate:
    """A value with its band. Bands have the unit of the value."""

    value: float | None
    band: float | None  #: None: nothing to make one of
    order: float | None  #: None: no order is seen
    verdict: Verdict
    levels_say: float | None = None  #: the band without other elements and schemes
    errors: Mapping[str, float] = field(default_factory=dict)  #: of each source
    scatter: float = 0.0
    outside: tuple[str, ...] = ()  #: other elements and schemes whose values are outside of what levels say
    words: tuple[str, ...] = ()

    @property
    def shares(self) -> dict[str, float]:
        """Of the sources, of the sum of their errors."""
        whole = sum(self.errors.values())
        return {name: error / whole if whole else 0.0 for name, error in self.errors.items()}


def estimate(known: Evidence) -> Estimate:
    """The band of a value, its order if there is one, and whether both can be trusted."""
    finest = known.levels[0]
    if not finest.usable or finest.value is None:
        why = finest.message or "the case itself does not have this value"
        return Estimate(None, None, None, "not resolved", words=(why,))
    value, rounding = finest.value, SOLVER_DIFFERENCE * known.scale
    usable = [level for level in known.levels if level.usable]
    scatter = _deviation(known.shifts)
    seen = _order(usable, rounding, scatter)
    words, order = seen.words, seen.order
    assumed = min(1.0 if known.first_order else 2.0, seen.assumed)
    base = next((level for level in usable if level.size == 1.0), None)
    finer = finest.size**assumed
    errors: dict[str, float] = {}
    twins: dict[str, float] = {}
    if base is not None and base.value is not None:
        errors = {name: finer * _error(base, one, assumed) for name, one in known.sources.items() if one.usable}
        twins = {name: abs(other - base.value) for name, other in known.twins.items() if math.isfinite(other)}
    scatter *= finer / known.shifted
    levels_say = band = None
    if len(usable) > 1 or errors:
        together = max((finer * _error(usable[0], other, assumed) for other in usable[1:]), default=0.0)
        apart = math.hypot(*errors.values())
        levels_say = max(math.hypot(safety(order) * max(together, apart), SCATTER * scatter) + known.sampling, rounding)
        if known.instant is not None:
            levels_say = max(levels_say, known.instant.change)
    outside = tuple(name for name, change in twins.items() if levels_say is not None and finer * change > levels_say)
    if levels_say is not None or twins:
        changes = (abs(known.twins[name] - value) if name in outside else finer * twins[name] for name in twins)
        band = max(levels_say or 0.0, TWIN * max(changes, default=0.0))
    reasons = [*(() if seen.same else known.indicative), *known.unseen]
    words += tuple(_further_words(known, usable, reasons))
    verdict: Verdict = "resolved"
    no_phase = known.instant is not None and known.instant.late is None
    wide = band is None or band > known.tolerance * known.scale
    if len(usable) < 3 or reasons or (seen.assumed == SLOWEST_ORDER and wide) or no_phase:
        verdict = "indicative"
    if band is None or levels_say is None or (outside and wide):
        verdict = "not resolved"
    elif band >= known.scale > 0.0:
        verdict, words = "not resolved", (*words, "the band is as large as the value")
    return Estimate(value, band, order, verdict, levels_say, errors, scatter, outside, words)


def safety(order: float | None) -> float:
    """The factor of errors, by the order that is seen."""
    return SAFETY if order is None else SAFETY_WITH_ORDER


def _error(a: LevelValue, b: LevelValue, order: float) -> float:
    """Of a level of size 1, by the values of two others."""
    assert a.value is not None
    assert b.value is not None
    between = abs(a.size**order - b.size**order)
    return abs(a.value - b.value) / between if between else 0.0


@dataclass(frozen=True)
class _Seen:
    """How values change with the level."""

    words: tuple[str, ...] = ()
    order: float | None = None
    #: Order that errors are computed with: a slower one that is seen counts, a faster one does not.
    assumed: float = 2.0
    same: bool = False  #: on all of three levels or more


def _order(usable: Sequence[LevelValue], rounding: float, scatter: float) -> _Seen:
    """The order of monotone values. Below 2 it counts if no scatter explains it."""
    values = [level.value for level in usable if level.value is not None]
    if len(values) > 1 and max(values) - min(values) <= rounding:
        return _Seen(("the same on all levels, up to the tolerance of solvers",), same=len(values) > 2)
    if len(values) < 3:
        return _Seen()
    near, far = values[1] - values[0], values[2] - values[1]
    if near * far < 0.0:
        return _Seen(("it goes up and down between levels: no order",))
    sizes = [level.size for level in usable[:3]]
    near, far, sure = abs(near), abs(far), abs(near) - SCATTER * scatter
    if sure <= rounding:
        return _Seen()
    most = (far + SCATTER * scatter) / sure
    if most < _growth(sizes, LEAST_ORDER):
        words = f"finer levels change it hardly less than coarser ones: its order is below {LEAST_ORDER:g}"
        return _Seen((words,), assumed=SLOWEST_ORDER)
    if not _growth(sizes, LEAST_ORDER) <= far / near <= _growth(sizes, MOST_ORDER):
        return _Seen()
    order = _bisect(sizes, far / near)
    return _Seen(order=order, assumed=order if most < _growth(sizes, 2.0) else 2.0)


def _growth(sizes: Sequence[float], order: float) -> float:
    """(f_3 - f_2) / (f_2 - f_1) of values C h^p; it grows with p."""
    first, second, third = (size**order for size in sizes)
    return (third - second) / (second - first)


def _bisect(sizes: Sequence[float], ratio: float) -> float:
    low, high = LEAST_ORDER, MOST_ORDER
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _growth(sizes, middle) < ratio else (low, middle)
    return 0.5 * (low + high)


def _deviation(values: Sequence[float]) -> float:
    """Standard deviation of a sample; 0 without one."""
    some = [value for value in values if math.isfinite(value)]
    if len(some) < 2:
        return 0.0
    mean = math.fsum(some) / len(some)
    return math.sqrt(math.fsum((value - mean) ** 2 for value in some) / (len(some) - 1))


def _further_words(known: Evidence, usable: Sequence[LevelValue], indicative: Sequence[str]) -> Iterator[str]:
    for level in known.levels:
        if level.value is None:
            yield f"level x{level.size:.3g} has no result: {level.message}"
        elif not level.usable:
            yield f"level x{level.size:.3g} does not have this value: it exists on fine levels only"
    for name, source in known.sources.items():
        if source.value is None:
            yield f"{name} alone at x{source.size:.3g} has no result: {source.message}"
    if len(usable) == 1:
        yield "no other level has this value"
    if len(usable) == 2:
        yield "two levels only"
    if known.sampling > SOLVER_DIFFERENCE * known.scale:
        yield f"its steps sample the curve: up to {known.sampling:.2g} of it is between them"
    if known.instant is not None:
        yield _at_an_instant(known.instant)
    both = [reason for reason in known.first_order if reason in indicative]
    for words, reasons in (
        ("first order is assumed", [reason for reason in known.first_order if reason not in both]),
        ("indicative, first order is assumed", both),
        ("indicative", [reason for reason in indicative if reason not in both]),
    ):
        if reasons:
            yield f"{words}: {', '.join(reasons)}"


def _at_an_instant(instant: OscillationInstant) -> str:
    words = f"at one instant of an oscillation of period {instant.period:.3g}"
    if instant.late is None:
        return f"{words} whose phase is not known: any of its values is possible"
    return f"{words}, known to +-{instant.late:.2g} in time: it changes by {instant.change:.2g} within that"
