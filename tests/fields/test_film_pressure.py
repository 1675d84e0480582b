"""The pressure that films make elsewhere: a plug that squeezes fluid through the gaps beside it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from fluid_setup import field, make_fluid, solve_steady
from mpi4py import MPI
from programs import on_processes

from fsci.bench.studies import graded
from fsci.resolution.words import resolved
from solvers.fluid.flow.resolution.measure import measure
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.surfaces.immersed import rigid_body
from solvers.fluid.terms.boundary.patches import Patch

#: Height of the gaps, by that of the channel.
GAP = 0.016
#: Force on the plug by q2q1 in four cells of 0.004 across each gap; 7390.2 with two and 7389.9 with six. Lubrication
#: without the resistance of the ends gives 7092.
FORCE = 7390.2


def plug(
    element: str,
    grid: Grid,
    *,
    parts: int = 1,
    scale: float = 1.0,
    shut: bool = True,
    gap: float = GAP,
    end: float = 1.237,
    level: float = 0.0,
    inertia=False,
    comm=MPI.COMM_SELF,
):
    """A rectangle that moves into the end of a channel; each of its sides has some facets. level: of the pressure."""
    corner = np.array([[0.737, gap], [end, gap], [end, 1.0 - gap], [0.737, 1.0 - gap]]) * scale
    t = np.arange(parts)[:, None] / parts
    points = np.concatenate([a + t * (b - a) for a, b in zip(corner, np.roll(corner, -1, axis=0), strict=True)])
    count = np.arange(len(points))
    velocity = np.tile([-0.01, 0.0], (len(points), 1)) * scale
    body = rigid_body(
        "plug", points, np.stack([count, np.roll(count, -1)], axis=1), lambda t: (points + (t - 1) * velocity, velocity)
    )
    walls = ("x-", "y-", "y+") if shut else ("y-", "y+")
    patches = [
        Patch("open", tuple({"x-", "x+"} - set(walls)), "traction", field(-level, 0)),
        Patch("walls", walls, "no_slip"),
    ]
    fluid = make_fluid(grid, patches, [body], element=element, scheme="steady", convection=inertia, comm=comm)
    solve_steady(fluid)
    return fluid


def said(fluid) -> list:
    """What is said of the gaps to the walls of the channel."""
    found = [one for one in resolved(measure(fluid), fluid.settings.element) if one.to]
    assert [one.to for one in found] == ["y-", "y+"]
    return found


def error_of(fluid) -> float:
    """Error of the force [%]; units of force are those of mu V."""
    return 100.0 * (float(fluid.force()["plug"].sum(axis=0)[0]) / FORCE - 1.0)


def fine(h: float) -> Grid:
    """Cells of a size around the plug and in both gaps."""
    low = graded(0.0, 0.5, (0.0, 0.04), h, 1.3, 0.1)
    return Grid((graded(0.0, 2.0, (0.7, 1.28), h, 1.3, 0.1), np.concatenate([low, 1.0 - low[-2::-1]])))


def box(cells: tuple[int, int], scale: float = 1.0) -> Grid:
    return uniform([0, 0], [2 * scale, scale], list(cells))


@pytest.mark.parametrize("parts", [pytest.param(1, marks=pytest.mark.slow), 20])
@pytest.mark.parametrize(
    ("element", "grid", "off"),
    [
        ("q1q1", box((20, 10)), -97.7),
        ("q1q1", box((40, 20)), -80.5),
        ("q1q1", box((50, 100)), -64.6),
        ("q1q1", fine(0.008), 37.7),
        ("q1q1", fine(0.004), 5.9),
        ("q2q1", box((40, 20)), 8.2),
        ("q2q1", fine(0.008), 0.1),
    ],
)
def test_a_plug_warns_of_what_its_gaps_leak(element, grid, off, parts):
    """The pressure in front of it, where no wall is near, is that which the films need: its error is theirs."""
    fluid = plug(element, grid, parts=parts)
    assert error_of(fluid) == pytest.approx(off, abs=0.1)
    assert [one.warns for one in said(fluid)] == [abs(off) > 5.0] * 2


def flap(
    element: str, height: float, viscosity: float, *, thickness: float = 0.18, scale: float = 1.0, x: float = 1.03
):
    """A flap on the floor of a channel with 41 x 11 cells, through which a mean velocity of 2/3 flows."""
    corner = np.array([[x, -0.3], [x + thickness, -0.3], [x + thickness, height], [x, height]]) * scale
    t = np.arange(40)[:, None] / 40
    points = np.concatenate([a + t * (b - a) for a, b in zip(corner, np.roll(corner, -1, axis=0), strict=True)])
    count = np.arange(len(points))
    body = rigid_body("flap", points, np.stack([count, np.roll(count, -1)], axis=1))
    inflow = field(lambda x, y, t: 4.0 * scale * (y / scale) * (1.0 - y / scale), 0)
    patches = [
        Patch("in", ("x-",), "velocity", inflow),
        Patch("out", ("x+",), "outflow"),
        Patch("walls", ("y-", "y+"), "no_slip"),
    ]
    grid = uniform([0, 0], [4 * scale, scale], [41, 11])
    fluid = make_fluid(grid, patches, [body], element=element, scheme="steady", mu=viscosity * scale**2)
    solve_steady(fluid)
    return fluid


@pytest.mark.parametrize("thickness", [0.18, 0.09])
@pytest.mark.parametrize(("viscosity", "force", "off"), [(0.02, 2.591, 9.2), (0.2, 14.591, 6.3)])
def test_a_flap_that_leaves_a_narrow_way(viscosity, force, off, thickness):
    """The pressure in front of it is that which drives the flow through four cells at its tip, at Re 5 and 50.

    force: of q2q1 with 251 x 65 cells, of the thicker flap.
    """
    fluid = flap("q2q1", 0.62, viscosity, thickness=thickness)
    if thickness == 0.18:
        error = 100.0 * (float(fluid.force()["flap"].sum(axis=0)[0]) / force - 1.0)
        assert error == pytest.approx(off, abs=0.1)
    of_body, gap = resolved(measure(fluid), "q2q1")
    assert (of_body.warns, gap.to, gap.warns) == (False, "y+", True)
    assert gap.share > 0.9


def test_a_flap_that_leaves_a_wide_way():
    """The same with 6.6 cells at its tip: no film."""
    assert [one.to for one in resolved(measure(flap("q2q1", 0.4, 0.02)), "q2q1")] == [""]


def test_a_flap_in_another_unit():
    """Of length, with equal Reynolds number: the same shares."""
    one, small = (measure(flap("q2q1", 0.62, 0.02, scale=scale))[0] for scale in (1.0, 1e-3))
    assert small.gaps[0].share == pytest.approx(one.gaps[0].share, rel=1e-6)
    assert small.layer == pytest.approx(one.layer, rel=1e-6)


def test_velocities_continued_into_walls_are_no_flow():
    """With inertia, in gaps of 0.01 cells: those of their nodes are 1e4 times as fast as the fluid."""
    fluid = plug("q2q1", box((20, 10)), gap=0.001, inertia=True)
    assert [one.share for one in said(fluid)] == pytest.approx([1.0, 1.0], abs=0.01)
    assert all(one.warns for one in said(fluid))


@pytest.mark.parametrize("level", [1.0, 1e6])
def test_the_unit_of_length_changes_nothing(level):
    """Nor the level of the pressure."""
    found = said(plug("q1q1", box((40, 20))))
    small = plug("q1q1", box((40, 20), 1e-3), scale=1e-3)
    small.flow[~small.unknowns.velocity_mask] += level
    assert [one.share for one in said(small)] == pytest.approx([one.share for one in found], rel=1e-6)


def test_pressure_that_films_do_not_make_is_none_of_theirs():
    """The plug moves between open ends, one of which has a pressure that friction in the gaps cannot explain."""
    free = plug("q1q1", box((40, 20)), shut=False)
    (before, _) = said(free)
    pressure, x = free.unknowns.pressure, free.unknowns.pressure.points[:, 0]
    free.flow[pressure.dofs[:, 0]] += np.where(x < 1.0, 1e6, 0.0)
    (found, _) = said(free)
    assert found.share < 1e-3 * before.share


def test_two_processes_say_the_same(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "import json, sys\n"
        "from mpi4py import MPI\n"
        f"sys.path.append({str(Path(__file__).parent)!r})\n"
        "from test_film_pressure import box, plug, said\n"
        "found = said(plug('q1q1', box((40, 20)), parts=20, comm=MPI.COMM_WORLD))\n"
        "if MPI.COMM_WORLD.rank == 0:\n"
        "    print(json.dumps([[one.share, one.error] for one in found]))\n"
    )
    one, two = (json.loads(on_processes(count, program).stdout.splitlines()[-1]) for count in (1, 2))
    assert two == [pytest.approx(of_gap, rel=1e-6) for of_gap in one]


def test_a_rod_through_a_lid_at_a_high_pressure():
    """Its end is dry, outside of the box: the level pushes it, and its gaps leak all the same."""
    low, high = (plug("q1q1", box((40, 20)), end=2.5, level=level) for level in (0.0, 1e9))
    pushed = np.diff([float(fluid.force()["plug"].sum(axis=0)[0]) for fluid in (low, high)])
    assert pushed == pytest.approx(1e9 * (1.0 - 2.0 * GAP))
    for first, second in zip(said(low), said(high), strict=True):
        assert second.warns
        assert second.share == pytest.approx(first.share, rel=1e-3)


@pytest.mark.parametrize(("end", "warns"), [(1.237, True), (2.5, False)])
def test_what_a_flow_without_films_adds_to_a_high_pressure(end, warns):
    """A rod with a dry end, 3.6 % off at the level zero (0.547 in fine cells): 1 kPa pushes it by 200 N more, exactly.

    A body with fluid all around has the same error at any level.
    """
    low, high = (plug("q1q1", box((30, 15)), gap=0.4, end=end, level=level) for level in (0.0, 1e3))
    (first,), (second,) = (resolved(measure(fluid), "q1q1") for fluid in (low, high))
    assert (first.warns, second.warns) == (True, warns)
    if warns:
        assert second.error == pytest.approx(first.error, rel=1e-6)
    else:
        forces = [float(fluid.force()["plug"].sum(axis=0)[0]) for fluid in (low, high)]
        assert forces == pytest.approx([0.5669, 200.5669], abs=1e-4)
        assert second.error < 0.1
