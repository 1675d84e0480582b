"""A rigid body in the flow is a master of contact, too: one mesh, one motion."""

import numpy as np
import pytest
from case_text import with_section
from programs import fsci

from fsci.builder.automatic_pairs import with_pairs
from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: A ram comes down in a channel and presses an elastic block against the floor; it turns a little.
RAM = """\
title: a ram in a channel
time: {step: 0.02, end: 0.2}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  grid: {from: [0, 0], to: [2, 1], cells: [20, 10]}
  patches:
    open: {on: [x-, x+], outflow: true}
    walls: {on: [y-, y+], no_slip: true}
  bodies:
    ram:
      mesh: {shape: rectangle, size: [0.6, 0.3], origin: [0.7, 0.46], cells: [2, 1]}
      motion: {displacement: [0, "-0.09*(t/0.2)^2*(3 - 2*t/0.2)"], rotation: {centre: [1, 0.5], angle: "20*t"}}
structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    block:
      mesh: {shape: rectangle, size: [0.4, 0.4], origin: [0.8, 0], cells: [4, 4]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 2}
      supports: [{on: bottom, displacement: [0, 0]}]
contact:
  pairs:
    press: {slave: {body: block, on: top}, master: {obstacle: ram}}
coupling: {scheme: monolithic}
probes:
  force: {field: structure, body: block, quantity: reaction, on: bottom}
solver: {newton: {residual: 1.0e-9}}
"""

#: The same ram again, as a surface of contact alone (without the rotation, which obstacles do not have).
TWICE = RAM.replace(', rotation: {centre: [1, 0.5], angle: "20*t"}', "").replace(
    "contact:\n",
    """contact:
  obstacles:
    plate:
      mesh: {shape: rectangle, size: [0.6, 0.3], origin: [0.7, 0.46], cells: [2, 1]}
      on: bottom
      motion: [0, "-0.09*(t/0.2)^2*(3 - 2*t/0.2)"]
""",
)


def run(text, folder):
    folder.mkdir()
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


def test_one_body_for_flow_and_contact(tmp_path):
    """The same as the body and an obstacle that moves with it."""
    one = run(TWICE, tmp_path / "one")
    two = run(TWICE.replace("obstacle: ram", "obstacle: plate"), tmp_path / "two")
    assert one["force.y"].max() > 10.0
    for column in ("force.x", "force.y", "contact.press.y"):
        np.testing.assert_allclose(one[column], two[column], rtol=1e-7, atol=1e-7)


def test_it_turns(tmp_path):
    """The right end of the ram lies higher than the left one: the left corner of the block is pressed first."""
    history = run(RAM, tmp_path / "case")
    assert history["contact.press.y"].min() < -1.0


def test_the_program_finds_it(tmp_path):
    """`bodies: all` asks for pairs with rigid bodies and walls of the flow, too, and `check` lists them."""
    path = tmp_path / "case.yaml"
    path.write_text(with_section(RAM, "contact: {bodies: all}\n", "contact"))
    found = with_pairs(load_case(path)).contact.pairs.values()
    path.write_text(RAM)
    (named,) = load_case(path).contact.pairs.values()
    assert (named.slave, named.master) in [(pair.slave, pair.master) for pair in found]
    path.write_text(
        RAM.replace("pairs:\n    press: {slave: {body: block, on: top}, master: {obstacle: ram}}", "bodies: all")
    )
    done = fsci("check", path)
    assert "block.top (slave) on ram" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("obstacle: ram", "obstacle: rum"), "unknown obstacle 'rum'; did you mean 'ram'?"),
        (
            ("plate:", "ram:"),
            "'ram' is also the name of a rigid body of the flow; remove the obstacle and take the body as master",
        ),
    ],
)
def test_mistakes(change, message, tmp_path):
    (tmp_path / "case.yaml").write_text(TWICE.replace(*change))
    with pytest.raises(CaseError) as caught:
        load_case(tmp_path / "case.yaml")
    assert message in str(caught.value)
