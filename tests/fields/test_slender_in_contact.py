"""A cantilever that bends onto a stop, without numerical settings: second order, as beam theory says.

A load q per length bends a beam freely by q l^4 / (8 E I) at its tip. A stop at 0.3 of that bears

    R = 3/8 q l - 3 E I gap / l^3 = 0.2625 q l ,

and the slope there is still downwards, so that the tip alone touches. First-order cells of this length are three times
too stiff and bear a seventh of it.
"""

from __future__ import annotations

import numpy as np
import pytest
from programs import fsci

from fsci.case import load_case
from fsci.meshes.of_case import degree_of_cells
from fsci.running.history import read_history

E, THICKNESS, Q = 1.0e6, 0.05, 0.2
GAP = 0.3 * Q / (8 * E * THICKNESS**3 / 12)
BORNE = 0.2625 * Q


def beam(length):
    """The beam and its stop with this length [m]."""
    wall, stop = THICKNESS * length, [0.9 * length, (-GAP - 0.2) * length]
    return f"""\
title: a cantilever that bends onto a stop
time: {{step: 0.5, end: 1}}
structure:
  bodies:
    beam:
      mesh: {{shape: rectangle, size: [{length}, {wall}], cells: [10, 1]}}
      material: {{law: st_venant_kirchhoff, E: {E}, nu: 0}}
      supports: [{{on: left, displacement: [0, 0]}}]
      tractions: [{{on: top, value: [0, "-{Q}*t"]}}]
contact:
  obstacles:
    stop: {{mesh: {{shape: rectangle, size: [{0.4 * length}, {0.2 * length}], cells: [1, 1], origin: {stop}}}, on: top}}
  pairs:
    stop: {{slave: {{body: beam, on: bottom}}, master: {{obstacle: stop}}}}
"""


BEAM = beam(1)

#: the stop as a thick elastic body of a thousand times the stiffness
BLOCK = f"""\
    block:
      mesh: {{shape: rectangle, size: [0.4, 0.2], cells: [7, 4], origin: [0.83, {-GAP - 0.2}]}}
      material: {{law: st_venant_kirchhoff, E: {1000 * E}, nu: 0}}
      supports: [{{on: bottom, displacement: [0, 0]}}]
contact:
  pairs:
    stop: {{slave: {{body: SLAVE}}, master: {{body: MASTER}}}}
"""
ON_BLOCK = BEAM[: BEAM.index("contact:")] + BLOCK
SIDES = "beam, on: bottom", "block, on: top"

SPACE = (
    BEAM.replace(f"rectangle, size: [1, {THICKNESS}], cells: [10, 1]", f"box, size: [1, 1, {THICKNESS}], cells: CELLS")
    .replace("[0, 0]", "[0, 0, 0]")
    .replace('[0, "-', '[0, 0, "-')
    .replace(
        "rectangle, size: [0.4, 0.2], cells: [1, 1], origin: [0.9, ",
        "box, size: [0.4, 3, 0.2], cells: [1, 1, 1], origin: [0.9, -1, ",
    )
)

SCENES = {
    "quadrilaterals": BEAM,
    "triangles": BEAM.replace("[10, 1]", "[10, 1], cell: tri"),
    "moved by a third of a cell": BEAM.replace("origin: [0.9,", "origin: [0.933,"),
    "friction": BEAM.replace("contact:", "contact:\n  friction: {coefficient: 0.3}"),
    "on a block": ON_BLOCK.replace("SLAVE", SIDES[0]).replace("MASTER", SIDES[1]),
    "under a block": ON_BLOCK.replace("SLAVE", SIDES[1]).replace("MASTER", SIDES[0]),
    "found by itself": ON_BLOCK[: ON_BLOCK.index("  pairs:")] + "  bodies: all\n",
    "hexahedra": SPACE.replace("CELLS", "[10, 1, 1]"),
    "tetrahedra": SPACE.replace("CELLS", "[10, 2, 1], cell: tet"),
}


def borne(folder, text, *words, q=Q, processes=1):
    """Force on the stop [N], by what the clamp does not bear."""
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text + "probes: {clamp: {body: beam, quantity: reaction, on: left}}\n")
    done = fsci("run", folder, "-o", folder / "out", *words, processes=processes)
    assert done.returncode == 0, done.stdout + done.stderr
    return q - read_history(folder / "out" / "history.csv")[f"clamp.{'z' if 'box' in text else 'y'}"][-1]


@pytest.mark.parametrize("name", SCENES)
def test_a_stop_bears_what_beam_theory_says(name, tmp_path):
    assert borne(tmp_path, SCENES[name]) == pytest.approx(BORNE, rel=0.015)
    assert degree_of_cells(load_case(tmp_path), "beam") == 2
    if "block" in SCENES[name]:
        assert degree_of_cells(load_case(tmp_path), "block") == 2


def test_in_millimetres(tmp_path):
    """Lengths of a thousandth at the same stresses: forces per depth are a thousandth, too."""
    assert 1000 * borne(tmp_path, beam(0.001), q=0.001 * Q) == pytest.approx(BORNE, rel=0.015)


@pytest.mark.slow
def test_resumed_and_on_two_processes(tmp_path):
    whole = borne(tmp_path / "whole", BEAM)
    borne(tmp_path / "half", BEAM, "--set", "time.end=0.5")
    done = fsci("resume", tmp_path / "half" / "out", "--set", "time.end=1")
    assert done.returncode == 0, done.stdout + done.stderr
    histories = [read_history(tmp_path / name / "out" / "history.csv") for name in ("whole", "half")]
    for column in histories[0].keys() - {"wall"}:
        assert np.array_equal(histories[0][column], histories[1][column]), column
    assert borne(tmp_path / "two", BEAM, processes=2) == pytest.approx(whole, rel=1e-8)
