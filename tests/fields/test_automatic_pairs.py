"""Pairs of contact that the program finds: the rule, `fsci check`, and results equal to those of named pairs."""

import numpy as np
import pytest
from programs import fsci

from fsci.builder.automatic_pairs import with_pairs
from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from solvers.mesh.search import Search

#: A soft block between two stiff ones, and a rigid floor below.
STACK = """\
title: a stack
time: {step: 0.5, end: 1}
structure:
  bodies:
    low:
      mesh: {shape: rectangle, size: [3, 1], cells: [6, 2]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: left, displacement: [0, null]}]
    soft:
      mesh: {shape: rectangle, size: [2, 1], cells: [5, 3], origin: [0, 1]}
      material: {law: neo_hooke, mu: 40, nu: 0.25}
      supports: [{on: left, displacement: [0, null]}]
    high:
      mesh: {shape: rectangle, size: [3, 1], cells: [9, 3], origin: [0, 2]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: [left], displacement: [0, null]}, {on: top, displacement: [null, -0.1 * t]}]
contact:
  CONTACT
  obstacles:
    floor: {mesh: {shape: rectangle, size: [5, 1], cells: [3, 1], origin: [-1, -1]}, on: top}
probes:
  soft: {body: soft, quantity: displacement, at: [2, 2]}
"""
NAMED = """pairs:
    low_floor: {slave: {body: low, on: bottom}, master: {obstacle: floor}}
    soft_bottom: {slave: {body: soft, on: bottom}, master: {body: low, on: top}}
    soft_top: {slave: {body: soft, on: top}, master: {body: high, on: bottom}}"""


def write(folder, contact):
    folder.mkdir(exist_ok=True)
    path = folder / "case.yaml"
    path.write_text(STACK.replace("CONTACT", contact))
    return path


def run(folder, contact):
    assert run_case(load_case(write(folder, contact)), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


def test_an_obstacle_that_moves_by_a_formula(tmp_path):
    """The same as with named pairs: formulas are not sent between processes."""
    text = STACK.replace("on: top}\nprobes", 'on: top, motion: [0, "0.05*t"]}\nprobes')
    assert text != STACK
    histories = []
    for name, contact in (("all", "bodies: all\n  reach: 0.5"), ("named", NAMED)):
        path = write(tmp_path / name, contact)
        path.write_text(text.replace("CONTACT", contact))
        assert run_case(load_case(path), tmp_path / name / "out") == FINISHED
        histories.append(read_history(tmp_path / name / "out" / "history.csv"))
    assert histories[0]["soft.y"][-1] != histories[0]["soft.y"][0]
    for axis in "xy":
        assert histories[0][f"soft.{axis}"] == pytest.approx(histories[1][f"soft.{axis}"], rel=1e-9)


def test_three_bodies_and_a_floor(tmp_path):
    """The same as with named pairs; what is behind another body is a pair, too (it may come out), and not touched."""
    found = {name: run(tmp_path / name, text) for name, text in (("all", "bodies: all"), ("named", NAMED))}
    found["near"] = run(tmp_path / "near", "bodies: all\n  reach: 0.5")
    touched = {
        "soft_bottom_low_top": "soft_bottom",
        "low_bottom_floor": "low_floor",
        "soft_top_high_bottom": "soft_top",
    }
    for which in ("all", "near"):
        forces = {name[8:-2]: f for name, f in found[which].items() if name[:8] == "contact." and name[-2:] == ".y"}
        assert {name for name, force in forces.items() if force.any()} == touched.keys()
        assert len(forces) == (3 if which == "near" else 6)
        for name, other in touched.items():
            assert forces[name] == pytest.approx(found["named"][f"contact.{other}.y"], rel=1e-10)
        assert found[which]["soft.x"] == pytest.approx(found["named"]["soft.x"], rel=1e-12)
    assert found["named"]["contact.soft_top.y"][-1] < -1.0


def pairs_of(path, *changes):
    case = with_pairs(load_case(path, changes))
    sides = [(pair.slave, pair.master) for pair in case.contact.pairs.values()]
    return {tuple(side.obstacle or f"{side.body}.{side.on[0]}" for side in pair) for pair in sides}


def test_two_tori():
    """Hollow bodies: outer surfaces only; of two that are alike the first one is the slave."""
    both = [("contact", "{bodies: all}")]
    assert pairs_of("cases/two_tori/case.yaml", *both) == {("lower.outer", "upper.outer")}
    stiff = [*both, ("structure.bodies.lower.material.E", "1e4")]
    assert pairs_of("cases/two_tori/case.yaml", *stiff) == {("upper.outer", "lower.outer")}
    fine = [*both, ("structure.bodies.upper.mesh.cells", "[60, 30, 1]")]
    assert pairs_of("cases/two_tori/case.yaml", *fine) == {("upper.outer", "lower.outer")}


def test_a_body_in_a_cavity(tmp_path):
    """A sphere in a hollow one meets its inside; one in a tube does, too, and not the ends and the outside."""
    case = load_case("cases/sphere_tube/case.yaml", [("contact", "{bodies: all}")])
    named = load_case("cases/sphere_tube/case.yaml").contact.pairs
    (found,) = with_pairs(case).contact.pairs.values()
    (wanted,) = named.values()
    assert (found.slave, found.master) == (wanted.slave, wanted.master)


def test_reach(tmp_path):
    """Surfaces farther apart than that are no pair; pairs that the case names stay."""
    path = write(tmp_path, "bodies: all")
    lifted = [("structure.bodies.high.mesh.origin", "[0, 2.5]")]
    assert ("soft.top", "high.bottom") in pairs_of(path, *lifted)
    assert ("soft.top", "high.bottom") not in pairs_of(path, *lifted, ("contact.reach", "0.4"))
    own = "{slave: {body: high, on: bottom}, master: {body: soft, on: top}}"
    found = pairs_of(path, ("contact.pairs", f"{{mine: {own}}}"))
    assert ("high.bottom", "soft.top") in found
    assert ("soft.top", "high.bottom") not in found


APART = """\
time: {step: 0.025, end: 1}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    a: {mesh: {shape: disc, radius: 0.5, cells: [16, 1]}, material: &m {law: neo_hooke, E: 1e4, nu: 0.3, density: 1}}
    b:
      mesh: {shape: disc, radius: 0.5, cells: [16, 1], translate: [FAR, 0]}
      material: *m
      initial_velocity: [SPEED, 0]
contact: {bodies: all}
probes: {a: {body: a, quantity: momentum}, b: {body: b, quantity: momentum}}
"""


@pytest.mark.parametrize("far", [1.3, 3.0, 8.0])
def test_bodies_meet_from_any_distance(far, tmp_path):
    """A disc hits another one at rest, many diameters away; no step passes through it."""
    (tmp_path / "case.yaml").write_text(APART.replace("FAR", str(far)).replace("SPEED", str(-2.0 * (far - 1.0))))
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out") == FINISHED
    history = read_history(tmp_path / "out" / "history.csv")
    before, after = history["b.x"][0], history["b.x"][-1]
    assert history["contact.active"][0] == 0
    assert abs(after) < 0.5 * abs(before)
    assert history["a.x"][-1] + after == pytest.approx(before, rel=1e-7)


def test_far_pairs_are_not_searched(tmp_path, monkeypatch):
    """Three discs, of which two touch all the time: the pairs of the third one are searched once or twice."""
    text = (
        APART.replace("FAR", "0.99")
        .replace("SPEED", "0")
        .replace(
            "contact:",
            "    c: {mesh: {shape: disc, radius: 0.5, cells: [16, 1], translate: [0, 90]}, material: *m}\ncontact:",
        )
    )
    (tmp_path / "case.yaml").write_text(text)
    count: dict[int, int] = {}
    pairs = Search.pairs

    def counted(self, *arguments):
        if arguments[2:] and np.shape(arguments[0])[1] == 2 and len(arguments) == 5:
            count[id(self)] = count.get(id(self), 0) + 1
        return pairs(self, *arguments)

    monkeypatch.setattr(Search, "pairs", counted)
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out") == FINISHED
    assert sorted(count.values())[0] <= 2
    assert max(count.values()) > 20


def test_check_lists_the_pairs(tmp_path):
    done = fsci("check", write(tmp_path, "bodies: all\n  reach: 0.5\n  friction: {coefficient: 0.3}"))
    assert done.returncode == 0, done.stderr
    lines = [line.split(maxsplit=2)[1:] for line in done.stdout.splitlines() if line.strip().startswith("pair ")]
    assert ["soft_top_high_bottom", "soft.top (slave) on high.bottom, friction 0.3"] in lines
    assert len(lines) == 3


UNKNOWN = """\
  gap: {quantity: gap, pair: soft_top_high_botom}
verify:
  - {value: contact.soft_top_high_bottom.y, reference: 1, relative: 0.1}
  - {value: contact.soft_top_high_botom.y, reference: 1, relative: 0.1}
  - {value: contact.atcive, reference: 1, relative: 0.1}
"""


def test_names_that_no_found_pair_has(tmp_path):
    """`check` and `run` refuse them with the same words, once the pairs are known."""
    path = write(tmp_path, "bodies: all\n  reach: 0.5")
    path.write_text(path.read_text() + UNKNOWN)
    wanted = [
        "24:30: unknown pair 'soft_top_high_botom'; did you mean 'soft_top_high_bottom'?",
        "27:13: there is no value 'contact.soft_top_high_botom.y'; did you mean 'contact.soft_top_high_bottom.y'?",
        "28:13: there is no value 'contact.atcive'; did you mean 'contact.active'?",
    ]
    for command in (["check", path], ["run", path, "-o", tmp_path / "out"]):
        done = fsci(*command)
        assert done.returncode == 2
        assert [line for line in done.stderr.splitlines() if "case.yaml" in line] == [f"{path}:{end}" for end in wanted]


MISTAKES = {
    "nothing": ("c_n: 1", "'contact' needs 'pairs', or 'bodies: all' for automatic pairs"),
    "unknown": ("bodies: [low, sotf]", "unknown body 'sotf'; did you mean 'soft'?"),
    "far": ("bodies: all\n  reach: 1e-9", "no named surfaces of these bodies can meet: name the pairs"),
    "reach": (f"{NAMED}\n  reach: 1", "'reach' applies only to the pairs that 'bodies' finds"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_named(name, tmp_path):
    contact, message = MISTAKES[name]
    path = write(tmp_path, contact)
    if name == "far":
        path.write_text(path.read_text().replace("origin: [0, 1]", "origin: [0, 1.2]").replace("[0, 2]}", "[0, 3]}"))
        path.write_text(path.read_text().replace("origin: [-1, -1]", "origin: [-1, -3]"))
    with pytest.raises(CaseError) as caught:
        with_pairs(load_case(path))
    assert message in str(caught.value)


#: Contact of the stack -> frictions of the pairs floor, bottom and top: a coefficient, the text of a bound, or None.
OTHER = "soft_top: {slave: {body: soft, on: top}, master: {body: high, on: bottom}"
FRICTIONS = {
    "none": (NAMED, (None, None, None)),
    "default": (f"friction: {{coefficient: 0.3}}\n  {NAMED}", (0.3, 0.3, 0.3)),
    "one has none": (f"friction: {{coefficient: 0.3}}\n  {NAMED[:-1]}, friction: none}}", (0.3, 0.3, None)),
    "one is empty": (f"friction: {{coefficient: 0.3}}\n  {NAMED[:-1]}, friction: {{}}}}", (0.3, 0.3, None)),
    "one has its own": (f"friction: {{coefficient: 0.3}}\n  {NAMED[:-1]}, friction: {{bound: 2}}}}", (0.3, 0.3, "2")),
    "one alone": (f"{NAMED[:-1]}, friction: {{coefficient: 0.2}}}}", (None, None, 0.2)),
    "one is tied": (f"friction: {{coefficient: 0.3}}\n  {NAMED[:-1]}, tied: true}}", (0.3, 0.3, None)),
    "the default is none": (f"friction: none\n  {NAMED[:-1]}, friction: {{coefficient: 0.2}}}}", (None, None, 0.2)),
    "found": ("friction: {bound: 2}\n  bodies: all\n  reach: 0.5", ("2", "2", "2")),
    "found and named": (
        f"bodies: all\n  reach: 0.5\n  friction: {{bound: 2}}\n  pairs: {{{OTHER}, friction: none}}}}",
        ("2", "2", None),
    ),
    "found and named by the default": (
        f"bodies: all\n  reach: 0.5\n  friction: {{bound: 2}}\n  pairs: {{{OTHER}}}}}",
        ("2", "2", "2"),
    ),
}


@pytest.mark.parametrize("name", FRICTIONS)
def test_friction_by_pair_with_a_default(name, tmp_path):
    """A pair has its own friction, `none` is no friction, without one it has that of `contact`."""
    contact, wanted = FRICTIONS[name]
    pairs = with_pairs(load_case(write(tmp_path, contact))).contact.pairs
    found = {}
    for pair in pairs.values():
        sides = pair.slave.body, pair.master.body or pair.master.obstacle
        law = None if pair.law in ("frictionless", "tied") else pair.law_parameters[0]
        found[sides] = f"{law:g}" if pair.law == "tresca" else law
    assert tuple(found[key] for key in (("low", "floor"), ("soft", "low"), ("soft", "high"))) == wanted


def test_a_default_is_the_friction_that_each_pair_would_have(tmp_path):
    """Bit for bit, and other than without friction."""
    every = NAMED.replace("}}", "}, friction: {coefficient: 0.4}}")
    one, other = run(tmp_path / "one", f"friction: {{coefficient: 0.4}}\n  {NAMED}"), run(tmp_path / "other", every)
    without = run(tmp_path / "without", f"friction: none\n  {NAMED}")
    for column in ("soft.x", "soft.y", "contact.soft_top.y", "contact.friction"):
        assert np.array_equal(one[column], other[column])
    assert abs(one["soft.x"][-1]) < 0.99 * abs(without["soft.x"][-1])
    assert "contact.friction" not in without


def test_frictions_of_one_slave(tmp_path):
    """A pair of the case and one that is found have the same slave: each has its own friction."""
    named = "{p: {slave: {body: soft, on: bottom}, master: {obstacle: floor}, friction: none}}"
    path = write(tmp_path, f"bodies: all\n  friction: {{bound: 2}}\n  pairs: {named}")
    pairs = with_pairs(load_case(path)).contact.pairs
    assert pairs["p"].law == "frictionless"
    assert pairs["soft_bottom_low_top"].law == "tresca"


def test_the_slave_of_a_tie_is_no_slave_of_contact(tmp_path):
    """The pair that is found has the other surface as slave, as multipliers of ties have no gap."""
    named = "{p: {slave: {body: soft, on: bottom}, master: {obstacle: floor}, tied: true}}"
    pairs = with_pairs(load_case(write(tmp_path, f"bodies: all\n  pairs: {named}"))).contact.pairs
    slaves = [(pair.slave.body, pair.slave.on) for name, pair in pairs.items() if name != "p"]
    assert ("soft", ("bottom",)) not in slaves
    assert pairs["low_top_soft_bottom"].law == "frictionless"


def test_verify_knows_the_columns_of_friction_by_default(tmp_path):
    check = "verify: [{value: contact.friction, reference: 0, absolute: 1}]\n"
    for friction, known in (("{coefficient: 0.3}", True), ("none", False)):
        path = write(tmp_path, f"friction: {friction}\n  {NAMED}")
        path.write_text(path.read_text() + check)
        if known:
            load_case(path)
        else:
            with pytest.raises(CaseError, match=r"contact\.friction"):
                load_case(path)


def test_free_bodies_come_to_any_side(tmp_path):
    """A ball above a block may fall down beside it: all sides that are not held, within the reach."""
    path = tmp_path / "case.yaml"
    path.write_text(
        """\
time: {step: 1, end: 1}
structure:
  dynamics: {}
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [2, 2]}
      material: {law: neo_hooke, E: 1, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [0, 0]}]
rigid: {bodies: {ball: {mesh: {shape: disc, radius: 0.2, cells: [8, 1], translate: [0.5, 1.5]}, density: 1}}}
contact: {bodies: all}
"""
    )
    assert pairs_of(path) == {("block.top", "ball"), ("block.right", "ball"), ("block.bottom", "ball")}
    assert pairs_of(path, ("contact.reach", "0.5")) == {("block.top", "ball")}
