"""Friction of two free rigid bodies, or of one and what it touches, by a section of their own."""

from __future__ import annotations

import re

import pytest

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from fsci.twin.changes import twins

#: Gravity of a slope in its own frame: a block on another one, which lies on a floor; a third beside them.
BLOCKS = """\
time: {step: 0.02, end: 0.3}
rigid:
  gravity: [2, -10]
  bodies:
    upper: {mesh: {shape: rectangle, size: [0.4, 0.1], cells: [1, 1], origin: [0.31, 0.1]}, density: 3, held: [rotation]}
    lower: {mesh: {shape: rectangle, size: [2, 0.1], cells: [1, 1], origin: [0.03, 0]}, density: 5, held: [rotation]}
    alone: {mesh: {shape: rectangle, size: [0.4, 0.1], cells: [1, 1], origin: [2.8, 0]}, density: 2, held: [rotation]}
contact:
  friction: {coefficient: 0.5}
  rigid_pairs:
    slippery: {bodies: [lower, upper], friction: {coefficient: 0.1}}
    smooth: {bodies: [alone, floor], friction: none}
  obstacles: {floor: {mesh: {shape: rectangle, size: [9, 1], cells: [1, 1], origin: [-1, -1]}, on: top}}
probes: {upper: {body: upper, quantity: displacement, at: [0.31, 0.1]}, lower: {body: lower, quantity: displacement, at: [0.03, 0]}, alone: {body: alone, quantity: displacement, at: [2.8, 0]}}
output: {fields_every: 0}
"""  # noqa: E501


def written(folder, text):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    return folder / "case.yaml"


def ways(folder, text):
    """Ways along x [m], by name of the probe."""
    assert run_case(load_case(written(folder, text)), folder / "out") == FINISHED
    history = read_history(folder / "out" / "history.csv")
    return {name[:-2]: history[name][-1] for name in history if name.endswith(".x") and name.count(".") == 1}


@pytest.mark.parametrize("moved", [0.0, 1.0 / 3.0])
def test_each_pair_has_its_own(tmp_path, moved):
    """g (sin a - mu cos a) of each sliding block, of which one has the default of nothing: the lower one rests."""
    text = BLOCKS.replace("[0.31, 0.1]", f"[{0.31 + moved}, 0.1]")
    found = ways(tmp_path, text)
    t = 0.3
    assert found["lower"] == pytest.approx(0.0, abs=1e-10)
    assert found["upper"] == pytest.approx(0.5 * (2.0 - 0.1 * 10.0) * t**2, rel=1e-3)
    assert found["alone"] == pytest.approx(0.5 * 2.0 * t**2, rel=1e-3)


def test_the_order_of_names_and_the_scale_do_not_matter(tmp_path):
    """The same in millimetres, with 1e-3 of gravity, whose ways are 1e-3 of those in metres."""
    one = ways(tmp_path / "one", BLOCKS)
    text = BLOCKS.replace("[lower, upper]", "[upper, lower]").replace("gravity: [2, -10]", "gravity: [2e-3, -0.01]")
    text = re.sub(r"(size|origin|at): \[(\S+), (\S+)\]", r"\1: [\2*1e-3, \3*1e-3]", text)
    two = ways(tmp_path / "two", text)
    for name, way in one.items():
        assert two[name] == pytest.approx(1e-3 * way, rel=1e-6, abs=1e-13), name


def test_twins_of_free_bodies(tmp_path):
    """The opposite order of bodies is one; there is no c_n to change."""
    case = load_case(written(tmp_path, BLOCKS))
    found = {twin.name: twin for twin in twins(case)}
    assert "c_n" not in found
    other = load_case(tmp_path / "case.yaml", found["reversed"].settings)
    assert list(other.rigid) == list(reversed(case.rigid))


#: A block on the floor of a flow in next to no fluid, which slides, beside one that rests.
WALLS = """\
time: {step: 0.02, end: 0.2}
fluid:
  density: 1.0e-5
  viscosity: 1.0e-8
  element: q1q1
  gravity: [2, -10]
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 0.4], cells: [15, 6]}
  patches: {top: {on: y+, outflow: true}, floor: {on: [x-, x+, y-], no_slip: true}}
  bodies:
    one: {mesh: {shape: rectangle, size: [0.2, 0.15], cells: [1, 1], origin: [0.13, 6.7e-5]}, free: {density: 3, held: [rotation]}}
    two: {mesh: {shape: rectangle, size: [0.2, 0.15], cells: [1, 1], origin: [0.63, 6.7e-5]}, free: {density: 3, held: [rotation]}}
coupling: {}
contact: {friction: {coefficient: 0.3}, rigid_pairs: {slide: {bodies: [floor, one], friction: {coefficient: 0.1}}}}
probes: {one: {body: one, quantity: displacement, at: [0.13, 6.7e-5]}, two: {body: two, quantity: displacement, at: [0.63, 6.7e-5]}}
output: {fields_every: 0}
"""  # noqa: E501


@pytest.mark.parametrize("scheme", ["monolithic", "partitioned"])
def test_with_a_wall_of_a_flow(tmp_path, scheme):
    found = ways(tmp_path, WALLS.replace("coupling: {}", f"coupling: {{scheme: {scheme}}}"))
    assert found["one"] == pytest.approx(0.5 * (2.0 - 0.1 * 10.0) * 0.2**2, rel=2e-3)
    assert found["two"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[lower, upper]", "[uper, lower]", "no rigid body, obstacle or closed patch 'uper'; did you mean 'upper'?"),
        ("[lower, upper]", "[lower, lower]", "give two different names: a rigid body does not touch itself"),
        ("[lower, upper]", "[lower]", "must have 2 entries, not 1"),
        ("[lower, upper]", "[alone, floor]", "'slippery' is a pair of the same two: remove one of them"),
        ("{coefficient: 0.1}", "{bound: 3}", "rigid bodies have Coulomb's friction: give 'coefficient'"),
        ("[alone, floor]", "[wall, floor]", "one of both must be a free rigid body: 'upper', 'lower' or 'alone'"),
    ],
)  # fmt: skip
def test_mistakes_of_rigid_pairs(tmp_path, old, new, message):
    text = BLOCKS.replace(old, new).replace(
        "obstacles: {",
        "obstacles: {wall: {mesh: {shape: rectangle, size: [1, 1], cells: [1, 1], origin: [20, 0]}}, ",
    )
    with pytest.raises(CaseError) as error:
        load_case(written(tmp_path, text))
    assert message in str(error.value)
    assert "case.yaml:1" in str(error.value)


SHARED = "'floor' is also the name of a closed patch, which the body may touch: give one of them another name"


def test_a_free_body_has_not_the_name_of_a_wall(tmp_path):
    """Friction by pair could not tell them apart; an open patch and a body that nothing touches may share a name."""
    text = (
        WALLS.replace("  one: {", "  floor: {").replace("body: one", "body: floor").replace("floor, one", "floor, two")
    )
    with pytest.raises(CaseError) as error:
        load_case(written(tmp_path, text))
    (problem,) = error.value.problems
    assert problem.message == SHARED
    assert (problem.place.line, problem.place.column) == (11, 12)
    load_case(written(tmp_path, WALLS.replace("    two: {", "    top: {").replace("body: two", "body: top")))
    contact = WALLS[WALLS.index("contact: ") : WALLS.index("probes: ")]
    off = WALLS.replace("    two: {", "    floor: {").replace("body: two", "body: floor")
    load_case(written(tmp_path, off.replace(contact, "contact: none\n")))


def test_a_pair_names_a_given_body_and_a_wall_at_once(tmp_path):
    fixed = "    floor: {mesh: {shape: rectangle, size: [0.1, 0.1], cells: [1, 1], origin: [0.4, 0.2]}}\n    one: {"
    with pytest.raises(CaseError) as error:
        load_case(written(tmp_path, WALLS.replace("    one: {", fixed)))
    (problem,) = error.value.problems
    assert problem.message == "'floor' is a rigid body and a closed patch: give one of them another name"


def test_without_free_bodies(tmp_path):
    text = WALLS.replace("free: {density: 3, held: [rotation]}", "slip_length: 0").replace("coupling: {}\n", "")
    text = text.replace("contact: {friction: {coefficient: 0.3}, ", "contact: {") + (
        "structure: {bodies: {plate: {mesh: {shape: rectangle, size: [1, 1], cells: [1, 1]},"
        " material: {law: neo_hooke, E: 1, nu: 0.3}}}}\n"
        "coupling: {}\n"
    )
    with pytest.raises(CaseError, match="'rigid_pairs' is for free rigid bodies, which this case has not"):
        load_case(written(tmp_path, text))
