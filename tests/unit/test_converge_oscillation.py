"""Values at one instant of an oscillation: levels may turn around a crest, and agree by chance."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from fsci.converge.estimate import Evidence, LevelValue, OscillationInstant, estimate
from fsci.converge.oscillation import oscillation, turns
from fsci.converge.plan import PlannedRun
from fsci.converge.results import Done, findings
from fsci.converge.values import Observed
from fsci.twin.changes import Twin
from fsci.twin.runs import TwinEnded

PLAN = SimpleNamespace(
    case=SimpleNamespace(fluid=None, structure=None, rigid_section=None), fixed=(), unchanged=lambda runs: []
)  # no reason to trust no band


def curve(end, size, offset=0.0, ripple=0.0, samples=20):
    """A damped oscillation of period 1, 0.8 % longer on the case, with a step in proportion to the size."""
    time = np.linspace(0.0, end, round(end * samples / size) + 1)
    frequency = 2.0 * math.pi * (1.0 - 0.008 * size**2)
    return time, offset + np.exp(-0.2 * time) * np.sin(frequency * time) + ripple * np.sin(40.0 * time)


def exact(end, offset=0.0, ripple=0.0):
    return offset + math.exp(-0.2 * end) * math.sin(2.0 * math.pi * end) + ripple * math.sin(40.0 * end)


def level(size, time, values):
    run = PlannedRun(Twin("case" if size == 1.0 else f"coarser_{size:.3g}", "", "space"), "level", {"step": size})
    observed = Observed(float(values[-1]), float(np.abs(values).max()), 0.0, time, values)
    return Done(run, TwinEnded(run.twin), {"x": observed})


def found(end, **more):
    runs = [level(size, *curve(end, size, **more)) for size in (1.0, 2**0.5, 2.0)]
    return findings(PLAN, runs, [])["x"].estimate


@pytest.mark.parametrize("ripple", [0.0, 1e-3])
@pytest.mark.parametrize("offset", [0.0, 3.0])
def test_the_band_holds_at_each_instant(offset, ripple):
    """Of 60 instants of a period; without the phase some bands do not hold the value."""
    ends = 2.25 + np.arange(60) / 60.0
    errors = [abs(found(end, offset=offset, ripple=ripple).value - exact(end, offset, ripple)) for end in ends]
    told = [found(end, offset=offset, ripple=ripple) for end in ends]
    assert all(one.band >= error for one, error in zip(told, errors, strict=True))
    assert np.median([one.band / error for one, error in zip(told, errors, strict=True)]) < 2.5
    assert all("at one instant of an oscillation of period 1" in " ".join(one.words) for one in told)
    plain = [
        estimate(
            Evidence([LevelValue(size, curve(end, size, offset, ripple)[1][-1]) for size in (1.0, 2**0.5, 2.0)], 1.0)
        )
        for end in ends
    ]
    assert sum(one.band < error for one, error in zip(plain, errors, strict=True)) >= 3


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_units_of_an_oscillation_do_not_matter(factor):
    """Of value and time."""
    runs = []
    for size in (1.0, 2**0.5, 2.0):
        time, values = curve(2.8, size)
        runs.append(level(size, factor * time, values / factor))
    assert findings(PLAN, runs, [])["x"].estimate.band == pytest.approx(found(2.8).band / factor)


def test_a_phase_that_is_not_known():
    """After 24 periods the case is late by a fifth of one, and the coarsest level by more than half of one."""
    told = found(24.05)
    assert told.verdict == "indicative"
    assert "oscillation of period 1.01 whose phase is not known: any of its values is possible" in told.words[-1]
    assert told.band >= abs(told.value - exact(24.05))


@pytest.mark.parametrize("end", [0.2, 0.6])
def test_what_does_not_swing(end):
    """Less than one crest and one trough."""
    assert "instant" not in " ".join(found(end).words)


def test_swings_smaller_than_the_band():
    """They are in it already."""
    time = np.linspace(0.0, 3.0, 300)
    values = time + 0.01 * np.sin(40.0 * time) + 1e-3
    assert oscillation(time, values, 0.02) is None
    small = oscillation(time, values, 1e-4)
    assert small is None or small.swing < 0.02


def test_turns():
    time = np.linspace(0.0, 2.0, 41)
    found = turns(time, np.sin(2.0 * math.pi * (time - 0.013)), 0.1)
    assert [turn.time for turn in found] == pytest.approx([0.263, 0.763, 1.263, 1.763], abs=1e-3)
    assert [turn.sign for turn in found] == [1.0, -1.0, 1.0, -1.0]
    assert [abs(turn.value) for turn in found] == pytest.approx([1.0] * 4, abs=1e-3)
    assert turns(time, time, 0.1) == []
    assert turns(time, np.full(41, np.nan), 0.1) == []


def test_steps_of_other_lengths():
    """A run that repeats steps with half of their size."""
    time = np.sort(np.concatenate([np.linspace(0.0, 2.9, 59), [1.01, 1.02, 2.22]]))
    values = np.sin(2.0 * math.pi * time)
    one = oscillation(time, values, 1e-3)
    assert one.half_period == pytest.approx(0.5, abs=2e-3)
    assert one.slope == pytest.approx(2.0 * math.pi * math.cos(5.8 * math.pi), rel=0.05)
    assert one.curvature == pytest.approx(-((2.0 * math.pi) ** 2) * math.sin(5.7 * math.pi), rel=0.02)  # a step before
    late = oscillation(time, values, 1e-3).late(time, np.sin(2.0 * math.pi * (time - 0.02)))
    assert late == pytest.approx(0.02 * 2.9 / one.last.time, abs=2e-3)


def test_words_of_an_instant():
    known = Evidence([LevelValue(size, 1.0 + 1e-3 * size**2) for size in (1.0, 2**0.5, 2.0)], 1.0)
    told = estimate(Evidence(known.levels, 1.0, instant=OscillationInstant(2.0, 0.03, 0.05)))
    assert told.band == told.levels_say == 0.05
    assert told.verdict == "resolved"
    assert told.words == (
        "at one instant of an oscillation of period 2, known to +-0.03 in time: it changes by 0.05 within that",
    )
    assert estimate(Evidence(known.levels, 1.0, instant=OscillationInstant(2.0, 0.03, 1e-9))).band == pytest.approx(
        1.25e-3, rel=1e-2
    )
    assert estimate(Evidence(known.levels, 1.0, instant=OscillationInstant(2.0, None, 0.5))).verdict == "indicative"
