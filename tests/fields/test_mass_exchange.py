"""Contact surfaces lose their mass when a step could bring them together, and get it back."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from contact_setup import make_body, make_contact, turned
from scipy.spatial.transform import Rotation
from structure_setup import block, constant
from test_contact_start import TIGHT, advance
from test_rigid_inertia import FAR, probe, spins

from fsci import shapes
from solvers.contact import reach
from solvers.contact.interface import describe_interface
from solvers.contact.pair import Pair
from solvers.contact.reach import Reach
from solvers.contact.surface import Surface
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.mesh.search import Search
from solvers.structure import mass_exchange
from solvers.structure.dynamics import Dynamics
from solvers.structure.field import Structure
from solvers.structure.materials import NeoHooke
from solvers.structure.rayleigh import Damping
from solvers.structure.supports import Roller, Support

SOFT = NeoHooke(4e2, 6e2, 2.0)


def wall_at(x):
    return Surface("wall", np.array([[x, 99.0], [x, -99.0]]), np.array([[0, 1]]), "line", None)


def rows(structure, steps, dt=0.01):
    """The whole state after each step."""
    found = []
    for _ in advance(structure, dt, steps):
        now, energy = structure.now, structure.energy
        found.append(np.concatenate([now.u, now.v, now.a, [energy.kinetic, energy.internal, energy.work]]))
    return np.array(found)


@pytest.mark.parametrize("damping", [Damping(), Damping(0.1, 0.01)], ids=["undamped", "damped"])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_pair_out_of_reach_changes_no_bit(dim, damping):
    mesh = block("quad" if dim == 2 else "hexahedron", 2)
    loads = {
        "initial_velocity": spins([0, 0, 1.0], (0.2,) * dim, v=(0.1, -0.2, 0.3)),
        "gravity": tuple(constant(g) for g in (1.0, 0.0, -2.0)[:dim]),
    }
    time = Dynamics(GeneralisedAlpha.from_rho_inf(0.9), damping=damping)
    alone = Structure([make_body("body", mesh, SOFT, **loads)], time, TIGHT)
    body = make_body("body", mesh, SOFT, **loads)
    paired, _ = make_contact([body], [(("body", "left"), FAR[dim])], time=time, settings=TIGHT, exchanges_mass=True)
    assert np.array_equal(rows(paired, 5), rows(alone, 5))


@pytest.mark.parametrize("rho_inf", [1.0, 0.7])
@pytest.mark.parametrize("dim", [2, 3])
def test_momentum_and_energy_stay_when_pairs_come_and_go(dim, rho_inf):
    """A block that turns and vibrates while the pair appears and disappears without contact."""
    mesh = block("quad" if dim == 2 else "hexahedron", 4)
    turning = spins([0.3, -0.2, 1.0] if dim == 3 else [0, 0, 1.0], (0.5,) * dim, v=(0.1, -0.2, 0.3))
    vibrating = tuple(
        partial(lambda f, i, x, t: f(x, t) + 0.1 * np.cos(3.0 * x[i]), f, i) for i, f in enumerate(turning)
    )
    time = Dynamics(GeneralisedAlpha.from_rho_inf(rho_inf))
    body = make_body("body", mesh, SOFT, initial_velocity=vibrating)
    structure, contact = make_contact(
        [body], [(("body", "left"), FAR[dim])], time=time, settings=TIGHT, exchanges_mass=True
    )
    contact.find_present = lambda *_: np.array([present])
    present, counts, found = False, [], []
    structure.initialise(0.0, 0.005)
    for n in range(20):
        present = 5 <= n < 12
        structure.begin_step(0.005 * n, 0.005)
        counts.append(len(structure.inertia.find_massless()))
        structure.solve()
        structure.end_step()
        energy = structure.energy.kinetic + structure.energy.internal
        centre, p, L = (probe(structure, q) for q in ("centre", "momentum", "angular_momentum"))
        arm, p3 = (np.pad(a, (0, 3 - dim)) for a in (centre, p))
        found.append([*p, *(L - np.cross(arm, p3)[3 - len(L) :]), energy])
    assert counts[4] == counts[12] == 0 < counts[5]
    found = np.array(found)
    assert found[:, :dim] == pytest.approx(np.tile(found[0, :dim], (20, 1)), rel=1e-8)
    assert found[:, dim:-1] == pytest.approx(
        np.tile(found[0, dim:-1], (20, 1)), abs=2e-3 * np.abs(found[0, dim:-1]).max()
    )
    lost = found[:, -1] / found[0, -1] - 1.0
    assert np.abs(lost).max() < (1e-3 if rho_inf == 1.0 else 2e-2)
    jumps = np.abs(np.diff(found[:, -1]))[[4, 11]] / found[0, -1]
    assert jumps.max() < 2e-3


@pytest.mark.parametrize("angle", [0.0, 30.0])
@pytest.mark.parametrize("first", [0, 5])
def test_supports_move_massless_nodes_too(first, angle):
    """A damped block that is pressed evenly, with a pair in reach from a step on, which never closes: as without it.

    Supports hold two nodes of the pair. At 30 degrees they are oblique.
    """
    turn = Rotation.from_euler("z", angle, degrees=True).as_matrix()[:2, :2]
    mesh, down, rate = turned(block("quad", 4), turn), turn @ [0.0, -1.0], 0.5
    time = Dynamics(GeneralisedAlpha.from_rho_inf(1.0), damping=Damping(0.0, 0.1))
    material = NeoHooke(4e2, 0.0, 1e-3)  # nothing moves across
    start = tuple(lambda x, t, i=i: -rate * (down @ x[:2]) * down[i] for i in range(2))

    def forces(present_from):
        supports = [Roller("bottom", down), Roller("top", down, lambda x, t: rate * t), Support([0], 0.0)]
        body = make_body("body", mesh, material, supports=supports, initial_velocity=start)
        structure, contact = make_contact(
            [body], [(("body", "right"), FAR[2])], time=time, settings=TIGHT, exchanges_mass=True
        )
        contact.find_present = lambda u, v, t, dt: np.array([t > (present_from - 0.5) * dt])
        found = [structure.now.internal + structure.now.damping for _ in advance(structure, 0.01, 15)]
        assert len(structure.inertia.find_massless()) == (10 if present_from < 15 else 0)
        return np.array(found)

    without = forces(99)
    assert np.abs(forces(first) - without).max() < 1e-4 * np.abs(without).max()


def test_mass_returns_after_an_impact():
    """A block bounces off a wall: massless while they are near, and as before when they are far apart again."""
    flies = (constant(1.0), constant(0.3))
    body = make_body("body", block("quad", 4), SOFT, initial_velocity=flies)
    structure, _ = make_contact(
        [body], [(("body", "right"), wall_at(1.3))], time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)), settings=TIGHT,
        exchanges_mass=True,
    )  # fmt: skip
    counts, momenta = [], []
    for _ in advance(structure, 0.01, 150):
        counts.append(len(structure.inertia.find_massless()))
        momenta.append(probe(structure, "momentum"))
    changes = np.flatnonzero(np.diff(counts))
    assert counts[0] == counts[-1] == 0
    assert max(counts) == 10
    assert len(changes) == 2
    momenta = np.array(momenta)
    assert momenta[:, 1] == pytest.approx(np.full(151, 0.6), rel=1e-8)
    assert -2.0 < momenta[-1, 0] < -1.5
    assert structure.energy.error / structure.energy.initial == pytest.approx(0.0, abs=0.01)


def test_bounds_of_the_scale_do_not_matter(monkeypatch):
    """The energy of a block that vibrates after its impact, with bounds over three decades."""
    flies = (constant(1.0), constant(0.3))
    found = []
    for bound in (2.0, 20.0, 2000.0):
        monkeypatch.setattr(mass_exchange, "LEAST_SCALE", 1.0 / bound)
        monkeypatch.setattr(mass_exchange, "MOST_SCALE", bound)
        body = make_body("body", block("quad", 4), SOFT, initial_velocity=flies)
        time = Dynamics(GeneralisedAlpha.from_rho_inf(1.0))
        wall = [(("body", "right"), wall_at(1.1))]
        structure, _ = make_contact([body], wall, time=time, settings=TIGHT, exchanges_mass=True)
        for _ in advance(structure, 0.01, 60):
            pass
        assert not len(structure.inertia.find_massless())
        found.append([structure.energy.kinetic, structure.energy.internal, probe(structure, "momentum")[0]])
    assert found[1] == pytest.approx(found[0], rel=1e-3)
    assert found[2] == pytest.approx(found[0], rel=1e-3)


@pytest.mark.parametrize(
    ("ways", "edges"),
    [
        pytest.param(1.0, 0.2, marks=pytest.mark.slow),
        (200.0, 0.2),
        (2.0, 0.002),
        pytest.param(2.0, 20.0, marks=pytest.mark.slow),
    ],
)
def test_how_early_a_pair_is_present_does_not_matter(monkeypatch, ways, edges):
    """A block bounces off a wall, with a pair that appears just before the impact or is present all the time.

    What its surface vibrates with differs; momentum, energy and the place of the centre do not.
    """
    found = []
    for values in ((reach.WAYS, reach.EDGES), (ways, edges)):
        monkeypatch.setattr(reach, "WAYS", values[0])
        monkeypatch.setattr(reach, "EDGES", values[1])
        body = make_body("body", block("quad", 4), SOFT, initial_velocity=(constant(1.0), constant(0.3)))
        time = Dynamics(GeneralisedAlpha.from_rho_inf(1.0))
        wall = [(("body", "right"), wall_at(1.3))]
        structure, _ = make_contact([body], wall, time=time, settings=TIGHT, exchanges_mass=True)
        present = [len(structure.inertia.find_massless()) > 0 for _ in advance(structure, 0.01, 150)]
        energy = structure.energy.kinetic + structure.energy.internal
        found.append([sum(present), *probe(structure, "momentum"), energy, probe(structure, "centre")[0]])
    assert found[0][0] != found[1][0]
    assert found[1][1:3] == pytest.approx(found[0][1:3], rel=1e-5)
    assert found[1][3:] == pytest.approx(found[0][3:], rel=2e-3, abs=2e-3)


def test_a_restored_state_has_its_present_pairs():
    """Steps repeated from a saved state give the same bits, before and after the pair has appeared."""

    def create():
        body = make_body("body", block("quad", 3), SOFT, initial_velocity=(constant(1.0), constant(0.0)))
        time = Dynamics(GeneralisedAlpha.from_rho_inf(0.9), damping=Damping(0.1, 0.001))
        pair = [(("body", "right"), wall_at(1.1))]
        return make_contact([body], pair, time=time, settings=TIGHT, exchanges_mass=True)[0]

    structure, states, ends = create(), [], []
    for _ in advance(structure, 0.01, 25):
        states.append(structure.save())
        ends.append(structure.now.u.copy())
    present = [bool(state["contact"]["present"].all()) for state in states]
    assert not present[0]
    assert present[-1]
    first = present.index(True)
    for n in (first - 1, first, first + 2):
        for other in (structure, create()):
            if other is not structure:
                other.initialise(0.0, 0.01)
            other.restore(states[n])
            other.step(0.01 * n, 0.01)
            assert np.array_equal(other.now.u, ends[n + 1])


def test_supports_keep_their_motion():
    """A plate that is held and driven by one end: nothing jumps when its pair appears."""
    driven = Support("left", (constant(0.0), lambda x, t: np.full(x.shape[1], 0.2 * t)))
    body = make_body("body", shapes.rectangle([1.0, 0.2], [8, 2]), SOFT, supports=[driven])
    structure, contact = make_contact(
        [body], [(("body", "top"), wall_at(9.0))], time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)), settings=TIGHT,
        exchanges_mass=True,
    )  # fmt: skip
    contact.find_present = lambda *_: np.array([structure.current.t > 0.045])
    left = np.repeat(body.points[0, : body.owned] < 1e-9, 2).reshape(-1, 2)
    for t in advance(structure, 0.01, 10):
        assert structure.now.u.reshape(-1, 2)[left[:, 0], 1] == pytest.approx(0.2 * t, abs=1e-14)
    assert len(structure.inertia.find_massless())
    assert abs(structure.energy.error) < 0.02 * structure.energy.exchanged


@pytest.mark.parametrize("dim", [2, 3])
def test_reach(dim):
    """Near within twice the way and a fifth of an edge; then until twice that; with a contact force always."""
    body = make_body("body", block("quad" if dim == 2 else "hexahedron", 4))
    points = FAR[dim].points.copy()
    points[:, 0], points[:, 1:] = 0.0, 40.0 * (points[:, 1:] - 3.0)
    wall = replace(FAR[dim], points=points)
    from coupling.contact_surfaces import contact_surface

    interface = describe_interface([Pair(contact_surface([body], "body", "right"), wall)])
    reach, x = Reach(interface), interface.nodes.points.copy()
    slave = interface.nodes_of(interface.pairs[0].slave)
    none, away, there = np.zeros(len(x), dtype=bool), np.array([False]), np.array([True])
    distance = 2.0 * 0.1 + 0.2 * 0.25
    ways = np.zeros_like(x)
    ways[slave, 1] = -0.1

    def found(gap, present, pressed=none):
        x[slave, 0] = -gap
        return bool(reach.find(x, ways, present, pressed)[0])

    assert found(0.9 * distance, away)
    assert not found(1.5 * distance, away)
    assert found(1.5 * distance, there)
    assert not found(2.5 * distance, there)
    assert found(2.5 * distance, there, ~none)


@pytest.mark.parametrize("dim", [2, 3])
def test_pairs_and_nodes_in_reach_take_one_search(dim, monkeypatch):
    """The nodes are those of a search of their own, as long as nothing moves."""
    cell = "quad" if dim == 2 else "hexahedron"
    low, high = (block(cell, n) for n in (3, 4))
    tilt = 1.05 + 0.4 * high.points[:, :1]
    high = replace(high, points=high.points + tilt * np.eye(dim)[-1])
    _, contact = make_contact([make_body("a", low), make_body("b", high)], [(("b", "bottom"), ("a", "top"))])
    searches, pairs = [], Search.pairs
    monkeypatch.setattr(Search, "pairs", lambda *given: searches.append(1) or pairs(*given))
    x, rng = contact.interface.nodes.points.copy(), np.random.default_rng(3)
    ways, none, there = rng.uniform(-0.03, 0.03, x.shape), np.zeros(len(x), dtype=bool), np.array([True])
    reach = Reach(contact.interface)
    for moved, count in ((x, 1), (x, 1), (x - 0.02 * (x > 1.0), 2)):
        reach.find(moved, ways, there, none)
        found = reach.nodes(moved, ways, there)
        assert len(searches) == count
        with monkeypatch.context() as apart:
            apart.setattr(Search, "pairs", pairs)
            assert np.array_equal(found, Reach(contact.interface).nodes(moved, ways, there))
        assert 0 < found.sum() < len(x)


@pytest.mark.parametrize("facet", ["line", "line3", "quad", "triangle"])
def test_the_reach_does_not_depend_on_how_a_scene_is_turned(facet):
    """The pair appears at the distance of a fifth of an edge, at any angle."""
    dim = 2 if facet.startswith("line") else 3
    mesh = {
        "line": lambda: block("quad", 3),
        "line3": lambda: shapes.rectangle([1.0, 1.0], [3, 3], order=2),
        "quad": lambda: block("hexahedron", 3),
        "triangle": lambda: block("tetrahedron", 3),
    }[facet]()
    for angle in (0.0, 17.0, 45.0, 90.0):
        turned = Rotation.from_euler("z", angle, degrees=True).as_matrix()[:dim, :dim]
        bodies = []
        for shift in (0.0, 2.0):
            low = np.array([shift, 0.13, 0.07][:dim])
            bodies.append(make_body("ab"[len(bodies)], replace(mesh, points=(mesh.points + low) @ turned.T), SOFT))
        _, contact = make_contact(bodies, [(("a", "right"), ("b", "left"))], exchanges_mass=True)
        reach, x = Reach(contact.interface), contact.interface.nodes.points
        at_rest, apart = np.zeros_like(x), np.array([False])
        second = contact.interface.nodes.of_surface[1]
        edge = 1.0 / 3.0 if facet != "triangle" else reach._edges[0]
        for gap, found in ((0.21 * edge, False), (0.19 * edge, True)):
            moved = x.copy()
            moved[second] -= (1.0 - gap) * turned[:, 0]
            assert reach.find(moved, at_rest, apart, np.zeros(len(x), dtype=bool)) == found, (angle, gap)
