"""Values of runs and distances of their curves, with known answers."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from fsci.case.verify import Check
from fsci.converge.values import Distance, Observed, chosen, distance, observed
from fsci.running.verify import evaluate

TIME = np.linspace(0.1, 3.0, 30)


def run(*checks, **columns):
    history = {"time": TIME, **{name.replace("_", "."): value for name, value in columns.items()}}
    made = [Check(**{"relative": 1.0, **check}) for check in checks]
    summary = {"probes": {name: {} for name in history if name != "time"}, "verify": evaluate(history, made)}
    return observed(SimpleNamespace(verify=made, probes={}, dimension=2, fluid=None), history, summary)


def test_columns_and_checks():
    found = run(
        {"value": "u.x", "statistic": "final", "reference": 1.0},
        {"value": "u.x", "statistic": "max", "reference": 1.0},
        {"value": "u.y", "statistic": "max", "reference": 0.0, "absolute": 1.0, "relative": None},
        u_x=np.sin(TIME),
        u_y=0.0 * TIME,
    )
    assert list(found) == ["u.x", "u.y", "u.x max"]
    assert found["u.x"].value == pytest.approx(math.sin(3.0))
    assert found["u.y"].scale == pytest.approx(np.sin(TIME).max())
    # the top of a sine between its samples: 1 but for the error of a parabola
    top = found["u.x max"]
    assert top.value + top.sampling == pytest.approx(1.0, abs=2e-6)
    assert top.sampling > 1e-4


def test_counters_are_no_values():
    """How many steps an iteration takes has no exact value: a finer level may need more, and none is wrong."""
    found = run(
        *({"value": name, "statistic": "max", "reference": 3.0} for name in ("iterations", "contact.active", "force")),
        iterations=np.full(30, 3.0),
        contact_active=np.full(30, 7.0),
        force=np.full(30, 2.0),
    )
    assert [name for name in found if " " in name] == ["force max"]


def test_a_check_without_a_value():
    found = run({"value": "u.x", "statistic": "frequency", "reference": 1.0}, u_x=TIME)
    assert math.isnan(found["u.x frequency"].value)


@pytest.mark.parametrize("late", [-0.02, 0.01])
def test_shift_of_curves(late):
    one = Observed(0.0, 1.0, 0.0, TIME, np.sin(2.0 * TIME))
    fine = np.linspace(0.05, 3.0, 600)
    other = Observed(0.0, 1.0, 0.0, fine, np.sin(2.0 * (fine - late)))
    found = distance(one, other)
    assert found.shift == pytest.approx(late, rel=0.02)
    assert found.largest == pytest.approx(2.0 * abs(late), rel=0.02)
    assert found.mean < found.largest


@pytest.mark.parametrize("rest", [0.1, -0.1 * np.sin(2.0 * TIME), -0.1 * np.cos(20.0 * TIME)])
def test_curves_that_no_shift_explains(rest):
    """Another size or another swing; and one that is nearly constant, whose shift would be 100,000 times the run."""
    curve = np.sin(2.0 * TIME)
    one, other = Observed(0.0, 1.0, 0.0, TIME, curve), Observed(0.0, 1.0, 0.0, TIME, curve + rest)
    assert distance(one, other).shift is None
    assert distance(one, one) == Distance(0.0, 0.0, None)
    one, other = Observed(0.0, 1.0, 0.0, TIME, 1.0 + 1e-6 * TIME), Observed(0.0, 1.0, 0.0, TIME, np.full(30, 1.1))
    assert distance(one, other).shift is None


def test_numbers_have_no_distance():
    assert distance(Observed(1.0, 1.0), Observed(2.0, 1.0)) is None
    one = Observed(0.0, 1.0, 0.0, TIME[:2], TIME[:2])
    assert distance(one, one) is None


def test_chosen():
    names = ["u.x", "u.y", "drag", "u.x max from 2"]
    assert chosen(names, []) == names
    assert chosen(names, ["u"]) == ["u.x", "u.y", "u.x max from 2"]
    assert chosen(names, ["u.x"]) == ["u.x", "u.x max from 2"]
    assert chosen(names, ["drag"]) == ["drag"]
