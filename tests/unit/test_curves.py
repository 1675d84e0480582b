"""Section `curves`: values between points, files, messages, and that results folders have all they need."""

import os
import time

import numpy as np
import pytest
from case_mistakes import first_lines, refused

from fsci.case import CaseError, load_case
from fsci.running.results_folder import prepare_folder

CASE = """\
time: {step: 0.5, end: 1}
curves:
  pulse: {table: [[0, 0], [0.5, 2], [2, -1]]}
  soft: {table: [[0, 0], [0.5, 2], [2, -1]], smooth: true}
  inflow: {csv: ../data/inflow.csv}
structure:
  bodies:
    beam:
      mesh: {shape: rectangle, size: [2, 1], cells: [2, 1]}
      material: {law: neo_hooke, E: 1e6, nu: 0.3, density: 0}
      supports:
        - {on: left, displacement: ["1e-3*pulse(t)", 0]}
      tractions:
        - {on: right, value: ["x*soft(2*t)", "inflow(t - 1)"]}
"""
CSV = "t; value\n\n# a comment\n0;1\n1e0 ; -3\n2\t0\n"


@pytest.fixture
def case(tmp_path, monkeypatch):
    for folder in ("case", "data"):
        (tmp_path / folder).mkdir()
    (tmp_path / "case" / "case.yaml").write_text(CASE)
    (tmp_path / "data" / "inflow.csv").write_text(CSV)
    monkeypatch.chdir(tmp_path / "case")
    return tmp_path / "case"


def test_values(case):
    """Straight between the points, constant outside; the smooth curve takes the extremum as its own."""
    curves = load_case(case).curves
    times = np.array([-1.0, 0.0, 0.25, 0.5, 1.0, 2.0, 3.0])
    assert curves["pulse"](times) == pytest.approx([0.0, 0.0, 1.0, 2.0, 1.0, -1.0, -1.0])
    assert curves["inflow"](times) == pytest.approx([1.0, 1.0, 0.0, -1.0, -3.0, 0.0, 0.0])
    soft = curves["soft"](np.linspace(-1.0, 3.0, 4001))
    assert (soft.max(), soft.min()) == (2.0, -1.0)
    assert np.abs(np.diff(soft, 2)).max() < 1e-4  # no kink: one has 1e-3 times the change of slope
    assert curves["soft"](times[[0, 1, 3, 5, 6]]) == pytest.approx([0.0, 0.0, 2.0, -1.0, -1.0])


def test_expressions_call_curves(case):
    beam = load_case(case).structure.bodies["beam"]
    x = np.array([[1.0, 2.0], [0.0, 0.0]])
    assert beam.supports[0].displacement[0](x, 0.25) == pytest.approx([1e-3, 1e-3])
    assert beam.tractions[0].value[0](x, 0.25) == pytest.approx([2.0, 4.0])
    assert beam.tractions[0].value[1](x, 1.5) == pytest.approx([-1.0, -1.0])


def test_files_of_curves_are_kept(case, tmp_path):
    out = tmp_path / "out"
    prepare_folder(load_case(case), out)
    assert (out / "curves" / "inflow" / "inflow.csv").read_text() == CSV
    assert load_case(out).curves["inflow"](0.5) == pytest.approx(-1.0)


@pytest.mark.parametrize(
    "text", ["0,1\n1;2\n2 3\n", "0, 1\n1, 2\n2, 3\n", "t\n0\t1\n1\t2\n2\t3", "# a\nt v\n0 1\n\n1 2\n2 3\n"]
)
def test_separators(case, text):
    """Any in each line; tables with one and the same are read at once."""
    (case.parent / "data" / "inflow.csv").write_text(text)
    assert load_case(case).curves["inflow"].points.tolist() == [[0, 1], [1, 2], [2, 3]]


def test_a_large_file_is_read_quickly(case):
    times = np.arange(200_000) * 1e-3
    text = "\n".join(f"{t!r},{t + 1!r}" for t in times.tolist())
    (case.parent / "data" / "inflow.csv").write_text(text)
    begin = time.perf_counter()
    points = load_case(case).curves["inflow"].points
    assert time.perf_counter() - begin < 4.0, "line by line it takes 4 s on a machine where this takes 0.4 s"
    assert np.array_equal(points, np.stack([times, times + 1], axis=1))


@pytest.mark.parametrize("name", ["/dev/zero", "/dev/stdin", "pipe", "folder", "../data"])
def test_what_is_not_a_file_is_not_read(case, name):
    os.mkfifo("pipe")
    os.mkdir("folder")
    error = refused(CASE.replace("../data/inflow.csv", name))
    assert first_lines(error)[0] == f"case.yaml:5:17: 'csv': '{name}' is not a file"


def test_the_largest_file(case, monkeypatch):
    monkeypatch.setattr("fsci.case.curve.MOST_BYTES_OF_CURVE", 10)
    assert first_lines(refused(CASE))[0] == "case.yaml:5:17: 'csv': '../data/inflow.csv' is larger than 1e-05 MB"


def test_curves_in_flows_motions_and_obstacles(tmp_path):
    """Wherever t is allowed: patches, rigid bodies, obstacles of contact."""
    text = """\
time: {step: 0.5, end: 1}
curves: {soft: {table: [[0, 0], [1, 2]]}}
fluid:
  density: 1
  viscosity: 1
  grid: {from: [0, 0], to: [1, 1], cells: [4, 4]}
  patches:
    inlet: {on: x-, velocity: ["soft(t)*y", 0]}
    rest: {on: [x+, y-, y+], outflow: true}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, cells: [8, 1], translate: [0.5, 0.5]}
      motion: {velocity: ["soft(t)", 0], rotation: {centre: [0.5, 0.5], angle: 10*soft(t)}}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [1, 1], origin: [0, -1]}
      material: {law: neo_hooke, E: 1, nu: 0, density: 1}
  dynamics: {}
coupling: {}
contact:
  obstacles: {wall: {mesh: {shape: rectangle, size: [1, 1], cells: [1, 1]}, on: left, motion: ["-soft(t)", 0]}}
  pairs: {wall: {slave: {body: block, on: right}, master: {obstacle: wall}}}
"""
    (tmp_path / "case.yaml").write_text(text)
    case = load_case(tmp_path)
    y = np.array([[0.0], [0.5]])
    assert case.fluid.patches["inlet"].velocity[0](y, 0.5) == pytest.approx([0.5])
    assert case.fluid.bodies["disc"].motion.velocity[0].at_times(0.25) == pytest.approx(0.5)
    assert case.fluid.bodies["disc"].motion.rotation.angle.at_times(0.25) == pytest.approx(5.0)
    assert case.contact.obstacles["wall"].motion[0](y, 1.0) == pytest.approx([-2.0])


MISTAKES = [
    ("pulse:", "sin:", "3:3: 'sin' must be another name: 'sin' is built into expressions"),
    ("pulse:", "a-b:", "3:3: 'a-b' must be a name without '-', which means minus in expressions, not 'a-b'"),
    (
        "[2, -1]]}",
        "[0.5, -1]]}",
        "3:38: entry 1 of entry 3 of 'table' must be greater than 0.5, the one before, not 0.5",
    ),
    ("[[0, 0], [0.5, 2], [2, -1]]}", "[[0, 0]]}", "3:18: 'table' must have 2 or more entries, not 1"),
    ("[0.5, 2]", "[0.5]", "3:27: entry 2 of 'table' must have 2 entries, not 1"),
    ("{table:", "{csv: a, table:", "3:10: a curve needs either 'table' or 'csv'"),
    ("{csv: ../data/inflow.csv}", "{}", "5:11: a curve needs either 'table' or 'csv'"),
    ("inflow.csv", "no.csv", "5:17: 'csv': '../data/no.csv' cannot be read: No such file or directory"),
    ("pulse(t)", "pluse(t)", "12:43: entry 1 of 'displacement': unknown function 'pluse'; did you mean 'pulse'?"),
    ("pulse(t)", "pulse*t", "12:43: entry 1 of 'displacement': 'pulse' is a function: write pulse(...)"),
    ("pulse(t)", "pulse(t, 1)", "12:43: entry 1 of 'displacement': 'pulse' takes 1 argument, not 2"),
]


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES, ids=[m[2] for m in MISTAKES])
def test_message(case, old, new, message):
    assert f"case.yaml:{message}" in first_lines(refused(CASE.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t, v\n0, 1\n", "'../data/inflow.csv' has 1 points, at least 2 are needed"),
        (
            "0, 1\n1, 2, 3\n",
            "'../data/inflow.csv', line 2: two numbers are expected, not '1, 2, 3'; "
            "a file has a time and one value in a line",
        ),
        (
            "0,0;1\n0,5;2\n",
            "'../data/inflow.csv', line 1: two numbers are expected, not '0,0;1'; decimals have a point",
        ),
        ("0, 1\n1, nan\n", "'../data/inflow.csv', line 2: two numbers are expected, not '1, nan'"),
        ("nan, 0\n0, 1\n1, 1\n", "'../data/inflow.csv', line 1: two numbers are expected, not 'nan, 0'"),
        ("t, v\n0, 1\n\n1, -inf\n2, 1\n", "'../data/inflow.csv', line 4: two numbers are expected, not '1, -inf'"),
        ("0, 1\n1, 1e999\n", "'../data/inflow.csv', line 2: two numbers are expected, not '1, 1e999'"),
        (
            "0, 1, 2\n1, 2\n2, 3\n",
            "'../data/inflow.csv', line 1: two numbers are expected, not '0, 1, 2'; "
            "a file has a time and one value in a line",
        ),
        ("0, 1\n1, 2 # end\n", "'../data/inflow.csv', line 2: two numbers are expected, not '1, 2 # end'"),
        ("0 1\n2 1\n1 3\n", "'../data/inflow.csv' must have increasing times, not go from 2 to 1"),
    ],
)
def test_message_about_a_file(case, text, message):
    (case.parent / "data" / "inflow.csv").write_text(text)
    with pytest.raises(CaseError) as caught:
        load_case("case.yaml")
    assert str(caught.value).startswith(f"case.yaml:5:17: 'csv': {message}\n")
