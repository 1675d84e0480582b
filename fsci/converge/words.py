"""What `fsci converge` prints about values and runs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from fsci.converge.estimate import SOLVER_DIFFERENCE
from fsci.converge.results import BandedValue, Done
from fsci.twin.grids import Settings


def sentences(name: str, found: BandedValue, runs: Sequence[Done]) -> Iterator[str]:
    """The value with its band, then what is to be said about it."""
    told = found.estimate
    if told.value is None:
        yield f"{name}: no value: {'; '.join(told.words)}"
        return
    if told.band is None or found.relative is None:
        yield f"{name} {told.value:.6g}, no band: NOT RESOLVED: {'; '.join(told.words)}"
        return
    order = "" if told.order is None else f", order {told.order:.2g}"
    verdict = (
        ""
        if told.verdict == "resolved"
        else f": {told.verdict.upper() if told.verdict == 'not resolved' else told.verdict}"
    )
    yield f"{name} {_with_band(told.value, told.band)} ({percent(found.relative)}){order}{_largest(found)}{verdict}"
    words = {one.run.name: one.run.twin.words for one in runs}
    for twin, value in found.twins.items():
        yield f"  {_twin(twin, words[twin], value, found)}"
    if found.distance is not None and found.scale:
        apart = found.distance
        shifted = "" if apart.shift is None else f", shifted by {apart.shift:+.2g} in time"
        yield (
            f"  over time, to the next level: {percent(apart.largest / found.scale)} at most, "
            f"{percent(apart.mean / found.scale)} in the mean{shifted}"
        )
    yield from (f"  {words}" for words in told.words)


def _largest(found: BandedValue) -> str:
    """The source with the largest share, and the scatter."""
    shares, band = found.estimate.shares, found.estimate.band
    parts = []
    # of a band that is the tolerance of solvers, the shares are those of rounding errors
    if any(shares.values()) and band is not None and band > SOLVER_DIFFERENCE * found.scale:
        name = max(shares, key=lambda one: shares[one])
        parts.append(f"largest: {name} {100.0 * shares[name]:.0f} %")
    if found.estimate.scatter and found.scale:
        parts.append(f"shifts {percent(found.estimate.scatter / found.scale)}")
    return f"; {', '.join(parts)}" if parts else ""


def _twin(name: str, words: str, value: float, found: BandedValue) -> str:
    told = found.estimate
    assert told.value is not None
    if name not in told.outside:
        return f"{words}: {0.0 if abs(value) < SOLVER_DIFFERENCE * found.scale else value:.6g}, inside"
    say = "levels" if told.levels_say is None or not found.scale else percent(told.levels_say / found.scale)
    change = f" ({100.0 * (value - told.value) / found.scale:+.2g} %)" if found.scale else ""
    verdict = "NOT RESOLVED: " if told.verdict == "not resolved" else ""
    return f"{verdict}levels say {say}, but {words} gives {value:.6g}{change}"


def without_results(runs: Sequence[Done]) -> Iterator[str]:
    """Other elements and schemes that have failed, and why: no value has been compared with theirs."""
    for one in runs:
        if one.run.role == "twin" and one.ended.message:
            yield f"{one.run.twin.words}: no result: {one.ended.message.splitlines()[0]}"


def helps(runs: Sequence[Done], found: Mapping[str, BandedValue]) -> list[str]:
    """Settings that help where a twin is outside."""
    told = [one.estimate for one in found.values() if one.estimate.verdict == "not resolved"]
    outside = {twin for one in told for twin in one.outside}
    return [f"{one.run.twin.words} helps: {settings(one.run.twin.settings)}" for one in runs if one.run.name in outside]


def settings(changes: Settings) -> str:
    """As options of the command line."""
    return " ".join(
        f"--set {name}={value if ' ' not in value else repr(value)}" for name, value in dict(changes).items()
    )


def run_row(one: Done) -> str:
    """A line on a run that has ended."""
    seconds = "" if one.ended.seconds is None else f"{one.ended.seconds:.1f} s"
    message, *_ = [*one.ended.message.splitlines(), ""]
    return f"{one.run.name:12} {seconds:>9}  {message or one.run.twin.words}"


def percent(share: float) -> str:
    """Two digits, without an exponent up to a million; what solvers decide is not shown in digits."""
    if not math.isfinite(share):
        return "unknown"
    digits = f"{100.0 * share:.2g}"
    return f"{float(digits):.0f} %" if 100.0 <= float(digits) < 1e6 else f"{digits} %"


def _with_band(value: float, band: float) -> str:
    """A value to two digits of its band; zero has no sign."""
    if band <= 0.0:
        return f"{value:.6g} +- 0"
    place = 1 - math.floor(math.log10(band))
    if not -3 <= place <= 6 or abs(value) >= 1e6:
        digits = max(2, math.floor(math.log10(max(abs(value), band))) + 1 + place)
        return f"{round(value, place):z.{min(digits, 12)}g} +- {band:.2g}"
    return f"{value:z.{max(place, 0)}f} +- {band:.{max(place, 0)}f}"


def seconds_in_words(seconds: float) -> str:
    """For estimates."""
    if seconds < 100.0:
        return f"{seconds:.2g} s" if seconds < 9.95 else f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
