"""Bodies that touch and part: fluid enters between them, wherever their common side lies in the grid."""

import numpy as np
import pytest
from fluid_setup import block, body, make_fluid, step
from programs import fsci

from fsci.running.history import read_history
from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch


def brick(low, high):
    """A box in space as triangles, with the normal outwards."""
    corners = np.array([[x, y, z] for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])])
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def parting(dim, element, seat, cells):
    """Two blocks of five cells' width that touch at y = seat; after two steps the upper one rises by 0.3 cells each."""
    rise = 0.3 / cells

    def upper(x, t):
        moves = float(t > 0.25)
        return x + moves * np.eye(dim)[1] * rise * (t - 0.2) / 0.1, 0.0 * x + moves * np.eye(dim)[1] * rise / 0.1

    make = block if dim == 2 else brick
    ends = [([0.77, -0.3, -0.1], [1.27, seat, 1.1]), ([0.77, seat, -0.1], [1.27, 1.6, 1.1])]
    below, above = (make(low[:dim], high[:dim]) for low, high in ends)
    patches = [
        Patch("in", ("x-",), "pressure", (0.1,)),
        Patch("out", ("x+",), "outflow"),
        Patch("walls", ("y-", "y+", "z-", "z+")[: 2 * dim - 2], "slip"),
    ]
    grid = uniform([0] * dim, [2, 1, 1][:dim], [2 * cells, cells, 3][:dim])
    fluid = make_fluid(
        grid, patches, [body("lower", *below), body("upper", *above, motion=upper)], mu=0.05, dt=0.1, element=element,
        scheme="backward_euler",
    )  # fmt: skip
    for number in range(4):
        step(fluid, 0.1 * number, 0.1)
    rate = flow_rate(fluid)
    return rate(["in"]), rate(["out"])


SEATS = (0.5, 0.5 + 1.0 / 30, 0.4, 0.45)


@pytest.mark.parametrize(
    ("dim", "element", "seat"),
    [
        *((2, element, seat) for element in ("q1q1", "q2q1") for seat in SEATS),
        (3, "q1q1", SEATS[1]),
        *(pytest.param(3, "q1q1", seat, marks=pytest.mark.slow) for seat in SEATS if seat != SEATS[1]),
    ],
)
def test_blocks_part(dim, element, seat):
    """In a plane of the grid, a third of a cell above it, in another plane, in the middle of a cell."""
    into, out = parting(dim, element, seat, 10)
    assert into < 0.0
    assert into + out == pytest.approx(-0.5 * 0.3 / 10 / 0.1, abs=1e-6)  # what the upper one leaves


VALVE = """\
time: {{step: 0.02, end: 0.1}}
fluid:
  density: 1
  viscosity: 0.02
  element: q1q1
  scheme: backward_euler
  grid: {{from: [0, 0], to: [2, 1], cells: {cells}}}
  patches:
    inlet: {{on: x-, pressure: "ramp(t, 0, 0.1)"}}
    outlet: {{on: x+, outflow: true}}
    walls: {{on: [y-, y+], no_slip: true}}
  bodies:
    lower:
      mesh: {{shape: rectangle, size: [0.2, 0.8], cells: [2, 8], origin: [0.9, -0.3]}}
      motion: {{displacement: [0, "-0.2*max(t - 0.04, 0)"]}}
    upper:
      mesh: {{shape: rectangle, size: [0.2, 0.8], cells: [2, 8], origin: [0.9, 0.5]}}
      motion: {{displacement: [0, "0.2*max(t - 0.04, 0)"]}}
probes:
  q: {{quantity: flow_rate, through: outlet}}
"""


def test_a_seat_of_any_width_opens(tmp_path):
    """Of three and of six cells."""
    rates = []
    for number, cells in enumerate(("[30, 20]", "[60, 40]")):
        (tmp_path / "case.yaml").write_text(VALVE.format(cells=cells))
        done = fsci("run", tmp_path, "-o", tmp_path / str(number))
        assert done.returncode == 0, done.stdout + done.stderr
        rates.append(read_history(tmp_path / str(number) / "history.csv")["q"][-1])
    assert rates[0] == pytest.approx(rates[1], rel=0.15)
