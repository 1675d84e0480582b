"""Differences of two runs, with known answers."""

import math

import numpy as np
import pytest

from fsci.twin.compare import changes, values
from fsci.twin.zero import CharacteristicScales

TIME = np.array([1.0, 2.0, 3.0, 4.0])


def run(x, y=0.0, verify=(), time=TIME):
    history = {"time": time, "u.x": x + 0.0 * time, "u.y": y + 0.0 * time, "contact.p.x": 0.0 * time}
    return history, {"probes": {"u.x": {}, "u.y": {}}, "verify": list(verify)}


def test_a_small_component_is_compared_with_the_vector():
    found = changes(values(*run(10.0, 1e-9)), values(*run(10.0, 2e-9)))
    assert found["u.y"].value == pytest.approx(1e-10)
    assert found["u.x"].value == 0.0


def test_what_is_zero_but_for_rounding():
    """A column whose whole probe is rounding is compared with the others of its unit; one without a unit is not."""

    def zero(noise):
        history = {"time": TIME, "at_rest": noise + 0.0 * TIME, "speed": 2.0 + 0.0 * TIME, "mass": noise + 0.0 * TIME}
        speed = (1, 0, -1)
        powers = CharacteristicScales({"at_rest": speed, "speed": speed, "mass": (0, 1, 0)})
        return values(history, {"probes": dict.fromkeys(history)}, powers)

    found = changes(zero(1e-17), zero(3e-17))
    assert found["at_rest"].curve == pytest.approx(1e-17)
    assert found["mass"].curve == pytest.approx(2.0 / 3.0)
    assert changes(zero(1e-9), zero(3e-9))["at_rest"].curve == pytest.approx(0.1)


def test_the_largest_difference_over_time():
    found = changes(values(*run(TIME)), values(*run(TIME + np.array([0.0, 0.4, 0.0, 0.1]))))
    assert found["u.x"].value == pytest.approx(0.1 / 4.1)
    assert found["u.x"].curve == pytest.approx(0.4 / 4.1)


def test_half_of_the_step():
    """Values at the same times are compared; a line between them has no difference."""
    fine = np.arange(0.5, 4.1, 0.5)
    assert changes(values(*run(2.0 * TIME)), values(*run(2.0 * fine, time=fine)))["u.x"].curve == 0.0


def test_values_that_one_run_lacks():
    late = np.array([np.nan, np.nan, 3.0, 4.0])
    assert changes(values(*run(TIME)), values(*run(late)))["u.x"].curve == 0.0
    never = np.full(4, np.nan)
    assert changes(values(*run(TIME)), values(*run(never)))["u.x"].value == math.inf
    assert changes(values(*run(never)), values(*run(never)))["u.x"].value == 0.0
    assert changes(values(*run(TIME)), {})["u.x"].value == math.inf


def test_numbers_of_verify():
    """Errors and counters are no values; a force on the slave is the opposite one if roles are exchanged."""

    def verify(force, mass):
        return (
            {"name": "contact.p.x max", "value": force, "reference": 5.0},
            {"name": "fluid.mass max_abs", "value": mass, "reference": 0.0},
            {"name": "iterations max", "value": 5.0, "reference": 5.0},
        )

    base = values(*run(1.0, verify=verify(5.0, 1e-14)))
    twin = values(*run(1.0, verify=verify(-4.0, 1e-12)), opposite=("contact.p.x",))
    found = changes(base, twin)
    assert found["contact.p.x max"].value == pytest.approx(-0.2)
    assert "fluid.mass max_abs" not in found
    assert "iterations max" not in found
