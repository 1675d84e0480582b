"""Statics past a limit point: the step that fails says that there is no equilibrium."""

import numpy as np
import pytest
from advised import require_advice
from contact_setup import make_body, make_contact
from structure_setup import vector

from fsci import shapes
from solvers.api import FailureKind, StepFailed
from solvers.contact.surface import Surface
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Support
from solvers.structure.deformation import LimitPoint
from solvers.structure.elastic_constants import lame
from solvers.structure.field import Structure
from solvers.structure.loads import Traction
from solvers.structure.materials import NeoHooke
from solvers.structure.time_scheme import Statics

SETTINGS = SolverSettings(Tolerance(residual=1e-10, max_iterations=30), linear="direct")


def go_on(structure, t, step, end):
    """(time of the last equilibrium, failure of the step with a sixteenth of the length, or None)."""
    while t < end:
        state, failed = structure.save(), None
        for dt in step * 0.5 ** np.arange(5):
            try:
                structure.step(t, float(dt))
            except StepFailed as failure:
                failed = failure
                structure.restore(state)
            else:
                t, failed = t + float(dt), None
                break
        if failed is not None:
            return t, failed
    return t, None


def arch_under_a_plate(length, order=1):
    """A shallow arch over 3 m times `length` between clamped ends, and a plate that comes down on it by 0.5 m/s."""
    held = [Support(end, vector(0, 0)) for end in ("start", "end")]
    mesh = shapes.ring(2.95 * length, 3.05 * length, [40, 2], angle=60, start=60, order=order)
    body = make_body("arch", mesh, NeoHooke(*lame(1000.0, 0.3), 1.0), supports=held)
    points = np.array([[-3.0, 3.05], [3.0, 3.05]]) * length
    plate = Surface(
        "plate", points, np.array([[0, 1]]), "line", None, motion=lambda t: points - [0.0, 0.5 * length * t]
    )
    return make_contact([body], [(("arch", "outer"), plate)], settings=SETTINGS)[0]


@pytest.mark.parametrize(
    ("step", "length"),
    [
        (0.025, 1.0),
        pytest.param(0.0125, 1e-3, marks=pytest.mark.slow),
        pytest.param(0.025, 1e-3, marks=pytest.mark.slow),
        pytest.param(0.0125, 1.0, marks=pytest.mark.slow),
    ],
)
def test_a_plate_on_an_arch(step, length):
    """Pressed down to 0.2 of its rise a shallow arch buckles to one side under the plate."""
    structure = arch_under_a_plate(length)
    structure.initialise(0.0, step)
    t, failed = go_on(structure, 0.0, step, 1.0)
    assert t == pytest.approx(0.39, abs=0.01)
    assert f"no equilibrium beyond t = {t:.4g}" in str(failed)
    assert "use dynamics" in str(failed)
    require_advice(failed, FailureKind.LIMIT_POINT)


def snaps(structure, step, end):
    """Findings of snaps until the end, with their times."""
    structure.initialise(0.0, step)
    found = []
    for t in step * np.arange(round(end / step)):
        structure.step(t, step)
        found += [(t + step, finding) for finding in structure.energy_sentinel.look(t + step, step)]
    return found


def arch_under_a_load(pressure, power):
    """An arch that a dead load of `pressure` t^power presses down."""
    half = np.arctan2(0.3, 1.0 - 0.15**2)  # of the angle, for a chord of 2 and a rise of 0.15
    radius, degrees = 1.0 / np.sin(half), float(np.degrees(half))
    mesh = shapes.ring(radius - 0.02, radius + 0.02, [20, 1], angle=2.0 * degrees, start=90.0 - degrees, order=2)
    held = [Support(end, vector(0, 0)) for end in ("start", "end")]
    load = Traction("outer", (lambda x, t: 0.0 * x[0], lambda x, t: -pressure * t**power + 0.0 * x[0]))
    body = make_body("arch", mesh, NeoHooke(*lame(1000.0, 0.3), 1.0), supports=held, tractions=[load])
    return Structure([body], Statics(), SETTINGS)


@pytest.mark.parametrize("step", [0.025, pytest.param(0.0125, marks=pytest.mark.slow)])
def test_an_arch_that_statics_takes_past_its_limit_point_is_said_to_snap(step):
    """With cells of second order the plate's arch snaps at 0.36, and statics finds another equilibrium."""
    ((t, finding),) = snaps(arch_under_a_plate(1.0, order=2), step, 0.425)
    assert finding.kind == "snap"
    assert t == pytest.approx(0.375, abs=1e-9)
    assert "the step to t = 0.375 moved bodies" in finding.message
    assert "is nowhere: they snapped to another equilibrium" in finding.message
    assert "take 'dynamics'" in finding.message


def test_a_run_that_is_resumed_one_step_before_says_it_too():
    first, second = (arch_under_a_plate(1.0, order=2) for _ in range(2))
    assert snaps(first, 0.025, 0.35) == []
    second.initialise(0.0, 0.025)
    second.restore(first.save())
    second.energy_sentinel.restore(first.energy_sentinel.save())
    second.step(0.35, 0.025)
    (finding,) = second.energy_sentinel.look(0.375, 0.025)
    assert finding.kind == "snap"
    assert "the step to t = 0.375 moved bodies" in finding.message


@pytest.mark.parametrize(("pressure", "power"), [(0.03, 1), (-0.1, 1), (-0.1, 3)])
def test_an_arch_below_its_limit_or_pulled_does_not_snap(pressure, power):
    assert snaps(arch_under_a_load(pressure, power), 0.05, 1.0) == []


def test_iterates_that_invert_elements_beyond_a_limit_point_say_so():
    """Inverted elements are how Newton's method fails there as often as any other way."""
    structure = arch_under_a_load(0.03, 1)
    structure.initialise(0.0, 0.1)
    body = structure.bodies[0]
    body.set_displacement((body.points[:2].T * [-2.0, 0.0]).ravel())  # its mirror image
    with pytest.raises(StepFailed, match=r"inverted \(volume ratio -1\) at iteration 3"):
        structure.check_deformation(3, ())
    before = structure.energy_sentinel.save()
    structure.energy_sentinel.restore(before | {"limit_point": {"speeds": np.array([1.0] * 5 + [5.0]), "reached": 0.7}})
    with pytest.raises(StepFailed, match=r"inverted .* no equilibrium beyond t = 0\.7: .* use dynamics"):
        structure.check_deformation(3, ())


def test_growth_that_is_usual_is_no_limit():
    limit = LimitPoint()
    for k in range(10):
        limit.accept(float(k), 1.0 + 0.05 * k)
    assert limit.explain() == ""
    limit.accept(10.0, 2.9)
    assert "beyond t = 10:" in limit.explain()
