"""A viscosity by the shear rate around an elastic body, as a user runs it: both schemes, resumed, a known limit."""

import numpy as np
import pytest
from coupled_case import POST
from programs import fsci

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

CARREAU = "viscosity: 0.05\n  shear: {law: carreau, infinite: 0.005, time: 0.5, exponent: 0.4}\n"
THINNING = POST.replace("viscosity: 0.05\n", CARREAU)
PARTITIONED = "coupling: {scheme: partitioned, tolerance: 1.0e-9}"
NAMES = ("tip.x", "tip.y", "force.x")


def run(text, folder, *overrides):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml", overrides), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


@pytest.fixture(scope="module")
def thinning(tmp_path_factory):
    return run(THINNING, tmp_path_factory.mktemp("thinning"))


def test_partitioned_is_monolithic_with_it(thinning, tmp_path):
    found = run(THINNING.replace("coupling: {scheme: monolithic}", PARTITIONED), tmp_path)
    for name in NAMES:
        assert np.abs(found[name] - thinning[name]).max() < 1e-6 * np.abs(thinning[name]).max()


def test_exponent_one_is_newtonian(thinning, tmp_path):
    known = run(POST, tmp_path / "known")
    found = run(THINNING, tmp_path / "limit", ("fluid.shear.exponent", "1"))
    for name in NAMES:
        assert np.abs(found[name] - known[name]).max() < 1e-9 * np.abs(known[name]).max()
    assert abs(thinning["force.x"][-1]) < 0.98 * abs(known["force.x"][-1])


@pytest.mark.slow
def test_resumed_with_it(thinning, tmp_path):
    run(THINNING, tmp_path, ("time.end", "0.04"))
    ended = fsci("resume", tmp_path / "out", "--set", "time.end=0.1")
    assert ended.returncode == 0, ended.stderr
    found = read_history(tmp_path / "out" / "history.csv")
    for name in NAMES:
        assert np.array_equal(found[name], thinning[name])


@pytest.mark.slow
def test_two_processes_agree(thinning, tmp_path):
    (tmp_path / "case.yaml").write_text(THINNING)
    assert fsci("run", tmp_path / "case.yaml", "-o", tmp_path / "two", processes=2).returncode == 0
    found = read_history(tmp_path / "two" / "history.csv")
    for name in NAMES:
        assert np.abs(found[name] - thinning[name]).max() < 1e-7 * np.abs(thinning[name]).max()


def test_seepage_through_closed_contact_is_refused(tmp_path):
    (tmp_path / "case.yaml").write_text(THINNING + "contact: {film: {transmissivity: 1.0e-7}}\n")
    with pytest.raises(CaseError, match="seepage through closed contact needs a constant viscosity: remove 'shear'"):
        load_case(tmp_path / "case.yaml")
