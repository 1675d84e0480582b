"""Programs of tests: an exception in one process ends all of them, and the next program runs after it."""

import subprocess

import pytest
from programs import fsci, on_processes

PROGRAM = """\
import sys, time
from mpi4py import MPI
comm = MPI.COMM_WORLD
print(f"rank {comm.rank}\\n", end="")  # in one piece: others write between two
if sys.argv[1] == "fails" and comm.rank == comm.size - 1:
    raise RuntimeError("on purpose")
if sys.argv[1] == "sleeps":
    time.sleep(600)
comm.Barrier()
"""


@pytest.fixture
def program(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    return tmp_path / "program.py"


@pytest.mark.parametrize("processes", [1, 2])
def test_an_exception_ends_all(program, processes):
    with pytest.raises(AssertionError, match="RuntimeError: on purpose"):
        on_processes(processes, program, "fails", timeout=100)
    done = on_processes(processes, program, "works", timeout=100)
    assert sorted(done.stdout.splitlines()) == [f"rank {rank}" for rank in range(processes)]


def test_the_end_of_the_time(program):
    with pytest.raises(subprocess.TimeoutExpired):
        on_processes(1, program, "sleeps", timeout=0.5)


def test_exit_codes_and_output():
    done = fsci("check", "--nonsense")
    assert done.returncode == 2
    assert done.stderr.startswith("usage: fsci")
    assert fsci("--version").stdout.startswith("fsci ")
