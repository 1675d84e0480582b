"""Free rigid bodies in cases without a fluid: alone, with elastic bodies and tools; resumed, on two processes."""

import numpy as np
import pytest
from programs import fsci
from scipy.integrate import solve_ivp

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: A pendulum, two squares on a spring, one of which lies on a floor.
ALONE = """\
title: loose bodies
time: {step: 0.02, end: 0.2}
rigid:
  gravity: [0, -10]
  bodies:
    bar: {mesh: {shape: rectangle, origin: [0, 1.95], size: [1, 0.1], cells: [1, 1]}, density: 3, pivot: [0, 2]}
    one:
      mesh: {shape: rectangle, origin: [4, 0], size: [1, 1], cells: [2, 2]}
      density: 2
      springs: [{at: [5, 0.5], stiffness: 40, dashpot: 1, to: {body: two, at: [6, 0.5]}, length: 0.8}]
    two: {mesh: {shape: rectangle, origin: [6, 3], size: [1, 1], cells: [1, 1]}, density: 5, gravity: [0, -5]}
contact:
  obstacles:
    floor: {mesh: {shape: rectangle, origin: [-5, -1], size: [20, 1], cells: [1, 1]}, on: top}
probes:
  tip: {body: bar, quantity: displacement, at: [1, 2]}
  bar: {body: bar, quantity: angular_momentum}
  one: {body: one, quantity: centre}
  two: {body: two, quantity: momentum}
solver: {newton: {residual: 1.0e-12}}
"""

#: A stamp on an elastic block: a rigid obstacle with a mass, pressed by a force that grows and stays.
PRESS = """\
title: a stamp on a block
time: {step: 4, end: 120}
structure:
  dynamics: {rho_inf: 0}
  bodies:
    block:
      mesh: {shape: rectangle, origin: [-0.5, 0], size: [1, 1], cells: [4, 4]}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1.0e-3}
      supports: [{on: bottom, displacement: [0, 0]}]
contact:
  pairs: {press: {slave: {body: block, on: top}, master: {obstacle: stamp}}}
  obstacles:
    stamp:
      mesh: {shape: rectangle, origin: [-0.713, 1], size: [1.5, 0.3], cells: [1, 1]}
      on: bottom
      free: {density: 1.0e-3, held: [x, rotation], loads: [{force: [0, "-4*ramp(t, 0, 40)"]}]}
probes:
  depth: {quantity: displacement, body: block, at: [0.5, 1]}
  stamp: {quantity: displacement, field: rigid, body: stamp, at: [0, 1.15]}
solver: {newton: {residual: 1.0e-11}}
"""


def write(folder, text):
    folder.mkdir(exist_ok=True)
    path = folder / "case.yaml"
    path.write_text(text)
    return path


def run(folder, text, *overrides):
    assert run_case(load_case(write(folder, text), overrides), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


def test_bodies_fall_swing_and_lie(tmp_path):
    history = run(tmp_path / "a", ALONE)
    angle = -np.arcsin(history["tip.y"][-1])
    quarter = 1.5 * 10.0 * (0.5 * 0.2**2) / 1.005  # the turn by 3 g / 2 l, for small times: J = m (l^2 + b^2 / 4) / 3
    assert angle == pytest.approx(quarter * 1.0, rel=0.02)
    assert np.abs(history["one.y"] - 0.5).max() < 1e-9
    weight = history["contact.on_one.y"]
    assert weight[-1] == pytest.approx(20.0, rel=0.2)  # less what the stretched spring pulls up
    assert sorted(path.name for path in (tmp_path / "a" / "out" / "fields").glob("*.pvd"))


def test_the_check_names_them(tmp_path):
    done = fsci("check", write(tmp_path / "a", ALONE))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "rectangle, rigid, free" in done.stdout


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(ALONE, id="alone"),
        pytest.param(PRESS.replace("end: 120", "end: 40"), id="press", marks=pytest.mark.slow),
    ],
)
def test_resumed_and_on_two_processes(tmp_path, text):
    """A run that stopped halfway ends with the same numbers, bit for bit; two processes have them to rounding."""
    case = load_case(write(tmp_path / "a", text))
    half = repr(0.5 * case.time.end)
    histories = []
    for name, words in (
        ("once", [["run", case.path, "-o", tmp_path / "once"]]),
        (
            "twice",
            [
                ["run", case.path, "-o", tmp_path / "twice", "--set", f"time.end={half}"],
                ["resume", tmp_path / "twice", "--set", f"time.end={case.time.end}"],
            ],
        ),
    ):
        for command in words:
            done = fsci(*command)
            assert done.returncode == 0, done.stdout + done.stderr
        histories.append(read_history(tmp_path / name / "history.csv"))
    once, twice = histories
    for name in once.keys() - {"wall"}:
        assert np.array_equal(once[name], twice[name], equal_nan=True), name
    done = fsci("run", case.path, "-o", tmp_path / "two", processes=2)
    assert done.returncode == 0, done.stdout + done.stderr
    two = read_history(tmp_path / "two" / "history.csv")
    for name in once.keys() - {"wall", "residual", "iterations"}:
        assert once[name] == pytest.approx(two[name], rel=1e-8, abs=1e-9, nan_ok=True), name


def test_a_force_presses_as_far_as_the_moved_tool_that_needs_it(tmp_path):
    """Once at rest: the contact force is the load, and a tool moved as far exerts it, to 1e-8."""
    pressed = run(tmp_path / "force", PRESS)
    assert pressed["contact.press.y"][-1] == pytest.approx(-4.0, rel=1e-8)
    way = pressed["stamp.y"][-1]
    assert way < -0.01
    motion = f'motion: [0, "{float(way)!r}*ramp(t, 0, 40)"]'
    free = PRESS[PRESS.index("free: {") : PRESS.index("\nprobes")]
    moved_text = PRESS.replace(free, motion).replace(PRESS[PRESS.index("  stamp: {q") : PRESS.index("solver")], "")
    moved = run(tmp_path / "way", moved_text)
    assert moved["contact.press.y"][-1] == pytest.approx(-4.0, rel=1e-8)
    assert moved["depth.x"][-1] == pytest.approx(pressed["depth.x"][-1], rel=1e-8)


#: The same in statics, by three load steps.
STATIC = PRESS.replace("  dynamics: {rho_inf: 0}\n", "").replace("step: 4, end: 120", "step: 0.4, end: 1.2")
STATIC = STATIC.replace("-4*ramp(t, 0, 40)", "-4*t/1.2")


def test_in_statics_a_force_presses_as_far_as_the_moved_tool_that_needs_it(tmp_path):
    """In each load step the contact force is the load; a tool moved as far exerts it; both to 1e-8."""
    pressed = run(tmp_path / "force", STATIC)
    for step in range(3):
        assert pressed["contact.press.y"][step] == pytest.approx(-4.0 * (step + 1) / 3.0, rel=1e-8)
    free = STATIC[STATIC.index("free: {") : STATIC.index("\nprobes")]
    motion = f'motion: [0, "{float(pressed["stamp.y"][-1])!r}*t/1.2"]'
    text = STATIC.replace(free, motion).replace(STATIC[STATIC.index("  stamp: {q") : STATIC.index("solver")], "")
    moved = run(tmp_path / "way", text)
    assert moved["contact.press.y"][-1] == pytest.approx(-4.0, rel=1e-8)
    assert moved["depth.x"][-1] == pytest.approx(pressed["depth.x"][-1], rel=1e-8)


def test_in_statics_a_spring_carries_its_share_and_a_gap_closes(tmp_path):
    """A stamp above the block hangs on a weak spring: spring and contact carry load and weight together."""
    settings = "springs: [{at: [0, 1.2], stiffness: [0, 2]}], gravity: [0, -100],"
    text = STATIC.replace("origin: [-0.713, 1]", "origin: [-0.713, 1.1]").replace("held: [x", settings + " held: [x")
    history = run(tmp_path / "a", text)
    weight = 1.5 * 0.3 * 1e-3 * 100.0
    carried = -2.0 * history["stamp.y"][-1] - history["contact.press.y"][-1]
    assert history["stamp.y"][-1] < -0.1
    assert carried == pytest.approx(4.0 + weight, rel=1e-8)


@pytest.mark.parametrize("kind", ["obstacle", "rigid"])
def test_a_rigid_body_that_is_tied_to_an_elastic_one_hands_its_load_over(tmp_path, kind):
    """Pulled and sheared, free to turn: the force of the tie is the load, and the block carries its moment, too."""
    text = STATIC.replace("{obstacle: stamp}", "{obstacle: stamp}, tied: true").replace("held: [x, rotation], ", "")
    text = text.replace('force: [0, "-4*t/1.2"]', 'force: ["t/1.2", "4*t/1.2"]')
    if kind == "rigid":
        free = text[text.index("{density: 1.0e-3, ") + 1 : text.index("\nprobes")].rstrip("}")
        mesh = "mesh: {shape: rectangle, origin: [-0.713, 1], size: [1.5, 0.3], cells: [1, 1]}"
        text = text[: text.index("  obstacles:")] + text[text.index("probes:") :]
        text += f"rigid: {{bodies: {{stamp: {{{mesh}, {free}}}}}}}\n"
    history = run(tmp_path / "a", text)
    assert history["contact.press.x"][-1] == pytest.approx(1.0, rel=1e-8)
    assert history["contact.press.y"][-1] == pytest.approx(4.0, rel=1e-8)
    assert history["stamp.x"][-1] > 0.05


def test_in_statics_nothing_moves_a_body_that_nothing_holds(tmp_path):
    """A stamp that is drawn away: a message, with the block or without."""
    text = STATIC.replace("-4*t/1.2", "4*t/1.2").replace("origin: [-0.713, 1]", "origin: [-0.713, 1.1]")
    text = text.replace("time: {", "time: {retry: {halvings: 0}, ")
    done = fsci("run", write(tmp_path / "a", text), "-o", tmp_path / "out")
    assert done.returncode == 1
    assert "the linear system is singular: is a body not supported?" in done.stdout + done.stderr
    alone = text[: text.index("contact:")] + text[text.index("solver:") :]
    alone += "rigid: {bodies: {bar: {mesh: {shape: rectangle, origin: [3, 0], size: [1, 1], cells: [1, 1]}, density: 1"
    alone += ", loads: [{force: [1, 0]}]}}}\n"
    done = fsci("run", write(tmp_path / "b", alone), "-o", tmp_path / "out2")
    assert done.returncode == 1
    assert "nothing holds a free body in statics: it needs contact with an elastic body" in done.stdout + done.stderr
    guide = "guide: {mesh: {shape: rectangle, origin: [0.8, 0.9], size: [0.2, 1], cells: [1, 1]}, on: left}\n    stamp:"
    done = fsci("run", write(tmp_path / "c", text.replace("stamp:\n", guide + "\n")), "-o", tmp_path / "out3")
    assert done.returncode == 1
    assert "and springs where it is near other rigid bodies" in done.stdout + done.stderr


SIDES = ("top", "left", "right")


def test_the_tool_is_as_well_a_body_of_the_section_rigid(tmp_path):
    """The same stamp under `rigid`: the same numbers; `bodies: all` pairs it with all sides that are not held."""
    force = run(tmp_path / "a", PRESS, ("time.end", "12"))
    settings = PRESS[PRESS.index("free: {density: 1.0e-3, ") : PRESS.index("\nprobes")]
    inner = settings[len("free: {") : -1]
    mesh = "mesh: {shape: rectangle, origin: [-0.713, 1], size: [1.5, 0.3], cells: [1, 1]}"
    rigid = PRESS[: PRESS.index("  obstacles:")] + PRESS[PRESS.index("probes:") :]
    rigid += f"rigid: {{bodies: {{stamp: {{{mesh}, {inner}}}}}}}\n"
    loose = run(tmp_path / "b", rigid, ("time.end", "12"))
    pairs = rigid[rigid.index("  pairs:") : rigid.index("probes:")]
    found = run(tmp_path / "c", rigid.replace(pairs, "  bodies: all\n"), ("time.end", "12"))
    sides = ", ".join(f"{a}: {{slave: {{body: block, on: {a}}}, master: {{obstacle: stamp}}}}" for a in SIDES)
    named = run(tmp_path / "d", rigid.replace(pairs, f"  pairs: {{{sides}}}\n"), ("time.end", "12"))
    for name in ("stamp.y", "depth.x", "depth.y"):
        assert loose[name] == pytest.approx(force[name], rel=1e-9, abs=1e-12)
        assert found[name] == pytest.approx(named[name], rel=1e-9, abs=1e-12)


def test_an_obstacle_turns(tmp_path):
    """A stamp that turns about the middle of its edge lifts one corner of the block and presses the other one."""
    free = PRESS[PRESS.index("free: {") : PRESS.index("\nprobes")]
    turning = (
        'motion: {displacement: [0, "-0.02*ramp(t, 0, 20)"], '
        'rotation: {centre: [0.037, 1], angle: "-2*ramp(t, 0, 20)"}}'
    )
    text = PRESS.replace(free, turning).replace(PRESS[PRESS.index("  stamp: {q") : PRESS.index("solver")], "")
    history = run(tmp_path / "a", text, ("time.end", "24"))
    angle = np.radians(2.0)
    x = 0.5 + history["depth.x"][-1] - 0.037
    assert history["depth.y"][-1] == pytest.approx(-0.02 - np.tan(angle) * x, rel=1e-3)
    turned = text.replace('angle: "-2*ramp(t, 0, 20)"', 'angular_velocity: "where(t < 20, -0.1, 0)"')
    assert run(tmp_path / "b", turned, ("time.end", "24"))["depth.y"][-1] == pytest.approx(history["depth.y"][-1])


MISTAKES = [
    (ALONE, "pivot: [0, 2]", "pivot: [0, 2, 0]", "6:106: 'pivot' must have 2 entries in 2D, not 3"),
    (
        ALONE,
        "pivot: [0, 2]",
        "pivot: [0, 2], held: [x]",
        "a body with a 'pivot' does not move along x: remove 'x' from 'held'",
    ),
    (
        ALONE,
        "pivot: [0, 2]",
        "pivot: [0, 2], initial_velocity: [1, 0]",
        "a body with a 'pivot' only turns: give 'initial_angular_velocity' instead",
    ),
    (
        ALONE,
        "body: two, at",
        "body: one, at",
        "a spring leads to another body, but 'one' is the body itself",
    ),
    (ALONE, "body: two, at", "body: tow, at", "there is no free or elastic body 'tow'; did you mean 'two'?"),
    (ALONE, "stiffness: 40", "stiffness: [40, 3]", "'stiffness' must be one number for a spring along a line"),
    (
        ALONE,
        "to: {body: two, at: [6, 0.5]}, ",
        "",
        "'length' is for a spring to another point: give 'to', too",
    ),
    (ALONE, "density: 2\n", "density: 2\n      loads: [{at: [0, 0]}]\n", "a load needs 'force' or 'moment'"),
    (
        ALONE,
        "density: 2\n",
        "density: 2\n      loads: [{moment: 3, at: [0, 0]}]\n",
        "'at' is the point of a 'force': a moment has none",
    ),
    (
        ALONE,
        "density: 2\n",
        "density: 2\n      loads: [{moment: [1, 2, 3]}]\n",
        "'moment' must have 1 entry in 2D, not 3",
    ),
    (ALONE, "bodies:\n    bar", "bodies: {}\nx:\n    bar", "needs at least one body"),
    (
        PRESS.replace("dynamics: {rho_inf: 0}\n  ", ""),
        "held: [x, rotation],",
        "held: [x, rotation], initial_velocity: [0, -1],",
        "'initial_velocity' needs 'dynamics' in 'structure'",
    ),
    (PRESS, "free:", "motion: [0, t]\n      free:", "give either 'motion' or 'free', not both"),
]


@pytest.mark.parametrize(("text", "right", "wrong", "message"), MISTAKES)
def test_mistakes_are_located(tmp_path, text, right, wrong, message):
    assert right in text
    with pytest.raises(CaseError) as error:
        load_case(write(tmp_path / "a", text.replace(right, wrong)))
    assert message in str(error.value)
    assert "case.yaml:" in str(error.value)


def test_a_case_needs_bodies_or_a_fluid(tmp_path):
    with pytest.raises(CaseError, match="a case needs a section 'structure', 'fluid' or 'rigid'"):
        load_case(write(tmp_path / "a", "time: {step: 1, end: 1}\n"))


#: A block of rubber flies into a loose square, off its middle.
COLLISION = """\
title: a block hits a square
time: {step: 0.002, end: 0.06}
structure:
  dynamics: {rho_inf: 0.9}
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [3, 3], order: 1}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      initial_velocity: [4, 0]
rigid:
  bodies:
    square: {mesh: {shape: rectangle, origin: [1.05, 0.333], size: [0.7, 0.9], cells: [1, 1]}, density: 3}
contact: {bodies: all}
probes:
  block: {field: structure, body: block, quantity: momentum}
  square: {body: square, quantity: momentum}
  turn: {field: structure, body: block, quantity: angular_momentum}
  spin: {body: square, quantity: angular_momentum}
solver: {newton: {residual: 1.0e-11}}
"""


def test_a_collision_keeps_momentum_and_turns_both(tmp_path):
    """The sums over both bodies: momentum to rounding, angular momentum to the order of the steps."""
    history = run(tmp_path / "a", COLLISION)
    assert history["square.x"][-1] > 2.0
    for axis, before in (("x", 4.0), ("y", 0.0)):
        assert np.abs(history[f"block.{axis}"] + history[f"square.{axis}"] - before).max() < 1e-9
    turns = history["turn"] + history["spin"]
    assert np.abs(history["spin"]).max() > 0.1
    assert np.abs(turns - turns[0]).max() < 5e-3 * np.abs(turns[0])


def test_a_stamp_lies_on_a_block_with_its_weight(tmp_path):
    """Under its weight alone, hinged at no point: once at rest, contact carries it to 1e-8."""
    loads = 'loads: [{force: [0, "-4*ramp(t, 0, 40)"]}]'
    text = PRESS.replace(loads, 'gravity: [0, "-1e4*ramp(t, 0, 40)"]')
    history = run(tmp_path / "a", text)
    assert history["contact.press.y"][-1] == pytest.approx(-1.5 * 0.3 * 1e-3 * 1e4, rel=1e-8)


def test_a_lever_presses_by_its_moment(tmp_path):
    """A bar with a pivot lies on the block: moment of the contact force about the pivot = the given moment."""
    free = PRESS[PRESS.index("free: {") : PRESS.index("\nprobes")]
    lever = 'free: {density: 1.0e-3, pivot: [-3, 1.15], held: [], loads: [{moment: "-9*ramp(t, 0, 40)"}]}'
    text = PRESS.replace(free, lever) + "  # with the moment of all forces on the floor of the block\n"
    text = text.replace("probes:\n", "probes:\n  floor: {quantity: reaction, on: bottom}\n")
    history = run(tmp_path / "a", text)
    arm = 9.0 / history["floor.y"][-1]
    assert 2.5 < arm < 3.5  # from the pivot to the resultant on the block
    assert history["contact.press.y"][-1] == pytest.approx(-history["floor.y"][-1], rel=1e-8)


#: Two bars that overlap at a joint, the upper one hinged, and a floor that the lower one reaches.
DOUBLE = """\
title: a double pendulum
time: {step: 0.02, end: 0.3}
rigid:
  gravity: [0, -10]
  bodies:
    upper: {mesh: {shape: rectangle, origin: [-0.1, -0.1], size: [1.2, 0.2], cells: [2, 1]}, density: 3, pivot: [0, 0]}
    lower:
      mesh: {shape: rectangle, origin: [0.9, -0.1], size: [1.2, 0.2], cells: [2, 1]}
      density: 3
      springs: [{at: [1, 0], stiffness: 1e5, dashpot: 100, to: {body: upper, at: [1, 0]}}]
probes:
  upper: {body: upper, quantity: displacement, at: [1, 0]}
  lower: {body: lower, quantity: displacement, at: [1, 0]}
  tip: {body: lower, quantity: displacement, at: [2, 0]}
"""


def double_pendulum(end: float) -> tuple[float, float]:
    """Place of the tip by the equations of motion for the angles a, b of both bars from the horizontal."""
    m, g, bar, c = 3.0 * 1.2 * 0.2, 10.0, 1.0, 0.5  # the centre of each bar is half a metre from its joint
    J = m * (1.2**2 + 0.2**2) / 12.0 + m * c**2

    def rates(t, state):
        a, b, v, w = state
        mass = np.array([[J + m * bar**2, m * bar * c * np.cos(a - b)], [m * bar * c * np.cos(a - b), J]])
        turn = m * bar * c * np.sin(a - b)
        moments = [-turn * w**2 - m * (c + bar) * g * np.cos(a), turn * v**2 - m * c * g * np.cos(b)]
        return [v, w, *np.linalg.solve(mass, moments)]

    a, b = solve_ivp(rates, (0.0, end), np.zeros(4), rtol=1e-9, atol=1e-9).y[:2, -1]
    return float(np.cos(a) + np.cos(b)), float(np.sin(a) + np.sin(b))


def test_bodies_that_a_joint_holds_together_do_not_touch(tmp_path):
    """The bars fold at the joint, within each other, without contact and without a warning; the joint holds."""
    done = fsci("run", write(tmp_path / "a", DOUBLE), "-o", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "overlap" not in done.stdout + done.stderr
    history = read_history(tmp_path / "out" / "history.csv")
    place = 1.0 + history["tip.x"][-1] + 1.0, history["tip.y"][-1]
    assert place == pytest.approx(double_pendulum(0.3), rel=3e-3)
    for axis in "xy":
        assert np.abs(history[f"upper.{axis}"] - history[f"lower.{axis}"]).max() < 1e-3
    checked = fsci("check", tmp_path / "a")
    assert checked.returncode == 0
    assert "overlap" not in checked.stdout + checked.stderr


def test_pictures_and_the_report_of_rigid_bodies_alone(tmp_path):
    """No field colours them: they are drawn in one colour, with the curves of the probes."""
    assert run_case(load_case(write(tmp_path / "a", DOUBLE), [("time.end", "0.04")]), tmp_path / "out") == FINISHED
    done = fsci("report", tmp_path / "out")  # which draws what `plot` does
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "out" / "pictures" / "final_displacement.png").stat().st_size > 1000
    assert (tmp_path / "out" / "pictures" / "history_tip.png").exists()


#: Two discs on a floor that tips, beside a block that nothing touches.
TIPPED = """\
title: discs on a floor that tips
time: {step: 0.02, end: 0.2}
structure:
  dynamics: {}
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [1, 1]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      supports: [{on: bottom, displacement: [0, 0]}]
rigid:
  gravity: [0, -10]
  bodies:
    one: {mesh: {shape: disc, radius: 0.3, translate: [3, 0.3], cells: [16, 1]}, density: 2}
    two: {mesh: {shape: disc, radius: 0.3, translate: [3.05, 1.05], cells: [16, 1]}, density: 2}
contact:
  obstacles:
    floor:
      mesh: {shape: rectangle, origin: [1.5, -1], size: [5, 1], cells: [1, 1]}
      on: top
      motion: {rotation: {centre: [3, 0], angle: "20*t"}}
probes: {one: {body: one, quantity: centre}, two: {body: two, quantity: centre}}
"""


def test_rigid_bodies_are_the_same_beside_an_elastic_one(tmp_path):
    """On an obstacle that turns: alone, beside a block without pairs, and with pairs that `bodies: all` finds."""
    structure = TIPPED[TIPPED.index("structure:") : TIPPED.index("rigid:")]
    alone = run(tmp_path / "a", TIPPED.replace(structure, ""))
    assert alone["two.y"][-1] < 1.0
    assert alone["contact.on_one.y"].max() > 1.0
    for name, overrides in (("b", []), ("c", [("contact.bodies", "all")])):
        beside = run(tmp_path / name, TIPPED, *overrides)
        for column in ("one.x", "one.y", "two.x", "two.y", "contact.on_one.y"):
            assert beside[column] == pytest.approx(alone[column], rel=1e-6, abs=1e-7)


def test_without_contact_bodies_pass_each_other_and_the_floor(tmp_path):
    structure = TIPPED[TIPPED.index("structure:") : TIPPED.index("rigid:")]
    text = TIPPED.replace(structure, "").replace("end: 0.2", "end: 0.3")
    contact = text[text.index("contact:") : text.index("probes:")]
    history = run(tmp_path / "a", text.replace(contact, "contact: none\n"))
    assert history["one.y"][-1] == pytest.approx(0.3 - 0.45, abs=1e-12)
