"""Bodies that cross more than a cell in a step are named by `fsci check` and by the run, with a step that is small."""

import pytest
from mpi4py import MPI

from fsci.builder.build import build
from fsci.case import load_case
from fsci.check.meshes import check_meshes
from fsci.running.run import FAILED, FINISHED, run_case
from solvers.march import march
from solvers.timing import Timer

CASE = """
time: {step: 0.1, end: 0.2}
fluid:
  density: 1
  viscosity: 1
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [2, 1], cells: [20, 10]}
  patches:
    walls: {on: [x-, x+, y-, y+], no_slip: true}
  bodies:
    disc:
      mesh: {shape: rectangle, size: [0.43, 0.43], cells: [2, 2], origin: [0.31, 0.31]}
      motion: {displacement: ["SPEED*t", 0]}
"""


def run(folder, speed):
    (folder / "case.yaml").write_text(CASE.replace("SPEED", speed))
    case = load_case(folder / "case.yaml")
    assert run_case(case, folder / "out") == FINISHED
    return case.warnings, (folder / "out" / "log.txt").read_text()


def test_three_cells_in_a_step(tmp_path):
    """0.3 m per step of 0.1 s in cells of 0.1 m."""
    warnings, log = run(tmp_path, "3")
    assert len(warnings) == 1
    assert (
        "the body crosses 3 cells in a time step: forces are inaccurate; a 'step' below 0.067 keeps it" in warnings[0]
    )
    assert log.count("body 'disc' crosses 3 cells in a time step") == 1
    assert "a step below 0.067 keeps it below 2 cells" in log


def fast(case):
    """The warnings of a check, but those of the few cells across the body and between it and the walls."""
    few = "cells across the body", "cells in the gap"
    return [line for line in check_meshes(case).warnings if not any(words in line for words in few)]


def test_a_rotation(tmp_path):
    """The corners, 0.304 m from the centre, go round with 57 degrees in a step of 0.1 s: 3 cells, less on a slant."""
    turning = "motion: {rotation: {centre: [0.525, 0.525], angular_velocity: 573}}"
    (tmp_path / "case.yaml").write_text(CASE.replace('motion: {displacement: ["SPEED*t", 0]}', turning))
    case = load_case(tmp_path / "case.yaml")
    assert case.warnings == ()  # the mesh is not read yet
    (warning,) = fast(case)
    assert (
        "case.yaml:14:15: the body crosses 3 cells in a time step: forces are inaccurate; a 'step' below 0.067"
        in warning
    )
    slow = load_case(tmp_path / "case.yaml", [("time.step", "0.06")])
    assert fast(slow) == []


@pytest.mark.filterwarnings("ignore:overflow")
@pytest.mark.parametrize("speed", ["1e12", "1e200"])
def test_a_body_that_is_gone(speed, tmp_path):
    """As an iterate that diverges: no more layers of cells than there are, and a run that ends."""
    opened = CASE.replace("x+, y-", "y-").replace("  bodies:", "    out: {on: x+, outflow: true}\n  bodies:")
    (tmp_path / "case.yaml").write_text(opened.replace("SPEED", speed))
    assert run_case(load_case(tmp_path / "case.yaml", [("time.retry.halvings", "0")]), tmp_path / "out") in (0, FAILED)


def test_less_than_two_cells(tmp_path):
    warnings, log = run(tmp_path, "1.9")
    assert warnings == ()
    assert "cells in a time step" not in log


BALL = """\
time: {step: 0.5, end: 1}
fluid:
  density: 1
  viscosity: 1
  element: q1q1
  flow: stokes
  scheme: bdf2
  grid:
    from: [0, 0, -3]
    to: [1.05, 1.05, 3]
    cells: [14, 14, null]
    z: [{to: -0.75, cells: 12, ratio: 0.4}, {to: 0.75, cells: 20}, {to: 3, cells: 12, ratio: 2.5}]
  patches:
    planes: {on: [x-, y-], symmetry: true}
    walls: {on: [x+, y+, z-, z+], no_slip: true}
  bodies:
    tube: {mesh: {shape: tube, inner_radius: 1, outer_radius: 1.8, height: 8, cells: [96, 1, 1], translate: [0, 0, -4]}}
    ball:
      mesh: {shape: sphere, radius: 0.5, cells: [12, 1]}
      free: {density: 2, gravity: [0, 0, -1], held: [x, y, rotation]}
coupling: {scheme: monolithic}
output: {fields_every: 0}
"""


@pytest.mark.slow
def test_multigrid_solves_the_flow_around_a_ball_that_falls_in_a_tube(tmp_path):
    """It is fast, so that the flow is extended to three layers: incomplete factors diverged there."""
    (tmp_path / "case.yaml").write_text(BALL)
    scheme = build(load_case(tmp_path / "case.yaml"), MPI.COMM_SELF, Timer()).scheme
    notes, depth = [], 0
    for _, info in march(scheme, 1.0, 2):
        notes += info.notes
        depth = max(depth, scheme.coupled.flow.cut.depth)
    assert depth >= 2
    assert notes == []
    assert scheme.coupled.flow.iterative.sequence.current == "multigrid"
