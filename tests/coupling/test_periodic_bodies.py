"""Free and elastic bodies across the end of a periodic channel: as in the middle of it."""

import numpy as np
import pytest
from mpi4py import MPI
from programs import fsci

from fsci.builder.build import build
from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case
from solvers.march import march
from solvers.timing import Timer

CHANNEL = """\
time: {step: 0.02, end: END}
fluid:
  density: 1
  viscosity: 0.02
  body_force: [1, 0]
  element: ELEMENT
  grid: {from: [0, 0], to: [2, 1], cells: [16, 8]}
  patches: {ends: {on: [x-, x+], periodic: true}, floor: {on: y-, no_slip: true}, lid: {on: y+, velocity: [4, 0]}}
BODIEScoupling: {scheme: SCHEME}
solver: {newton: {residual: 1.0e-11}}
"""
FREE = """\
  bodies:
    disc: {mesh: {shape: disc, radius: 0.2, cells: [24, 1], translate: [X, 0.47]}, free: {density: 1.5}}
"""
ELASTIC = """\
structure:
  dynamics: {}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, cells: [16, 3], translate: [X, 0.47]}
      material: {law: neo_hooke, E: 50, nu: 0.4, density: 1.5}
"""


def case(folder, bodies, *, x=0.9, element="q1q1", scheme="monolithic", end=0.1):
    text = CHANNEL.replace("BODIES", bodies).replace("X", str(x)).replace("ELEMENT", element)
    path = folder / "case.yaml"
    path.write_text(text.replace("SCHEME", scheme).replace("END", str(end)))
    return path


def motion(folder, steps=5, **choices):
    """(way and velocity of the vertices, force on the disc) after each step."""
    found = build(load_case(case(folder, **choices)), MPI.COMM_SELF, Timer())
    rows = []
    for _ in march(found.scheme, 0.02 * steps, steps):
        flow = found.scheme.coupled.flow
        force = flow.force()["disc"].sum(axis=0)
        moved = flow.cut.motion
        rows.append((np.stack([moved.x + np.array([0.9 - choices["x"], 0]), moved.v]), force))
    return [np.array(some) for some in zip(*rows, strict=True)]


@pytest.mark.parametrize("bodies", [FREE, ELASTIC], ids=["free", "elastic"])
@pytest.mark.parametrize(
    ("element", "scheme"),
    [
        ("q1q1", "monolithic"),
        pytest.param("q2q1", "monolithic", marks=pytest.mark.slow),
        pytest.param("q2q1", "partitioned", marks=pytest.mark.slow),
    ],
)
def test_it_moves_as_within_the_period(tmp_path, bodies, element, scheme):
    """By whole cells further, across the end, and in another period."""
    way, force = motion(tmp_path, bodies=bodies, x=0.9, element=element, scheme=scheme)
    assert way[-1, 0].mean(axis=0)[0] > 0.9 + 1e-3
    for shift in (1.0, 0.875, -3.0):
        moved, felt = motion(tmp_path, bodies=bodies, x=0.9 + shift, element=element, scheme=scheme)
        assert np.abs(moved - way).max() < 1e-8
        assert np.abs(felt - force).max() < 1e-8 * np.abs(force).max()


@pytest.mark.parametrize(
    "bodies", [pytest.param(FREE, id="free"), pytest.param(ELASTIC, id="elastic", marks=pytest.mark.slow)]
)
def test_it_resumes_across_the_end(tmp_path, bodies):
    """To the last digit; and two processes have the same to 1e-8."""
    probe = "probes: {force: {quantity: force, body: disc}, energy: {quantity: kinetic_energy}}\n"
    histories = []
    for name, processes, end in (("whole", 1, 0.08), ("two", 2, 0.08), ("part", 1, 0.04)):
        (tmp_path / name).mkdir()
        path = case(tmp_path / name, bodies, x=1.9, end=end)
        path.write_text(path.read_text() + probe + "output: {fields_every: 0}\n")
        if processes == 1:
            assert run_case(load_case(path), tmp_path / name / "out") == FINISHED
        else:
            assert fsci("run", path, "-o", tmp_path / name / "out", processes=2).returncode == 0
    assert resume_run(tmp_path / "part" / "out", [("time.end", "0.08")]) == FINISHED
    histories = [read_history(tmp_path / name / "out" / "history.csv") for name in ("whole", "part", "two")]
    for column in ("force.x", "force.y", "energy"):
        whole, part, two = (np.array(history[column], dtype=float) for history in histories)
        assert np.array_equal(part, whole)
        assert np.abs(two - whole).max() < 1e-8 * np.abs(whole).max()


def test_a_body_as_long_as_the_period(tmp_path):
    """It would meet its image."""
    bar = FREE.replace("shape: disc, radius: 0.2, cells: [24, 1]", "shape: rectangle, size: [2, 0.4], cells: [10, 2]")
    path = case(tmp_path, bar)
    with pytest.raises(CaseError) as caught:
        build(load_case(path), MPI.COMM_SELF, Timer())
    rule = "the body must be shorter than the period along x, 2: it has 2"
    assert str(caught.value).startswith(f"{path}:10:11: {rule}")
