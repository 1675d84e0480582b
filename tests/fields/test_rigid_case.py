"""Free rigid bodies in a case: run on two processes, resumed bit for bit, with located mistakes."""

import numpy as np
import pytest
from programs import fsci

from fsci.case import CaseError, load_case
from fsci.run.history import read_history
from fsci.run.run import FINISHED, run_case

#: A disc sinks in a box, held back by an eccentric spring.
SINKING = """\
title: a disc that sinks
time: {step: 0.02, end: 0.08}
fluid:
  density: 1
  viscosity: 0.05
  grid: {from: [0, 0], to: [1, 1], cells: [12, 12]}
  patches:
    walls: {on: [x-, x+, y-, y+], no_slip: true}
  dynamics: {rho_inf: 0.5}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, translate: [0.5, 0.5], cells: [24, 2]}
      free:
        density: 2
        gravity: [0, -5]
        springs: [{at: [0.6, 0.55], stiffness: [3, 1], damping: 0.1}]
        held: []
        initial_spin: [1]
coupling: {scheme: monolithic}
probes:
  centre: {body: disc, quantity: centre}
  rim: {body: disc, quantity: velocity, at: [0.7, 0.5]}
  spin: {body: disc, quantity: angular_momentum}
  mass: {body: disc, quantity: mass}
  force: {body: disc, quantity: force}
  beside: {quantity: velocity, at: [0.1, 0.5]}
solver: {newton: {residual: 1.0e-10}}
"""


def write(folder, text: str = SINKING):
    path = folder / "case.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("scheme", ["{scheme: monolithic}", "{scheme: partitioned, tolerance: 1.0e-9}"])
def test_run_and_resume(tmp_path, scheme):
    """It sinks and turns; a run that stopped halfway ends with the same numbers, bit for bit."""
    path = write(tmp_path, SINKING.replace("{scheme: monolithic}", scheme))
    histories = []
    for name, ends in (("once", ["0.08"]), ("twice", ["0.04", "0.08"])):
        out = tmp_path / name
        for number, end in enumerate(ends):
            words = ["run", path, "-o", out, "--set", f"time.end={end}"] if number == 0 else None
            run = fsci(*(words or ["resume", out, "--set", f"time.end={end}"]))
            assert run.returncode == 0, run.stdout + run.stderr
        histories.append(read_history(out / "history.csv"))
    once, twice = histories
    assert once["centre.y"][-1] < 0.5 - 1e-3
    assert once["mass"] == pytest.approx(2 * np.pi * 0.04, rel=0.02)
    assert once["interface.force"].max() < 1e-6
    for name in once.keys() - {"wall"}:
        assert np.array_equal(once[name], twice[name], equal_nan=True), name


def test_two_processes(tmp_path):
    path, histories = write(tmp_path), []
    for processes in (1, 2):
        out = tmp_path / str(processes)
        run = fsci("run", path, "-o", out, processes=processes)
        assert run.returncode == 0, run.stdout + run.stderr
        histories.append(read_history(out / "history.csv"))
    for name in ("centre.x", "centre.y", "rim.x", "rim.y", "spin", "force.x", "force.y"):
        one, two = (history[name] for history in histories)
        assert one == pytest.approx(two, rel=1e-8, abs=1e-9), name


MISTAKES = [
    (
        "coupling: {scheme: monolithic}\n",
        "",
        "a free body needs the section 'coupling'; 'coupling: {}' for its defaults",
    ),
    ("grid:", "scheme: steady\n  grid:", "a free body needs a time-dependent flow: choose the scheme bdf2"),
    ("held: []", "held: [z]", "a body in 2D has no degree of freedom 'z'; choose 'x', 'y' or 'rotation'"),
    ("initial_spin: [1]", "initial_spin: [1, 2, 3]", "'initial_spin' must have 1 entry in 2D, not 3"),
    ("stiffness: [3, 1]", "stiffness: [3, 1, 1]", "'stiffness' must have 2 entries in 2D, not 3"),
    ("gravity: [0, -5]", "gravity: [0, -5, 0]", "'gravity' must have 2 entries in 2D, not 3"),
    ("free:", "motion: {displacement: [0, t]}\n      free:", "give either 'motion' or 'free', not both"),
    (
        "{body: disc, quantity: c",
        "{field: rigid, body: disk, quantity: c",
        "is measured on a free body: name it as 'body'",
    ),
]


@pytest.mark.parametrize(("right", "wrong", "message"), MISTAKES)
def test_mistakes_are_located(tmp_path, right, wrong, message):
    assert right in SINKING
    with pytest.raises(CaseError) as error:
        load_case(write(tmp_path, SINKING.replace(right, wrong)))
    assert message in str(error.value)
    assert "case.yaml:" in str(error.value)


def test_elastic_bodies_beside_it_are_refused(tmp_path):
    text = (
        SINKING
        + """\
structure:
  dynamics: {}
  bodies:
    block:
      mesh: {shape: rectangle, size: [0.1, 0.1], cells: [1, 1]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 2}
"""
    )
    with pytest.raises(CaseError, match="a case has either free rigid bodies or elastic ones"):
        load_case(write(tmp_path, text))


def test_a_held_body_does_not_move(tmp_path):
    """All ways held: the flow is that around a body at rest."""
    text = SINKING.replace("held: []", "held: [x, y, rotation]").replace(
        "initial_spin: [1]", "initial_velocity: [0, 0]"
    )
    assert run_case(load_case(write(tmp_path, text)), tmp_path / "out") == FINISHED
    history = read_history(tmp_path / "out" / "history.csv")
    assert np.array_equal(history["centre.y"], np.full(4, history["centre.y"][0]))
    assert np.abs(history["rim.y"]).max() < 1e-14
