"""Patches that meet: each lets in the integral of its velocity, in any order."""

from itertools import permutations

import numpy as np
import pytest
from fluid_setup import field, make_fluid, step
from programs import on_processes

from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined
from solvers.fluid.terms.boundary.patches import Patch

OUT = Patch("out", ("x+",), "outflow")


def rates(dim, patches, element="q1q1", grid=None):
    """Flow rates through all patches after a step."""
    grid = grid or uniform([0] * dim, [2, 1, 1][:dim], [4, 10, 5][:dim])
    fluid = make_fluid(grid, patches, mu=0.1, dt=0.1, element=element)
    step(fluid, 0.0, 0.1)
    rate = flow_rate(fluid)
    return {patch.name: rate([patch.name]) for patch in patches}, fluid


def slot(dim, value=1.0, low=0.2, high=0.5):
    """An inlet on a part of a face; its edges are planes of the grid."""
    velocity = field(*[value, 0.0, 0.0][:dim])
    where = lambda x, t: np.minimum(x[1] - low, high - x[1])  # noqa: E731
    return Patch("slot", ("x-",), "velocity", velocity, where=where)


@pytest.mark.parametrize("kind", ["no_slip", "slip"])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("dim", [2, 3])
def test_slot_in_a_wall(dim, element, kind):
    sides = ("y-", "y+", "z-", "z+")[: 2 * dim - 2]
    found, _ = rates(dim, [Patch("wall", ("x-", *sides), kind), slot(dim), OUT], element)
    assert found == pytest.approx({"wall": 0.0, "slot": -0.3, "out": 0.3}, abs=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_inlet_between_walls(dim):
    """A uniform inflow on a whole face: walls of other faces take nothing of it."""
    sides = ("y-", "y+", "z-", "z+")[: 2 * dim - 2]
    inlet = Patch("in", ("x-",), "velocity", field(*[1.0, 0.0, 0.0][:dim]))
    for order in permutations([inlet, Patch("walls", sides, "no_slip"), OUT]):
        assert rates(dim, order)[0] == pytest.approx({"in": -1.0, "walls": 0.0, "out": 1.0}, abs=1e-9)


def test_two_inlets_in_any_order():
    """Without a wall between them; the order changes no bit of the normal velocity."""
    lower, upper = slot(2, 3.0), slot(2, -1.0, 0.5, 0.7)
    upper = Patch("upper", upper.faces, upper.kind, upper.value, upper.where)
    walls = Patch("walls", ("y-", "y+"), "slip")
    wall = Patch("wall", ("x-",), "no_slip")
    flows = []
    for order in permutations([lower, upper, OUT]):
        found, fluid = rates(2, [wall, walls, *order])
        assert found["slot"] == pytest.approx(-0.9, abs=1e-12)
        assert found["upper"] == pytest.approx(0.2, abs=1e-12)
        assert found["out"] == pytest.approx(0.7, abs=1e-9)
        flows.append(fluid.velocity())
    assert all(np.array_equal(flow, flows[0]) for flow in flows)


def test_a_lid_lets_nothing_through_the_walls():
    lid = Patch("lid", ("y+",), "velocity", field(1.0, 0.0))
    for order in permutations([lid, Patch("left", ("x-",), "no_slip"), Patch("rest", ("x+", "y-"), "no_slip")]):
        found, fluid = rates(2, order)
        assert found == {"lid": 0.0, "left": 0.0, "rest": 0.0}
        assert fluid.velocity().max() == 1.0


def test_an_open_patch_beside_an_inlet():
    """What the inlet lets in does not depend on what leaves beside it."""
    beside = Patch("beside", ("x-",), "traction", field(0.0, 0.0), where=lambda x, t: x[1] - 0.5)
    inlet = Patch("in", ("x-",), "velocity", field(1.0, 0.0), where=lambda x, t: 0.5 - x[1])
    for order in permutations([beside, inlet]):
        found, _ = rates(2, [*order, Patch("walls", ("y-", "y+"), "slip"), OUT])
        assert found["in"] == pytest.approx(-0.5, abs=1e-9)
        assert sum(found.values()) == pytest.approx(0.0, abs=1e-9)


def check():
    """Unequal cells and hanging nodes at the edge of the slot; on several processes."""
    grid = refined(uniform([0, 0, 0], [2, 1, 1], [4, 5, 5]), [RefinedBox([0, 0.4, 0], [1, 1, 0.6], 1)])
    walls = Patch("walls", ("x-", "y-", "y+", "z-", "z+"), "no_slip")
    for element in ("q1q1", "q2q1"):
        found, _ = rates(3, [walls, slot(3, low=0.2, high=0.5), OUT], element, grid)
        # faces of cells belong to the slot by their middle: coarse ones up to 0.4, and 0.1 x 0.6 of fine ones
        assert found == pytest.approx({"walls": 0.0, "slot": -0.26, "out": 0.26}, abs=1e-8)


def test_edges_between_unequal_cells():
    check()


@pytest.mark.slow
def test_two_processes():
    on_processes(2, __file__)


if __name__ == "__main__":
    check()
