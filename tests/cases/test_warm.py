"""Runs as copies of one warm process: as those of new processes, and none of them ends the others."""

import os
import signal
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from petsc4py import PETSc
from programs import new_process

from fsci.running import warm
from fsci.running.files import LOCK
from fsci.running.history import read_history
from fsci.running.warm import PROCESS_HAS_ENDED, WarmProcess

BAR = """
time: {step: 0.1, end: 1}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    bar:
      mesh: {shape: rectangle, size: [1, 0.1], cells: [20, 1]}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [0, 0]}]
      gravity: [0, -1]
probes:
  end: {quantity: displacement, at: [1, 0.05]}
"""


LONG = ("--set", "time.step=1e-5", "--set", "output.fields_every=0")


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bar")
    (folder / "case.yaml").write_text(BAR)
    return str(folder)


@pytest.fixture(scope="module")
def one():
    with WarmProcess() as process:
        yield process


def wait_for_steps(folder):
    """The number of the process that writes into a folder, once it has done a step."""
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        history, lock = folder / "history.csv", folder / LOCK
        if history.exists() and history.read_text().count("\n") > 2 and lock.exists():
            return int(lock.read_text().split()[1])
        time.sleep(0.01)
    raise AssertionError("no step was done")


def test_the_same_as_a_new_process(case, one, tmp_path):
    """Numbers to the last bit, code and words; two at a time."""
    new = new_process("run", case, "-o", tmp_path / "new")
    with ThreadPoolExecutor(2) as pool:
        ended = list(pool.map(lambda name: one.run("run", case, "-o", str(tmp_path / name)), ("a", "b")))
    for name, done in zip(("a", "b"), ended, strict=True):
        assert (done.returncode, done.stderr) == (new.returncode, new.stderr) == (0, "")
        assert words(done.stdout)[:2] == words(new.stdout)[:2]
        found, expected = read_history(tmp_path / name / "history.csv"), read_history(tmp_path / "new" / "history.csv")
        for column in expected.keys() - {"wall"}:
            assert found[column].tolist() == expected[column].tolist()


def words(text):
    """Lines besides those of a first run, which compiles."""
    return [line for line in text.splitlines() if not line.startswith("compiling")]


def listening():
    """Numbers of the sockets that wait for connections from anywhere."""
    lines = [
        line.split() for path in ("/proc/net/tcp", "/proc/net/tcp6") for line in Path(path).read_text().splitlines()
    ]
    return {line[9] for line in lines if line[3] == "0A"}


def test_nobody_can_connect_to_a_copy(case, one, tmp_path):
    """Else a port of MPI is one of all copies; one that gets a stranger's message there waits for ever."""
    out = tmp_path / "long"
    with ThreadPoolExecutor(1) as pool:
        run = pool.submit(one.run, "run", case, "-o", str(out), *LONG)
        process = wait_for_steps(out)
        sockets = {os.readlink(path).strip("socket:[]") for path in Path(f"/proc/{process}/fd").iterdir()}
        waiting = sockets & listening()
        os.kill(process, signal.SIGKILL)
        run.result(60)
    assert not waiting


def test_a_run_keeps_its_core(case, one, tmp_path):
    """MUMPS polls MPI. With processes that yield each time, a busy machine gave a run of 1.2 s one in 58 s."""
    out = tmp_path / "long"
    with ThreadPoolExecutor(1) as pool:
        run = pool.submit(one.run, "run", case, "-o", str(out), *LONG)
        process = wait_for_steps(out)
        environment = Path(f"/proc/{process}/environ").read_bytes()
        os.kill(process, signal.SIGKILL)
        run.result(60)
    assert b"yield_when_idle" not in environment


def test_one_process_is_started(case, tmp_path, monkeypatch):
    started = []
    monkeypatch.setattr(warm.subprocess, "Popen", lambda *a, **b: started.append(a) or POPEN(*a, **b))
    with WarmProcess() as process:
        assert started == []
        for _ in range(3):
            assert process.run("check", case).returncode == 0
    assert len(started) == 1


POPEN = subprocess.Popen


def test_bad_commands(case, one):
    assert one.run("chek").returncode == 2
    bad = one.run("check", case, "--set", "time.step=-1")
    assert bad.returncode == 2
    assert "time.step" in bad.stderr
    assert one.run("check", case).returncode == 0


def test_a_run_that_is_killed(case, one, tmp_path):
    """Its code says the signal; the next run is as good as ever."""
    out = tmp_path / "long"
    with ThreadPoolExecutor(1) as pool:
        run = pool.submit(one.run, "run", case, "-o", str(out), *LONG)
        os.kill(wait_for_steps(out), signal.SIGKILL)
        assert run.result(60).returncode == -signal.SIGKILL
    assert one.run("run", case, "-o", str(tmp_path / "next")).returncode == 0


def test_an_interrupted_run(case, one, tmp_path):
    """SIGINT ends it as it ends any run: code 3, and a checkpoint to go on from."""
    out = tmp_path / "long"
    with ThreadPoolExecutor(1) as pool:
        run = pool.submit(one.run, "run", case, "-o", str(out), *LONG)
        os.kill(wait_for_steps(out), signal.SIGINT)
        assert run.result(60).returncode == 3
    assert list((out / "checkpoint").iterdir())


def test_the_process_is_lost(case):
    """What runs ends, and so does all that comes after it, with words instead of a wait.

    PETSc's handler of signals ends this process where it writes to one that is gone.
    """
    PETSc.Vec().createSeq(1)
    with WarmProcess() as process:
        assert process.run("check", case).returncode == 0
        process._process.kill()
        process._process.wait()
        lost = []
        thread = threading.Thread(target=lambda: lost.append(process.run("check", case)), daemon=True)
        thread.start()
        thread.join(20.0)
        assert lost[0].returncode == -signal.SIGKILL
        assert lost[0].stderr == PROCESS_HAS_ENDED
