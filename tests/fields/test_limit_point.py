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
from solvers.structure.materials import NeoHooke

SETTINGS = SolverSettings(Tolerance(residual=1e-10, max_iterations=20), linear="direct")


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


@pytest.mark.parametrize(
    ("step", "length"),
    [
        (0.025, 1.0),
        (0.0125, 1e-3),
        pytest.param(0.025, 1e-3, marks=pytest.mark.slow),
        pytest.param(0.0125, 1.0, marks=pytest.mark.slow),
    ],
)
def test_a_plate_on_an_arch(step, length):
    """Pressed down to 0.2 of its rise a shallow arch buckles to one side under the plate."""
    held = [Support(end, vector(0, 0)) for end in ("start", "end")]
    mesh = shapes.ring(2.95 * length, 3.05 * length, [40, 2], angle=60, start=60)
    body = make_body("arch", mesh, NeoHooke(*lame(1000.0, 0.3), 1.0), supports=held)
    points = np.array([[-3.0, 3.05], [3.0, 3.05]]) * length
    plate = Surface(
        "plate", points, np.array([[0, 1]]), "line", None, motion=lambda t: points - [0.0, 0.5 * length * t]
    )
    structure, _ = make_contact([body], [(("arch", "outer"), plate)], settings=SETTINGS)
    structure.initialise(0.0, step)
    t, failed = go_on(structure, 0.0, step, 1.0)
    assert t == pytest.approx(0.39, abs=0.01)
    assert f"no equilibrium beyond t = {t:.4g}" in str(failed)
    assert "use dynamics" in str(failed)
    require_advice(failed, FailureKind.LIMIT_POINT)


def test_growth_that_is_usual_is_no_limit():
    limit = LimitPoint()
    for k in range(10):
        limit.accept(float(k), 1.0 + 0.05 * k)
    assert limit.explain() == ""
    limit.accept(10.0, 2.9)
    assert "beyond t = 10:" in limit.explain()
