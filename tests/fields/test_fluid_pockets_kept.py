"""The sentinel of closed pockets: volumes, identity from step to step, and warnings."""

from types import SimpleNamespace

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, sphere, step, turned

from solvers.fluid.cut.pockets import regions
from solvers.fluid.flow.conservation import pockets as module
from solvers.fluid.flow.conservation.cavities import enclosed, find_cavities
from solvers.fluid.flow.conservation.pockets import Pockets
from solvers.fluid.flow.conservation.regions import Regions, RegionsOfCut
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

TIGHT = Patch("walls", ("x-", "x+", "y-", "y+"), "no_slip")
OPEN = Patch("open", ("x+",), "outflow")
SLIP = Patch("slip", ("y-", "y+"), "slip")


def ring(inner, outer, motion=None, centre=(0.0, 0.0), count=48):
    """A body between two polygons of the areas of circles; motion: (points, t) -> (positions, velocities)."""
    points = np.concatenate([circle(centre, outer, count), circle(centre, inner, count)])
    facets = np.concatenate([loop(count), count + loop(count)[:, ::-1]])
    return body("ring", points, facets, motion=motion)


def spinning(points, t):
    """Rotation by 0.5 rad/s."""
    x = turned(points, 0.5 * t)
    return x, 0.5 * np.stack([-x[:, 1], x[:, 0]], axis=1)


def look_at(fluid, steps, dt):
    """(the sentinel, its findings in the last of some steps)."""
    sentinel = Pockets(fluid, RegionsOfCut(fluid))
    sentinel.start(0.0)
    found = []
    for number in range(steps):
        step(fluid, number * dt, dt)
        found = sentinel.look((number + 1) * dt, dt)
    return sentinel, found


@pytest.mark.parametrize("dim", [2, 3])
def test_cavities_and_what_is_in_them(dim):
    if dim == 2:
        shapes = [(circle((0, 0), r, 32), loop(32)) for r in (0.9, 0.8, 0.3, 0.2)]
    else:
        shapes = [sphere((0, 0, 0), r, 2) for r in (0.9, 0.8, 0.3, 0.2)]
    volume = [enclosed(x, facets) for x, facets in shapes]
    points = np.concatenate([x for x, _ in shapes])
    starts = np.cumsum([0, *(len(x) for x, _ in shapes)])
    facets = [f[:, :: 1 if k % 2 == 0 else -1] + starts[k] for k, (_, f) in enumerate(shapes)]
    together, box = np.concatenate(facets), [np.full(dim, -1.0), np.full(dim, 1.0)]
    wet = np.ones(len(together), dtype=bool)
    outer, inner = find_cavities(together, points, wet, box)
    assert -enclosed(points, together[outer.facets]) == pytest.approx(volume[1] - volume[2], rel=1e-13)
    assert -enclosed(points, together[inner.facets]) == pytest.approx(volume[3], rel=1e-13)
    wet[len(facets[0])] = False  # a facet that the fluid does not touch
    assert len(find_cavities(together, points, wet, box)) == 1
    assert len(find_cavities(together, points + 0.5, np.ones_like(wet), box)) == 1  # the other reaches beyond the box


def test_water_in_a_rigid_ring_that_spins_is_kept():
    fluid = make_fluid(uniform([-1, -1], [1, 1], [24, 24]), [TIGHT], [ring(0.5, 0.75, spinning)], mu=0.1, dt=0.1)
    sentinel, found = look_at(fluid, 4, 0.1)
    numbers = sentinel.numbers()
    assert found == []
    assert list(numbers) == ["fluid.pocket_1", "fluid.pocket_2"]  # in the ring, and around it: the box is closed
    assert numbers["fluid.pocket_1"] == pytest.approx(np.pi * 0.5**2, rel=1e-12)
    assert numbers["fluid.pocket_2"] == pytest.approx(4 - np.pi * 0.75**2, rel=1e-12)


def test_strips_that_meet_within_a_wall_do_not_join_pockets():
    """Values of second degree are extended into strips: fluid in a ring that moves with the flow has its own level."""

    def carried(points, t):
        return points + np.array([0.7 * t, 0.0]), np.tile([0.7, 0.0], (len(points), 1))

    box = uniform([-0.8, -0.5], [0.8, 0.5], [64, 40])
    ends, walls = Patch("ends", ("x-", "x+"), "periodic"), Patch("walls", ("y-", "y+"), "slip")
    moved = ring(0.16, 0.42, carried, (-0.2, 0.02))
    fluid = make_fluid(box, [ends, walls], [moved], element="q2q1", mu=0.05, dt=0.03, initial_velocity=field(0.7, 0.0))
    step(fluid, 0.0, 0.03)
    assert not fluid.iterate._levels.unknown
    assert len(fluid.iterate._levels._holds) == 2
    nodes = fluid.unknowns.velocity.dofs
    velocity = fluid.flow[nodes][fluid.system.active_dofs[nodes[:, 0]]]
    assert np.abs(velocity - [0.7, 0.0]).max() < 1e-10


@pytest.mark.parametrize(("inner", "outer"), [(0.5, 0.75), (0.05, 0.45)])
def test_a_ring_that_is_squeezed_by_its_data_is_found(inner, outer):
    """Also where no cell is full of the fluid in it."""

    def squeezed(points, t):
        return points * (1 - 0.05 * t), -0.05 * points

    fluid = make_fluid(
        uniform([-1, -1], [1, 1], [24, 24]), [TIGHT, OPEN], [ring(inner, outer, squeezed)], mu=0.1, dt=0.1
    )
    _, (found,) = look_at(fluid, 2, 0.1)
    assert (found.kind, found.body) == ("pocket", "pocket_1")
    assert found.value == pytest.approx(0.99**2 - 1, rel=1e-9)
    assert found.where == pytest.approx((0.0, 0.0), abs=1e-9)
    assert "closed pocket 1 of the fluid, around (" in found.message
    volumes = f"{np.pi * (0.99 * inner) ** 2:.5g} [volume] instead of {np.pi * inner**2:.5g}"
    assert f"has {volumes} since it closed at t = 0 (-1.99%)" in found.message


def test_a_process_whose_cells_are_all_solid():
    grid = make_fluid(uniform([0, 0], [1, 1], [4, 4]), [TIGHT]).grid
    labels, count = regions(grid, np.empty(0, dtype=np.int32))
    assert count == 0
    assert not labels.any()


def piston(speed):
    """A plate across the channel that moves along it."""
    points, facets = block([1.13, -0.2], [1.63, 1.2])
    v = np.array([speed, 0.0])
    return body("piston", points, facets, motion=lambda x, t: (x + t * v, 0.0 * x + v))


def channel(bodies, inflow, **settings):
    patches = [Patch("in", ("x-",), "velocity", field(inflow, 0.0)), OPEN, SLIP]
    return make_fluid(uniform([0, 0], [3, 1], [15, 5]), patches, bodies, mu=0.1, dt=0.1, **settings)


@pytest.mark.parametrize("scheme", ["backward_euler", "bdf2"])
def test_what_flows_in_counts(scheme):
    """A piston that gives way to the inflow, and one that does not."""
    sentinel, found = look_at(channel([piston(0.5)], 0.5, scheme=scheme), 4, 0.1)
    assert found == []
    assert sentinel.numbers()["fluid.pocket_1"] == pytest.approx(1.13 + 0.4 * 0.5, rel=1e-12)
    _, (found,) = look_at(channel([piston(0.4)], 0.5, scheme=scheme), 4, 0.1)
    assert found.value == pytest.approx((1.13 + 0.4 * 0.4) / (1.13 + 0.4 * 0.5) - 1, rel=1e-9)


def test_a_pocket_that_opens_ends():
    """A plate leaves the channel: first the fluid before it is closed, then not."""
    points, facets = block([1.13, -0.2], [1.63, 1.05])
    v = np.array([0.0, 0.5])
    plate = body("plate", points, facets, motion=lambda x, t: (x - t * v, 0.0 * x - v))
    sentinel, found = look_at(channel([plate], 0.0), 4, 0.1)
    assert found == []
    assert np.isnan(sentinel.numbers()["fluid.pocket_1"])


def test_a_rigid_scene_at_rest_has_no_pockets_that_change():
    sentinel, found = look_at(channel([piston(0.0)], 0.0), 1, 0.1)
    assert found == []
    assert list(sentinel.numbers()) == ["fluid.pocket_1"]


# ------------------------------------------------------------------------------------------- identity over time


class Scene:
    """Regions by hand: a row of 12 cells of unit volume; each step says which of them are which closed region."""

    def __init__(self, monkeypatch):
        grid = uniform([0, 0], [12, 1], [12, 1])
        everything = np.arange(12)
        cut = SimpleNamespace(
            facets=np.empty((0, 2), dtype=int), motion=SimpleNamespace(x=np.empty((0, 2))), uncut=everything
        )
        comm = SimpleNamespace(allreduce=lambda x: x)
        self.fluid = SimpleNamespace(
            parts=SimpleNamespace(boundary=SimpleNamespace(patches=[])),
            moving=SimpleNamespace(surfaces=SimpleNamespace(wet=np.empty(0, dtype=bool))),
            settings=SimpleNamespace(time=SimpleNamespace(times=1)),
            current=SimpleNamespace(difference=SimpleNamespace(alpha=1.0, beta=(1.0,))),
            grid=SimpleNamespace(grid=grid, owned=12, numbers=everything),
            comm=comm,
            cut=cut,
            dim=2,
        )
        monkeypatch.setattr(module, "flow_rate", lambda fluid: None)
        self.sentinel = Pockets(self.fluid, self)

    def now(self):
        return self.regions

    def set(self, text, *volumes):
        """text: a letter for each cell, capital for open regions, '.' for solid; volumes: of closed regions."""
        letters = sorted(set(text) - {"."})
        of_cell = np.array([letters.index(c) if c != "." else -1 for c in text])
        closed = np.array([c.islower() for c in letters])
        volume = np.bincount(of_cell[of_cell >= 0], minlength=len(letters)).astype(float)
        if volumes:
            volume[closed] = volumes
        whole = [np.flatnonzero(of_cell == k) if closed[k] else np.empty(0, dtype=int) for k in range(len(letters))]
        self.fluid.cut.uncut = np.flatnonzero(of_cell >= 0)
        self.regions = Regions(of_cell, ~closed, closed, volume, whole)

    def start(self, text):
        self.set(text)
        self.sentinel.start(0.0)

    def look(self, text, *volumes):
        """{pocket: relative change} and the columns."""
        self.set(text, *volumes)
        found = self.sentinel.look(1.0, 1.0)
        return {f.body: round(f.value, 6) for f in found}, list(self.sentinel.numbers().values())


def test_pockets_go_on_where_their_cells_are(monkeypatch):
    scene = Scene(monkeypatch)
    scene.start("aaaa....bbbb")
    assert scene.look(".aaaa..bbbb.") == ({}, [4.0, 4.0])
    assert scene.look("..aaaa.bbbb.", 4.0, 3.9) == ({"pocket_2": -0.025}, [4.0, 3.9])


def test_pockets_that_join_and_part_have_their_sum(monkeypatch):
    scene = Scene(monkeypatch)
    scene.start("aaaa....bbbb")
    found, columns = scene.look("aaaaaaaabbbb".replace("b", "a"), 7.9)
    assert found == {"pocket_1": -0.0125}
    assert columns[0] == 7.9
    assert np.isnan(columns[1])
    assert scene.look("aaaaa..bbbbb", 3.0, 5.0)[0] == {}
    assert scene.look("aaaaa..bbbbb", 3.0, 4.9)[0] == {"pocket_1": -0.0125}


def test_a_pocket_of_which_a_part_opens_is_a_new_one(monkeypatch):
    scene = Scene(monkeypatch)
    scene.start("aaaaaaaa....")
    found, columns = scene.look("aaa..OOO....", 2.0)
    assert found == {}
    assert np.isnan(columns).all()
    assert scene.look("aaa..OOO....", 1.9)[0] == {"pocket_2": -0.05}


def test_pockets_that_close_later_are_watched_without_a_column(monkeypatch):
    scene = Scene(monkeypatch)
    scene.start("OOOOOOOOOOOO")
    assert scene.look("OOOO..aaaaaa") == ({}, [])
    assert scene.look("OOOO..aaaaaa", 6.3) == ({"pocket_1": 0.05}, [])
    assert scene.look("OOOOOOOOOOOO") == ({}, [])


def test_a_restored_state_goes_on(monkeypatch):
    scene = Scene(monkeypatch)
    scene.start("aaaa....bbbb")
    scene.look("aaaa....bbbb", 3.9, 4.0)
    other = Scene(monkeypatch)
    other.sentinel.restore(scene.sentinel.save())
    for one in (scene, other):
        assert one.look(".aaa....bbbb", 3.9, 4.1) == ({"pocket_1": -0.025, "pocket_2": 0.025}, [3.9, 4.1])
