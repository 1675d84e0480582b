"""Contact through the program: processes, resume, balances, impact, opening and closing, and mistakes in the case."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from programs import fsci
from structure_setup import make_structure

from coupling.contact_surface import contact_surface
from fsci import shapes
from fsci.case import CaseError, load_case
from fsci.checkpoint import read_checkpoint
from fsci.history import read_history
from fsci.run import FINISHED, resume_run, run_case
from solvers.structure.materials import NeoHooke, lame

#: A rigid plate comes down on a block, slides and leaves it, twice.
PLATE = """\
title: a plate on a block
time: {step: 0.125, end: 1.0}
structure:
  bodies:
    block:
      mesh: {shape: box, size: [1, 1, 1], cells: [3, 3, 3]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1.0}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
contact:
  obstacles:
    plate:
      mesh: {shape: box, size: [3, 3, 1], cells: [1, 1, 1], translate: [-1, -1, 1.01]}
      on: bottom
      motion: ["0.05*t", "0.1*t", "-0.2*sin(2*pi*t)^2"]
  pairs:
    press: {slave: {body: block, on: top}, master: {obstacle: plate}}
probes:
  foot: {quantity: reaction, on: bottom}
  top: {quantity: displacement, at: [0.4, 0.5, 1]}
  energy: {quantity: energy}
solver: {newton: {residual: 1.0e-12}}
"""
#: Two blocks that fly; the left one is faster. Their centres miss each other.
COLLISION = """\
title: two blocks collide
time: {step: 0.02, end: 1.0}
structure:
  dynamics: {rho_inf: 1.0}
  bodies:
    left:
      mesh: {shape: rectangle, size: [1, 1], cells: [3, 4]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1.0}
      initial_velocity: [3, 0.5]
    right:
      mesh: {shape: rectangle, size: [1, 1], cells: [3, 3], cell: tri, translate: [1.2, 0.3]}
      material: {law: neo_hooke, E: 500, nu: 0.3, density: 2.0}
      initial_velocity: [-1, 0]
contact:
  pairs:
    meet: {slave: {body: left, on: right}, master: {body: right, on: left}}
probes:
  momentum: {quantity: momentum}
  right: {body: right, quantity: momentum}
  energy: {quantity: energy}
solver: {newton: {residual: 1.0e-12}}
"""


#: A block that slides between walls comes down on a plate by 0.1 per time; it is 0.035 above it.
PISTON = """\
title: a block between walls
time: {step: 0.1, end: 0.6}
structure:
  plane: strain
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [3, 2]}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.25}
      supports:
        - {on: [left, right], symmetry: true}
        - {on: top, displacement: [0, -0.1*t]}
contact:
  obstacles:
    plate: {mesh: {shape: rectangle, size: [3, 1], cells: [4, 1], translate: [-1, -1.035]}, on: top}
  pairs:
    press: {slave: {body: block, on: bottom}, master: {obstacle: plate}}
probes:
  pressure: {quantity: pressure, pair: press}
  least: {quantity: pressure, pair: press, extreme: least}
  corner: {quantity: pressure, pair: press, at: [1, 0]}
  gap: {quantity: gap, pair: press}
  wide: {quantity: gap, pair: press, extreme: largest}
  middle: {quantity: gap, pair: press, at: [0.3, 0.1]}
  touch: {quantity: first_contact, pair: press}
verify:
  - {value: touch, reference: 0.4, absolute: 1e-12}
solver: {newton: {residual: 1.0e-12}}
"""


def run(text, folder, *overrides):
    """Run a case in this process; its history."""
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml", list(overrides)), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plate")
    return folder / "out", run(PLATE, folder)


@pytest.fixture(scope="module")
def collision(tmp_path_factory):
    folder = tmp_path_factory.mktemp("collision")
    return folder / "out", run(COLLISION, folder)


def test_columns(plate):
    _, history = plate
    for name in ("active", "changes", "press.x", "press.y", "press.z"):
        assert f"contact.{name}" in history


def test_contact_closes_and_opens(plate):
    _, history = plate
    assert history["contact.active"].tolist() == [16, 16, 16, 0, 16, 16, 16, 0]
    assert np.abs(history["top.z"][[3, 7]]).max() < 1e-10
    depth = 0.2 * np.sin(2 * np.pi * history["time"]) ** 2 - 0.01
    closed = history["contact.active"] > 0
    assert history["top.z"][closed] == pytest.approx(-depth[closed], rel=1e-10)


def test_nothing_is_retried_and_newton_is_short(plate):
    out, history = plate
    assert json.loads((out / "summary.json").read_text())["steps"]["retried"] == 0
    assert history["iterations"].max() <= 6


def test_contact_force_is_the_reaction(plate):
    """Frictionless on a flat plate: only normal force, and the foot carries it."""
    _, history = plate
    size = np.abs(history["foot.z"]).max()
    for axis in "xyz":
        assert np.abs(history[f"contact.press.{axis}"] + history[f"foot.{axis}"]).max() < 1e-10 * size
    assert np.abs(history["contact.press.x"]).max() < 1e-10 * size
    assert history["contact.press.z"].min() < -100


@pytest.mark.parametrize("processes", [2, 3])
def test_processes_agree(plate, tmp_path, processes):
    _, alone = plate
    (tmp_path / "case.yaml").write_text(PLATE)
    result = fsci("run", tmp_path / "case.yaml", "-o", tmp_path / "out", processes=processes)
    assert result.returncode == FINISHED, result.stdout + result.stderr
    together = read_history(tmp_path / "out" / "history.csv")
    same_up_to_rounding(alone, together)


def same_up_to_rounding(one, two):
    """Vectors are compared as wholes: their small components are rounding errors."""
    for name in one.keys() - {"wall", "residual"}:
        group = [other for other in one if other.rsplit(".", 1)[0] == name.rsplit(".", 1)[0]]
        size = max(np.abs(one[other]).max() for other in group)
        assert np.abs(one[name] - two[name]).max() <= 1e-9 * size, name


def test_processes_agree_in_motion(collision, tmp_path):
    _, alone = collision
    (tmp_path / "case.yaml").write_text(COLLISION)
    result = fsci("run", tmp_path / "case.yaml", "-o", tmp_path / "out", processes=3)
    assert result.returncode == FINISHED, result.stdout + result.stderr
    same_up_to_rounding(alone, read_history(tmp_path / "out" / "history.csv"))


@pytest.mark.parametrize(("text", "end"), [(PLATE, 0.625), (COLLISION, 0.1)])
def test_resume_is_bitwise(text, end, tmp_path, plate, collision):
    """Stopped in the middle of contact."""
    straight, whole = plate if text is PLATE else collision
    out = tmp_path / "run" / "out"
    run(text, tmp_path / "run", ("time.end", str(end)))
    assert read_history(out / "history.csv")["contact.active"][-1] > 0
    (out / "case.yaml").write_text((out / "case.yaml").read_text().replace(f"end: {end}", "end: 1.0"))
    result = fsci("resume", out)
    assert result.returncode == FINISHED, result.stdout + result.stderr
    resumed = read_history(out / "history.csv")
    for name in whole.keys() - {"wall"}:
        assert np.array_equal(whole[name], resumed[name]), name
    (one, _), (two, _) = (read_checkpoint(folder / "checkpoint") for folder in (straight, out))
    contacts = [state["scheme"]["contact"] for state in (one, two)]
    for first, second in (contacts, [contact.pop("work") for contact in contacts]):
        for name, value in first.items():
            assert np.array_equal(value, second[name]), name
    for name in ("u", "v", "a"):
        for body, value in one["scheme"][name].items():
            assert np.array_equal(value, two["scheme"][name][body]), name


def test_surfaces_together_are_one():
    """Facets that are in two of them count once; nodes between them belong to both."""
    mesh = shapes.rectangle((2, 1), (4, 1), order=2)
    top = mesh.surfaces["top"]
    parts = {"west": top[:3], "east": top[2:]}
    mesh = replace(mesh, surfaces=mesh.surfaces | parts)
    bodies = [make_structure(mesh, NeoHooke(1.0, 1.0)).bodies[0]]
    whole, together = (contact_surface(bodies, "body", *n) for n in (("top",), tuple(parts)))
    assert np.array_equal(whole.points, together.points)
    assert np.array_equal(np.sort(whole.facets, axis=0), np.sort(together.facets, axis=0))
    assert together.name == "body.west.east"


def test_several_surfaces_of_an_obstacle(plate, tmp_path):
    """Sides of the plate that nothing comes near change nothing."""
    sides = PLATE.replace("on: bottom\n", "on: [bottom, left, top]\n")
    history = run(sides, tmp_path / "sides", ("time.end", "0.5"))
    assert history["contact.press.z"].min() < -1.0
    assert history["contact.press.z"] == pytest.approx(plate[1]["contact.press.z"][: len(history["time"])], rel=1e-9)


@pytest.mark.parametrize("text", [PLATE.replace("1.01]", "3]"), COLLISION.replace("[1.2, 0.3]", "[9, 0.3]")])
def test_bodies_that_never_meet(text, tmp_path):
    """The result without the section: static, bit for bit; free flight, in which mass may be anywhere, to rounding."""
    first, last = text.index("contact:\n"), text.index("probes:\n")
    apart, without = run(text, tmp_path / "with"), run(text[:first] + text[last:], tmp_path / "without")
    assert not apart["contact.active"].any()
    for name in without.keys() - {"wall", "residual", "structure.energy"}:
        if "dynamics" in text:
            assert np.abs(apart[name] - without[name]).max() < 1e-12 * max(1.0, np.abs(without[name]).max()), name
        else:
            assert np.array_equal(apart[name], without[name]), name


def test_momentum_of_a_collision(collision):
    _, history = collision
    momentum = np.array([3 - 2, 0.5])
    for axis, wanted in zip("xy", momentum, strict=True):
        assert np.abs(history[f"momentum.{axis}"] - wanted).max() < 1e-9 * np.linalg.norm(momentum)
    assert history["contact.active"].max() >= 3
    assert history["contact.active"][-1] == 0
    assert history["right.x"][-1] > 0 > history["right.x"][0]  # it has been thrown back


BEFORE = 0.5 * 1.0 * (3**2 + 0.5**2) + 0.5 * 2.0 * 1.0  #: energy of the two blocks before they meet


@pytest.mark.parametrize(("step", "end"), [("0.02", "1.0"), ("0.005", "1.0"), ("0.00125", "0.15")])
def test_contact_gives_no_energy(step, end, tmp_path):
    """Without damping; impact may take some (10 % with the large step, 1.1 % with the others).

    At t = 0.085 the corner of the left block slides onto the right one, into which it is bent by then: pushed out in
    one small step, it would give 25 %, pushed out as its area grows, 0.7 %.
    """
    history = run(COLLISION, tmp_path / "run", ("time.step", step), ("time.end", end))
    assert history["energy.total"].max() < (1 + 1e-9) * BEFORE
    assert history["energy.total"][-1] > (0.9 if step == "0.02" else 0.985) * BEFORE
    assert history["contact.active"].max() == 5


#: A soft block is pressed onto another one and dragged along, slowly.
DRAG = """\
title: press and drag
time: {step: 0.02, end: 1.6}
structure:
  dynamics: {rho_inf: 1}
  bodies:
    base:
      mesh: {shape: rectangle, size: [4, 1], cells: [12, 3], origin: [0, -1]}
      material: {law: neo_hooke, E: 500, nu: 0.3, density: 0.1}
      supports: [{on: bottom, displacement: [0, 0]}]
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [4, 4], origin: [0.5, 0.001]}
      material: {law: neo_hooke, E: 500, nu: 0.3, density: 0.1}
      supports: [{on: top, displacement: ["0.75*max(t - 1, 0)^2", "-0.3*min(t, 1)^2*(3 - 2*min(t, 1))"]}]
contact:
  pairs: {p: {slave: {body: block, on: bottom}, master: {body: base, on: top}}}
probes: {energy: {quantity: energy}}
"""


def test_slow_pressing_and_dragging(tmp_path):
    """Undamped: no energy from nothing, and a force without zigzag; with the mean of old and new force 5 N."""
    history = run(DRAG, tmp_path / "run")
    steps = json.loads((tmp_path / "run" / "out" / "summary.json").read_text())["steps"]
    stored, force = history["energy.internal"].max(), history["contact.p.y"]
    assert steps["retried"] == 0
    assert np.abs(history["structure.energy"]).max() < 0.01 * stored
    zigzag = np.abs(force[2:] - 2 * force[1:-1] + force[:-2]) / 4
    assert zigzag[force[1:-1] > 1.0].max() < 0.005 * force.max()
    assert history["contact.active"][-1] == 5
    assert force[history["time"] > 1.0] == pytest.approx(122.0, rel=0.015)


def test_a_body_without_a_node_off_its_slave_surfaces(tmp_path):
    text = COLLISION.replace("cells: [3, 4]", "cells: [1, 4]").replace("left, on: right}", "left, on: [left, right]}")
    (tmp_path / "case.yaml").write_text(text)
    with pytest.raises(CaseError) as caught:
        run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out")
    assert str(caught.value).split("\n")[0] == (
        f"{tmp_path / 'case.yaml'}:7:13: all nodes of the body are on slave surfaces, which have no mass in dynamics: "
        "use two or more cells between them, or make one of them the master"
    )


def test_momentum_of_a_damped_collision(tmp_path):
    history = run(COLLISION, tmp_path / "damped", ("structure.dynamics.rho_inf", "0.5"))
    assert np.abs(history["momentum.x"] - 1.0).max() < 1e-9
    assert np.abs(history["momentum.y"] - 0.5).max() < 1e-9


def test_a_small_overlap_at_the_start(tmp_path):
    """Two bars without lateral contraction that begin 2e-3 too long: each is shortened by half of it."""
    overlap, E = 2e-3, 1000.0
    law = f"material: {{law: st_venant_kirchhoff, E: {E}, nu: 0}}"
    history = run(
        f"""\
title: two bars
time: {{step: 1, end: 1}}
structure:
  bodies:
    left:
      mesh: {{shape: rectangle, size: [1, 1], cells: [2, 3]}}
      {law}
      supports: [{{on: left, symmetry: true}}, {{on: bottom, symmetry: true}}]
    right:
      mesh: {{shape: rectangle, size: [1, 1], cells: [2, 2], translate: [{1 - overlap}, 0]}}
      {law}
      supports: [{{on: right, symmetry: true}}, {{on: bottom, symmetry: true}}]
contact:
  pairs:
    joint: {{slave: {{body: left, on: right}}, master: {{body: right, on: left}}}}
probes:
  middle: {{body: left, quantity: displacement, on: right}}
solver: {{newton: {{residual: 1.0e-12}}}}
""",
        tmp_path / "bars",
    )
    stretch = 1 - overlap / 2
    assert history["middle.x"][0] == pytest.approx(-overlap / 2, rel=1e-10)
    assert history["contact.joint.x"][0] == pytest.approx(E * 0.5 * (stretch**2 - 1) * stretch, rel=1e-9)


def test_impact_in_one_step(tmp_path):
    """A block that would fly half its size into the plate within the first step."""
    history = run(
        """\
title: a block hits a wall
time: {step: 0.1, end: 0.5}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    block:
      mesh: {shape: box, size: [1, 1, 1], cells: [2, 2, 3]}
      material: {law: neo_hooke, E: 2000, nu: 0.3, density: 1.0}
      initial_velocity: [0, 0, -5]
contact:
  obstacles:
    wall: {mesh: {shape: box, size: [3, 3, 1], cells: [1, 1, 1], translate: [-1, -1, -1.02]}, on: top}
  pairs:
    hit: {slave: {body: block, on: bottom}, master: {obstacle: wall}}
probes:
  foot: {quantity: displacement, on: bottom}
  energy: {quantity: energy}
""",
        tmp_path / "hit",
        ("time.retry.halvings", "0"),
    )
    assert history["contact.active"][0] == 9
    assert history["foot.z"].min() > -0.02 - 1e-9
    assert history["foot.z"][-1] > 0.02  # and off it flies
    assert history["iterations"].max() <= 8


def test_uniform_pressure_is_that_of_the_column(tmp_path):
    """A plate on a block whose sides are held: the pressure of uniaxial strain, in a field of the results."""
    import meshio

    sides = "[{on: bottom, symmetry: true}, {on: left, symmetry: true}, {on: right, symmetry: true}, "
    sides += "{on: front, symmetry: true}, {on: back, symmetry: true}]"
    text = PLATE.replace("[{on: bottom, displacement: [0, 0, 0]}]", sides)
    history = run(text, tmp_path / "column", ("time.end", "0.25"))
    stretch = 1 - 0.19
    mu, lmbda = lame(1000, 0.3)
    pressure = -(mu * (stretch**2 - 1) + lmbda * np.log(stretch)) / stretch
    assert history["contact.press.z"][-1] == pytest.approx(-pressure, rel=1e-9)
    mesh = meshio.read(tmp_path / "column" / "out" / "fields" / "block_000002.vtu")
    top = mesh.points[:, 2] > stretch - 1e-6
    assert top.sum() == 16
    assert mesh.point_data["contact_pressure"][top] == pytest.approx(pressure, rel=1e-9)
    assert mesh.point_data["contact_traction"][top, 2] == pytest.approx(-pressure, rel=1e-9)


# --------------------------------------------------------------------------------------------------- mistakes in a case

PRESS = "    press: {slave: {body: block, on: top}, master: {obstacle: plate}}"
BOX_SURFACES = "(available: left, right, front, back, bottom, top)"

#: what is replaced, by what, the message with line and column, the text that stands there
MISTAKES = [
    ("body: block, on: top", "body: blok, on: top", "16:27: unknown body 'blok'; did you mean 'block'?", "blok"),
    (
        "body: block, on: top",
        "body: block, on: tpo",
        f"16:38: 'box' has no surface 'tpo'; did you mean 'top'? {BOX_SURFACES}",
        "tpo",
    ),
    ("obstacle: plate", "obstacle: plat", "16:63: unknown obstacle 'plat'; did you mean 'plate'?", "plat"),
    ("on: bottom\n", "on: botom\n", f"13:11: 'box' has no surface 'botom'; did you mean 'bottom'? {BOX_SURFACES}", "b"),
    (
        "{body: block, on: top}",
        "{obstacle: plate}",
        "16:20: the slave must be a surface of a body: make the obstacle the master",
        "{obstacle",
    ),
    (
        "body: block, on: top",
        "body: block",
        "16:27: a side of a body needs the setting 'on', the name of its surface",
        "block",
    ),
    (
        "{obstacle: plate}",
        "{obstacle: plate, body: block, on: top}",
        "16:52: give either 'body' and 'on', or 'obstacle'",
        "{obstacle",
    ),
    ("{obstacle: plate}", "{on: top}", "16:52: give either 'body' and 'on', or 'obstacle'", "{on"),
    (
        "{obstacle: plate}",
        "{obstacle: plate, on: top}",
        "16:74: the surface of an obstacle is named where the obstacle is",
        "top",
    ),
    ("  pairs:\n" + PRESS, "  pairs: {}", "15:10: 'pairs' needs at least one pair", "{}"),
    ("  pairs:\n" + PRESS + "\n", "", "9:1: missing setting 'pairs' in 'contact'", "contact"),
    (
        "body: block, on: top",
        "body: block, on: [left, tpo]",
        f"16:45: 'box' has no surface 'tpo'; did you mean 'top'? {BOX_SURFACES}",
        "tpo",
    ),
    (
        "master: {obstacle: plate}",
        "master: {body: block, on: [left, top]}",
        "16:52: a surface cannot touch itself: name another master",
        "{body",
    ),
    (
        "master: {obstacle: plate}",
        "master: {body: block, on: top}",
        "16:52: a surface cannot touch itself: name another master",
        "{body",
    ),
    (", \"-0.2*sin(2*pi*t)^2\"]", "]", "14:15: 'motion' must have 3 entries in 3D, not 2", "["),
    ("contact:\n", "contact:\n  c_n: 0\n", "10:8: 'c_n' must be greater than 0, not 0", "0"),
    (
        "contact:\n",
        "contact:\n  friction: 1\n",
        "10:3: unknown setting 'friction' (available: pairs, obstacles, c_n)",
        "friction",
    ),
    (
        "quantity: displacement, at: [0.4, 0.5, 1]",
        "quantity: gap, pair: press, at: [0.4, 0.5, 1], extreme: least",
        "19:65: give either 'at' or 'extreme', not both",
        "least",
    ),
    (
        "quantity: displacement, at: [0.4, 0.5, 1]",
        "quantity: first_contact, pair: press, extreme: least",
        "19:56: 'first_contact' is that of the whole pair: no 'extreme'",
        "least",
    ),
    (
        "quantity: displacement, at: [0.4, 0.5, 1]",
        "quantity: pressure, pair: pres",
        "19:35: unknown pair 'pres'; did you mean 'press'?",
        "pres",
    ),
    (
        "quantity: displacement, at: [0.4, 0.5, 1]",
        "quantity: first_contact",
        "19:19: quantity 'first_contact' needs 'pair: PAIR'",
        "first",
    ),
    (
        "quantity: displacement, at: [0.4, 0.5, 1]",
        "quantity: gap, pair: press, on: top",
        "19:41: give either 'pair' or 'on', not both",
        "top",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message", "at"), MISTAKES, ids=[m[2] for m in MISTAKES])
def test_message(old, new, message, at, tmp_path):
    path = tmp_path / "case.yaml"
    assert PLATE.count(old) >= 1
    text = PLATE.replace(old, new, 1)
    path.write_text(text)
    with pytest.raises(CaseError) as caught:
        load_case(path)
    lines = [str(problem).split("\n")[0] for problem in caught.value.problems]
    found = [i for i, line in enumerate(lines) if line == f"{path}:{message}"]
    assert found, lines
    assert len(lines) == 1, lines
    place = caught.value.problems[found[0]].place
    assert text.split("\n")[place.line - 1][place.column - 1 :].startswith(at)


def test_the_case_without_mistakes_loads(tmp_path):
    (tmp_path / "case.yaml").write_text(PLATE)
    assert load_case(tmp_path / "case.yaml").warnings == ()


def test_probes_of_a_pair(tmp_path):
    """Uniaxial strain: with the stretch s the pressure of St. Venant-Kirchhoff is (lambda + 2 mu)/2 (1 - s^2) s."""
    history = run(PISTON, tmp_path)
    t, (mu, lmbda) = history["time"], lame(1000, 0.25)
    stretch = 1.0 - np.maximum(0.1 * t - 0.035, 0.0)
    pressure = 0.5 * (lmbda + 2.0 * mu) * (1.0 - stretch**2) * stretch
    for name in ("pressure", "least", "corner"):
        assert history[name] == pytest.approx(pressure, rel=1e-9, abs=1e-9)
    for name in ("gap", "wide", "middle"):
        assert history[name] == pytest.approx(np.maximum(0.035 - 0.1 * t, 0.0), abs=1e-12)
    assert np.array_equal(history["touch"], [np.nan] * 3 + [t[3]] * 3, equal_nan=True)
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["verify"][0]["ok"]


def test_first_contact_is_remembered(tmp_path):
    """By a run that goes on after the contact, and by one that stopped just in the step of it."""
    (tmp_path / "case.yaml").write_text(PISTON)
    for end in ("0.4", "0.5"):
        out = tmp_path / end
        assert run_case(load_case(tmp_path / "case.yaml", [("time.end", end), ("verify", "[]")]), out) == FINISHED
        text = (out / "case.yaml").read_text().replace(f"end: {end}", "end: 0.6")
        (out / "case.yaml").write_text(text)
        assert resume_run(out) == FINISHED
        assert read_history(out / "history.csv")["touch"][3:] == pytest.approx([0.4] * 3)
