"""A piston in a channel: u = (v, 0), p = -rho a (x - x_0), with the velocity and acceleration of the time scheme."""

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, nodal_errors, step

from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

RHO, MU, LEFT, START, DT = 1.0, 0.1, -0.5, 0.1, 0.1


def way(t):
    """Displacement [m] of the piston."""
    return -(t**3)


def velocity(number, dt):
    """Of the first-order coupling: (d_n - d_{n-1}) / dt; at rest before the start."""
    return (way(number * dt) - way((number - 1) * dt)) / dt if number > 0 else 0.0


def acceleration(scheme, number, dt):
    v = [velocity(n, dt) for n in (number, number - 1, number - 2)]
    if scheme == "backward_euler" or number <= 2:
        return (v[0] - v[1]) / dt
    return (1.5 * v[0] - 2.0 * v[1] + 0.5 * v[2]) / dt


def piston(dim, scheme, element, dt=DT):
    points, facets = block([START, -1, -1][:dim], [2, 1, 1][:dim])
    first = np.eye(dim)[0]

    def motion(points, t):
        number = round(t / dt)
        return points + way(t) * first, 0 * points + velocity(number, dt) * first

    patches = [
        Patch("inlet", ("x-",), "traction", field(*[0] * dim)),
        Patch("sides", ("y-", "y+", "z-", "z+")[: 2 * dim - 2], "slip"),
        Patch("behind", ("x+",), "no_slip"),
    ]
    low, high = [LEFT, -0.05, -0.05], [0.5, 0.05, 0.05]
    grid = uniform(low[:dim], high[:dim], [10, 3, 3][:dim])
    return make_fluid(
        grid, patches, [body("piston", points, facets, motion=motion)], rho=RHO, mu=MU, scheme=scheme, element=element,
        dt=dt,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("dim", "element", "scheme"),
    [(2, e, s) for e in ("q1q1", "q2q1") for s in ("backward_euler", "bdf2")] + [(3, "q1q1", "backward_euler")],
)
def test_piston(dim, element, scheme):
    fluid = piston(dim, scheme, element)
    for number in range(1, 5 if dim == 2 else 3):
        step(fluid, (number - 1) * DT, DT)
        v, a = velocity(number, DT), acceleration(scheme, number, DT)
        u, p = nodal_errors(fluid, field(v, *[0] * (dim - 1)), lambda x, t, a=a: -RHO * a * (x[0] - LEFT), 0.0)
        assert max(u, p) < 1e-8
        force = fluid.force()["piston"].sum(axis=0)
        column = START + way(number * DT) - LEFT
        assert force[0] == pytest.approx(-RHO * a * column * 0.1 ** (dim - 1), abs=1e-8)
        assert np.abs(force[1:]).max() < 1e-8
        if scheme == "backward_euler" and number == 4:
            assert v == pytest.approx(-0.37)
            assert RHO * -a * 0.6 == pytest.approx(1.08)


def test_volume_that_the_piston_displaces():
    """The flow through the inlet is the velocity times the area: no fluid is lost where the cut passes."""
    from solvers.fluid.flow.conservation.regions import RegionsOfCut
    from solvers.fluid.flow.conservation.volume_balance import VolumeBalance
    from solvers.fluid.flow.probes import on_patch

    fluid = piston(2, "bdf2", "q1q1")
    rate, balance = on_patch(fluid, "flow_rate", "inlet"), VolumeBalance(fluid, RegionsOfCut(fluid)).numbers
    for number in range(1, 5):
        step(fluid, (number - 1) * DT, DT)
        assert rate()[""] == pytest.approx(-velocity(number, DT) * 0.1, abs=1e-10)
        assert balance()["fluid.mass"] == pytest.approx(0.0, abs=1e-12)
