"""Elastic walls thinner than a cell: nothing passes, and they carry the difference of the pressures."""

import json
from pathlib import Path

import numpy as np
import pytest
from programs import fsci

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import run_case

CASES = Path(__file__).parents[2] / "cases"
CASE = """\
time: {{step: 0.05, end: {end}}}
fluid:
  density: 1
  viscosity: 0.01
  scheme: backward_euler
  element: {element}
  grid: {{from: [0, 0], to: [3, 1], cells: [30, 10]}}
  patches:
    inlet: {{on: x-, traction: ["min(t,1)", 0]}}
    outlet: {{on: x+, traction: [0, 0]}}
    walls: {{on: [y-, y+], slip: true}}
structure:
  dynamics: {{rho_inf: 0.5, damping: {{stiffness: 0.01}}}}
  bodies:
    plate:
      mesh: {{shape: rectangle, size: [0.02, 1], cells: [1, 10], order: 2, origin: [1.537, 0]}}
      material: {{law: st_venant_kirchhoff, E: {E}, nu: 0.3, density: 1}}
      supports: [{{on: [bottom, top], displacement: [0, 0]}}]
coupling: {{scheme: {scheme}}}
probes:
  flow: {{quantity: flow_rate, through: outlet}}
  mid: {{body: plate, quantity: displacement, at: [1.537, 0.5]}}
  left: {{quantity: pressure, at: [1.51, 0.52]}}
  right: {{quantity: pressure, at: [1.59, 0.52]}}
"""
RUN = {"E": 1e8, "end": 2, "element": "q1q1", "scheme": "monolithic"}


def history_of(folder, **changes):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(CASE.format(**(RUN | changes)))
    case = load_case(folder)
    assert case.warnings == ()
    assert run_case(case, folder / "out") == 0
    return read_history(folder / "out" / "history.csv")


def test_wall_that_closes_a_channel(tmp_path):
    """In the end it rests: pressures 1 and 0 in the same column of cells, and the deflection of the wall alone."""
    history = history_of(tmp_path)
    assert abs(history["flow"][-1]) < 1e-10
    assert history["left"][-1] == pytest.approx(1.0, abs=1e-6)
    assert history["right"][-1] == pytest.approx(0.0, abs=1e-6)
    assert history["mid.x"][-1] == pytest.approx(3.425697e-5, rel=1e-4)


@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=pytest.mark.slow)])
def test_both_schemes(tmp_path, element):
    """A soft wall, which goes to other cells: the same deflection, with Newton steps as of a thick one."""
    one, two = (
        history_of(tmp_path / scheme, E=1e4, end=0.3, element=element, scheme=scheme)
        for scheme in ("monolithic", "partitioned")
    )
    assert one["mid.x"][-1] > 3e-3
    assert np.allclose(one["mid.x"], two["mid.x"], rtol=1e-4)
    assert np.allclose(one["flow"], two["flow"], rtol=1e-3)
    assert one["iterations"].max() <= 4
    assert np.abs(one["fluid.mass"]).max() < 1e-9


@pytest.mark.slow
def test_resumed_and_on_two_processes(tmp_path):
    """A run that goes on is the same bit for bit, and on two processes the same to 1e-8."""
    found = {}
    for name, processes, end in (("whole", 1, 0.2), ("resumed", 1, 0.1), ("two", 2, 0.2)):
        (tmp_path / "case.yaml").write_text(CASE.format(**(RUN | {"E": 1e4, "end": end})))
        done = fsci("run", tmp_path, "-o", tmp_path / name, processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        if name == "resumed":
            done = fsci("resume", tmp_path / name, "--set", "time.end=0.2")
            assert done.returncode == 0, done.stdout + done.stderr
        found[name] = read_history(tmp_path / name / "history.csv")
    for column in ("mid.x", "flow", "left", "right"):
        whole = found["whole"][column]
        assert np.array_equal(found["resumed"][column], whole)
        assert np.allclose(found["two"][column], whole, rtol=1e-8, atol=1e-8 * np.abs(whole).max())


@pytest.mark.slow
def test_end_of_a_flag_in_a_plane_of_the_grid(tmp_path):
    """Twice the end crosses a plane in one iterate and not in the next: no step is repeated."""
    assert run_case(load_case(CASES / "thin_flag"), tmp_path) == 0
    assert json.loads((tmp_path / "summary.json").read_text())["steps"] == {"accepted": 100, "retried": 0}


def test_wall_made_of_a_line(tmp_path):
    """A line in a mesh file with a thickness is the same wall in the same flow."""
    script = "Point(1) = {1.547, 0, 0}; Point(2) = {1.547, 1, 0}; Line(1) = {1, 2}; Transfinite Curve {1} = 11;\n"
    (tmp_path / "line.geo").write_text(script)
    soft = RUN | {"E": 1e4, "end": 0.2}
    shape = history_of(tmp_path / "shape", **soft)
    text = CASE.format(**soft)
    old = "{shape: rectangle, size: [0.02, 1], cells: [1, 10], order: 2, origin: [1.537, 0]}"
    assert old in text
    text = text.replace(old, "{file: line.geo, thickness: 0.02, order: 2}").replace("[bottom, top]", "edge")
    (tmp_path / "case.yaml").write_text(text)
    assert run_case(load_case(tmp_path), tmp_path / "out") == 0
    line = read_history(tmp_path / "out" / "history.csv")
    for column in ("mid.x", "flow", "left", "right"):
        assert line[column] == pytest.approx(shape[column], rel=1e-8, abs=1e-10)
