"""Stokes flow through square arrays of cylinders and simple cubic arrays of spheres, an eighth of one cell of them.

References: Sangani, Acrivos, Int. J. Multiphase Flow 8 (1982) 193-206; Zick, Homsy, J. Fluid Mech. 115 (1982) 13-26.
"""

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, solve_steady, sphere

from solvers import fem
from solvers.fluid.flow.probes import on_patch
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

#: F / (mu U) per length of a cylinder, and F / (6 pi mu a U) of a sphere, U the mean velocity of the whole cell
CYLINDERS = {0.05: 15.56, 0.1: 24.83, 0.2: 51.53, 0.3: 102.90, 0.5: 532.55}
SPHERES = {0.027: 2.008, 0.064: 2.810, 0.216: 7.442}


def radius(dim, concentration):
    return np.sqrt(concentration / np.pi) if dim == 2 else np.cbrt(3 * concentration / (4 * np.pi))


def resistance(dim, concentration, cells, element="q1q1"):
    """The dimensionless resistance above, with `cells` along half of the array's period, which has the length 1.

    By symmetry the flow crosses the ends at a right angle, and the pressure there is uniform: 1/2 upstream, 0 in the
    middle of the grain. So the force is known, and the flow rate is what is computed.
    """
    a = radius(dim, concentration)
    points, facets = (circle((0, 0), a, 800), loop(800)) if dim == 2 else sphere((0, 0, 0), a, 5)
    rest = [0] * (dim - 1)
    patches = [
        Patch("in", ("x-",), "traction", field(0.5, *rest)),
        Patch("middle", ("x+",), "traction", field(0, *rest)),
        Patch("sides", ("y-", "y+", "z-", "z+")[: 2 * dim - 2], "slip"),
    ]
    grain = body("grain", points, facets)
    fluid = make_fluid(
        uniform([-0.5, *rest], [0.0, *[0.5] * (dim - 1)], [cells] * dim), patches, [grain], mu=1.0, element=element,
        scheme="steady", convection=False, solver=SolverSettings(Tolerance(1e-8), linear_tolerance=1e-10),
    )  # fmt: skip
    hold_tangential(fluid, (0, 1))
    info = solve_steady(fluid)
    share = 2 ** (dim - 1)
    rate = share * -on_patch(fluid, "flow_rate", "in")()[""]
    force = 2 * share * fluid.force()["grain"].sum(axis=0)[0]
    assert force == pytest.approx(1.0, rel=1e-6)
    iterations = fluid.iterate.linear_iterations
    return 1.0 / (rate if dim == 2 else 6 * np.pi * a * rate), fluid.dofs(), (info.iterations, iterations)


def hold_tangential(fluid, numbers):
    """The flow crosses these patches at a right angle."""
    boundary, sides = fluid.parts.boundary, 2
    for number in numbers:
        for axis in range(1, fluid.dim):
            dofs = fem.facet_dofs(fluid.unknowns.space, axis, np.sort(boundary.facets[number]))
            boundary.imposed[dofs] = sides
    boundary.dofs = np.flatnonzero(boundary.imposed >= 0)
    fluid.move({})


@pytest.mark.parametrize("concentration", [0.05, 0.1, 0.2, 0.3])
@pytest.mark.parametrize(("element", "cells"), [("q1q1", 40), ("q2q1", 16)])
def test_cylinders(concentration, element, cells):
    found = resistance(2, concentration, cells, element)[0]
    assert found == pytest.approx(CYLINDERS[concentration], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("concentration", [0.064, 0.216])
def test_spheres(concentration):
    found = resistance(3, concentration, 20)[0]
    assert found == pytest.approx(SPHERES[concentration], rel=0.01)
