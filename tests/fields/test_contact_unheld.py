"""Bodies that friction alone holds: iterates in which all nodes slip leave them without stiffness."""

import numpy as np
import pytest
from programs import fsci

from fsci.running.history import read_history
from solvers.contact.law.law import OPEN, SLIP, STICK
from solvers.contact.unheld import Loose, Unheld

#: A block drags another one over a base; both joints slide at the same force (draw 300286 of `fsci stress`).
STACK = """\
title: a frictional stack
time: {{step: 0.25, end: 1.25, retry: {{halvings: 2}}}}
structure:
  bodies:
    base:
      mesh: {{shape: rectangle, size: [2, 0.5], cells: [5, 2], order: 2, translate: [{x0}, 0]}}
      material: {{law: neo_hooke, E: 5240, nu: 0}}
      supports: [{{on: bottom, displacement: [0, 0]}}]
    middle:
      mesh: {{shape: rectangle, size: [1.5, 0.5], cells: [3, 2], order: 2, translate: [{x1}, 0.5]}}
      material: {{law: neo_hooke, E: 35600, nu: 0}}
    block:
      mesh: {{shape: rectangle, size: [1, 0.5], cells: [2, 2], order: 2, translate: [{x2}, 1.000000000001]}}
      material: {{law: neo_hooke, E: 1950000, nu: 0}}
      supports: [{{on: top, displacement: ["0.02*max(t-1,0)", "-0.002660000001*min(t,1)"]}}]
    beside:
      mesh: {{shape: rectangle, size: [0.4, 1.3], cells: [2, 3], translate: [12, -0.5]}}
      material: {{law: neo_hooke, E: {E}, nu: 0.3}}
      supports: [{{on: bottom, displacement: [0, 0]}}]
      tractions: [{{on: top, value: ["0.05*{E}*t", "-0.1*{E}*t"]}}]
contact:
  friction: {{coefficient: 0.2}}
  pairs:
    base_middle: {{slave: {{body: middle, on: bottom}}, master: {{body: base, on: top}}}}
    middle_block: {{slave: {{body: block, on: bottom}}, master: {{body: middle, on: top}}}}
probes:
  top: {{quantity: reaction, body: block, on: top}}
  bottom: {{quantity: reaction, body: base, on: bottom}}
solver: {{newton: {{residual: 1.0e-10, max_iterations: 25}}}}
output: {{fields_every: 0}}
"""


def dragged(folder, E, x=0.0, text=STACK, **options):
    """Forces [N] on the block and on the base at the ends of steps, by time."""
    folder.mkdir()
    (folder / "case.yaml").write_text(text.format(E=E, x0=-1 + x, x1=-0.75 + x, x2=-0.5 + x))
    done = fsci("run", folder / "case.yaml", "-o", folder / "out", **options)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "leap" not in done.stdout + done.stderr
    history = read_history(folder / "out" / "history.csv")
    return np.array([history[name] for name in ("time", "top.x", "top.y", "bottom.x", "bottom.y")])


def test_a_stack_does_not_depend_on_what_stands_beside(tmp_path):
    """The middle block slips on both sides; the force through both joints is at most mu times that across them."""
    alone = dragged(tmp_path / "soft", 100)
    np.testing.assert_allclose(dragged(tmp_path / "moved", 1e12, 0.1234), alone, rtol=1e-8, atol=1e-8)
    time, top_x, top_y, bottom_x, _ = alone
    np.testing.assert_allclose(top_x, -bottom_x, atol=1e-8)
    sliding = time > 1.1
    np.testing.assert_allclose(top_x[sliding], -0.2 * top_y[sliding], rtol=3e-3)  # normals of deformed surfaces


@pytest.mark.slow
def test_a_stack_with_half_the_step_and_on_two_processes(tmp_path):
    """Once both joints slide, the force does not depend on the steps before."""
    alone = dragged(tmp_path / "one", 100)
    np.testing.assert_allclose(dragged(tmp_path / "two", 100, processes=2), alone, rtol=1e-8, atol=1e-8)
    halved = dragged(tmp_path / "half", 100, text=STACK.replace("step: 0.25", "step: 0.125"))
    np.testing.assert_allclose(halved[:, halved[0] > 1.1], alone[:, alone[0] > 1.1], rtol=1e-8, atol=1e-8)


def test_bodies_that_a_node_holds_do_not_slip_freely():
    """A chain of two loose bodies on a held one: pair 0 holds the first, pair 1 joins them, pair 2 the second alone."""
    unheld, of_pair = (
        Unheld(
            [
                Loose("first", {0: 1.0, 1: -1.0}, np.eye(2)),
                Loose("second", {1: 1.0, 2: -1.0}, np.eye(2)),
            ]
        ),
        np.eye(3),
    )

    def found(*status):
        return unheld.slips_freely(of_pair, np.ones(3, dtype=bool), np.array(status, dtype=np.int8)).tolist()

    assert found(STICK, STICK, SLIP) == [False, False, False]
    assert found(STICK, SLIP, SLIP) == [False, True, True]
    assert found(SLIP, STICK, SLIP) == [True, False, True]
    assert found(SLIP, SLIP, OPEN) == [True, True, False]
    assert found(OPEN, SLIP, STICK) == [False, True, False]
    slipping = np.full(3, SLIP)
    assert Unheld([]).slips_freely(of_pair, np.ones(3, dtype=bool), slipping).tolist() == [False] * 3
    assert unheld.slips_freely(of_pair, np.zeros(3, dtype=bool), slipping).tolist() == [False] * 3
