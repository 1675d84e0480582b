"""The tangent is the derivative of the residual, all terms and schemes, while the stabilisation's scales are held."""

from itertools import pairwise

import numpy as np
import pytest
from fluid_setup import around_moving_body, field, make_fluid, moving_body, step, wall

from solvers.fluid.terms import cell_forms
from solvers.fluid.terms.boundary.patches import Patch


def channel(dim, element, scheme, convection):
    """Every kind of patch, a moving body, and a flow without any symmetry."""
    inflow = [lambda x, y, *zt: 1.0 + x + 0.3 * y, 0.1, 0.2][:dim]
    sides = ("y-", "y+", "z-", "z+")[: 2 * dim - 2]
    patches = [
        Patch("in", ("x-",), "velocity", field(*inflow)),
        Patch("out", ("x+",), "outflow"),
        Patch("pulled", sides[:1], "traction", field(*[0.3, -0.2, 0.1][:dim])),
        Patch("slip", sides[1:], "slip"),
    ]
    return make_fluid(
        around_moving_body(dim), patches, [moving_body(dim)],
        rho=1.2, mu=0.03, element=element, scheme=scheme, convection=convection, dt=0.05,
        body_force=field(*[1, -2, 0.5][:dim]),
    )  # fmt: skip


CASES = [(2, e, s, True) for e in ("q1q1", "q2q1") for s in ("steady", "backward_euler", "bdf2")] + [
    (2, "q1q1", "bdf2", False),
    (3, "q1q1", "bdf2", True),
]


def at_random_state(case):
    """A system in its second step at a random flow, and a generator of random numbers."""
    rng = np.random.default_rng(5)
    fluid = channel(*case)
    if case[2] != "steady":
        step(fluid, 0.0, 0.05)
    fluid.begin_step(0.05, 0.05)
    fluid.flow[:] = rng.normal(size=len(fluid.flow)) * fluid.system.active_dofs
    velocity = fluid.velocity()
    fluid.system.set_scales(velocity)
    return fluid, rng


@pytest.mark.parametrize("case", CASES)
def test_tangent_is_the_derivative(case):
    fluid, rng = at_random_state(case)
    system, state = fluid.system, fluid.flow.copy()
    nothing = np.zeros(fluid.unknowns.owned, dtype=bool)
    tangent = system.tangent(nothing, picard=False)
    for _ in range(3):
        direction = rng.normal(size=len(state)) * system.active_dofs
        x, y = tangent.createVecs()
        x.array[:] = direction
        tangent.mult(x, y)
        size = 1e-5
        found = []
        for sign in (1, -1):
            fluid.flow[:] = state + sign * size * direction
            found.append(system.residual())
        fluid.flow[:] = state
        difference = (found[0] - found[1]) / (2 * size)
        assert np.abs(y.array - difference).max() < 1e-6 * np.abs(difference).max()


@pytest.mark.parametrize("case", [c for c in CASES if c[3]])
def test_picard_is_exact_where_the_flow_carries_itself(case):
    """With a = u the residual is affine in u: r(u) = A u + r(0)."""
    fluid, _ = at_random_state(case)
    system, state = fluid.system, fluid.flow.copy()
    tangent = system.tangent(np.zeros(fluid.unknowns.owned, dtype=bool), picard=True)
    x, y = tangent.createVecs()
    x.array[:] = state
    tangent.mult(x, y)
    residual = system.residual()
    fluid.flow[:] = 0.0
    assert np.abs(residual - y.array - system.residual()).max() < 1e-11 * np.abs(residual).max()


def test_newton_converges_quadratically():
    """Scales fixed within a time step: the last residuals fall at second order."""
    fluid = channel(2, "q1q1", "bdf2", True)
    step(fluid, 0.0, 0.05)
    fluid.begin_step(0.05, 0.05)
    info = fluid.solve()
    r = np.array(info.residuals) / max(info.residuals)
    assert info.iterations <= 4
    assert all(b < 30 * a**2 or b < 1e-12 for a, b in pairwise(r[1:])), r


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_a_body_force_needs_no_other_tangent(element, monkeypatch):
    """Forms of tangents are the same with and without one, so that they are compiled once; residuals differ."""
    made = []
    for body_force in (None, field(1, -2)):
        fluid = make_fluid(
            around_moving_body(2), [wall(field(1, 0))], [moving_body(2)], element=element, scheme="bdf2",
            body_force=body_force,
        )  # fmt: skip
        with monkeypatch.context() as patch:
            patch.setattr(cell_forms.fem, "Integral", lambda domain, form: form)
            made.append(
                cell_forms.cell_forms(fluid.unknowns, fluid.system.terms, fluid.system.flow, fluid.system.weights)
            )
    without, with_force = made
    assert len(without.tangents) == 3
    assert [form.signature() for form in without.tangents] == [form.signature() for form in with_force.tangents]
    assert without.residuals[0].signature() != with_force.residuals[0].signature()
