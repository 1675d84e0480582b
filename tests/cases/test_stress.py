"""`fsci stress`: frames, draws, verdicts that can fall each way, and a few draws."""

import json
from dataclasses import replace

import numpy as np
import pytest
from programs import fsci

from fsci.case import load_case
from fsci.expression import Expression
from fsci.stress import long_run, program, run
from fsci.stress.draw import Draw, draw
from fsci.stress.frame import Frame
from fsci.stress.judge import distance, failure_of, missing_warning, other_bits, out_of_balance
from fsci.stress.mutants import cases
from fsci.stress.program import NEVER_ENDED, Ended
from fsci.stress.scene import StressScene, read_scenes, series

pytestmark = pytest.mark.usefixtures("runs_in_copies")

SPACE, FURTHER, COMPOSED = 100_000, 200_000, 300_000

FRAME = Frame(angle=30, shift=(3, -2), length=1e-3, mass=100.0, time=10.0)
QUANTITIES = {"c": "centre", "f": "force", "u": "displacement", "e": "energy"}


def test_frames_there_and_back():
    """Centres are turned, shifted and scaled; forces are per metre of depth: kg/s^2."""
    points, force, u = np.array([[1.0, 2.0], [0.5, -1.0]]), (3.0, 4.0), (0.1, 0.2)
    centre = np.array([FRAME.point(x) for x in points])
    turned = FRAME.turned(force) * 100.0 / 10.0**2
    history = {
        "time": np.array([10.0, 20.0]),
        "c.x": centre[:, 0],
        "c.y": centre[:, 1],
        **{f"f.{axis}": np.full(2, value) for axis, value in zip("xy", turned, strict=True)},
        **{f"u.{axis}": np.full(2, v) for axis, v in zip("xy", FRAME.vector(u, (1, 0, 0)), strict=True)},
        **{f"e.{part}": np.full(2, 7.0 * 1e-3 * 100.0 / 10.0**2) for part in ("kinetic", "internal", "work", "total")},
    }
    found = FRAME.back(history, QUANTITIES)
    assert found["time"] == pytest.approx([1.0, 2.0])
    assert np.stack([found["c.x"], found["c.y"]], axis=1) == pytest.approx(points)
    assert (found["f.x"][0], found["f.y"][0]) == pytest.approx(force)
    assert (found["u.x"][0], found["u.y"][0]) == pytest.approx(u)
    assert found["e.total"] == pytest.approx([7.0, 7.0])


def test_quarter_turns_are_exact():
    frame = Frame(angle=90.0)
    assert [frame.side(name) for name in ("x-", "x+", "y-", "y+")] == ["y-", "y+", "x+", "x-"]
    assert frame.grid((0, 0), (2, 1), (20, 10)) == {"from": [-1.0, 0.0], "to": [0.0, 2.0], "cells": [10, 20]}
    assert frame.vector((1, 0), (0, 0, 0)) == [0.0, 1.0]
    assert frame.vector(("min(t, 1)", 0), (0, 0, 0)) == [0.0, "1.0*(min((t/1.0), 1))"]
    assert FRAME.vector((0, "2*t"), (1, 0, 0)) == [f"{v!r}*(2*(t/10.0))" for v in FRAME.vector((0, 1), (1, 0, 0))]


def test_functions_of_place():
    """An inflow has the same value at the same place of the scene."""
    profile = "4*y*(1 - y)*t + x"
    x, t = np.array([0.2, 0.7]), 0.3
    there = FRAME.point(x)
    own, turned = Expression.parse(profile), FRAME.vector((profile, 0), (1, 0, -1))
    found = [Expression.parse(text)(np.array([there]).T, t * FRAME.time)[0] for text in turned]
    value = own(x[:, None], t)[0]
    assert found == pytest.approx(FRAME.vector((value, 0), (1, 0, -1)))


def test_turns_in_space():
    """About the diagonal of a cube axes become axes, exactly; any other axis keeps lengths and the axis."""
    frame = Frame(angle=120.0, axis=(1.0, 1.0, 1.0), shift=(1.0, 2.0, 3.0))
    assert frame.vector((1, 2, 3), (0, 0, 0)) == [3.0, 1.0, 2.0]
    assert [frame.side(name) for name in ("x-", "y+", "z-")] == ["y-", "z+", "x-"]
    assert frame.grid((0, 0, 0), (2, 1, 1), (12, 6, 6)) == {
        "from": [3.0, 1.0, 2.0],
        "to": [4.0, 3.0, 3.0],
        "cells": [6, 12, 6],
    }
    oblique = Frame(angle=33.0, axis=(1.0, -2.0, 0.5))
    assert np.linalg.norm(oblique.turned((3, 4, 12))) == pytest.approx(13.0)
    assert oblique.turned(oblique.axis) == pytest.approx(oblique.axis)
    box = {"mesh": {"shape": "box", "size": [1, 1, 1], "translate": [0, 0, 0], "cells": [1, 1, 1]}}
    mesh = oblique.case({"structure": {"bodies": {"body": box}}})["structure"]["bodies"]["body"]["mesh"]
    assert (mesh["shape"], mesh["rotate"]) == ("box", [{"axis": [1.0, -2.0, 0.5], "angle": 33.0}])
    history = {"time": np.ones(1), **{f"f.{axis}": v for axis, v in zip("xyz", oblique.turned((1, 2, 3)), strict=True)}}
    found = oblique.back(history, {"f": "force"}, 3)
    assert [found[f"f.{axis}"] for axis in "xyz"] == pytest.approx([1.0, 2.0, 3.0])


def test_draws_in_space():
    draws = [draw(SPACE + seed) for seed in range(100)]
    assert {one.scene.name for one in draws} == series(SPACE).keys()
    assert all(one.scene.dim == 3 for one in draws)
    turned = [one.frame for one in draws if one.twin == "rotated" and one.scene.any_angle]
    assert any(np.abs(frame.rotation - np.rint(frame.rotation)).max() > 0.1 for frame in turned)


@pytest.mark.parametrize("scene", sorted(series(SPACE)))
@pytest.mark.slow
def test_a_draw_of_each_scene_in_space(scene):
    seed = next(s for s in range(SPACE, SPACE + 1000) if s % 5 != 4 and draw(s).scene.name == scene)
    assert run.judge(seed).verdict == "right"


def test_further_draws():
    """Each scene comes up; what is held is turned with it."""
    draws = [draw(FURTHER + seed) for seed in range(40)]
    assert {one.scene.name for one in draws} == series(FURTHER).keys()
    held = next(one for one in draws if one.scene.parameters.get("held") == ["x"])
    turned = held.case(Frame(angle=90.0))["fluid"]["bodies"]["body"]["free"]
    assert (turned["held"], turned["gravity"]) == (["y"], [1.0, 0.0])


@pytest.mark.parametrize("scene", sorted(series(FURTHER)))
@pytest.mark.slow
def test_a_further_draw_of_each_scene(scene):
    """Some are refused with a message: bodies that leave fine cells, impacts that a step does not resolve."""
    seeds = [s for s in range(FURTHER, FURTHER + 30) if s % 5 != 4 and draw(s).scene.name == scene]
    verdicts = [run.judge(seed).verdict for seed in seeds[:2]]
    assert "wrong" not in verdicts
    assert "right" in verdicts


def test_composed_draws():
    """Each scene and twin comes up; the body beside a scene is in the twin alone."""
    draws = [draw(COMPOSED + seed) for seed in range(100)]
    assert {one.scene.name for one in draws} == series(COMPOSED).keys()
    assert len({one.twin for one in draws}) == 6
    one = next(one for one in draws if one.twin == "beside")
    bodies = [set(one.case(Frame(), twin)["structure"]["bodies"]) for twin in (False, True)]
    assert bodies[1] - bodies[0] == {"beside"}


@pytest.mark.parametrize("scene", sorted(series(COMPOSED)))
@pytest.mark.slow
def test_a_composed_draw_of_each_scene(scene):
    seeds = [s for s in range(COMPOSED, COMPOSED + 60) if draw(s).scene.name == scene and draw(s).twin == "beside"]
    assert run.judge(next(s for s in seeds if s % 5 != 4)).verdict == "right"


def test_a_scene_at_rest_has_rounding_errors():
    """They are larger than a millionth of its forces, which are rounding errors themselves."""
    heavy = replace(DRAW, scene=replace(SCENE, name="fall", parameters={"density": 0.1}))
    rests = {"force.x": np.zeros(2), "force.y": np.full(2, 1e-14), "interface.momentum": np.full(2, 1.4e-14)}
    assert out_of_balance(heavy, replace(GOOD, history={**HISTORY, **rests})) == ""
    rests["interface.momentum"][1] = 1e-12
    assert out_of_balance(heavy, replace(GOOD, history={**HISTORY, **rests})).startswith("interface.momentum misses")
    heavy.scene.parameters["solid density"] = 30.0  # its weight has rounding errors, too
    assert out_of_balance(heavy, replace(GOOD, history={**HISTORY, **rests})) == ""
    rests["interface.momentum"][1] = 4e-12
    assert out_of_balance(heavy, replace(GOOD, history={**HISTORY, **rests})).startswith("interface.momentum misses")


def test_a_free_body_that_has_left_the_box_has_no_force():
    """Round-off of the momentum is compared with that of the flow then."""
    free = replace(DRAW, scene=replace(SCENE, name="free", parameters={"density": 2.0}))
    gone = {"force.x": np.zeros(2), "force.y": np.zeros(2), "interface.momentum": np.array([0.0, 1e-12])}
    assert out_of_balance(free, replace(GOOD, history={**HISTORY, **gone})) == ""
    gone["interface.momentum"][1] = 1e-5
    assert out_of_balance(free, replace(GOOD, history={**HISTORY, **gone})).startswith("interface.momentum misses")


def test_draws_are_the_same_every_time():
    draws = [draw(seed) for seed in range(200)]
    assert {one.scene.name for one in draws} == series(0).keys()
    assert len({one.twin for one in draws}) == 5
    for seed, one in enumerate(draws):
        again = draw(seed)
        assert json.dumps(again.case(again.frame)) == json.dumps(one.case(one.frame))
        assert again.scene.parameters == one.scene.parameters


def test_a_body_is_moved_against_the_grid():
    one, other = draw(310), draw(310).moved(1e-12)
    starts = [d.case(Frame())["fluid"]["bodies"]["body"]["mesh"]["translate"] for d in (one, other)]
    assert np.subtract(*starts) == pytest.approx([-1e-12, -1e-12], rel=1e-3)
    assert one.case(Frame())["fluid"]["grid"] == other.case(Frame())["fluid"]["grid"]
    assert one.frame == other.frame


@pytest.mark.slow
def test_a_side_that_comes_to_lie_in_a_plane_of_the_grid_is_an_edge():
    """A shift of body and grid leaves it in the plane; one of the body alone gives the difference of the twin."""
    assert run.judge(310).verdict in ("edge", "right")


SCENE = StressScene("beam", {}, {"probes": {"tip": {"quantity": "displacement"}}}, must_warn=("lock",))
DRAW = Draw(0, SCENE, "shifted", Frame())
HISTORY = {"time": np.array([1.0, 2.0]), "wall": np.ones(2), "tip.x": np.array([1.0, 2.0]), "tip.y": np.zeros(2)}
GOOD = Ended(0, "warning: cells lock", HISTORY, {})


def changed(name, values):
    return replace(GOOD, history={**HISTORY, name: np.array(values)})


def test_what_no_run_may_do():
    assert failure_of(GOOD) == ""
    assert failure_of(Ended(NEVER_ENDED, "", {}, {})) == "exit code -1000: it did not end"
    assert failure_of(Ended(-11, "Segmentation fault", {}, {})) == "exit code -11: Segmentation fault"
    assert failure_of(Ended(1, "Traceback\nKeyError", {}, {})) == "a traceback: KeyError"
    assert failure_of(Ended(1, "", {}, {})) == "it failed without a word"
    assert failure_of(Ended(1, "the step failed", {}, {})) == ""


def test_dangers_have_to_be_named():
    assert missing_warning(DRAW, GOOD) == ""
    assert missing_warning(DRAW, replace(GOOD, words="")) == "no warning that has 'lock'"


def test_balances():
    assert out_of_balance(DRAW, GOOD) == ""
    assert out_of_balance(DRAW, changed("tip.x", [1.0, np.nan])) == "tip.x is not finite"
    leaking = replace(GOOD, history={**HISTORY, "fluid.mass": np.array([0.0, 1e-3]), "out": np.ones(2)})
    assert out_of_balance(DRAW, leaking) == "fluid.mass misses 0.001, more than 1e-06"
    resting = replace(GOOD, history={**HISTORY, "fluid.mass": np.array([1e-15, 1e-14]), "out": np.full(2, 1e-16)})
    assert out_of_balance(DRAW, resting) == ""
    pushing = {"interface.momentum": np.array([1.0, 0.0]), "force.x": np.ones(2), "force.y": np.ones(2)}
    found = out_of_balance(DRAW, replace(GOOD, history={**HISTORY, **pushing}))
    assert found == "interface.momentum misses 1, more than 1e-06"


def test_twins_have_to_agree():
    assert distance(DRAW, GOOD, GOOD, Frame()) == (0.0, "")
    assert distance(DRAW, GOOD, changed("tip.y", [0.0, 0.02]), Frame()) == (0.01, "tip")
    assert distance(DRAW, GOOD, changed("time", [1.0, 1.5]), Frame()) == (np.inf, "the last time")
    assert other_bits(GOOD, changed("wall", [3.0, 4.0])) == ""
    assert other_bits(GOOD, changed("tip.y", [0.0, 1e-300])) == "tip.y has other bits"


@pytest.mark.slow
def test_a_twin_rotated_the_wrong_way_is_detected(tmp_path, monkeypatch):
    """A whole draw whose twin is turned, but brought back as if it were not."""
    seed = next(s for s in range(1000) if s % 5 != 4 and draw(s).twin == "rotated" and draw(s).scene.name == "beam")
    assert run.judge(seed).verdict == "right"
    monkeypatch.setattr(Frame, "back", lambda frame, history, quantities, dim: history)
    assert run.judge(seed).verdict == "wrong"


@pytest.mark.slow
def test_a_gate_that_closes_a_basin_turned_around():
    """The pressure in the basin, which nothing determines, does not depend on the order of its nodes."""
    one = run.judge(11)
    assert (one.scene, one.twin, one.verdict) == ("gate", "rotated by 180 degrees", "right")


@pytest.mark.slow
def test_a_block_that_begins_on_the_floor_and_leaves_it():
    """Fluid comes under it, although its bottom is on the boundary of the box at the start."""
    one = run.judge(73)
    assert (one.scene, one.parameters["height"], one.verdict) == ("fall", 0.0, "right")


@pytest.mark.slow
def test_a_stack_beside_a_column_whose_residual_grows():
    """Residuals that grow in a body without contact call for no line search, as without the stack."""
    one = run.judge(300011)
    assert (one.scene, one.twin, one.verdict) == ("stack", "beside a body of 0.018 Pa", "right")


@pytest.mark.slow
def test_a_ring_that_closes_with_friction_beside_a_column():
    """The residual of the column does not decide how far the steps of the ring are shortened."""
    one = run.judge(440031)
    assert (one.scene, one.twin[:6], one.verdict) == ("curl", "beside", "right")


@pytest.mark.slow
def test_a_ring_that_closes_with_friction_at_another_angle():
    """Which facets are near at the beginning of the step in which its ends meet depended on the angle to the axes."""
    one = run.judge(300158)
    assert (one.scene, one.twin, one.verdict) == ("curl", "rotated by 290.26 degrees", "right")


def test_a_beam_in_units_in_which_its_stiffness_is_tiny():
    """1e-21: no pivot is zero because of its units."""
    one = run.judge(215)
    assert (one.scene, one.twin, one.verdict) == ("beam", "units times 1000, 1e-12, 1e+06", "right")


@pytest.mark.slow
def test_an_impact_that_the_step_does_not_resolve_is_reported():
    """The block leaves with twice its energy."""
    one = run.judge(166)
    assert (one.scene, one.verdict) == ("drop", "right")


def test_command_line(tmp_path):
    out = tmp_path / "stress.json"
    done = fsci("stress", "2", "--seed", "3", "-o", out)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[0].split() == ["scene", "draws", "right", "edge", "refused", "wrong"]
    assert done.stdout.splitlines()[-1].split()[:2] == ["all", "2"]
    assert [one["seed"] for one in json.loads(out.read_text())["outcomes"]] == [3, 4]
    assert "write a whole number, not 'x'" in fsci("stress", "x").stderr


def test_many_steps():
    """The rows of a run of 20 steps; thousands by `fsci stress --steps 10000`."""
    rows = long_run.long_run(20, parts=2)
    assert [row["up to step"] for row in rows] == [10, 20]
    assert all(row["mass"] < 1e-6 and row["memory [MB]"] > 50 for row in rows)
    assert rows[1]["step [ms]"] > 0


def pull_a_flat_block_off_the_floor(transmissivity, folder):
    """A run: the block lies on the floor from 0.6 s on and is pulled up from 1.17 s on."""
    case = json.loads(json.dumps(cases()["long"]))
    block = {**case["structure"]["bodies"].pop("disc"), "gravity": [0, "-2 - 4*sin(pi*t)"]}
    block["mesh"] = {"shape": "rectangle", "size": [0.62, 0.7], "cells": [2, 2], "origin": [0.21, 0.01]}
    case["structure"]["bodies"]["block"] = block
    case["contact"]["pairs"]["floor"]["slave"] = {"body": "block", "on": "bottom"}
    if transmissivity:
        case["contact"]["film"] = {"transmissivity": transmissivity}
    return program.run(folder, {**case, "time": {"step": 0.01, "end": 1.5}})


@pytest.mark.slow
def test_suction_without_a_layer_is_the_limit_of_thin_layers(tmp_path):
    """The thinner the layer is through which fluid comes under it, the slower it rises; without one it rises, too."""
    runs = [pull_a_flat_block_off_the_floor(layer, tmp_path / str(layer)) for layer in (0.0, 1e-6, 1e-5)]
    for ended in runs:
        assert ended.code == 0, ended.message
        time, active = ended.history["time"], ended.history["contact.active"]
        assert (active[(time > 0.6) & (time < 1.1)] > 0).all()
        assert (active[time > 1.25] == 0).all(), "its weight turns at 1.167 s"
    without, thin, thick = (ended.history["centre.y"][-1] for ended in runs)
    assert 0.35 < without < thin < thick
    assert thin - without < 0.5 * (thick - thin)


@pytest.mark.slow(seconds=65)
def test_many_draws():
    outcomes = run.stress(range(1000, 1015), print)
    assert not [one for one in outcomes if one.verdict == "wrong"]


OWN = """\
hanging:
  words: a block that hangs by its top
  any_angle: true
  parameters:
    E: {spread: [10, 1000]}
    cells: [1, 2]
    load: "{0.01*E}"
    soft: {choice: [true, false], when: E > 1.0e9, else: false}
  case:
    time: {step: 1, end: 2}
    structure:
      bodies:
        block:
          mesh: {shape: rectangle, size: [1, 1], translate: [0, 0], cells: ["{cells}", "{2*cells}"]}
          material: {law: neo_hooke, E: "{E}", nu: 0.3, density: 1}
          supports: [{on: top, displacement: [0, 0]}]
          tractions: [{on: bottom, value: [0, "-{load}*t"]}]
          gravity: [0, -1]
          pressures: [{when: soft, on: left, value: "{load}"}]
    probes: {low: {quantity: displacement, on: bottom}, force: {quantity: reaction, on: top}}
"""


def test_a_scene_from_outside(tmp_path):
    """One entry of a file: what is drawn, a case with formulas of it; twins are made of it as of ours."""
    (tmp_path / "own.yaml").write_text(OWN)
    done = fsci("stress", "2", "--scenes", tmp_path / "own.yaml", "-o", tmp_path / "out.json")
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads((tmp_path / "out.json").read_text())["outcomes"]
    assert {(one["scene"], one["verdict"]) for one in found} == {("hanging", "right")}
    assert [one["twin"].split()[0] for one in found] == ["rotated", "units"]
    assert all(one["parameters"]["load"] == pytest.approx(0.01 * one["parameters"]["E"]) for one in found)


def test_a_case_in_another_frame(tmp_path):
    """Settings change by their units, vectors and points are turned, what is a number of cells stays."""
    (tmp_path / "own.yaml").write_text(OWN)
    one = draw(0, tmp_path / "own.yaml")
    E, load = one.scene.parameters["E"], one.scene.parameters["load"]
    found = one.case(Frame(angle=90.0, shift=(1.0, 2.0), length=10.0, mass=3.0, time=2.0))
    body = found["structure"]["bodies"]["block"]
    stress = 3.0 / 10.0 / 2.0**2
    assert (found["time"]["step"], found["time"]["end"]) == (2.0, 4.0)
    assert body["mesh"]["size"] == [10.0, 10.0]
    assert (body["mesh"]["rotate"], body["mesh"]["translate"]) == ([{"angle": 90.0}], [-20.0, 10.0])
    assert (body["material"]["law"], body["material"]["nu"]) == ("neo_hooke", 0.3)
    assert body["material"]["E"] == pytest.approx(E * stress)
    assert body["material"]["density"] == pytest.approx(3.0 / 10.0**3)
    assert body["gravity"] == pytest.approx([10.0 / 2.0**2, 0.0])
    value, zero = body["tractions"][0]["value"]
    assert zero == 0.0
    assert value.endswith(f"*(-{load!r}*(t/2.0))")
    assert float(value.split("*")[0]) == pytest.approx(-stress)
    assert "pressures" not in body or body["pressures"] == []


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("any_angle", "any_angel", "scene 'hanging' has an unknown entry 'any_angel'"),
        ("  words:", "  title:", "scene 'hanging' needs 'words', 'parameters' and 'case'"),
        ("{load}*t", "{laod}*t", "unknown name 'laod'"),
        (
            "gravity: [0, -1]",
            "point_forces: [{at: [0, 0], value: [0, 1]}]",
            "there is no rule for 'value'",
        ),
        ("translate: [0, 0], ", "", "a mesh needs 'translate'"),
        ("hanging:", "hanging: [", "own.yaml: while parsing"),
        ("  words:", "  from: 400\n  words:", "no scene is drawn from number 0; the first one has 400: --seed 400"),
    ],
)
def test_mistakes_of_scenes(old, new, message, tmp_path):
    assert old in OWN
    (tmp_path / "own.yaml").write_text(OWN.replace(old, new, 1))
    done = fsci("stress", "1", "--scenes", tmp_path / "own.yaml")
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("name", read_scenes())
def test_each_scene_is_a_case_with_probes(name, tmp_path):
    """In the frame of its twin, too."""
    scene = read_scenes()[name]
    seeds = range(scene["from"], scene["from"] + 1000)
    one = next(one for one in map(draw, seeds) if one.scene.name == name and one.twin == "rotated")
    for frame in (Frame(), one.frame):
        (tmp_path / "case.yaml").write_text(json.dumps(one.case(frame)))
        assert load_case(tmp_path).probes
