"""Nodes that fluid hardly reaches: they continue polynomials exactly, lose nothing, and no constant matters."""

from functools import partial

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, turned, wall

from fsci.bench import fluid as bench
from solvers.fluid.extension import WELL
from solvers.fluid.forms import Penalties
from solvers.fluid.grid import Grid
from solvers.fluid.system import FlowSettings


def around_a_disc(element, scheme="steady"):
    """A flow on cells of different sizes, cut by a disc that moves and by a turned block."""
    x = np.concatenate([np.linspace(0, 0.3, 7), [0.34, 0.4, 0.47, 0.55], np.linspace(0.6, 1, 6)])
    v = np.array([0.5, 0.2])
    disc = body("disc", circle((0.31, 0.42), 0.17, 40), loop(40), motion=lambda x, t: (x + t * v, 0 * x + v))
    points, facets = block([0.66, 0.6], [0.81, 0.83])
    return make_fluid(
        Grid((x, np.linspace(0, 1, 15))), [wall(field(0, 0))], [disc, body("block", turned(points, 0.3), facets)],
        element=element, scheme=scheme, dt=0.02,
    )  # fmt: skip


def local_values(fluid, polynomial):
    """A polynomial of (x, y) at all nodes of velocity and pressure, as owned dofs."""
    values = np.zeros(fluid.unknowns.owned)
    for nodes in (fluid.unknowns.velocity, fluid.unknowns.pressure):
        values[nodes.dofs] = polynomial(*nodes.points.T)[:, None]
    return values


@pytest.mark.parametrize("scheme", ["steady", "bdf2"])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_polynomials_are_continued_exactly(element, scheme):
    """Also on cells of different sizes: those of first degree, and of second degree by the velocity of q2q1."""
    fluid = around_a_disc(element, scheme)
    combinations = fluid.system.combinations
    dependent = combinations.dependent[: fluid.unknowns.owned]
    assert dependent.sum() > 20
    linear = local_values(fluid, lambda x, y: 1 + 2 * x - 3 * y + x * y)
    assert np.abs(combinations.distance(linear)).max() < 1e-12
    if element == "q2q1" and scheme == "steady":  # far into a body it is a straight line
        quadratic = local_values(fluid, lambda x, y: x * x - 2 * y * y + x * x * y)
        velocity = fluid.unknowns.velocity.dofs
        assert np.abs(combinations.distance(quadratic)[velocity]).max() < 1e-12
        assert np.abs(combinations.distance(quadratic)).max() > 1e-4  # a pressure of first degree


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_no_force_and_no_volume_is_lost(element):
    """A constant has no distance to its extension: the sum of all equations is that of the free unknowns."""
    fluid = around_a_disc(element, "bdf2")
    combinations = fluid.system.combinations
    dependent = combinations.dependent[: fluid.unknowns.owned]
    assert combinations.values((~dependent).astype(float)) == pytest.approx(np.ones(len(dependent)), abs=1e-13)
    rows = np.random.default_rng(2).normal(size=len(dependent))
    assert combinations.collect(rows)[~dependent].sum() == pytest.approx(rows.sum(), rel=1e-12)


def test_nodes_of_well_cut_cells_are_free():
    """And those of no other cell are; where no fluid is, a node is what the extension says."""
    fluid = around_a_disc("q2q1", "bdf2")
    cut, unknowns, combinations = fluid.cut, fluid.unknowns, fluid.system.combinations
    share = cut.share[fluid.grid.numbers]
    largest = np.zeros(unknowns.local)
    for cells in (cut.uncut, cut.cut, cut.strip):
        np.maximum.at(largest, unknowns.cell_velocity[cells], share[cells, None, None])
    dofs = unknowns.velocity.dofs
    asked = fluid.system.active_dofs[dofs] & ~np.isin(dofs, fluid.boundary.dofs)
    assert np.array_equal(combinations.dependent[dofs][asked], (largest[dofs] < WELL)[asked])
    assert np.array_equal(combinations.eliminated[dofs][asked], (largest[dofs] == 0.0)[asked])


def test_no_constant_matters(monkeypatch):
    """The drag of 2D-1 moves by less than 0.05 % while the penalty grows by five orders of magnitude."""
    drags = []
    for factor in (0.1, 1.0, 1e4):
        settings = partial(FlowSettings, penalties=Penalties(extension=factor))
        monkeypatch.setattr(bench, "FlowSettings", settings)
        drags.append(bench.steady("q2q1", 10)["c_D error [%]"])
    assert np.ptp(drags) < 0.05
