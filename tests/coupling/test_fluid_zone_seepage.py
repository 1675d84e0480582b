"""Fluid that passes through closed contact: seals in closed form, the tangent, what a case says."""

from __future__ import annotations

import numpy as np
import pytest
from fluid_setup import enclosed, field, loop, make_fluid, solve_steady
from petsc4py import PETSc
from programs import fsci
from test_coupled_run import MEETING, run

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from solvers.fluid.flow.balances import seepage
from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion
from solvers.fluid.terms.boundary.patches import Patch

KAPPA, MU, INSIDE, OUTSIDE = 1e-7, 0.5, 3.0, 1.0


def seal(points, facets, closed) -> ImmersedBody:
    """A body whose facets `closed` are in contact and let fluid through."""
    surface = ImmersedSurface("seal", facets, len(points), None, closed, 0.0, KAPPA, "seeping")
    return ImmersedBody(surface, lambda t: Motion(points, np.zeros_like(points)))


def plate() -> ImmersedBody:
    """Across a channel of unit height, 0.43 long, in contact with its floor."""
    low, high = [0.33, 0.0], [0.76, 1.0]
    x = np.linspace(low[0], high[0], 5)
    sides = [[high[0], 0.5], [high[0], 1.0], [low[0], 1.0], [low[0], 0.5]]
    points = np.concatenate([np.stack([x, 0.0 * x], axis=1), sides])
    return seal(points, loop(len(points)), np.arange(len(points)) < 4)


def tube(a: float, b: float, around: int = 32, across: int = 4) -> ImmersedBody:
    """A tube from the floor of a box of height 0.5 to its ceiling, in contact with the floor, radii a < b."""
    bottom = np.stack([np.linspace(a, b, across + 1), np.zeros(across + 1)], axis=1)
    profile = np.concatenate([bottom, [[b, 0.25], [b, 0.5], [a, 0.5], [a, 0.25]]])
    angles, count = 2.0 * np.pi * np.arange(around) / around, len(profile)
    r, z = profile.T
    points = np.stack([np.outer(np.cos(angles), r), np.outer(np.sin(angles), r), np.tile(z, (around, 1))], axis=2)
    i, j = np.meshgrid(np.arange(around), np.arange(count), indexing="ij")
    first, second = i * count + j, i * count + (j + 1) % count
    third, fourth = ((i + 1) % around * count + (j + 1) % count), (i + 1) % around * count + j
    facets = np.stack([np.stack([first, fourth, third], -1), np.stack([first, third, second], -1)], axis=2)
    closed = np.repeat((j < across).ravel(), 2)
    points, facets = points.reshape(-1, 3), facets.reshape(-1, 3)
    facets = facets if enclosed(points, facets) > 0.0 else facets[:, ::-1]
    return seal(points, facets, closed)


def channel():
    """The flow around the plate, pressure 3 on the left and 1 on the right."""
    patches = [
        Patch("left", ("x-",), "traction", field(INSIDE, 0)),
        Patch("right", ("x+",), "traction", field(-OUTSIDE, 0)),
        Patch("walls", ("y-", "y+"), "no_slip"),
    ]
    return make_fluid(uniform([0, 0], [1, 1], [12, 9]), patches, [plate()], mu=MU, scheme="steady", convection=False)


def test_seal_in_a_channel():
    """Flow rate kappa dp / (mu L), pressure linear, and all that passes is in the flow."""
    fluid = channel()
    solve_steady(fluid)
    expected = KAPPA / MU * (INSIDE - OUTSIDE) / 0.43
    assert seepage(fluid.system) == pytest.approx(expected, rel=5e-3)
    assert flow_rate(fluid)(["right"]) == pytest.approx(expected, rel=5e-3)
    assert flow_rate(fluid)(["left"]) == pytest.approx(-expected, rel=5e-3)
    zone = fluid.system.assemble_zone()
    x = fluid.cut.motion.x[zone.facets.vertices]
    below = x[:, 1] == 0.0
    linear = INSIDE + (OUTSIDE - INSIDE) * (x[below, 0] - 0.33) / 0.43
    assert zone.pressure(fluid.flow)[below] == pytest.approx(linear, rel=5e-3)


def test_annular_seal():
    """Leak 2 pi kappa dp / (mu ln(b / a)) and pressure p1 + (p2 - p1) ln(r / a) / ln(b / a), to 1 %."""
    a, b = 0.36, 0.77

    def near(x, t):
        return x[0] ** 2 + x[1] ** 2 < (0.5 * (a + b)) ** 2

    patches = [
        Patch("inside", ("z+",), "traction", field(0, 0, -INSIDE), near),
        Patch("outside", ("z+",), "traction", field(0, 0, -OUTSIDE), lambda x, t: ~near(x, t)),
        Patch("walls", ("x-", "x+", "y-", "y+", "z-"), "no_slip"),
    ]
    grid = uniform([-1, -1, 0], [1, 1, 0.5], [15, 15, 4])
    fluid = make_fluid(grid, patches, [tube(a, b)], mu=MU, scheme="steady", convection=False)
    solve_steady(fluid)
    expected = 2.0 * np.pi * KAPPA * (INSIDE - OUTSIDE) / (MU * np.log(b / a))
    assert seepage(fluid.system) == pytest.approx(expected, rel=0.01)
    assert flow_rate(fluid)(["outside"]) == pytest.approx(expected, rel=0.01)
    zone = fluid.system.assemble_zone()
    x = fluid.cut.motion.x[zone.facets.vertices]
    below = x[:, 2] == 0.0
    r = np.hypot(*x[below, :2].T)
    exact = INSIDE + (OUTSIDE - INSIDE) * np.log(r / a) / np.log(b / a)
    assert zone.pressure(fluid.flow)[below] == pytest.approx(exact, rel=0.01)


def test_tangent():
    """The rows are linear in the pressure: their matrix times a pressure, and no sum over all rows."""
    fluid = channel()
    terms, unknowns = fluid.system.assemble_seepage(), fluid.unknowns
    p, rows = np.zeros(len(fluid.flow)), np.zeros(len(fluid.flow))
    dofs = unknowns.pressure.dofs[:, 0]
    p[dofs] = np.random.default_rng(0).standard_normal(len(dofs))
    terms.add_rows(rows, p)
    empty = PETSc.Mat().createAIJ(len(p), comm=PETSc.COMM_SELF)
    empty.setUp()
    empty.assemble()
    x, y = empty.createVecs()
    x.array[:] = p
    terms.added_to(empty, unknowns).mult(x, y)
    assert np.abs(rows).max() > 0.1 * KAPPA / MU
    assert y.array == pytest.approx(rows, abs=1e-12 * np.abs(rows).max())
    assert abs(rows.sum()) < 1e-12 * np.abs(rows).max()


#: An elastic block between ceiling and floor of a channel, pressed on the floor by its weight.
SEALED = """
time: {step: 0.05, end: 0.2}
fluid:
  density: 1
  viscosity: 0.5
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 1], cells: [9, 8]}
  patches:
    left: {on: x-, traction: ["3*min(t/0.1, 1)", 0]}
    right: {on: x+, traction: [-1, 0]}
    walls: {on: [y-, y+], no_slip: true}
structure:
  dynamics: {rho_inf: 0}
  bodies:
    block:
      mesh: {shape: rectangle, size: [0.47, 1], cells: [3, 4], origin: [0.25, 0]}
      material: {law: st_venant_kirchhoff, E: 1e4, nu: 0.3, density: 1}
      supports: [{on: top, displacement: [0, 0]}]
      gravity: [0, -40]
contact:
  film: {transmissivity: 1e-7, zone: seeping}
  obstacles:
    floor: {mesh: {shape: rectangle, size: [2, 0.1], cells: [1, 1], origin: [-0.5, -0.1]}, on: top}
  pairs:
    floor: {slave: {body: block, on: bottom}, master: {obstacle: floor}}
coupling: {scheme: monolithic}
verify: [{value: fluid.seepage, reference: 8.5106e-07, relative: 0.01}]
"""


def test_elastic_seal(tmp_path):
    """Both schemes find the same, and at rest the closed form to 1 %."""
    one = run(SEALED, tmp_path / "monolithic")
    other = run(SEALED.replace("monolithic", "partitioned, tolerance: 1.0e-9"), tmp_path / "partitioned")
    for name in ("contact.floor.y", "fluid.seepage"):
        assert one[name] == pytest.approx(other[name], rel=1e-6)
    assert one["iterations"].max() <= 5
    assert one["fluid.seepage"][-1] == pytest.approx(1e-7 / 0.5 * 2.0 / 0.47, rel=0.01)
    assert np.abs(one["fluid.mass"]).max() < 1e-9


@pytest.mark.slow
def test_two_processes(tmp_path):
    one = run(SEALED, tmp_path)
    done = fsci("run", tmp_path, "-o", tmp_path / "two", processes=2)
    assert done.returncode == 0, done.stdout + done.stderr
    two = read_history(tmp_path / "two" / "history.csv")
    for name in ("contact.floor.y", "fluid.seepage"):
        assert two[name] == pytest.approx(one[name], rel=1e-7)


def test_a_zone_that_seeps_needs_a_layer(tmp_path):
    (tmp_path / "case.yaml").write_text(MEETING.replace("contact:\n", "contact:\n  film: {zone: seeping}\n", 1))
    with pytest.raises(CaseError) as caught:
        load_case(tmp_path / "case.yaml")
    message = "fluid seeps in a layer: give 'transmissivity' or 'roughness'"
    assert message in str(caught.value.problems[0])
