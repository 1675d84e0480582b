"""What 1 % costs: bands of two and three runs of a family, and the table of all families."""

import json

import pytest
from programs import fsci

from fsci.bench.bands import known_runs, level, with_bands
from fsci.bench.one_percent import table
from fsci.bench.table import ERROR, LEVEL, TIME, UNKNOWNS, show


def row(option, size, error, seconds, element=0, first_order=()):
    """One value, drag, which is too large by `error` [%]."""
    return {
        "option": option,
        "resolution": f"{100 / size:g} cells",
        UNKNOWNS: round(1000 / size**2),
        TIME: seconds,
        ERROR: abs(error),
        LEVEL: level(
            {"drag final": 1.0 + 0.01 * error}, {"cells": size, "facets": 0.1}, {"element": element}, first_order
        ),
    }


#: Errors of second order, 8 to 0.5 %, of first order, and of a better method.
SECOND = [row("a", 4.0, 8.0, 1.0), row("a", 2.0, 2.0, 3.0), row("a", 1.0, 0.5, 10.0)]
FIRST = [row("b", 2.0, 2.0, 2.0, 0, ["the scheme"]), row("b", 1.0, 1.0, 5.0, 0, ["the scheme"])]
BETTER = [row("d", 4.0, 0.6, 2.0, 1), row("d", 2.0, 0.1, 4.0, 1)]
NORM = [{"option": "c", "resolution": "1", UNKNOWNS: 5, TIME: 1.0, ERROR: 2.0}]


def bands(rows, count):
    return [one.bands(count).get("drag final") for one in known_runs(rows)]


def test_bands_of_coarser_runs():
    """1.3 times the error, 1.25 times with three levels; what has one size in all runs is no level."""
    assert bands(SECOND, 2) == [None, pytest.approx(0.026), pytest.approx(0.0065)]
    assert bands(SECOND, 3) == [None, None, pytest.approx(0.00625)]
    assert bands(FIRST, 2) == [None, pytest.approx(0.013)]


def test_bands_of_a_better_method():
    """In cells twice as large, or in the same; 1.25 times what it changes."""
    first, second, third, *better = known_runs([*SECOND, *BETTER])
    assert [one.twin["option"] for one in (first, second, third)] == ["d"] * 3
    assert [one.twin[LEVEL]["sizes"]["cells"] for one in (first, second, third)] == [4.0, 4.0, 2.0]
    assert [one.twin for one in better] == [None, None]
    assert bands([*SECOND, *BETTER], 2)[:3] == [pytest.approx(0.0125 * change) for change in (7.4, 1.4, 0.4)]
    assert bands([*SECOND, *BETTER], 3)[:3] == [None, pytest.approx(0.026), pytest.approx(0.0065)]
    assert third.seconds(2) == 14.0
    assert third.seconds(3) == 17.0


@pytest.mark.parametrize("size", [0.5, 2.3])
def test_no_twin(size):
    """Smaller cells, or more than twice as large ones."""
    first, _ = known_runs([row("a", 1.0, 0.5, 10.0), row("d", size, 0.1, 1.0, 1)])
    assert first.twin is None


def test_columns():
    rows = with_bands([*SECOND, *FIRST])
    assert [one["band of 2 [%]"] for one in rows] == [
        "",
        pytest.approx(2.6),
        pytest.approx(0.65),
        "",
        pytest.approx(1.3),
    ]
    assert [one["band of 3 [%]"] for one in rows] == ["", "", pytest.approx(0.625), "", ""]
    assert "level" not in show(rows)


def test_the_table():
    """The coarse run of `b` has 1 % by chance; two runs of `a` are sure of less."""
    said = table({"flow": ("a flow: error against time", [*SECOND, *FIRST]), "norm": ("b", NORM)}).splitlines()
    of_one = "with a better method 0 of 0. Of 1 that are at most 1 %, 1 have no larger error."
    assert said[2:] == [
        "| `flow`, a flow | drag | b; 100 cells | 1,000 | 5.00 | 13.0 | 14.0 |",
        "| `norm`, b | a norm | **not reached**: 2.00 % by c; 1 | 5 | 1.00 | no band | no band |",
        "",
        f"Bands of 2 runs hold 3 of 3 values, {of_one}",
        f"Bands of 3 runs hold 1 of 1 values, {of_one}",
    ]
    assert said[0].count("|") == said[2].count("|")


def test_bands_that_miss():
    """A value that is wrong on all levels."""
    said = table({"flow": ("a flow", [row("a", 2.0, 5.0, 1.0), row("a", 1.0, 5.0, 3.0)])})
    assert "Bands of 2 runs hold 0 of 1 values, with a better method 0 of 0. Of 1 that are at most 1 %, 0 have" in said
    assert "| 4.00, but 5.00 % | no band |" in said


def test_no_table_without_errors():
    assert table({"search": ("seconds", [{"facets": 3, "seconds": 1.0}])}) == ""


def test_results_are_shown_again(tmp_path):
    """Nothing is run."""
    (tmp_path / "old.json").write_text(json.dumps({"results": {"flow": with_bands(SECOND)}}))
    done = fsci("bench", tmp_path / "old.json", "-o", tmp_path / "new.json")
    assert done.returncode == 0, done.stderr
    assert "| `flow`, flow | drag | a; 100 cells | 1,000 | 10.0 | 13.0 |" in done.stdout
    assert json.loads((tmp_path / "new.json").read_text())["results"]["flow"] == with_bands(SECOND)
