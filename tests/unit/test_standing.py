"""Two processes that stand by for programs of tests: what one program does does not reach the next."""

from subprocess import TimeoutExpired

import pytest
from programs import STANDING

PROGRAM = """\
import os, sys, time
from mpi4py import MPI
comm, word = MPI.COMM_WORLD, sys.argv[1]
print(f"{word} on {comm.rank} of {comm.size} in {os.getcwd()}", flush=True)
if word == "codes":
    sys.exit(3 * comm.rank)
if word == "both fail":
    sys.exit(2 + comm.rank)
if word == "raises" and comm.rank == 1:
    raise RuntimeError("on purpose")
if word == "patches":
    import dolfinx.mesh
    dolfinx.mesh.create_mesh = print
if word == "asks":
    import dolfinx.mesh
    sys.exit(5 * (dolfinx.mesh.create_mesh is print))
if word == "sleeps" or (word == "one leaves" and comm.rank == 0):
    time.sleep(600)
if word == "one leaves":
    sys.exit(4)
"""


@pytest.fixture
def run(tmp_path, monkeypatch):
    (tmp_path / "program.py").write_text(PROGRAM)
    monkeypatch.chdir(tmp_path)

    def with_word(word, timeout=60.0):
        done = STANDING.run(str(tmp_path / "program.py"), [word], timeout)
        lines = [f"{word} on {rank} of 2 in {tmp_path}" for rank in range(2)]
        assert sorted(done.stdout.splitlines()) == lines
        return done

    return with_word


def test_codes_are_those_of_the_program_before_which_nothing_is_left(run):
    assert [run(word).returncode for word in ("works", "codes", "works")] == [0, 3, 0]
    assert run("both fail").returncode in (2, 3)
    assert run("works").returncode == 0


def test_an_exception_ends_both_and_the_next_program_has_new_ones(run):
    failed = run("raises")
    assert failed.returncode != 0
    assert "RuntimeError: on purpose" in failed.stderr
    assert run("works").returncode == 0


def test_who_waits_for_one_that_has_failed_is_ended(run, monkeypatch):
    monkeypatch.setattr("standing.SECONDS_TO_END", 0.2)
    assert run("one leaves").returncode == 4
    assert run("works").returncode == 0


@pytest.mark.slow
def test_the_end_of_the_time_of_both(run):
    """It says where both were."""
    with pytest.raises(TimeoutExpired, match=r"(?s)(program\.py\", line 18.*){2}"):
        run("sleeps", timeout=0.5)
    assert run("works").returncode == 0


def test_a_function_that_a_program_replaces_is_put_back(run):
    patched = run("patches")
    assert patched.returncode == 1
    assert patched.stderr.splitlines() == ["the program has left dolfinx.mesh.create_mesh changed"] * 2
    assert run("asks").returncode == 0
