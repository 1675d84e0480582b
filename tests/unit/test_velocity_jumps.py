"""Times at which given velocities jump, and the steps that end there."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.jumps import BEFORE_JUMP, AtJumps, parts
from fsci.case.fluid import Movement
from fsci.case.rigid_motion import differentiated, rigid_motion
from fsci.case.velocity_jumps import kinks
from fsci.expression import Expression
from solvers.api import StepInfo


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("0.1*max(t - 0.2, 0)", [0.2]),
        ("0.1*max(t - 0.2137, 0) - 3", [0.2137]),
        ("min(t, 0.3)**2", [0.3]),
        ("abs(sin(20*t))", [np.pi * k / 20 for k in range(1, 7)]),
        ("1e-6*(max(t - 0.1, 0) - max(t - 0.5, 0))", [0.1, 0.5]),
        ("sin(40*t)", []),
        ("ramp(t, 0.1, 0.3)", []),
        ("exp(-100*t) + t**1.5", []),
        ("where(t > 0.3, (t - 0.3)**2, 0)", []),
        ("1 + 1e-9*sin(t)", []),
    ],
)
def test_kinks(text, times):
    sampled = (np.arange(400) + 0.382) / 8 * 0.02
    assert kinks(Expression.parse(text), sampled, 0.02) == pytest.approx(times, abs=1e-6)


def test_rates_beside_a_kink_are_those_of_their_side():
    value = differentiated(Expression.parse("2*max(t - 0.2, 0)"), 0.02, (0.2,))
    assert [value(t)[1] for t in (0.1999, 0.2 - 1e-9, 0.2, 0.2001)] == pytest.approx([0.0, 0.0, 2.0, 2.0])


def test_a_velocity_that_jumps_within_a_step_is_integrated_exactly():
    movement = Movement.model_validate({"velocity": ["where(t < 0.113, 0, 0.1)", "0"]})
    motion = rigid_motion(np.zeros((1, 2)), movement, 0.0, 0.02, (0.113,))
    for t in (0.1, 0.115, 0.12, 0.31):
        assert motion(t)[0][0, 0] == pytest.approx(0.1 * max(t - 0.113, 0.0), abs=1e-12)


def test_steps_end_just_before_jumps():
    before = BEFORE_JUMP * 0.02
    assert parts(0.1, 0.02, (0.113,)) == pytest.approx((0.013 - before, 0.007 + before), abs=1e-15)
    assert parts(0.1, 0.02, (0.12,)) == pytest.approx((0.02 * (1.0 - BEFORE_JUMP),), abs=1e-15)
    assert parts(0.1, 0.02, (0.1, 0.14)) == (pytest.approx(0.02),)


class Steps:
    """A scheme that says what it does."""

    can_start = True

    def __init__(self, divides):
        self.divides, self.done = divides, []

    def step(self, t, dt):
        self.done.append(("step", round(t, 6), round(dt, 6)))
        return StepInfo(1, (0.0,))

    def start_anew(self, t, dt):
        self.done.append(("start", round(t, 6), round(dt, 6)))


def test_a_scheme_starts_at_jumps():
    scheme = Steps(divides=True)
    steps = AtJumps(scheme, (0.02, 0.05))
    assert [steps.step(0.02 * k, 0.02).iterations for k in range(3)] == [1, 1, 2]
    assert scheme.done == [
        ("step", 0.0, 0.02),
        ("start", 0.02, 0.02),
        ("step", 0.02, 0.02),
        ("step", 0.04, 0.01),
        ("start", 0.05, 0.01),
        ("step", 0.05, 0.01),
    ]


def test_a_flow_alone_does_not_divide_its_steps():
    scheme = Steps(divides=False)
    steps = AtJumps(scheme, (0.02, 0.05))
    for k in range(5):
        steps.step(0.02 * k, 0.02)
    assert [what for what, _, _ in scheme.done] == ["step", *3 * ["start", "step"], "step"]
