import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Some containers set it; then each worker and each program that a test starts compiles all modules again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import pytest

START = time.monotonic()
NO_TIME = "no time is left"


def pytest_addoption(parser):
    parser.addoption("--minutes", type=float, help="begin no test after so many")


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


@pytest.fixture
def in_new_folder(tmp_path, monkeypatch):
    """The present folder is an empty one."""
    monkeypatch.chdir(tmp_path)
