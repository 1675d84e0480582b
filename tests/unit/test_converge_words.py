"""What `fsci converge` says, by situation."""

from dataclasses import replace
from pathlib import Path

import pytest

from fsci.converge.estimate import Estimate
from fsci.converge.page import write_page
from fsci.converge.plan import PlannedRun
from fsci.converge.results import BandedValue, Done
from fsci.converge.values import Distance, Observed
from fsci.converge.words import helps, percent, run_row, seconds_in_words, sentences, settings, without_results
from fsci.twin.changes import Twin
from fsci.twin.runs import TwinEnded


def done(name="element", words="element q2q1", role="twin", message="", value=5.5794, seconds=2.0, changes=()):
    run = PlannedRun(Twin(name, words, "space", changes), role)
    wall = {"wall": {"total": seconds}, "dofs": {"fluid": 10}}
    return Done(run, TwinEnded(run.twin, message=message, summary=wall), {"drag": Observed(value, abs(value))})


def told(band=0.0048, **more):
    return Estimate(5.5825, band, more.pop("order", 1.9), more.pop("verdict", "resolved"), levels_say=band, **more)


def test_a_resolved_value():
    found = BandedValue(
        told(errors={"cells": 0.003, "step": 0.001}, scatter=2e-5),
        5.5825,
        {"element": 5.5794},
        Distance(0.05, 0.01, 0.3),
    )
    assert list(sentences("drag", found, [done()])) == [
        "drag 5.5825 +- 0.0048 (0.086 %), order 1.9; largest: cells 75 %, shifts 0.00036 %",
        "  element q2q1: 5.5794, inside",
        "  over time, to the next level: 0.9 % at most, 0.18 % in the mean, shifted by +0.3 in time",
    ]
    found = replace(found, distance=Distance(0.05, 0.01, None))
    assert (
        list(sentences("drag", found, [done()]))[2]
        == "  over time, to the next level: 0.9 % at most, 0.18 % in the mean"
    )


def test_a_value_that_is_zero():
    """Rounding errors have neither digits nor shares."""
    zero = Estimate(2.2e-18, 2e-7, None, "resolved", levels_say=2e-7, errors={"step": 1e-18, "cells": 3e-18})
    assert list(sentences("still", BandedValue(zero, 0.2, {"element": -4.6e-33}), [done()])) == [
        "still 0 +- 2e-07 (0.0001 %)",
        "  element q2q1: 0, inside",
    ]
    assert next(sentences("still", BandedValue(replace(zero, value=-1e-34), 0.2), [])).startswith("still 0 +- 2e-07")


@pytest.mark.parametrize(
    ("share", "words"),
    [(0.0946, "9.5 %"), (0.994, "99 %"), (0.996, "100 %"), (6.63, "660 %"), (2.7e12, "2.7e+14 %"), (1e-8, "1e-06 %")],
)
def test_percent(share, words):
    assert percent(share) == words


def test_false_convergence():
    found = BandedValue(
        Estimate(841.4, 103.3, None, "not resolved", levels_say=31.1, outside=("element",)), 841.4, {"element": 758.9}
    )
    changes = (("fluid.element", "q2q1"), ("fluid.grid.cells", "[4, 4]"))
    runs = [done(changes=changes)]
    assert list(sentences("force", found, runs)) == [
        "force 841 +- 103 (12 %): NOT RESOLVED",
        "  NOT RESOLVED: levels say 3.7 %, but element q2q1 gives 758.9 (-9.8 %)",
    ]
    assert helps(runs, {"force": found}) == [
        "element q2q1 helps: --set fluid.element=q2q1 --set fluid.grid.cells='[4, 4]'"
    ]


def test_values_without_a_band():
    assert list(
        sentences("drag", BandedValue(Estimate(None, None, None, "not resolved", words=("why",)), 0.0), [])
    ) == ["drag: no value: why"]
    alone = Estimate(2.0, None, None, "not resolved", words=("no other level has this value",))
    assert list(sentences("drag", BandedValue(alone, 2.0), [])) == [
        "drag 2, no band: NOT RESOLVED: no other level has this value"
    ]


@pytest.mark.parametrize(
    ("value", "band", "text"),
    [
        (5.5825, 0.0048, "5.5825 +- 0.0048"),
        (41.3, 0.9, "41.30 +- 0.90"),
        (-2.27e-5, 1e-7, "-2.27e-05 +- 1e-07"),
        (123456.0, 789.0, "123456 +- 789"),
        (7.654321e8, 1.2e4, "7.65432e+08 +- 1.2e+04"),
        (3.0, 0.0, "3 +- 0"),
        (-1e-16, 0.0062, "0.0000 +- 0.0062"),
    ],
)
def test_digits_are_those_of_the_band(value, band, text):
    found = BandedValue(
        Estimate(value, band, None, "indicative", levels_say=band, words=("indicative: an impact",)), 1e9
    )
    first, second = sentences("p", found, [])
    assert first.startswith(f"p {text} (")
    assert first.endswith(": indicative")
    assert second == "  indicative: an impact"


def test_rows_of_runs():
    assert run_row(done()) == "element          2.0 s  element q2q1"
    assert run_row(done(message="no way\nmore")) == "element          2.0 s  no way"


def test_a_method_that_fails():
    """Its value is compared with none: that is said once."""
    runs = [
        done("coarser_2", role="level", message="too large"),
        done(),
        done("order", "second order", message="no\nmore"),
    ]
    assert list(without_results(runs)) == ["second order: no result: no"]


def test_times():
    assert [seconds_in_words(t) for t in (0.5, 12.3, 150.0, 7300.0)] == ["0.5 s", "12 s", "2 min", "2.0 h"]


def test_later_settings_replace_earlier_ones():
    assert settings((("a.b", "1"), ("a.b", "2"))) == "--set a.b=2"


def test_page(tmp_path: Path):
    found = {"drag": BandedValue(told(errors={"cells": 0.003}), 5.5825, {"element": 5.5794})}
    runs = [done("case", "the case itself", "level", value=5.5825), done()]
    text = write_page("<a case>", tmp_path, found, runs).read_text()
    assert "Errors of &lt;a case&gt;" in text
    assert "drag 5.5825 +- 0.0048" in text
    assert 'class="ok">resolved' in text
    assert "data:image/png" in text
    assert (tmp_path / "error_against_time.png").read_bytes()[:4] == b"\x89PNG"
