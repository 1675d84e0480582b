"""Scenes that do not touch each other in one case: each gives what it gives alone, whatever lies beside it."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI
from programs import fsci
from unconnected_scenes import Scene, case_of, computed, difference, dragged, draw_pair, on_a_corner, tied

from fsci import shapes
from fsci.running.history import read_history
from solvers.mesh.mesh import Mesh
from solvers.structure.body import Body, Support
from solvers.structure.field import Structure
from solvers.structure.materials import NeoHooke

AGREE = 1e-9


@pytest.mark.parametrize("seed", [*range(6), *(pytest.param(n, marks=pytest.mark.slow) for n in range(6, 120))])
def test_two_scenes_in_one_case(tmp_path, seed):
    """Statics and dynamics, contact, friction, ties, follower loads; ratios of stiffness from 1e-6 to 1e6."""
    rng = np.random.default_rng(seed)
    scenes, dynamics = draw_pair(rng), bool(rng.integers(2))
    both = computed(tmp_path / "both", case_of(scenes, dynamics=dynamics))
    for scene in scenes:
        alone = computed(tmp_path / scene.name, case_of([scene], dynamics=dynamics))
        assert difference(scene, alone, both) < AGREE


@pytest.mark.parametrize("stiffness", [1.378, pytest.param(1e3, marks=pytest.mark.slow), 1e9])
def test_line_searches_of_two_scenes(tmp_path, stiffness):
    """Each shortens its own steps: together they take as many as the one that needs more."""
    scenes = [Scene("a", [0.0, 0.0], 1e3), Scene("b", [7.0, 0.5], stiffness)]
    for scene, edge, load in zip(
        scenes, (-0.4841810627903052, -0.44798793688412153), (2.008e-4, 1.465e-4), strict=True
    ):
        on_a_corner(scene, edge, load)
    both = computed(tmp_path / "both", case_of(scenes))
    alone = [computed(tmp_path / scene.name, case_of([scene])) for scene in scenes]
    for scene, history in zip(scenes, alone, strict=True):
        assert difference(scene, history, both) < AGREE
    assert both["iterations"] == pytest.approx(np.maximum(*(history["iterations"] for history in alone)))


def test_a_set_that_cycles_beside_one_that_changes(tmp_path):
    """The line search of a scene begins when its own set comes back. With that of all it did not converge."""
    scenes = [Scene("a", [0.0, 0.0], 1e3), Scene("b", [7.0, 0.5], 5.445e5)]
    on_a_corner(scenes[0], -0.5033854551936683, 2.5955084e-4)
    on_a_corner(scenes[1], -0.5080574301534384, 1.8046887e-4)
    both = computed(tmp_path / "both", case_of(scenes))
    alone = [computed(tmp_path / scene.name, case_of([scene])) for scene in scenes]
    for scene, history in zip(scenes, alone, strict=True):
        assert difference(scene, history, both) < AGREE
    assert both["iterations"] == pytest.approx(np.maximum(*(history["iterations"] for history in alone)))


@pytest.mark.slow
def test_two_scenes_on_two_processes(tmp_path):
    """Each of them as on one process; parts of bodies and pairs lie on both."""
    rng = np.random.default_rng(3)
    scenes = [Scene("a", [0.0, 0.0], 1e3), Scene("b", [7.0, 0.5], 1e-3)]
    dragged(scenes[0], rng)
    tied(scenes[1], rng)
    alone = computed(tmp_path / "one", case_of(scenes))
    run = fsci("run", tmp_path / "one" / "case.yaml", "-o", tmp_path / "two", processes=2)
    assert run.returncode == 0, run.stdout + run.stderr
    both = read_history(tmp_path / "two" / "history.csv")
    assert (both["iterations"] == alone["iterations"]).all()
    for scene in scenes:
        assert difference(scene, alone, both) < AGREE


SOFT = """
time: {step: 0.1, end: 0.5}
structure:
  bodies:
    soft:
      mesh: {shape: rectangle, size: [1, 0.05], cells: [20, 2], order: 2}
      material: {law: neo_hooke, E: 10, nu: 0.3, density: 0.01}
      supports: [{on: left, displacement: [0, 0]}]
      gravity: [0, -t/0.5]
"""
STEEL = """    steel:
      mesh: {shape: rectangle, size: [1, 1], cells: [4, 4], origin: [0, 3]}
      material: {law: neo_hooke, E: 2e11, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [t, 0]}]
"""
TIP = "probes: {tip: {body: soft, quantity: displacement, at: [1, 0.05]}}\n"


@pytest.mark.parametrize("residual", ["1e-8", "1e-4"])
def test_a_soft_beam_beside_moving_steel(tmp_path, residual):
    """With the usual tolerance, too. The rounding errors of steel exceed the load on the beam."""
    solver = f"solver: {{newton: {{residual: {residual}}}}}\n"
    alone = computed(tmp_path / "alone", SOFT + TIP + solver)
    beside = computed(tmp_path / "beside", SOFT + STEEL + TIP + solver)
    assert alone["tip.y"][-1] == pytest.approx(-0.45739, abs=1e-5)
    assert beside["tip.y"] == pytest.approx(alone["tip.y"], rel=float(residual))
    assert beside["residual"].max() < 1e-5  # that of the beam; the rounding errors of the steel are above


PRESSED = """
time: {step: 0.25, end: 1}
structure:
  bodies:
    steel:
      mesh: {shape: rectangle, size: [2, 1], cells: [6, 3], origin: [-1, -1]}
      material: {law: neo_hooke, E: STIFF, nu: 0.3}
      supports: [{on: bottom, displacement: [null, 0]}, {on: left, displacement: [0, null]}]
      tractions: [{on: right, value: ["STIFF*5e-3*t", 0]}]
    soft:
      mesh: {shape: rectangle, size: [0.5, 0.5], cells: [4, 4], origin: [-0.25, 0]}
      material: {law: neo_hooke, E: 10, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [0, null]}]
      gravity: [0, "-2*t"]
contact: {pairs: {p: {slave: {body: soft, on: bottom}, master: {body: steel, on: top}LAW}}}
probes:
  top: {body: soft, quantity: displacement, at: [0.25, 0.5]}
  bottom: {body: soft, quantity: displacement, at: [-0.25, 0.0]}
"""


@pytest.mark.parametrize("law", ["", ", friction: {coefficient: 0.3}"])
def test_a_soft_block_on_loaded_steel(tmp_path, law):
    """They touch, and the forces in the steel are 1e9 times those on the block: it sinks as on a softer one."""
    of = {}
    for E in ("2e11", "2e6"):
        history = computed(tmp_path / E, PRESSED.replace("STIFF", E).replace("LAW", law))
        of[E] = history["top.y"] - history["bottom.y"]
    assert of["2e11"] == pytest.approx(of["2e6"], rel=1e-4)


STRIP = """
time: {step: 0.025, end: 0.025}
structure:
  bodies:
    strip:
      mesh: {shape: rectangle, size: [2, 0.05], cells: [40, 1], order: 2, origin: [-1, 0]}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.3}
      supports: [{on: [left, right], displacement: [0, 0]}]
      tractions: [{on: top, value: [0, "-6*t"]}]
probes:
  left: {quantity: reaction, on: left}
  right: {quantity: reaction, on: right}
"""
UNTOUCHED = """
contact:
  obstacles:
    step: {mesh: {shape: rectangle, size: [0.5, 0.5], cells: [1, 1], origin: [-1, -0.58]}, on: top}
  pairs:
    s: {slave: {body: strip, on: bottom}, master: {obstacle: step}}
"""


@pytest.mark.parametrize("contact", ["", UNTOUCHED])
def test_iterates_that_blow_up_do_not_loosen_the_tolerance(tmp_path, contact):
    """Residuals of 1e5 N before the solution, in which each end of the strip takes half of the load of 0.3 N."""
    history = computed(tmp_path, STRIP + contact)
    for end in ("left", "right"):
        assert history[f"{end}.y"][-1] == pytest.approx(0.15, abs=1e-8)


RESTING = """
time: {{step: 0.1, end: 0.6}}
structure:
  dynamics: {{rho_inf: 0.5}}
  bodies:
    block:
      mesh: {{shape: rectangle, size: [0.4, 0.3], cells: [3, 3], origin: [{x}, 0]}}
      material: {{law: neo_hooke, E: 2000, nu: 0.3, density: 10}}
      gravity: ["ramp(t,0,0.5)", "-10*ramp(t,0,0.5)"]
contact:
  obstacles:
    floor: {{mesh: {{shape: rectangle, size: [3, 0.2], cells: [1, 1], origin: [{floor}, -0.2]}}, on: top}}
  pairs:
    floor: {{slave: {{body: block, on: bottom}}, master: {{obstacle: floor}}{law}}}
probes: {{c: {{quantity: centre}}}}
"""


@pytest.mark.parametrize("law", [", friction: {coefficient: 0.4}", ", friction: {bound: 30}", ""])
@pytest.mark.parametrize("x", [0.0, 100.81, 1e4])
def test_contact_far_from_the_origin(tmp_path, law, x):
    """The gap and the slip are differences of positions, whose rounding errors grow: no step is refused for them."""
    history = computed(tmp_path, RESTING.format(x=x, floor=x - 1.0, law=law))
    assert history["contact.floor.y"][-1] == pytest.approx(12.0, rel=0.05)
    assert len(history["time"]) == 6


def settled(mesh, stiffness, density, support):
    """A body of Poisson's ratio 0.25 that is held at its left ends, under its weight."""
    body = Body(
        "body", mesh, NeoHooke(mu=stiffness, lmbda=stiffness, density=density),
        supports=[Support("left", support)], gravity=(0.0, -1.0), comm=MPI.COMM_SELF,
    )  # fmt: skip
    structure = Structure([body])
    structure.initialise(0.0, 1.0)
    structure.step(0.0, 1.0)
    return structure


def flat(height):
    """A cantilever of 1 x 0.2 whose fourth column of cells is so high."""
    mesh = shapes.rectangle(size=(1.0, 0.2), cells=(8, 2))
    mesh.points[np.isclose(mesh.points[:, 0], 0.5), 0] = 0.375 + height
    return mesh


@pytest.mark.parametrize("height", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("density", [1e3, 1.0, 1e-3])
def test_flat_cells_bend(height, density):
    """Their rounding errors, of a stiffness that grows with 1 / height, are theirs alone."""
    found = [np.abs(settled(flat(h), 4e8, density, (0.0, 0.0)).now.u).max() for h in (height, 1e-4)]
    assert found[0] == pytest.approx(found[1], rel=1e-2)


def test_pieces_of_one_body():
    """A mesh of two rectangles without a common node, of which the upper one is stiff: the lower one sinks alone."""
    lower, upper = (shapes.rectangle(size=(1.0, 0.1), cells=(10, 2), origin=(0.0, y)) for y in (0.0, 3.0))
    n = len(lower.points)
    both = Mesh(
        np.concatenate([lower.points, upper.points]), np.concatenate([lower.cells, n + upper.cells]), "quad",
        {"left": np.concatenate([lower.surfaces["left"], n + upper.surfaces["left"]])},
    )  # fmt: skip
    moved = (lambda x, t: 1.0 * (x[1] > 2.0), 0.0)
    together = settled(both, lambda x, t: np.where(x[1] > 2.0, 1e11, 4.0), 1e-3, moved)
    alone = settled(lower, 4.0, 1e-3, moved)
    assert together.pieces.count == 2
    below = together.bodies[0].points[1, : together.bodies[0].owned] < 2.0
    sunk = np.abs(alone.now.u[1::2]).max()
    assert sunk > 0.01
    assert np.abs(together.now.u.reshape(-1, 2)[below, 1]).max() == pytest.approx(sunk, rel=1e-6)
