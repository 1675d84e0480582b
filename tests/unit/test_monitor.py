"""What a run shows: aligned lines in a pipe, a bar below them on a terminal, nothing off rank 0."""

from __future__ import annotations

import io

import pytest

from fsci.running.monitor import Monitor, duration
from solvers.api import FailureKind, StepFailed, StepInfo


@pytest.fixture(autouse=True)
def able(monkeypatch):
    """The terminal moves its cursor, whatever the tests themselves run in."""
    monkeypatch.setenv("TERM", "xterm")


class Terminal(io.StringIO):
    """A stream that claims to be a terminal."""

    def isatty(self) -> bool:
        return True


def run(monitor: Monitor, steps: int = 3, numbers: dict[str, float] | None = None) -> None:
    """A small run with one retry."""
    with monitor:
        monitor.start("Flag", {"structure": 12345}, 2, begin=0.0, end=steps * 0.1, time=0.0)
        for step in range(1, steps + 1):
            monitor.step(step, 0.1 * step, 0.1, StepInfo(4, (2.5e3, 1.0, 3e-9), numbers or {}), 0.2)
        monitor.retry(StepFailed("structure", FailureKind.NEWTON, "Newton diverged", iteration=7), 0.05)
        monitor.finish("finished")


def test_plain_lines_are_aligned_under_their_titles():
    stream = io.StringIO()
    run(Monitor(stream=stream))
    lines = stream.getvalue().splitlines()
    assert lines[0] == "Flag"
    assert lines[1] == "structure 12,345 dofs; 2 processes; time 0 to 0.3"
    assert lines[2].split() == ["step", "time", "dt", "its", "residual", "last", "wall", "left"]
    assert lines[3].split() == ["1", "0.1", "0.1", "4", "2.50e+03", "3.00e-09", "200", "ms", "400", "ms"]
    assert len({len(line) for line in lines[2:6]}) == 1
    assert len(lines[2]) <= 80
    assert lines[6] == "warning: structure: Newton diverged at iteration 7; repeated with dt = 0.05"
    assert lines[7] == "finished"
    assert "\x1b" not in stream.getvalue()


def test_time_left_counts_simulated_time_not_steps():
    stream = io.StringIO()
    monitor = Monitor(stream=stream)
    monitor.start("Flag", {}, 1, begin=0.0, end=10.0, time=4.0)
    monitor.step(41, 4.5, 0.5, StepInfo(1, (1.0,)), 2.0)
    assert stream.getvalue().rstrip().endswith("22.0 s")


def test_active_contact_nodes_have_a_column_when_there_are_any():
    stream = io.StringIO()
    run(Monitor(stream=stream), numbers={"contact.active": 17.0})
    lines = stream.getvalue().splitlines()
    assert "active" in lines[2]
    assert lines[3].split()[6] == "17"
    assert len(lines[2]) <= 80


def test_the_header_is_repeated():
    stream = io.StringIO()
    run(Monitor(stream=stream), steps=100)
    assert stream.getvalue().count("residual") == 3


def test_a_terminal_gets_colours_and_a_bar_and_is_given_back():
    stream = Terminal()
    run(Monitor(stream=stream))
    shown = stream.getvalue()
    assert "\x1b[?25l" in shown, "the cursor is hidden while the bar lives"
    assert shown.rindex("\x1b[?25h") > shown.rindex("\x1b[?25l"), "and shown again"
    assert "100%" in shown
    assert "3.00e-09" in shown


def test_an_exception_gives_the_terminal_back():
    stream = Terminal()

    def broken_run() -> None:
        with Monitor(stream=stream) as monitor:
            monitor.start("Flag", {}, 1, begin=0.0, end=1.0, time=0.0)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        broken_run()
    assert stream.getvalue().rindex("\x1b[?25h") > stream.getvalue().rindex("\x1b[?25l")


def test_other_ranks_say_nothing(tmp_path):
    stream = Terminal()
    run(Monitor(enabled=False, log=tmp_path / "log.txt", stream=stream))
    assert stream.getvalue() == ""
    assert not (tmp_path / "log.txt").exists()


def test_the_log_has_the_plain_lines_and_grows_on_resume(tmp_path):
    stream = Terminal()
    run(Monitor(log=tmp_path / "log.txt", stream=stream))
    once = (tmp_path / "log.txt").read_text()
    assert "3.00e-09" in once
    assert "\x1b" not in once
    run(Monitor(log=tmp_path / "log.txt", stream=stream))
    assert (tmp_path / "log.txt").read_text() == 2 * once


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0, "0 ms"),
        (0.0846, "85 ms"),
        (0.9996, "1.0 s"),
        (59.96, "1:00 min"),
        (245, "4:05 min"),
        (7440, "2:04 h"),
    ],
)
def test_durations_are_short(seconds, text):
    assert duration(seconds) == text


def test_durations_fit_their_column():
    assert max(len(duration(1.07**power)) for power in range(-100, 250)) <= 9
