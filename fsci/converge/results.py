"""What all runs together say about each value, and converge.json."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from fsci.case import Case
from fsci.converge.estimate import BAND, Estimate, Evidence, LevelValue, OscillationInstant, estimate
from fsci.converge.oscillation import oscillation
from fsci.converge.plan import Plan, PlannedRun
from fsci.converge.reasons import first_order, indicative, unseen
from fsci.converge.values import Distance, Observed, chosen, distance, observed
from fsci.twin.runs import TwinEnded


@dataclass(frozen=True)
class Done:
    """A run that has ended, with its values; without any there is a message."""

    run: PlannedRun
    ended: TwinEnded
    values: Mapping[str, Observed] = field(default_factory=dict)

    @property
    def seconds(self) -> float:
        return self.ended.seconds or 0.0

    @property
    def unknowns(self) -> int:
        return int(sum(self.ended.summary.get("dofs", {}).values()))


@dataclass(frozen=True)
class BandedValue:
    """A value of the finest level with its band."""

    estimate: Estimate
    scale: float
    twins: Mapping[str, float] = field(default_factory=dict)  #: values by other elements and schemes
    distance: Distance | None = None  #: of its curve to that of the next level
    size: float = 1.0  #: of the finest level

    @property
    def relative(self) -> float | None:
        """The band over the scale."""
        band = self.estimate.band
        return None if band is None else band / self.scale if self.scale else 0.0


def done(case: Case, run: PlannedRun, ended: TwinEnded) -> Done:
    """The values of a run."""
    return Done(run, ended, {} if ended.message else observed(case, ended.history, ended.summary))


def findings(plan: Plan, runs: Sequence[Done], only: Sequence[str], tolerance: float = BAND) -> dict[str, BandedValue]:
    """By value; none as long as the case itself has not ended."""
    base = next((one for one in runs if one.run.name == "case"), None)
    if base is None or base.ended.message:
        return {}
    ended = (plan.case, base.ended.history, base.ended.summary)
    known = Evidence(
        (),
        0.0,
        first_order=first_order(*ended),
        indicative=indicative(*ended),
        unseen=unseen(plan.fixed, plan.unchanged([one.run for one in runs])),
        tolerance=tolerance,
    )
    names = list(dict.fromkeys(name for one in runs if one.run.role == "level" for name in one.values))
    return {name: _finding(name, runs, known) for name in chosen(names, only)}


def _finding(name: str, runs: Sequence[Done], of_case: Evidence) -> BandedValue:
    """A value with its band; `of_case` has what is known of all values."""
    levels = sorted((one for one in runs if one.run.role == "level"), key=lambda one: one.run.size)
    # a finer level that fails does not take the value of the case
    while levels[0].run.size < 1.0 and levels[0].ended.message:
        levels = levels[1:]
    finest = levels[0].values.get(name)
    scale = max((one.values[name].scale for one in levels if name in one.values), default=0.0)
    known = replace(
        _evidence(runs, levels, lambda one: _value(one, name), scale),
        sampling=0.0 if finest is None else finest.sampling,
        first_order=of_case.first_order,
        indicative=of_case.indicative,
        unseen=of_case.unseen,
        tolerance=of_case.tolerance,
    )
    told = estimate(known)
    instant = _instant(name, runs, levels, known, told)
    if instant is not None:
        told = estimate(replace(known, instant=instant))
    with_curve = [one.values[name] for one in levels if name in one.values]
    apart = distance(with_curve[0], with_curve[1]) if len(with_curve) > 1 else None
    others = {key: value for key, value in known.twins.items() if math.isfinite(value)}
    return BandedValue(told, scale, others, apart, known.levels[0].size)


def _evidence(runs: Sequence[Done], levels: Sequence[Done], value: Callable[[Done], float], scale: float) -> Evidence:
    """What all runs say about a number that each of them has, nan if it does not; levels from the finest one on."""
    parts = _parts(runs, value)
    shifts = [one for one in runs if one.run.role == "shift"]
    near = [one for one in levels if shifts and one.run.size == shifts[0].run.size]
    return Evidence(
        levels=[_level(one, value, size_of(one.run, parts)) for one in levels],
        scale=scale,
        sources={_source(one): _level(one, value, one.run.size) for one in runs if one.run.role == "source"},
        shifts=[value(one) for one in [*near, *shifts]] if shifts else (),
        shifted=shifts[0].run.size if shifts else 1.0,
        twins={one.run.name: value(one) for one in runs if one.run.role == "twin" and not one.ended.message},
    )


def _instant(
    name: str, runs: Sequence[Done], levels: Sequence[Done], known: Evidence, told: Estimate
) -> OscillationInstant | None:
    """That of an oscillation whose swings are larger than the band; the time by which it is late is a value, too."""
    finest = levels[0].values.get(name)
    if finest is None or told.band is None:
        return None
    found = oscillation(finest.time, finest.curve, told.band)
    if found is None:
        return None

    def late(one: Done) -> float:
        observed = one.values.get(name)
        return math.nan if observed is None else found.late(observed.time, observed.curve)

    period = 2.0 * found.half_period
    of_time = estimate(replace(_evidence(runs, levels, late, period), first_order=known.first_order)).band
    if of_time is None or of_time >= 0.25 * period:
        return OscillationInstant(period, None, found.swing)
    return OscillationInstant(period, of_time, found.change(of_time))


def _source(one: Done) -> str:
    return next(iter(one.run.ratios))


def _parts(runs: Sequence[Done], value: Callable[[Done], float]) -> dict[str, float]:
    """Errors of sources, each alone, of second order."""
    base = next(value(one) for one in runs if one.run.name == "case")
    alone = {_source(one): (one.run.size, value(one)) for one in runs if one.run.role == "source"}
    return {
        source: abs(other - base) / abs(size**2 - 1.0)
        for source, (size, other) in alone.items()
        if math.isfinite(other - base)
    }


def size_of(run: PlannedRun, parts: Mapping[str, float]) -> float:
    """The size of a level: sqrt(sum e_i r_i^2 / sum e_i) with the errors e_i of sources and their ratios r_i.

    Small counts do not have the same ratios for all. Without errors of all of them it is the mean ratio.
    """
    whole = sum(parts.get(name, 0.0) for name in run.ratios)
    if not whole or not parts.keys() >= run.ratios.keys():
        return run.size
    return math.sqrt(sum(parts[name] * ratio**2 for name, ratio in run.ratios.items()) / whole)


def _level(one: Done, value: Callable[[Done], float], size: float) -> LevelValue:
    message, *_ = [*one.ended.message.splitlines(), ""]
    return LevelValue(size, None if one.ended.message else value(one), message)


def _value(one: Done, name: str) -> float:
    return one.values[name].value if name in one.values else math.nan


def as_json(found: Mapping[str, BandedValue], runs: Sequence[Done], known: Mapping[str, str]) -> dict[str, Any]:
    """The content of converge.json, without the settings that reach a tolerance."""
    return {
        "checksums": known,
        "values": {name: _plain(one) for name, one in found.items()},
        "runs": {
            one.run.name: {
                "words": one.run.twin.words,
                "role": one.run.role,
                "settings": dict(one.run.twin.settings),
                "ratios": one.run.ratios,
                "seconds": one.ended.seconds,
                "unknowns": one.unknowns,
                "message": one.ended.message,
                "values": {name: value.value for name, value in one.values.items() if name in found},
            }
            for one in runs
        },
    }


def _plain(one: BandedValue) -> dict[str, Any]:
    told = one.estimate
    return {
        "value": told.value,
        "band": told.band,
        "scale": one.scale,
        "order": told.order,
        "shares": told.shares,
        "verdict": told.verdict,
        "words": told.words,
        "levels_say": told.levels_say,
        "scatter": told.scatter,
        "twins": {name: {"value": value, "inside": name not in told.outside} for name, value in one.twins.items()},
        "distance": None if one.distance is None else asdict(one.distance),
    }
