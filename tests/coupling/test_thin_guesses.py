"""Thin elastic bodies that touch and part: the solution of a step does not depend on where its iterates were."""

import numpy as np
import pytest
from mpi4py import MPI
from test_thin_contact import CASE

from coupling.coupled import Coupled
from fsci.builder.build import build
from fsci.case import load_case
from solvers.fluid.flow.field import Fluid
from solvers.timing import Timer

#: 10 times Newton's tolerance, of the displacements and the flow rate
SAME = 1e-7


def from_two_guesses(folder, text, first, last, monkeypatch):
    """Take steps; from `first` on each without its predictor, and with it, although contact is closed.

    Returns for each of these the difference of displacements, that of the flow rate, and the facets in contact.
    """
    (folder / "case.yaml").write_text(text)
    case = load_case(folder)
    simulation = build(case, MPI.COMM_SELF, Timer())
    scheme, dt = simulation.scheme, case.time.step
    simulation.initialise(0.0, dt)
    interface, found = scheme.coupled.interface, []
    for number in range(last):
        before, ends = scheme.save(), []
        for predicted in (False, True)[number < first :]:
            scheme.restore(before)
            with monkeypatch.context() as patch:
                if predicted:
                    patch.setattr(Fluid, "has_films", lambda self: False)
                else:
                    patch.setattr(Coupled, "predict", lambda self, t, *, with_pressure=False: None)
                info = scheme.step(number * dt, dt)
            ends.append((interface.displacement().copy(), simulation.probes()["flow"], info.numbers["contact.active"]))
        if number >= first:
            (x, one, _), (y, other, active) = ends
            of_flow = abs(one - other) / abs(other)
            found.append((np.abs(x - y).max() / np.abs(y).max(), of_flow, active))
    return np.array(found).T


@pytest.mark.slow
def test_flaps_in_2d(tmp_path, monkeypatch):
    """First contact, and the two steps after it, in which flaps that have bounced touch and part in the iterates."""
    text = CASE.format(back=1.6, E=1e5, upper=1e7, end=3.5)
    moved, flow, active = from_two_guesses(tmp_path, text, 12, 17, monkeypatch)
    assert active.min() == 0 < active.max()
    assert moved.max() < SAME
    assert flow.max() < SAME
