"""Contact of a surface with itself: search, roles, and bodies that fold."""

from dataclasses import replace

import numpy as np
import pytest
from contact_setup import make_body, make_contact
from programs import fsci
from structure_setup import constant

from fsci import shapes
from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from solvers.contact.dual_tree import DualTree
from solvers.contact.self_search import MASTER, SLAVE, SelfSearch, choose_roles, wall_thickness
from solvers.structure.body import Support

ZERO = constant(0)

# ------------------------------------------------------------------------------------------------------------ search


def closed_line(x):
    """Facets of a closed line through points given with the body on the left."""
    n = len(x)
    return x, np.stack([np.arange(n), (np.arange(n) + 1) % n], axis=1)


def strip(middle, thickness):
    """The outline of a strip along a line of points (n, 2)."""
    along = np.gradient(middle, axis=0)
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    right, left = middle + 0.5 * thickness * normal, middle - 0.5 * thickness * normal
    return closed_line(np.concatenate([right, left[::-1]]))


def fold(n):
    """A serpentine of five flanks, a tenth of their length apart."""
    pitch, line = 0.1, []
    for k in range(5):
        way = np.linspace(0.0, 1.0, n) if k % 2 == 0 else np.linspace(1.0, 0.0, n)
        line.append(np.stack([way, np.full(n, k * pitch)], axis=1))
        bend = np.linspace(-0.5, 0.5, max(n // 4, 3) + 2)[1:-1] * np.pi
        side = 1.0 if k % 2 == 0 else -1.0
        line.append(np.stack([way[-1] + side * 0.5 * pitch * np.cos(bend), (k + 0.5 + 0.5 * np.sin(bend)) * pitch]).T)
    return strip(np.concatenate(line[:-1]), 0.04)


def closing_c(n):
    angles = np.linspace(0.02, 2 * np.pi - 0.02, n)
    return strip(np.stack([np.cos(angles), np.sin(angles)], axis=1), 0.2)


def tube(n):
    """A tube in folds: r = 1 + 0.3 sin(20 z), outside and inside, as quadrilaterals."""
    z, angle = np.meshgrid(np.linspace(0, 1, 2 * n), 2 * np.pi * np.arange(n) / n, indexing="ij")
    node = np.arange(z.size).reshape(z.shape)
    after = np.roll(node, -1, axis=1)
    quads = np.stack([node[:-1], after[:-1], after[1:], node[1:]], axis=-1).reshape(-1, 4)
    points = [
        np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1).reshape(-1, 3)
        for r in (1 + 0.3 * np.sin(40 * z), 0.97 + 0.3 * np.sin(40 * z))
    ]
    return np.concatenate(points), np.concatenate([quads, quads[:, ::-1] + z.size])


def by_force(tree, x, inflation):
    low, high = tree.slabs(x, None, 0.5 * inflation)
    found = [
        np.stack([np.full(len(j), i), j], axis=1)
        for i in range(len(low))
        if len(j := i + 1 + np.flatnonzero(((low[i] <= high[i + 1 :]) & (low[i + 1 :] <= high[i])).all(axis=1)))
    ]
    found = np.concatenate(found)
    return found[tree.may_touch(found, tree.normals(x))]


BODIES = {"fold": (fold, 30, "line"), "c": (closing_c, 120, "line"), "tube": (tube, 40, "quad")}


@pytest.mark.parametrize("name", BODIES)
def test_pairs_are_those_of_brute_force(name):
    make, n, facet_type = BODIES[name]
    x, facets = make(n)
    tree = DualTree(facets, facet_type, x)
    edge = np.linalg.norm(x[facets[:, 1]] - x[facets[:, 0]], axis=1).max()
    wanted = by_force(tree, x, edge)
    assert len(wanted) > 20
    found = tree.pairs(x, edge)
    assert set(map(tuple, found.tolist())) == set(map(tuple, wanted.tolist()))
    assert len(found) == len(wanted)


@pytest.mark.parametrize("name", BODIES)
def test_work_grows_like_n_log_n(name):
    """Comparisons in the tree, with the number of facets: none of them is between neighbours."""
    make, n, facet_type = BODIES[name]
    counts = []
    for refine in (1, 4) if facet_type == "line" else (1, 2):
        x, facets = make(refine * n)
        tree = DualTree(facets, facet_type, x)
        edge = np.linalg.norm(x[facets[:, 1]] - x[facets[:, 0]], axis=1).max()
        tree.pairs(x, 0.2 * edge)
        counts.append((len(facets), tree.tests))
    (k, tests), (more, more_tests) = counts
    assert more_tests / tests < 1.3 * more * np.log(more) / (k * np.log(k))


def test_a_flat_surface_needs_one_comparison():
    """Its root has a cone of normals: one comparison."""
    x = np.stack([np.linspace(0, 1, 101), np.zeros(101)], axis=1)
    tree = DualTree(np.stack([np.arange(100), np.arange(1, 101)], axis=1), "line", x)
    assert len(tree.pairs(x, 0.5)) == 0
    assert tree.tests == 1


# ------------------------------------------------------------------------------------------------------------- roles


def test_roles_alternate():
    """Two parts of the graph; in the second one the pressed facet is a slave; fixed roles stay."""
    pairs = np.array([[0, 5], [1, 5], [1, 6], [2, 7], [3, 7]])
    none = np.zeros(9, dtype=np.int8)
    roles = choose_roles(none, np.eye(9, dtype=int)[7], pairs)
    assert roles.tolist() == [SLAVE, SLAVE, MASTER, MASTER, 0, MASTER, MASTER, SLAVE, 0]
    fixed = none.copy()
    fixed[6] = SLAVE
    roles = choose_roles(fixed, np.zeros(9, dtype=int), pairs)
    assert roles.tolist() == [MASTER, MASTER, SLAVE, SLAVE, 0, SLAVE, SLAVE, MASTER, 0]


def test_an_odd_circle_has_slaves_only():
    """Every pair still has a slave and a master: the facet of the lower number is the slave."""
    pairs = np.array([[0, 1], [1, 2], [0, 2]])
    assert choose_roles(np.zeros(3, dtype=np.int8), np.zeros(3, dtype=int), pairs).tolist() == [SLAVE] * 3


def test_the_other_side_of_a_wall_is_no_master():
    """A strip thinner than its facets are long has pairs between its folds, and none through itself."""
    x, facets = fold(16)
    search = SelfSearch(facets, "line", x)
    edge = np.linalg.norm(x[facets[:, 1]] - x[facets[:, 0]], axis=1).max()
    assert edge > 0.04
    pairs = search.pairs(x, x, edge)
    middles, normals = x[facets].mean(axis=1), search.tree.normals(x)[:, 0]
    away = middles[pairs[:, 1]] - middles[pairs[:, 0]]
    assert len(pairs) > 20
    mean = 0.5 * (normals[pairs[:, 0]] - normals[pairs[:, 1]])
    assert (np.einsum("pd,pd->p", away, mean) > 0.0).all()
    assert len(search.tree.pairs(x, edge)) > len(pairs) + 20  # of the tree alone


@pytest.mark.parametrize("name", ["fold", "c"])
def test_pairs_and_roles_turn_with_the_surface(name):
    """The sides of the tree's volumes do not turn: of themselves they would find other pairs at another angle."""
    make, n, facet_type = BODIES[name]
    x, facets = make(n)
    edge = np.linalg.norm(x[facets[:, 1]] - x[facets[:, 0]], axis=1).max()

    def found(angle, of):
        c, s = np.cos(angle), np.sin(angle)
        turned = x @ np.array([[c, s], [-s, c]])
        search = SelfSearch(facets, facet_type, turned)
        return (search if of == "roles" else search.tree).pairs(*[turned] * (2 if of == "roles" else 1), edge).tolist()

    angles = np.linspace(0.1, 6.0, 12)
    assert all(found(angle, "roles") == found(0.0, "roles") for angle in angles)
    assert any(found(angle, "tree") != found(0.0, "tree") for angle in angles)


def test_thickness_of_a_wall():
    x, facets = closing_c(120)
    middles = x[facets].mean(axis=1)
    normals = DualTree(facets, "line", x).normals(x)[:, 0]
    thickness = wall_thickness(middles, normals)
    sides = np.abs(np.linalg.norm(middles, axis=1) - 1.0) > 0.09
    assert thickness[sides] == pytest.approx(0.2, rel=0.05)


# -------------------------------------------------------------------------------------------------------------- runs


def run(text, folder):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


#: A ring with a slit is closed by pressure from outside; its ends stick to each other.
CLOSING = """\
title: a C closes
time: {step: 0.1, end: 1}
structure:
  bodies:
    c:
      mesh: {shape: ring, inner_radius: 0.8, outer_radius: 1.0, angle: 350, start: 5, cells: [48, 3], order: 1}
      material: {law: neo_hooke, E: 100, nu: 0.3}
      supports:
        - {at: [-1, 0], displacement: [0, 0]}
        - {at: [-0.8, 0], displacement: [null, 0]}
      pressures: [{on: outer, value: 0.004 * t}]
contact:
  pairs:
    tips: {self: {body: c, on: [inner, outer, start, end]}, friction: {coefficient: 0.5}}
probes:
  low: {body: c, quantity: displacement, at: [0.9961946981, -0.0871557427]}
  high: {body: c, quantity: displacement, at: [0.9961946981, 0.0871557427]}
  gap: {pair: tips, quantity: gap}
  mean: {pair: tips, quantity: mean_gap}
"""


def test_a_closing_c(tmp_path):
    """Its ends meet with their outer corners, which stop each other."""
    found = run(CLOSING, tmp_path)
    closed = found["contact.active"] > 0
    assert 1 < closed.sum() < len(closed)
    assert found["low.y"][~closed] == pytest.approx(-found["high.y"][~closed], abs=1e-9)
    assert np.abs(found["gap"][closed]).max() < 1e-12
    assert np.array_equal(found["mean"], found["gap"], equal_nan=True)
    assert np.ptp((found["low.y"] - found["high.y"])[closed]) < 2e-3 < np.ptp(found["low.y"][~closed])
    assert found["iterations"].max() <= 8


#: A free ring with a slit claps together.
CLAPPING = """\
title: a C claps
time: {step: 0.02, end: 0.3}
structure:
  dynamics: {rho_inf: 1}
  bodies:
    c:
      mesh: {shape: ring, inner_radius: 0.8, outer_radius: 1.0, angle: 350, start: 5, cells: [40, 3]}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}
      initial_velocity: [0.1, "-1.5 * y * max(x, 0)"]
contact:
  pairs:
    tips: {self: {body: c, on: [start, end]}}
probes:
  energy: {quantity: energy}
  momentum: {quantity: momentum}
"""


def test_corners_may_be_on_the_surface(tmp_path):
    """With the corners between the ends and the rest on one surface: no energy comes in (85 % with normals that are
    means across them), as much as with the ends alone goes out."""
    found = run(CLAPPING.replace("on: [start, end]", "on: [inner, outer, start, end]"), tmp_path)
    assert (found["contact.active"] > 0).sum() >= 2
    assert np.abs(found["structure.energy"]).max() < 0.02 * found["energy.total"][0]
    assert found["structure.energy"].max() < 1e-3 * found["energy.total"][0]
    assert len(found["time"]) == 15  # no step was repeated
    assert found["iterations"].max() <= 8


@pytest.fixture(scope="module")
def clapping(tmp_path_factory):
    return run(CLAPPING, tmp_path_factory.mktemp("clapping"))


def test_a_ring_claps(clapping):
    """Momentum stays, and energy is kept within 2 % with a large step (0.03 % with a fourth of it)."""
    touching = clapping["contact.active"] > 0
    assert 2 <= touching.sum() < len(touching)
    for axis in "xy":
        change = clapping[f"momentum.{axis}"] - clapping[f"momentum.{axis}"][0]
        assert np.abs(change).max() < 1e-8 * np.abs(clapping["momentum.x"][0])
    assert np.abs(clapping["structure.energy"]).max() < 0.02 * clapping["energy.total"][0]
    assert clapping["iterations"].max() <= 8


def test_a_resumed_ring_claps_alike(clapping, tmp_path):
    """Stopped with its tips in contact: equal bits."""
    middle = clapping["time"][np.flatnonzero(clapping["contact.active"])[0]]
    run(CLAPPING.replace("end: 0.3", f"end: {middle:g}"), tmp_path)
    out = tmp_path / "out"
    (out / "case.yaml").write_text((out / "case.yaml").read_text().replace(f"end: {middle:g}", "end: 0.3"))
    done = fsci("resume", out)
    assert done.returncode == FINISHED, done.stdout + done.stderr
    resumed = read_history(out / "history.csv")
    for name in clapping.keys() - {"wall"}:
        assert np.array_equal(clapping[name], resumed[name]), name


@pytest.mark.slow
def test_processes_clap_alike(clapping, tmp_path):
    (tmp_path / "case.yaml").write_text(CLAPPING)
    done = fsci("run", tmp_path / "case.yaml", "-o", tmp_path / "out", processes=2)
    assert done.returncode == FINISHED, done.stdout + done.stderr
    together = read_history(tmp_path / "out" / "history.csv")
    for name in ("energy.total", "contact.active", "momentum.x"):
        assert np.abs(clapping[name] - together[name]).max() <= 1e-9 * np.abs(clapping[name]).max(), name


def test_with_contact_between_bodies(tmp_path):
    """A fold with a sheet in it: the surface meets itself and an obstacle, and all forces are in balance."""
    case = load_case(
        "cases/self_contact_fold/case.yaml",
        [
            ("time", "{step: 0.05, end: 0.8}"),
            ("verify", "[]"),
            ("contact.obstacles.sheet", "{mesh: {shape: rectangle, size: [0.9, 0.01], cells: [1, 1]}, on: top}"),
            ("contact.obstacles.sheet.mesh.origin", "[-0.05, 0.07]"),
            ("contact.pairs.sheet", "{slave: {body: strip, on: inside}, master: {obstacle: sheet}}"),
            ("probes.bottom", "{body: strip, quantity: reaction, on: bottom}"),
            ("probes.least", "{pair: sheet, quantity: gap}"),
        ],
    )
    assert run_case(case, tmp_path / "out") == FINISHED
    found = read_history(tmp_path / "out" / "history.csv")
    forces = found["bottom.y"] + found["top.y"] + found["contact.sheet.y"]
    assert np.abs(forces).max() < 1e-8 * np.abs(found["top.y"]).max()
    assert found["contact.sheet.y"][-1] > 0.05 * np.abs(found["top.y"][-1])
    assert found["contact.active"][-1] >= 4
    assert np.nanmin(found["gap"]) > -1e-10
    assert found["iterations"].max() <= 15


def bellows(around, along, wall=0.1, pitch=0.8, depth=0.3):
    """One fold of a corrugated tube."""
    mesh = shapes.tube(1 - 0.5 * wall, 1 + 0.5 * wall, pitch, [around, 1, along])
    x, y, z = mesh.points.T
    radius, k = np.hypot(x, y), 2 * np.pi / pitch
    slope = -depth * k * np.sin(k * z)
    across = (radius - 1) / np.sqrt(1 + slope**2)
    bent = 1 + depth * np.cos(k * z) + across
    return replace(mesh, points=np.stack([bent * x / radius, bent * y / radius, z - across * slope], axis=1))


@pytest.mark.slow
def test_a_tube_folds():
    """A corrugated tube in 3D is pressed together until its outside touches itself, all around alike."""
    supports = [
        Support("bottom", (ZERO, ZERO, ZERO)),
        Support("top", (ZERO, ZERO, lambda x, t: -0.58 * t + ZERO(x, t))),
    ]
    body = make_body("tube", bellows(16, 16), supports=supports)
    structure, contact = make_contact([body], [(("tube", "outer"), ("tube", "outer"))])
    structure.initialise(0.0, 0.05)
    for step in range(20):
        structure.begin_step(0.05 * step, 0.05)
        assert structure.solve().iterations <= 9
        structure.end_step()
    active = np.flatnonzero(contact.active_set.active)
    assert len(active) >= 16
    assert len(active) % 16 == 0
    assert np.nanmin(contact.mean_gap()) > -1e-12
    radii = np.hypot(*contact.x[contact.multipliers.node[active], :2].T)
    assert len(np.unique(radii.round(9))) == len(active) // 16
    (mortar,) = contact.interface.mortars
    tree, x = mortar.search.tree, contact.x[mortar.masters.nodes]
    wanted = by_force(tree, x, mortar.edge)
    assert len(wanted) > 100
    assert set(map(tuple, tree.pairs(x, mortar.edge).tolist())) == set(map(tuple, wanted.tolist()))


MISTAKES = {
    "both": (("{self: {", "{slave: {body: c, on: inner}, self: {"), "give either 'slave' and 'master', or 'self'"),
    "half": (
        ("{self: {", "{slave: {"),
        "a pair needs 'slave' and 'master', or 'self' for a surface that may touch itself",
    ),
    "tied": (("friction: {coefficient: 0.5}", "tied: true"), "a surface cannot be tied to itself"),
    "unknown": (("on: [inner, outer, start, end]", "on: innr"), "14:32: 'ring' has no surface 'innr'"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_named(name, tmp_path):
    (old, new), message = MISTAKES[name]
    (tmp_path / "case.yaml").write_text(CLOSING.replace(old, new))
    with pytest.raises(CaseError) as caught:
        load_case(tmp_path / "case.yaml")
    assert message in str(caught.value)


def test_check_lists_it():
    done = fsci("check", "cases/self_contact_fold")
    assert done.returncode == 0, done.stderr
    assert "strip.inside on itself" in done.stdout


#: A clip whose ends meet under pressure, half of it being the image of the other one.
CLIP = """\
time: {step: STEP, end: 0.1}
structure:
  bodies:
    clip:
      mesh: {shape: tube, inner_radius: 0.9, outer_radius: 1.1, height: 0.3, cells: [48, 2, 1], angle: 320, start: 20}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      pressures: [{on: outer, value: "1.6*t"}]
      supports:
        - {at: [-1.1, 0, 0], displacement: [0, 0, null]}
        - {at: [-0.9, 0, 0], displacement: [null, 0, null]}
        - {on: bottom, symmetry: true}
contact:
  pairs:
    p: {self: {body: clip, on: [inner, start, end, outer]}}
probes:
  upper: {body: clip, quantity: displacement, at: [1.03366188, 0.37622216, 0]}
  lower: {body: clip, quantity: displacement, at: [1.03366188, -0.37622216, 0]}
solver: {newton: {residual: 1.0e-10, max_iterations: 30}, linear: {method: direct}}
output: {fields_every: 0}
"""


#: The same in the plane.
CLIP_2D = (
    CLIP.replace("shape: tube", "shape: ring")
    .replace("height: 0.3, cells: [48, 2, 1]", "cells: [48, 2]")
    .replace("[-1.1, 0, 0], displacement: [0, 0, null]", "[-1.1, 0], displacement: [0, 0]")
    .replace("[-0.9, 0, 0], displacement: [null, 0, null]", "[-0.9, 0], displacement: [null, 0]")
    .replace("        - {on: bottom, symmetry: true}\n", "")
    .replace("0.37622216, 0]", "0.37622216]")
)


@pytest.mark.parametrize(
    "clip", [pytest.param(CLIP_2D, id="plane"), pytest.param(CLIP, id="space", marks=pytest.mark.slow)]
)
def test_the_ends_of_a_clip_do_not_pass_in_one_step(tmp_path, clip):
    """With one step they stop on each other as with small ones."""
    found = []
    for step in (0.1, 0.02):
        folder = tmp_path / str(step)
        folder.mkdir()
        (folder / "case.yaml").write_text(clip.replace("STEP", str(step)))
        assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
        history = read_history(folder / "out" / "history.csv")
        found.append([history[column][-1] for column in ("upper.y", "lower.y", "contact.active")])
    assert found[1][2] > 0
    assert found[0] == pytest.approx(found[1], rel=0.02)
