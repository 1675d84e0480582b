"""The theory that the case `elastic_tube` is compared with, and its values in the case."""

from pathlib import Path

import numpy as np
import pytest
from tube_waves import FLUID, RADIUS, WALL, E, missed, pressure_on_axis, wave_number

from fsci.case import load_case
from fsci.running.verify import peak

CASE = Path(__file__).parents[2] / "cases" / "elastic_tube"


def test_long_waves_are_those_of_moens_and_korteweg():
    """c^2 = E h / (2 rho R) for a wall free to move along z, less O(h / R) by the compliance of a thick ring."""
    omega = 1e-3
    speed = omega / wave_number(omega, omega)
    assert speed == pytest.approx(np.sqrt(E * WALL / 2 / FLUID / (RADIUS + WALL / 2)), rel=0.02)
    assert abs(missed(omega / speed, omega)) < 1e-9


@pytest.mark.parametrize(("column", "z"), [("near", 4.0), ("far", 14.0)])
def test_the_case_has_the_times_of_the_theory(column, z):
    (check,) = (check for check in load_case(CASE).verify if check.value == column)
    assert check.reference == pytest.approx(peak(*pressure_on_axis(z))[0], abs=2e-3)
