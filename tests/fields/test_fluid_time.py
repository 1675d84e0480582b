"""Orders in time with a moving body, for flows that are linear in space: the error is that of the time scheme alone."""

import numpy as np
import pytest
from fluid_setup import body, circle, errors, field, loop, make_fluid, nodal_errors, step, symbolic, wall

from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

RHO, MU, END = 1.3, 0.05, 0.8


def flow():
    import sympy

    x, y, t = sympy.symbols("x y t")
    velocity = [sympy.sin(3 * t) * y + sympy.cos(2 * t), sympy.sin(2 * t) * x - sympy.cos(3 * t)]
    return symbolic(velocity, sympy.cos(4 * t) * (x - 2 * y), (x, y, t), rho=RHO, mu=MU, steady=False)


def error(scheme, element, steps, moving=True):
    """L2 errors of velocity and pressure at the end; a disc crosses the box and carries the exact velocity."""
    u, gradient, p, force = flow()
    velocity, dt = field(*u), END / steps

    def motion(points, t):
        now = points + moving * np.array([0.25 * np.sin(2 * t), 0.1 * t])
        return now, np.stack([c(now.T, t) for c in velocity], axis=1)

    disc = body("disc", circle((-0.11, 0.02), 0.19, 40), loop(40), motion=motion)
    fluid = make_fluid(
        uniform([-0.5, -0.5], [0.5, 0.5], [10, 10]), [wall(velocity)], [disc], rho=RHO, mu=MU, element=element,
        scheme=scheme, body_force=field(*force), initial_velocity=velocity, dt=dt,
    )  # fmt: skip
    for number in range(steps):
        step(fluid, number * dt, dt)
    return errors(fluid, u, gradient, p, END)[[0, 2]]


@pytest.mark.parametrize(
    ("element", "scheme", "order"),
    [
        ("q1q1", "backward_euler", 1),
        ("q1q1", "bdf2", 2),
        ("q1q1", "bdf2_optimized", 2),
        pytest.param("q2q1", "backward_euler", 1, marks=pytest.mark.slow),
        pytest.param("q2q1", "bdf2", 2, marks=pytest.mark.slow),
        pytest.param("q2q1", "bdf2_optimized", 2, marks=pytest.mark.slow),
    ],
)
def test_order_in_time(element, scheme, order):
    found = np.array([error(scheme, element, steps) for steps in (32, 64)])
    rates = np.log2(found[0] / found[1])
    assert rates.min() > order - 0.15, (found, rates)


@pytest.mark.slow
def test_error_of_the_optimized_scheme():
    """About half of that of BDF2."""
    two, both = (error(scheme, "q2q1", 64)[0] for scheme in ("bdf2", "bdf2_optimized"))
    assert both < 0.65 * two


@pytest.mark.parametrize("scheme", ["backward_euler", "bdf2"])
def test_flow_that_starts_at_once(scheme):
    """All of the water moves from the first step on: one blow p = rho (L - x) v / dt, and no pressure afterwards."""
    v, dt, rho = 0.7, 0.1, RHO
    patches = [
        Patch("in", ("x-",), "velocity", field(v, 0)), Patch("sides", ("y-", "y+"), "slip"),
        Patch("out", ("x+",), "traction", field(0, 0)),
    ]  # fmt: skip
    fluid = make_fluid(uniform([0, 0], [1, 1], [4, 3]), patches, rho=rho, mu=MU, scheme=scheme, dt=dt)
    for number in range(5):
        step(fluid, number * dt, dt)
        blow = rho * v / dt if number == 0 else 0.0
        u, p = nodal_errors(fluid, field(v, 0), lambda x, t, blow=blow: blow * (1.0 - x[0]), 0.0)
        assert max(u, p) < 1e-10
