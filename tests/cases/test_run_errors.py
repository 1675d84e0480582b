"""Mistakes that only the meshes can tell: located messages and exit code 2, on one process and on two."""

import pytest
from programs import fsci

CASE = """\
time: {step: 1, end: 1}
structure:
  bodies:
    flag:
      mesh: {file: flag.geo, order: 1}
      region: flag
      material: {law: neo_hooke, E: 1e6, nu: 0.3}
      supports:
        - {on: clamp, displacement: [0, 0]}
      body_force: [0, -1]
probes:
  A: {quantity: displacement, at: [0.6, 0.2]}
"""

MISTAKES = {
    "surface": (
        "on: clamp",
        "on: clmp",
        "case.yaml:9:16: unknown surface, line or points 'clmp'; did you mean 'clamp'?",
    ),
    "region": ("region: flag", "region: flog", "case.yaml:6:15: unknown region 'flog'; did you mean 'flag'?"),
    "length": ("body_force: [0, -1]", "body_force: [0, 0, -1]", "case.yaml:10:19: 'body_force' has 3 entries, but the"),
    "point": ("at: [0.6, 0.2]", "at: [0.7, 0.2]", "case.yaml:12:35: the point (0.7, 0.2) is not in body 'flag'"),
    "symmetry": (
        "displacement: [0, 0]",
        "symmetry: true",
        "case.yaml:9:11: a plane of symmetry must be plane, but this surface is curved",
    ),
}


@pytest.mark.parametrize("processes", [1, 2])
@pytest.mark.parametrize("mistake", MISTAKES)
def test_located(mistake, processes, tmp_path):
    right, wrong, message = MISTAKES[mistake]
    with open("cases/csm3/flag.geo") as file:
        (tmp_path / "flag.geo").write_text(file.read())
    (tmp_path / "case.yaml").write_text(CASE.replace(right, wrong))
    run = fsci("run", tmp_path, "-o", tmp_path / "out", processes=processes, timeout=60)
    assert run.returncode == 2, run.stdout + run.stderr
    assert message in run.stderr
    assert run.stderr.count(message) == 1
    assert "Traceback" not in run.stderr


@pytest.mark.parametrize("processes", [1, 2])
def test_no_state_at_the_start(processes, tmp_path):
    """A load that is infinite at t = 0 is an error at once, not a run that begins without it."""
    falling = """\
time: {step: 0.1, end: 1}
structure:
  dynamics: {rho_inf: 1}
  bodies:
    plate:
      mesh: {shape: rectangle, size: [1, 1], cells: [2, 2]}
      material: {law: neo_hooke, E: 1, nu: 0.3, density: 1}
      body_force: [0, "1/t"]
"""
    (tmp_path / "case.yaml").write_text(falling)
    run = fsci("run", tmp_path, "-o", tmp_path / "out", processes=processes, timeout=60)
    assert run.returncode == 2, run.stdout + run.stderr
    message = "case.yaml:8:23: entry 2 of 'body_force': '1/t' is infinite at t = 0"
    assert run.stderr.count(message) == 1
    assert "Traceback" not in run.stderr
