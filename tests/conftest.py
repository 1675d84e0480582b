import os
import subprocess
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Some containers set it; then each worker and each program that a test starts compiles all modules again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import pytest

from fsci.running.copied_process import start_mpi_alone

START = time.monotonic()
NO_TIME = "no time is left"


def pytest_addoption(parser):
    parser.addoption("--minutes", type=float, help="begin no test after so many")


def pytest_configure(config):
    """Start MPI before a test imports it; not where other processes run the tests: they would inherit its variables."""
    if hasattr(config, "workerinput") or not config.getoption("numprocesses", None):
        start_mpi_alone()


def pytest_collection_modifyitems(items):
    """What takes minutes comes last, the longest at the end: where time ends before the tests do, few are left out."""
    items.sort(key=lambda item: max((mark.kwargs.get("seconds", 0) for mark in item.iter_markers("slow")), default=0))


def pytest_runtest_setup(item):
    minutes = item.config.getoption("minutes")
    if minutes is not None and time.monotonic() - START > 60.0 * minutes:
        pytest.skip(NO_TIME)


def pytest_terminal_summary(terminalreporter):
    skipped = terminalreporter.stats.get("skipped", [])
    left_out = [report.nodeid for report in skipped if report.longrepr[2] == f"Skipped: {NO_TIME}"]
    if left_out:
        terminalreporter.section(f"left out, {NO_TIME}")
        for name in left_out:
            terminalreporter.line(name)


def pytest_unconfigure():
    """End the processes that stand by."""
    if "programs" in sys.modules:
        sys.modules["programs"].STANDING.close()


@pytest.fixture
def in_new_folder(tmp_path, monkeypatch):
    """The present folder is an empty one."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def runs_in_copies(monkeypatch):
    """Runs that `fsci twin`, `converge`, `sweep` and `stress` start on one process need no new process."""
    from types import SimpleNamespace

    from programs import WARM, run_command

    WARM.start()
    monkeypatch.setattr("fsci.stress.program.subprocess", SimpleNamespace(**{**vars(subprocess), "run": run_command}))
    for module in ("fsci.twin.twin", "fsci.converge.converge", "fsci.sweep.sweep"):
        monkeypatch.setattr(f"{module}.WarmProcess", lambda: WARM)
