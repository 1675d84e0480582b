"""One run, one folder: a second run or resume is refused as long as the first one writes."""

import os
import platform
import shutil
import signal
import subprocess
import time

import pytest
from programs import ENVIRONMENT, PARALLEL, command, fsci
from small_cases import PLATE

from fsci.case import CaseError
from fsci.cli import execute
from fsci.running.files import LOCK
from fsci.running.history import read_history
from fsci.running.lock import Lock

HERE = platform.node()


@pytest.fixture
def start():
    """Starts `fsci` without its output; what still runs in the end is killed."""
    started = []

    def function(*words, processes=1):
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        environment = PARALLEL if processes > 1 else ENVIRONMENT
        started.append(subprocess.Popen(command(*words, processes=processes), env=environment, **quiet))
        return started[-1]

    yield function
    for process in started:
        process.kill()
        process.wait()


def wait_for_steps(process, out):
    while not (out / "history.csv").exists() or len(read_history(out / "history.csv").get("step", ())) < 3:
        time.sleep(0.01)
        assert process.poll() is None


@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_second_run_is_refused(tmp_path, start, processes):
    """The first one goes on as if nothing had been, and after its end, or its death, another one may write."""
    (tmp_path / "case.yaml").write_text(PLATE)
    out, endless = tmp_path / "out", ("--set", "time.end=1e6")
    first = start("run", tmp_path, "-o", out, *endless)
    wait_for_steps(first, out)
    again = ("run", tmp_path, "-o", out, "--force"), ("resume", out)
    for words in again:
        second = fsci(*words, processes=processes, timeout=60)
        assert second.returncode == 2, second.stdout + second.stderr
        assert second.stderr.count(f"{out}: a run (process {first.pid} on {HERE}) writes here: wait until it ends") == 1
        assert "Traceback" not in second.stderr
    steps = len(read_history(out / "history.csv")["step"])
    (out / "STOP").touch()
    assert first.wait(60) == 3
    assert len(read_history(out / "history.csv")["step"]) >= steps
    assert (out / LOCK).read_text() == ""
    assert fsci("resume", out, "--set", "time.step=1e5", processes=processes).returncode == 0


@pytest.mark.slow
def test_on_two_processes_the_first_holds_it(tmp_path, start):
    (tmp_path / "case.yaml").write_text(PLATE)
    out = tmp_path / "out"
    mpirun = start("run", tmp_path, "-o", out, "--set", "time.end=1e6", processes=2)
    wait_for_steps(mpirun, out)
    assert (out / LOCK).read_text().split()[1] != str(mpirun.pid)
    assert fsci("resume", out).returncode == 2
    (out / "STOP").touch()
    assert mpirun.wait(60) == 3
    assert fsci("resume", out, "--set", "time.step=1e5").returncode == 0


def test_a_run_that_was_killed_holds_nothing(tmp_path, start):
    (tmp_path / "case.yaml").write_text(PLATE)
    out = tmp_path / "out"
    words = ("--set", "time.end=1e6", "--set", "output.checkpoint_every=1")
    first = start("run", tmp_path, "-o", out, *words)
    wait_for_steps(first, out)
    first.send_signal(signal.SIGKILL)
    first.wait()
    assert (out / LOCK).read_text() == f"process {first.pid} on {HERE}\n"
    done = fsci("resume", out, "--set", "time.step=1e5")
    assert done.returncode == 0, done.stderr


@pytest.fixture
def out(tmp_path):
    (tmp_path / "case.yaml").write_text(PLATE)
    assert execute(["run", str(tmp_path), "-o", str(tmp_path / "out")]) == 0
    return tmp_path / "out"


def test_a_run_on_another_computer_cannot_be_looked_at(out, capfd):
    (out / LOCK).write_text("process 12 on far.example\n")
    before = (out / "history.csv").read_bytes()
    for words in (["run", str(out.parent), "-o", str(out)], ["resume", str(out), "--set", "time.end=2"]):
        assert execute(words) == 2
        assert capfd.readouterr().err == (
            f"{out}: a run (process 12 on far.example) has not ended by itself, or still writes here: "
            "wait until it ends, stop it with a file STOP in this folder, or choose another folder with -o; "
            f"if that process is gone, remove {out / LOCK}\n"
        )
    assert (out / "history.csv").read_bytes() == before
    (out / LOCK).unlink()
    assert execute(["resume", str(out), "--set", "time.end=2"]) == 0


@pytest.mark.parametrize("text", ["", "x" * 5000, "process 1 on a b\n", "\xff\n"])
def test_other_texts_hold_nothing(out, text):
    (out / LOCK).write_text(text)
    assert execute(["resume", str(out), "--set", "time.end=2"]) == 0


def test_without_locks_the_process_is_looked_for(tmp_path, monkeypatch):
    """As on some network file systems."""

    def no_locks(*arguments):
        raise OSError(37, "No locks available")

    monkeypatch.setattr("fcntl.flock", no_locks)
    (tmp_path / LOCK).write_text(f"process 1 on {HERE}\n")
    with pytest.raises(CaseError, match=r"a run \(process 1 on .*\) writes here: .* if that process is gone, remove "):
        Lock(tmp_path)
    gone = os.spawnlp(os.P_NOWAIT, "true", "true")
    os.waitpid(gone, 0)
    (tmp_path / LOCK).write_text(f"process {gone} on {HERE}\n")
    Lock(tmp_path).close()


def test_a_refused_folder_gets_no_lock(tmp_path):
    (tmp_path / "case.yaml").write_text(PLATE)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").touch()
    assert execute(["run", str(tmp_path), "-o", str(tmp_path / "out")]) == 2
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["thesis.tex"]
    shutil.rmtree(tmp_path / "out")
    assert execute(["resume", str(tmp_path)]) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["case.yaml"]
