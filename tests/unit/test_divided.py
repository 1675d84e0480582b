"""Steps that are divided into parts that grow."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coupling.divided import lengths, step_in_parts
from solvers.api import StepInfo
from solvers.fluid.flow.history import History
from solvers.fluid.settings.time_scheme import SCHEMES


@pytest.mark.parametrize(
    ("longest", "parts"),
    [
        (math.inf, (1.0,)),
        (1.0, (1.0,)),
        (1.0 - 1e-9, (1.0,)),
        (0.99, (0.5, 0.5)),
        (0.5, (0.5, 0.5)),
        (0.3, (0.25, 0.25, 0.5)),
        (0.1, (0.0625, 0.0625, 0.125, 0.25, 0.5)),
    ],
)
def test_parts_double_and_fill_the_step(longest, parts):
    assert lengths(1.0, longest) == parts
    assert sum(parts) == 1.0


def test_parts_are_taken_one_after_the_other():
    """Numbers of the last, iterations and notes of all."""
    taken = []

    def step(t, dt):
        taken.append((t, dt))
        return StepInfo(3, (1.0, dt), {"end": t + dt}, (f"at {t:g}",))

    info = step_in_parts(step, 2.0, (0.25, 0.25, 0.5))
    assert taken == [(2.0, 0.25), (2.25, 0.25), (2.5, 0.5)]
    assert info == StepInfo(9, (1.0, 0.5), {"end": 3.0}, ("at 2", "at 2.25", "at 2.5"))


def test_longest_step_after_others():
    """Only rules with two times behind ask for it, from the second step on."""
    euler, bdf2 = (History(SCHEMES[name], 1) for name in ("backward_euler", "bdf2"))
    for history in (euler, bdf2):
        assert history.longest_step == math.inf
        history.end_step(0.1, history.past[0].velocity, history.past[0].found, np.zeros(1))
        assert history.longest_step == math.inf
        history.end_step(0.2, history.past[0].velocity, history.past[0].found, np.zeros(1))
    assert euler.longest_step == math.inf
    assert bdf2.longest_step == 0.4
