"""Statistics of sampled signals whose extremes and periods are known exactly."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fsci.case.verify import Check
from fsci.running.verify import evaluate


def check(
    value: str,
    statistic: str,
    reference: float,
    *,
    start: float | None = None,
    end: float | None = None,
    **tolerance: float,
) -> Check:
    window = {"from": start, "to": end}
    return Check(**{"value": value, "statistic": statistic, "reference": reference, **window, **tolerance})


def sine(samples: int, periods: float, *, frequency: float = 1.1, phase: float = 0.3) -> dict[str, np.ndarray]:
    """-0.06 + 0.065 sin(2 pi f t + phase), sampled from the first step on like a history."""
    time = np.arange(1, round(samples * periods) + 1) / (samples * frequency)
    return {"time": time, "A.y": -0.06 + 0.065 * np.sin(2 * math.pi * frequency * time + phase)}


@pytest.mark.parametrize("phase", np.linspace(0, 6, 7))
def test_sine_at_forty_samples_per_period(phase):
    history = sine(40, 5.3, phase=phase)
    checks = [
        check("A.y", "mean", -0.06, absolute=1e-4 * 0.065),
        check("A.y", "amplitude", 0.065, relative=1e-4),
        check("A.y", "frequency", 1.1, relative=1e-5),
    ]
    results = evaluate(history, checks)
    assert [result["ok"] for result in results] == [True, True, True], results
    assert results[1]["tolerance"] == pytest.approx(0.065e-4)


def test_parabola_is_refined_exactly_on_uneven_steps():
    time = np.array([0.0, 0.3, 0.4, 1.1, 1.3])
    history = {"time": time, "u": 2 - (time - 0.5) ** 2}
    (result,) = evaluate(history, [check("u", "amplitude", (2 - (2 - 0.8**2)) / 2, absolute=1e-14)])
    assert result["ok"], result


def test_time_of_the_maximum():
    """Exact for a parabola, at its top and at an end of the window; of a sine the first top, of fourth order."""
    time = np.array([0.0, 0.3, 0.4, 1.1, 1.3])
    history = {"time": time, "u": 2 - (time - 0.5) ** 2, "rising": time**2}
    checks = [check("u", "time_of_max", 0.5, absolute=1e-14), check("rising", "time_of_max", 1.3, absolute=0)]
    assert all(result["ok"] for result in evaluate(history, checks))
    (result,) = evaluate(
        sine(40, 1.3), [check("A.y", "time_of_max", (0.5 * math.pi - 0.3) / 2.2 / math.pi, relative=1e-3)]
    )
    assert result["ok"], result


def test_final_min_max_are_samples():
    history = {"time": np.array([1.0, 2.0, 3.0, 4.0]), "u": np.array([0.0, 3.0, 2.9, -1.0])}
    history["low"] = -history["u"]
    checks = [
        check("u", "final", -1, absolute=0),
        check("u", "min", -1, absolute=0),
        check("u", "max", 3, absolute=0),
        check("u", "max_abs", 3, absolute=0),
        check("low", "max_abs", 3, absolute=0),
    ]
    assert all(result["ok"] for result in evaluate(history, checks))


def test_window_leaves_the_transient_out():
    time = np.arange(1, 1001) * 0.01
    transient = np.where(time < 4.995, 10.0, 0.0)
    history = {"time": time, "u": np.sin(2 * math.pi * time) + transient}
    whole, late = evaluate(
        history,
        [check("u", "amplitude", 1, relative=1e-3), check("u", "amplitude", 1, relative=1e-3, start=5.0)],
    )
    assert not whole["ok"]
    assert late["ok"]
    assert late["name"] == "u amplitude from 5"
    (first,) = evaluate({"time": time, "u": time}, [check("u", "min", 0.3, absolute=1e-12, start=0.1 + 0.2)])
    assert first["ok"], "the sample at the start of the window counts in spite of rounding"
    (last,) = evaluate({"time": time, "u": time}, [check("u", "max", 0.3, absolute=1e-12, end=0.1 + 0.2 - 1e-16)])
    assert last["ok"], "and so does that at its end, but no later one"
    (both,) = evaluate(history, [check("u", "min", 10, absolute=1.1, start=1.0, end=4.9)])
    assert both["ok"]
    assert both["name"] == "u min from 1 to 4.9"


def test_ripple_is_no_period():
    time = np.arange(1, 2001) * 0.0025
    history = {"time": time, "u": np.sin(2 * math.pi * time) + 0.03 * np.sin(2 * math.pi * 40 * time)}
    (result,) = evaluate(history, [check("u", "frequency", 1.0, relative=0.01)])
    assert result["ok"], result


@pytest.mark.parametrize("periods", [0.4, 0.9])
def test_frequency_needs_a_whole_period(periods):
    (result,) = evaluate(sine(40, periods, phase=0.3), [check("A.y", "frequency", 1.1, relative=0.5)])
    assert not result["ok"]
    assert math.isnan(result["value"])
    assert "period" in result["message"]


def test_constant_has_no_frequency():
    history = {"time": np.arange(9.0), "u": np.ones(9)}
    frequency, amplitude = evaluate(
        history, [check("u", "frequency", 0, absolute=1), check("u", "amplitude", 0, absolute=0)]
    )
    assert not frequency["ok"]
    assert amplitude["ok"]


def test_what_is_missing_is_not_ok_and_says_so():
    history = {"time": np.array([1.0, 2.0]), "u": np.array([1.0, math.nan])}
    column, late, broken = evaluate(
        history,
        [
            check("v", "final", 0, absolute=1),
            check("u", "final", 0, absolute=1, start=3.0),
            check("u", "max", 1, absolute=1),
        ],
    )
    assert [column["ok"], late["ok"], broken["ok"]] == [False] * 3
    assert "'v' is not in the history" in column["message"]
    assert "window" in late["message"]
    assert "not finite" in broken["message"]


def test_an_empty_history_gives_no_value():
    (result,) = evaluate({}, [check("u", "final", 0, absolute=1)])
    assert not result["ok"]
