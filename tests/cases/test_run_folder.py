"""The results folder holds all that the run read: it can be run and resumed wherever it is put."""

import shutil

import numpy as np
import pytest
from programs import fsci

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.results_folder import prepare_folder
from fsci.running.run import FAILED, FINISHED, run_case

CASE = """
time: {step: 0.5, end: 1}  # a comment
structure:
  bodies:
    here:
      mesh: {file: flag.geo, order: 2}
      material: {law: neo_hooke, E: 1e6, nu: 0.3}
      supports: [{on: clamp, displacement: [0, 0]}]
      body_force: [0, "-1000*t"]
    there:
      mesh: {file: ../shared/flag.geo, order: 2}
      material: {law: neo_hooke, E: 1e6, nu: 0.3}
      supports: [{on: clamp, displacement: [0, 0]}]
probes:
  A: {body: here, quantity: displacement, at: [0.6, 0.2]}
"""


@pytest.fixture
def case(tmp_path):
    for folder in ("case", "shared"):
        (tmp_path / folder).mkdir()
        shutil.copy("cases/csm3/flag.geo", tmp_path / folder)
    (tmp_path / "case" / "case.yaml").write_text(CASE)
    return tmp_path / "case"


def test_meshes_are_kept(case, tmp_path):
    out = tmp_path / "deep" / "out"
    prepare_folder(load_case(case), out)
    assert (out / "flag.geo").is_file()
    assert (out / "meshes" / "there" / "flag.geo").is_file()
    assert not (tmp_path / "deep" / "shared").exists()
    text = (out / "case.yaml").read_text()
    assert "# a comment" in text
    assert load_case(out).structure.bodies["there"].mesh.file == "meshes/there/flag.geo"
    assert load_case(out).structure.bodies["here"].mesh.file == "flag.geo"


def test_without_foreign_meshes_the_case_is_copied_as_it_is(tmp_path):
    prepare_folder(load_case("cases/csm3"), tmp_path)
    with open("cases/csm3/case.yaml") as file:
        assert (tmp_path / "case.yaml").read_text() == file.read()


def test_results_can_move(case, tmp_path):
    """The sources are gone and the folder is elsewhere: it can still be resumed, and run again."""
    out, moved = tmp_path / "out", tmp_path / "elsewhere" / "moved"
    assert run_case(load_case(case, [("time.end", "0.5")]), out) == FINISHED
    shutil.rmtree(case)
    shutil.rmtree(tmp_path / "shared")
    moved.parent.mkdir()
    out.rename(moved)
    (moved / "case.yaml").write_text((moved / "case.yaml").read_text().replace("end: 0.5", "end: 1.0"))
    done = fsci("resume", moved)
    assert done.returncode == FINISHED, done.stdout + done.stderr
    again = tmp_path / "again"
    assert run_case(load_case(moved), again) == FINISHED
    one, two = (read_history(folder / "history.csv") for folder in (moved, again))
    assert len(one["time"]) == 2
    assert np.array_equal(one["A.y"], two["A.y"])


def test_a_failure_takes_its_meshes_along(case, tmp_path):
    out = tmp_path / "out"
    crash = [("structure.bodies.here.body_force", "[0, -1e12]"), ("time.retry.halvings", "0")]
    assert run_case(load_case(case, crash), out) == FAILED
    kept = load_case(out / "failure")
    for body in kept.structure.bodies.values():
        assert (out / "failure" / body.mesh.file).is_file()


def test_meshes_of_obstacles_are_kept(case, tmp_path):
    contact = (
        "{obstacles: {wall: {mesh: {file: ../shared/flag.geo}, on: tip}},"
        " pairs: {touch: {slave: {body: here, on: tip}, master: {obstacle: wall}}}}"
    )
    prepare_folder(load_case(case, [("contact", contact)]), tmp_path / "out")
    kept = load_case(tmp_path / "out").contact
    assert kept is not None
    assert (tmp_path / "out" / kept.obstacles["wall"].mesh.file).is_file()
