"""Backflow at outlets: a vortex leaves without energy from outside, and where nothing flows back nothing changes."""

import numpy as np
import pytest
from fluid_setup import field, make_fluid, step

from solvers.api import StepFailed
from solvers.fluid.flow.probes import of_fluid
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patch_kinds import PatchKind
from solvers.fluid.terms.boundary.patches import Patch
from solvers.fluid.terms.boundary.windkessel import Windkessel

SPEED, RADIUS = 1.0, 0.15


def _plain(flow, u, value, n, v):
    """The outflow without the term of backflow."""
    import ufl

    return -flow.mu * ufl.dot(ufl.dot(n, ufl.grad(u)), v)


WITHOUT = PatchKind(open=True, form=_plain, depends_on_flow=True)


def with_vortex(kind, swirl, element="q1q1", law=None):
    """A uniform flow with a vortex of the stream function swirl R exp(-r^2 / (2 R^2)) that it carries to x+."""

    def bell(x, y):
        return swirl / RADIUS * np.exp(-((x - 1.4) ** 2 + (y - 0.5) ** 2) / (2.0 * RADIUS**2))

    velocity = field(lambda x, y, t: SPEED - (y - 0.5) * bell(x, y), lambda x, y, t: (x - 1.4) * bell(x, y))
    patches = [
        Patch("in", ("x-",), "velocity", field(SPEED, 0.0)),
        Patch("walls", ("y-", "y+"), "slip"),
        Patch("out", ("x+",), kind, outlet=law),
    ]
    return make_fluid(
        uniform([0, 0], [2, 1], [40, 20]), patches, mu=1e-4, element=element, dt=0.02, initial_velocity=velocity
    )


def energies(fluid, steps):
    """Kinetic energy of the whole box after each step, over that of the uniform flow."""
    measure, found = of_fluid(fluid, "kinetic_energy"), []
    for number in range(steps):
        step(fluid, 0.02 * number, 0.02)
        found.append(measure()[""])
    return np.array(found)


@pytest.mark.parametrize(
    ("kind", "law"), [("outflow", None), pytest.param("resistance", Windkessel(3.0), marks=pytest.mark.slow)]
)
def test_a_vortex_leaves(kind, law):
    """It turns four times as fast as the flow that carries it: the outlet sees backflow. Nothing remains."""
    fluid = with_vortex(kind, 4.0, law=law)
    found = energies(fluid, 70)
    assert np.diff(found).max() < 0.0
    assert found[0] > 1.5
    assert found[-1] == pytest.approx(1.0, abs=1e-3)


def test_without_the_term_energy_comes_in_until_nothing_converges():
    with pytest.raises(StepFailed):
        energies(with_vortex(WITHOUT, 4.0), 70)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_nothing_changes_where_nothing_flows_back(element):
    with_term, without = (with_vortex(kind, 0.5, element) for kind in ("outflow", WITHOUT))
    for fluid in (with_term, without):
        energies(fluid, 3)
    assert np.abs(with_term.flow - without.flow).max() < 1e-12
