"""When a monolithic step keeps the displacements and velocities that are extrapolated to its end."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupling.coupled import Coupled
from coupling.monolithic import Monolithic
from coupling.secant import Secant


class Part:
    """Counts what is asked of it."""

    def __init__(self, contact, films):
        self.in_contact, self.has_films = (lambda: contact), (lambda: films)
        self.calls = []

    def predict(self, *_, **__):
        self.calls.append("predict")

    def retreat(self, fraction):
        self.calls += fraction.tolist()


@pytest.mark.parametrize("residual", [0.5, 2.0, float("nan")])
@pytest.mark.parametrize(("contact", "films"), [(True, True), (True, False), (False, True)])
def test_predictors_that_increase_the_residual_in_a_film_in_contact(contact, films, residual):
    """They are taken back there, and kept everywhere else."""
    flow, solid = Part(contact, films), Part(contact, films)
    coupled = Coupled.__new__(Coupled)
    coupled.flow, coupled.solid = flow, solid
    scheme = Monolithic.__new__(Monolithic)
    residuals = iter([np.array([1.0, 1.0]), np.array([residual, 0.5])])
    scheme.coupled, scheme.residual, scheme._secant = coupled, lambda: next(residuals), Secant()
    scheme.follow = lambda: None
    scheme._predict(0.5)
    back = contact and films and not residual < 1.0
    assert flow.calls == solid.calls == (["predict", 1.0] if back else ["predict"])


def test_predictors_are_taken_back_to_the_start_of_the_step():
    """Displacements and velocities of a real scheme are those of before."""
    from test_fsci_rebound import DT, start

    scheme = start().scheme
    for step in range(3):
        scheme.step(step * DT, DT)
    coupled = scheme.coupled
    coupled.begin_step(3 * DT, DT)
    scheme.follow()
    scheme.residual()
    before = SimpleNamespace(u=coupled.solid.structure.now.u.copy(), flow=coupled.flow.flow.copy())
    coupled.predict(4 * DT)
    assert abs(coupled.solid.structure.now.u - before.u).max() > 1e-3
    assert abs(coupled.flow.flow - before.flow).max() > 1e-3
    scheme.follow()
    scheme.residual()
    scheme.retreat(np.ones(2))
    assert coupled.solid.structure.now.u == pytest.approx(before.u, abs=1e-14)
    assert coupled.flow.flow == pytest.approx(before.flow, abs=1e-12)


def test_predictors_out_of_reach_are_dropped(monkeypatch):
    """The step is then that from the state before it, at its full length."""
    from test_fsci_rebound import DT, start

    found = []
    for far in (0.0, 1.0):
        scheme = start().scheme
        for step in range(3):
            scheme.step(step * DT, DT)

        def predict(_, coupled=scheme.coupled, far=far, **__):
            coupled.solid.structure.now.u += far

        monkeypatch.setattr(scheme.coupled, "predict", predict)
        scheme.step(3 * DT, DT)
        found.append(scheme.coupled.solid.structure.now.u.copy())
    assert found[1] == pytest.approx(found[0], abs=1e-13)
