"""Bodies that cross more than a cell in a step are named by `fsci check` and by the run, with a step that is small."""

import pytest

from fsci.case import load_case
from fsci.check.meshes import check_meshes
from fsci.running.run import FAILED, FINISHED, run_case

CASE = """
time: {step: 0.1, end: 0.2}
fluid:
  density: 1
  viscosity: 1
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
    """The warnings of a check, but those of the few cells across the body."""
    return [line for line in check_meshes(case).warnings if "cells across the body" not in line]


def test_a_rotation(tmp_path):
    """The corners, 0.304 m from the centre, go round with 57 degrees in a step of 0.1 s: 3 cells, less on a slant."""
    turning = "motion: {rotation: {centre: [0.525, 0.525], angular_velocity: 573}}"
    (tmp_path / "case.yaml").write_text(CASE.replace('motion: {displacement: ["SPEED*t", 0]}', turning))
    case = load_case(tmp_path / "case.yaml")
    assert case.warnings == ()  # the mesh is not read yet
    (warning,) = fast(case)
    assert (
        "case.yaml:13:15: the body crosses 3 cells in a time step: forces are inaccurate; a 'step' below 0.067"
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
