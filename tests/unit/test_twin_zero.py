"""Sizes of numbers of one flow in each other's units."""

from pathlib import Path

import pytest

from fsci.case import load_case
from fsci.twin.zero import CharacteristicScales, scales

SPEED, STRESS, FORCE, MOMENT, FLOW_RATE, LENGTH = (1, 0, -1), (-1, 1, -2), (1, 1, -2), (2, 1, -2), (3, 0, -1), (1, 0, 0)
CASES = Path(__file__).parents[2] / "cases"


def size(unit, other, **settings):
    """That in `unit` of a number 3 of another one; the column itself is zero."""
    return CharacteristicScales({"zero": unit, "other": other}, **settings).scale(
        "zero", 0.0, {"zero": 0.0, "other": 3.0}
    )


@pytest.mark.parametrize(
    ("unit", "other", "expected"),
    [
        (SPEED, SPEED, 3.0),
        (MOMENT, FORCE, 3.0 * 0.5),
        (STRESS, FORCE, 3.0 / 0.5**2),
        (FORCE, STRESS, 3.0 * 0.5**2),
        (STRESS, SPEED, 1000.0 * 3.0**2),
        (FORCE, SPEED, 1000.0 * 3.0**2 * 0.5**2),
        (FLOW_RATE, SPEED, 3.0 * 0.5**2),
        ((0, 0, 0), SPEED, 1.0),
        (LENGTH, (3, 0, 0), 0.0),  # a body moves by less than its size
        (SPEED, STRESS, 0.0),
    ],
)
def test_sizes_in_a_flow(unit, other, expected):
    assert size(unit, other, length=0.5, density=1000.0) == pytest.approx(expected)


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_units_do_not_matter(factor):
    """Lengths in other units: a moment of force times length follows."""
    force, length = 3.0 * factor, 0.5 * factor
    found = CharacteristicScales({"zero": MOMENT, "other": FORCE}, length).scale(
        "zero", 0.0, {"zero": 0.0, "other": force}
    )
    assert found == pytest.approx(1.5 * factor**2)


def test_without_a_flow_only_one_unit_is_compared():
    assert size(MOMENT, FORCE) == 0.0
    assert size(MOMENT, MOMENT) == 3.0


@pytest.mark.parametrize(("own", "expected"), [(0.0, 1.0), (9e-13, 1.0), (1e-11, 1e-8), (1e-7, 1e-7), (1.0, 1.0)])
def test_small_numbers_keep_their_own_size(own, expected):
    found = CharacteristicScales({"own": SPEED, "other": SPEED}).scale("own", own, {"own": own, "other": 1.0})
    assert found == pytest.approx(expected)


def test_a_case_in_2d_is_per_depth():
    found = scales(load_case(CASES / "cylinder_2d1"))
    assert found.powers == {"drag": (0, 0, 0), "lift": (0, 0, 0), "dp": (-1, 1, -2), "outlet": (2, 0, -1)}
    assert (found.length, found.density) == (2.2, 1.0)
