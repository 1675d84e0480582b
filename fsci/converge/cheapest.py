"""The sizes of cells, facets and steps that reach a tolerance at least cost, by the errors of sources."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from fsci.converge.estimate import SCATTER, safety
from fsci.converge.plan import SECONDS_TO_START
from fsci.converge.results import BandedValue

#: Factors of sizes that are tried.
FACTORS_OF_SIZE = tuple(2.0 ** (power / 2.0) for power in range(2, -7, -1))
#: Error of the cells with a twin of second order over that of the case (docs/twin.md).
TENTH = 0.1
#: Seconds go with this power of the number of unknowns.
POWER = 1.15


@dataclass(frozen=True)
class Option:
    """The case, or a twin of it with better cells of one source, and what its run has cost."""

    seconds: float  #: without the start
    twin: str = ""  #: name of the run
    better: str = ""  #: the source that it has a tenth of the error of


@dataclass(frozen=True)
class Choice:
    """Factors of sources that reach the tolerance, as far as known."""

    option: Option
    factors: Mapping[str, float]
    seconds: float


def cheapest(
    found: Sequence[BandedValue],
    options: Sequence[Option],
    sources: Mapping[str, float],
    dimension: int,
    tolerance: float,
) -> Choice | None:
    """The cheapest of all factors and options with bands within the tolerance; None if no factor is enough.

    `sources` have their largest factors.
    """
    reach = [
        Choice(option, factors, _cost(option, factors, dimension))
        for option in options
        for factors in _factors(sources)
        if all(_relative(one, option, factors) <= tolerance for one in found)
    ]
    return min(reach, key=lambda one: one.seconds, default=None)


def _factors(sources: Mapping[str, float]) -> Iterator[dict[str, float]]:
    for factors in product(*([one for one in FACTORS_OF_SIZE if one <= largest] for largest in sources.values())):
        yield dict(zip(sources, factors, strict=True))


def _relative(found: BandedValue, option: Option, factors: Mapping[str, float]) -> float:
    """The band over the scale with other sizes; infinite for a twin in larger cells than it has been run with.

    The twin has at least the error that its value shows.
    """
    if factors.get(option.better, 1.0) > 1.0:
        return math.inf
    told, order = found.estimate, min(found.estimate.order or 2.0, 2.0)
    if told.value is None or told.band is None or told.levels_say is None or not found.scale:
        return math.inf
    gain = {name: TENTH if name == option.better else 1.0 for name in factors}
    shown = abs(found.twins[option.twin] - told.value) if option.twin in found.twins else 0.0
    shown *= max((factor**order for factor in factors.values()), default=1.0)
    factors = {name: factor / found.size for name, factor in factors.items()}
    known = {name: safety(told.order) * error for name, error in told.errors.items() if name in factors}
    # what no source alone explains is of the largest of them
    rest = math.sqrt(max(0.0, told.levels_say**2 - sum(error**2 for error in known.values())))
    least = max((gain[name] * factor**order for name, factor in factors.items()), default=1.0)
    band = math.hypot(rest * least, *(error * gain[name] * factors[name] ** order for name, error in known.items()))
    other = 1.0 if option.twin or not told.outside else told.band / told.levels_say
    cells = gain.get("cells", 1.0) * factors.get("cells", 1.0) ** order
    return max(band * other, shown, SCATTER * told.scatter * cells) / found.scale


def _cost(option: Option, factors: Mapping[str, float], dimension: int) -> float:
    """Steps cost in proportion, facets of rigid bodies hardly, and the fields by their unknowns."""
    fields = [factors[name] for name in ("cells", "bodies", "files") if name in factors]
    work = sum(factor ** (-dimension * POWER) for factor in fields) / len(fields) if fields else 1.0
    work *= factors.get("facets", 1.0) ** -0.1 / factors.get("step", 1.0)
    return SECONDS_TO_START + option.seconds * work
