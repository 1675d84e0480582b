"""Contact through the program: columns, processes, resumed runs, opening and closing, probes."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from case_text import without
from contact_cases import COLLISION, PISTON, PLATE, run
from programs import fsci
from structure_setup import make_structure

from coupling.contact_surfaces import contact_surface
from fsci import shapes
from fsci.case import load_case
from fsci.running.checkpoint import read_checkpoint
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import NeoHooke


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plate")
    return folder / "out", run(PLATE, folder)


@pytest.fixture(scope="module")
def collision(tmp_path_factory):
    folder = tmp_path_factory.mktemp("collision")
    return folder / "out", run(COLLISION, folder)


def test_columns(plate):
    _, history = plate
    for name in ("active", "changes", "press.x", "press.y", "press.z"):
        assert f"contact.{name}" in history


def test_contact_closes_and_opens(plate):
    _, history = plate
    assert history["contact.active"].tolist() == [16, 16, 16, 0, 16, 16, 16, 0]
    assert np.abs(history["top.z"][[3, 7]]).max() < 1e-10
    depth = 0.2 * np.sin(2 * np.pi * history["time"]) ** 2 - 0.01
    closed = history["contact.active"] > 0
    assert history["top.z"][closed] == pytest.approx(-depth[closed], rel=1e-10)


def test_nothing_is_retried_and_newton_is_short(plate):
    out, history = plate
    assert json.loads((out / "summary.json").read_text())["steps"]["retried"] == 0
    assert history["iterations"].max() <= 6


def test_contact_force_is_the_reaction(plate):
    """Frictionless on a flat plate: only normal force, and the foot carries it."""
    _, history = plate
    size = np.abs(history["foot.z"]).max()
    for axis in "xyz":
        assert np.abs(history[f"contact.press.{axis}"] + history[f"foot.{axis}"]).max() < 1e-10 * size
    assert np.abs(history["contact.press.x"]).max() < 1e-10 * size
    assert history["contact.press.z"].min() < -100


@pytest.mark.slow
def test_processes_agree(plate, tmp_path):
    """Contact closes, opens and closes again."""
    alone = {name: column[:5] for name, column in plate[1].items()}
    (tmp_path / "case.yaml").write_text(PLATE.replace("end: 1.0", "end: 0.625"))
    result = fsci("run", tmp_path / "case.yaml", "-o", tmp_path / "out", processes=3)
    assert result.returncode == FINISHED, result.stdout + result.stderr
    together = read_history(tmp_path / "out" / "history.csv")
    same_up_to_rounding(alone, together)


def same_up_to_rounding(one, two):
    """Vectors are compared as wholes: their small components are rounding errors."""
    for name in one.keys() - {"wall", "residual"}:
        group = [other for other in one if other.rsplit(".", 1)[0] == name.rsplit(".", 1)[0]]
        size = max(np.abs(one[other]).max() for other in group)
        assert np.abs(one[name] - two[name]).max() <= 1e-9 * size, name


@pytest.mark.parametrize("processes", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_processes_agree_in_motion(collision, processes, tmp_path):
    """They meet and part."""
    _, alone = collision
    (tmp_path / "case.yaml").write_text(COLLISION.replace("end: 1.0", "end: 0.2"))
    result = fsci("run", tmp_path / "case.yaml", "-o", tmp_path / "out", processes=processes)
    assert result.returncode == FINISHED, result.stdout + result.stderr
    together = read_history(tmp_path / "out" / "history.csv")
    steps = len(together["step"])
    assert together["contact.active"].max() >= 3
    assert together["contact.active"][-1] == 0
    same_up_to_rounding({name: column[:steps] for name, column in alone.items()}, together)


@pytest.mark.parametrize(("text", "end"), [(PLATE, 0.625), (COLLISION, 0.1)])
def test_resume_is_bitwise(text, end, tmp_path, plate, collision):
    """Stopped in the middle of contact."""
    straight, whole = plate if text is PLATE else collision
    out = tmp_path / "run" / "out"
    run(text, tmp_path / "run", ("time.end", str(end)))
    assert read_history(out / "history.csv")["contact.active"][-1] > 0
    (out / "case.yaml").write_text((out / "case.yaml").read_text().replace(f"end: {end}", "end: 1.0"))
    result = fsci("resume", out)
    assert result.returncode == FINISHED, result.stdout + result.stderr
    resumed = read_history(out / "history.csv")
    for name in whole.keys() - {"wall"}:
        assert np.array_equal(whole[name], resumed[name]), name
    (one, _), (two, _) = (read_checkpoint(folder / "checkpoint") for folder in (straight, out))
    contacts = [state["scheme"]["contact"] for state in (one, two)]
    works = [[contact.pop(name) for contact in contacts] for name in ("work", "obstacle_work")]
    for first, second in (contacts, *works):
        for name, value in first.items():
            assert np.array_equal(value, second[name]), name
    for name in ("u", "v", "a"):
        for body, value in one["scheme"][name].items():
            assert np.array_equal(value, two["scheme"][name][body]), name


def test_surfaces_together_are_one():
    """Facets that are in two of them count once; nodes between them belong to both."""
    mesh = shapes.rectangle((2, 1), (4, 1), order=2)
    top = mesh.surfaces["top"]
    parts = {"west": top[:3], "east": top[2:]}
    mesh = replace(mesh, surfaces=mesh.surfaces | parts)
    bodies = [make_structure(mesh, NeoHooke(1.0, 1.0)).bodies[0]]
    whole, together = (contact_surface(bodies, "body", *n) for n in (("top",), tuple(parts)))
    assert np.array_equal(whole.points, together.points)
    assert np.array_equal(np.sort(whole.facets, axis=0), np.sort(together.facets, axis=0))
    assert together.name == "body.west.east"


def test_several_surfaces_of_an_obstacle(plate, tmp_path):
    """Sides of the plate that nothing comes near change nothing."""
    sides = PLATE.replace("on: bottom\n", "on: [bottom, left, top]\n")
    history = run(sides, tmp_path / "sides", ("time.end", "0.5"))
    assert history["contact.press.z"].min() < -1.0
    assert history["contact.press.z"] == pytest.approx(plate[1]["contact.press.z"][: len(history["time"])], rel=1e-9)


@pytest.mark.parametrize("text", [PLATE.replace("1.01]", "3]"), COLLISION.replace("[1.2, 0.3]", "[9, 0.3]")])
def test_bodies_that_never_meet(text, tmp_path):
    """The result without the section: static, bit for bit; free flight, in which mass may be anywhere, to rounding."""
    apart, alone = run(text, tmp_path / "with"), run(without(text, "contact"), tmp_path / "without")
    assert not apart["contact.active"].any()
    for name in alone.keys() - {"wall", "residual", "structure.energy"}:
        if "dynamics" in text:
            assert np.abs(apart[name] - alone[name]).max() < 1e-12 * max(1.0, np.abs(alone[name]).max()), name
        else:
            assert np.array_equal(apart[name], alone[name]), name


def test_momentum_of_a_collision(collision):
    _, history = collision
    momentum = np.array([3 - 2, 0.5])
    for axis, wanted in zip("xy", momentum, strict=True):
        assert np.abs(history[f"momentum.{axis}"] - wanted).max() < 1e-9 * np.linalg.norm(momentum)
    assert history["contact.active"].max() >= 3
    assert history["contact.active"][-1] == 0
    assert history["right.x"][-1] > 0 > history["right.x"][0]  # it has been thrown back


def test_probes_of_a_pair(tmp_path):
    """Uniaxial strain: with the stretch s the pressure of St. Venant-Kirchhoff is (lambda + 2 mu)/2 (1 - s^2) s."""
    history = run(PISTON, tmp_path)
    t, (mu, lmbda) = history["time"], lame(1000, 0.25)
    stretch = 1.0 - np.maximum(0.1 * t - 0.035, 0.0)
    pressure = 0.5 * (lmbda + 2.0 * mu) * (1.0 - stretch**2) * stretch
    for name in ("pressure", "least", "corner"):
        assert history[name] == pytest.approx(pressure, rel=1e-9, abs=1e-9)
    for name in ("gap", "wide", "middle"):
        assert history[name] == pytest.approx(np.maximum(0.035 - 0.1 * t, 0.0), abs=1e-12)
    assert np.array_equal(history["touch"], [np.nan] * 3 + [t[3]] * 3, equal_nan=True)
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["verify"][0]["ok"]


def test_first_contact_is_remembered(tmp_path):
    """By a run that goes on after the contact, and by one that stopped just in the step of it."""
    (tmp_path / "case.yaml").write_text(PISTON)
    for end in ("0.4", "0.5"):
        out = tmp_path / end
        assert run_case(load_case(tmp_path / "case.yaml", [("time.end", end), ("verify", "[]")]), out) == FINISHED
        text = (out / "case.yaml").read_text().replace(f"end: {end}", "end: 0.6")
        (out / "case.yaml").write_text(text)
        assert resume_run(out) == FINISHED
        assert read_history(out / "history.csv")["touch"][3:] == pytest.approx([0.4] * 3)
