"""The band of a value, on sequences whose limit and order are known."""

import math

import pytest

from fsci.converge.estimate import Evidence, LevelValue, estimate

EXACT = 3.0
SIZES = (1.0, 2**0.5, 2.0)


def levels(order=2.0, coefficient=0.01, exact=EXACT, sizes=SIZES):
    return tuple(LevelValue(size, exact + coefficient * size**order) for size in sizes)


def evidence(found, **more):
    return Evidence(levels=tuple(found), scale=abs(found[0].value), **more)


@pytest.mark.parametrize("order", [0.9, 1.0, 1.5, 2.0, 2.5])
@pytest.mark.parametrize("sizes", [SIZES, (1.0, 1.37, 2.1), (1.0, 2.0, 4.0), (0.5, 1.0, 2.0**0.5, 2.0)])
def test_monotone_values(order, sizes):
    """The order is that of the sequence, and the band holds the limit."""
    found = estimate(evidence(levels(order, sizes=sizes)))
    assert found.order == pytest.approx(order, abs=1e-6)
    error = 0.01 * sizes[0] ** order
    assert error <= found.band
    assert order > 2.0 or found.band == pytest.approx(1.25 * error)  # Roache's factor of three grids with an order
    assert found.verdict == "resolved"


@pytest.mark.parametrize("factor", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_units_do_not_matter(factor, sign):
    plain = estimate(evidence(levels()))
    found = estimate(evidence([LevelValue(level.size, sign * factor * level.value) for level in levels()]))
    assert found.band == pytest.approx(factor * plain.band)
    assert (found.order, found.verdict) == (pytest.approx(2.0), "resolved")


@pytest.mark.parametrize("order", [2.7, 4.0])
def test_faster_than_second_order_is_no_order(order):
    found = estimate(evidence(levels(order)))
    assert found.order is None
    assert 0.01 < found.band
    assert found.verdict == "resolved"


@pytest.mark.parametrize("order", [0.5, 0.6, 0.7])
def test_slower_than_first_order(order):
    """About the square root of the size: second order would say a fifth of the error."""
    found = estimate(evidence(levels(order), tolerance=0.001))
    assert found.order is None
    assert found.verdict == "indicative"
    assert 0.01 < found.band
    assert "finer levels change it hardly less than coarser ones: its order is below 0.8" in found.words


@pytest.mark.parametrize(("tolerance", "verdict"), [(0.0043, "indicative"), (0.0045, "resolved")])
def test_a_slow_order_within_the_tolerance(tolerance, verdict):
    """The band of the slowest order, 1.3 times the error 0.01 of 3.01, is enough where it is smaller than asked for."""
    found = estimate(evidence(levels(0.5), tolerance=tolerance))
    assert found.band == pytest.approx(0.013)
    assert found.verdict == verdict
    assert "finer levels change it hardly less than coarser ones: its order is below 0.8" in found.words


@pytest.mark.parametrize(("scatter", "order"), [(0.0, 0.5), (1e-5, 0.5), (0.01, 2.0)])
def test_scatter_that_explains_a_slow_order(scatter, order):
    """Where the place of cells moves values by as much as the level does, no slow order is seen."""
    shifts = (EXACT - scatter, EXACT, EXACT + scatter)
    found = estimate(evidence(levels(0.6), shifts=shifts, tolerance=0.001))
    first, second, third = (level.value for level in levels(0.6))
    pairs = ((second - first) / (2 ** (order / 2) - 1), (third - first) / (2**order - 1))
    assert found.band == pytest.approx(math.hypot(1.3 * max(pairs), 2.0 * scatter), rel=0.02)
    assert found.verdict == ("resolved" if order == 2.0 else "indicative")


def test_alternating_values():
    values = [3.01, 2.98, 3.05]
    found = estimate(evidence([LevelValue(size, value) for size, value in zip(SIZES, values, strict=True)]))
    assert found.order is None
    assert found.band == pytest.approx(1.3 * 0.03)  # of levels 1 and 2: 0.03 / (2 - 1), of 1 and 3: 0.04 / (4 - 1)
    assert "it goes up and down between levels: no order" in found.words
    assert found.verdict == "resolved"


def test_coarser_levels_do_not_say_more_than_the_finest_one():
    """Of an error C h^4, a pair with the finest level says at most 5 C at p = 2, that of both others 6 C."""
    assert estimate(evidence(levels(4.0))).band == pytest.approx(1.3 * 5.0 * 0.01)
    # two levels that agree by chance do not hide the third one
    found = estimate(evidence([LevelValue(1.0, 3.0), LevelValue(2**0.5, 3.0), LevelValue(2.0, 3.3)]))
    assert found.band == pytest.approx(1.3 * 0.1)


def test_first_order_methods():
    """With p = 1 the same change means more."""
    second = estimate(evidence(levels(1.0)[:2]))
    first = estimate(evidence(levels(1.0)[:2], first_order=("backward Euler",)))
    assert first.band == pytest.approx(1.3 * 0.01)
    assert second.band == pytest.approx(1.3 * 0.01 * (2**0.5 - 1.0))
    assert "first order is assumed: backward Euler" in first.words


def test_two_levels_are_indicative():
    found = estimate(evidence(levels()[:2]))
    assert found.verdict == "indicative"
    assert found.order is None
    assert "two levels only" in found.words


def test_one_level_has_no_band():
    found = estimate(evidence(levels()[:1]))
    assert found.band is None
    assert found.verdict == "not resolved"
    assert "no other level has this value" in found.words


def test_a_level_that_refuses():
    coarse = LevelValue(2.0, None, "body 'disc' comes too close")
    found = estimate(evidence([*levels()[:2], coarse]))
    assert found.verdict == "indicative"
    assert "level x2 has no result: body 'disc' comes too close" in found.words


def test_a_value_on_fine_levels_only():
    """The first contact does not happen on the coarsest level."""
    found = estimate(evidence([*levels()[:2], LevelValue(2.0, math.nan)]))
    assert found.verdict == "indicative"
    assert "level x2 does not have this value: it exists on fine levels only" in found.words


def test_no_value_at_all():
    found = estimate(Evidence(levels=(LevelValue(1.0, math.nan), LevelValue(2.0, math.nan)), scale=0.0))
    assert (found.band, found.order, found.verdict) == (None, None, "not resolved")
    assert found.words == ("the case itself does not have this value",)


@pytest.mark.parametrize("noise", [0.0, 1e-12, 1e-7])
def test_errors_at_rounding(noise):
    values = [EXACT * (1.0 + noise * sign) for sign in (0.0, 1.0, -1.0)]
    found = estimate(evidence([LevelValue(size, value) for size, value in zip(SIZES, values, strict=True)]))
    assert found.order is None
    assert found.band == pytest.approx(1e-6 * EXACT)
    assert found.verdict == "resolved"
    assert found.words == ("the same on all levels, up to the tolerance of solvers",)


def test_scatter_of_shifts():
    """Levels that agree by chance; the place of the cells moves the value by 0.1."""
    found = estimate(evidence([LevelValue(size, EXACT) for size in SIZES], shifts=(2.9, 3.1, 2.9, 3.1)))
    assert found.scatter == pytest.approx(0.1 * (4.0 / 3.0) ** 0.5)
    assert found.band == pytest.approx(2.0 * found.scatter)


@pytest.mark.parametrize("size", [1.0, 2**0.5, 2.0])
def test_scatter_of_shifts_on_a_coarser_level(size):
    """It falls with the first power of the size; a finer level than the case has as much less as of other errors."""
    coarse = [LevelValue(level, EXACT) for level in SIZES]
    shifts = (2.9, 3.1, 2.9, 3.1)
    found = estimate(evidence(coarse, shifts=shifts, shifted=size))
    assert found.scatter == pytest.approx(0.1 * (4.0 / 3.0) ** 0.5 / size)
    assert found.band == pytest.approx(2.0 * found.scatter)
    finer = estimate(evidence([LevelValue(0.5, EXACT), *coarse], shifts=shifts, shifted=size))
    assert finer.scatter == pytest.approx(found.scatter / 4.0)


def test_sources_that_cancel():
    """Cells and facets have errors of opposite signs: all together hardly change."""
    cells, facets = LevelValue(2.0, EXACT + 0.3), LevelValue(2.0, EXACT - 0.3)
    found = estimate(evidence([LevelValue(size, EXACT) for size in SIZES], sources={"cells": cells, "facets": facets}))
    assert found.band == pytest.approx(1.3 * 0.1 * 2**0.5)
    assert found.shares == pytest.approx({"cells": 0.5, "facets": 0.5})


def test_shares():
    """Errors of first and second size by 3 to 1; a finer mesh of one source counts by what is left of its error."""
    cells, bodies = LevelValue(2.0, EXACT + 0.1), LevelValue(0.5, EXACT + 0.01 - 0.0075)
    found = estimate(
        evidence(levels(), sources={"cells": cells, "bodies": bodies, "step": LevelValue(2.0, None, "no")})
    )
    assert found.shares == pytest.approx({"cells": 0.75, "bodies": 0.25})
    assert "step alone at x2 has no result: no" in found.words


def test_twin_inside():
    found = estimate(evidence(levels(), twins={"element": 2.999}))
    assert found.band == pytest.approx(max(1.3 * 0.01, 1.25 * 0.011))
    assert found.outside == ()
    assert found.verdict == "resolved"


def test_false_convergence():
    """Three levels agree on a wrong value; the other element says so."""
    found = estimate(evidence(levels(coefficient=0.001), twins={"element": 2.7, "scheme": 3.001}))
    assert found.levels_say == pytest.approx(0.00125, rel=1e-3)
    assert found.band == pytest.approx(1.25 * 0.301)
    assert found.outside == ("element",)
    assert found.verdict == "not resolved"


def test_a_difference_within_the_tolerance():
    """Levels hardly change it, the other element by 1 %: it is in the band, enough unless less is asked for."""
    known = {"scale": EXACT, "levels": levels(coefficient=0.001), "twins": {"element": 1.01 * EXACT}}
    found = estimate(Evidence(**known))
    assert found.outside == ("element",)
    assert found.band == pytest.approx(1.25 * 0.029)
    assert found.verdict == "resolved"
    assert estimate(Evidence(**known, tolerance=0.01)).verdict == "not resolved"


def test_twins_that_differ_by_rounding():
    found = estimate(evidence([LevelValue(size, EXACT) for size in SIZES], twins={"element": EXACT * (1 + 7e-7)}))
    assert found.verdict == "resolved"


def test_a_band_as_large_as_the_value():
    found = estimate(evidence([LevelValue(1.0, 1.0), LevelValue(2**0.5, -0.3), LevelValue(2.0, 2.0)]))
    assert found.verdict == "not resolved"
    assert "the band is as large as the value" in found.words


def test_reasons_of_the_case():
    found = estimate(evidence(levels(), indicative=("an impact",)))
    assert found.verdict == "indicative"
    assert "indicative: an impact" in found.words


def test_a_value_that_no_level_changes():
    """An impact does not change it; facets that are the same on all levels may. Two levels agree by chance."""
    same = [LevelValue(size, EXACT) for size in SIZES]
    found = estimate(evidence(same, first_order=("an impact",), indicative=("an impact",)))
    assert found.verdict == "resolved"
    assert not any(words.startswith("indicative") for words in found.words)
    found = estimate(evidence(same, indicative=("an impact",), unseen=("the facets",)))
    assert found.verdict == "indicative"
    assert found.words[-1] == "indicative: the facets"
    assert estimate(evidence(same[:2], indicative=("an impact",))).verdict == "indicative"


def test_one_reason_for_both():
    found = estimate(evidence(levels(), first_order=("an impact", "the scheme"), indicative=("an impact", "a start")))
    assert found.words == (
        "first order is assumed: the scheme",
        "indicative, first order is assumed: an impact",
        "indicative: a start",
    )


def test_sampling_of_a_maximum():
    found = estimate(evidence(levels(), sampling=0.5))
    assert found.band == pytest.approx(1.25 * 0.01 + 0.5)
    assert "its steps sample the curve: up to 0.5 of it is between them" in found.words
