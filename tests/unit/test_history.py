"""history.csv keeps every bit, every line, and only the steps that count after a restart."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fsci.case import CaseError
from fsci.running.history import HistoryWriter, read_history


def test_numbers_come_back_bit_for_bit(tmp_path):
    path = tmp_path / "history.csv"
    values = [0.1 + 0.2, -1e-310, math.pi * 1e300, math.inf, -0.0]
    writer = HistoryWriter(path)
    for step, value in enumerate(values, start=1):
        writer.write(step, step / 3, 1 / 3, 4, 0.25, {"A.y": np.float64(value), "A.x": -value})
    history = read_history(path)
    assert list(history) == ["step", "time", "dt", "iterations", "wall", "A.y", "A.x"]
    assert history["A.y"].tobytes() == np.array(values).tobytes()
    assert history["time"].tobytes() == np.array([step / 3 for step in range(1, 6)]).tobytes()
    assert path.read_text().splitlines()[1].startswith("1,0.333")


def test_lines_are_there_before_the_file_is_closed(tmp_path):
    writer = HistoryWriter(tmp_path / "history.csv")
    writer.write(1, 0.1, 0.1, 3, 0.0, {"A": math.nan})
    assert len(read_history(tmp_path / "history.csv")["step"]) == 1
    assert math.isnan(read_history(tmp_path / "history.csv")["A"][0])


def test_other_columns_than_the_first_row_are_an_error_that_names_them(tmp_path):
    writer = HistoryWriter(tmp_path / "history.csv")
    writer.write(1, 0.1, 0.1, 3, 0.0, {"A": 1.0, "B": 2.0})
    with pytest.raises(ValueError, match=r"step 2.*B, C"):
        writer.write(2, 0.2, 0.1, 3, 0.0, {"A": 1.0, "C": 2.0})
    writer.write(2, 0.2, 0.1, 3, 0.0, {"B": 4.0, "A": 3.0})
    assert read_history(tmp_path / "history.csv")["B"].tolist() == [2.0, 4.0]


def test_resume_drops_later_steps_and_a_half_written_line(tmp_path):
    path = tmp_path / "history.csv"
    writer = HistoryWriter(path)
    for step in range(1, 6):
        writer.write(step, 0.1 * step, 0.1, 3, 0.0, {"A": float(step)})
    writer.close()
    with path.open("a") as file:
        file.write("6,0.6,0.1,3,0.0,6.")
    assert read_history(path)["A"].tolist() == [1, 2, 3, 4, 5]

    resumed = HistoryWriter(path, resume_after=3)
    assert read_history(path)["step"].tolist() == [1, 2, 3]
    resumed.write(4, 0.35, 0.05, 3, 0.0, {"A": 40.0})
    assert read_history(path)["A"].tolist() == [1, 2, 3, 40]
    with pytest.raises(ValueError, match="B"):
        resumed.write(5, 0.4, 0.05, 3, 0.0, {"B": 1.0})


@pytest.mark.parametrize("kept", [0, 2])
def test_a_resumed_run_may_have_other_columns(tmp_path, kept):
    """New ones are the last, and nan before; those that are gone are nan from then on, and may come back."""
    path = tmp_path / "history.csv"
    first = HistoryWriter(path)
    for step in (1, 2):
        first.write(step, 0.1 * step, 0.1, 3, 0.0, {"A": 1.0, "B": 2.0})
    second = HistoryWriter(path, resume_after=kept)
    for step in (kept + 1, kept + 2):
        second.write(step, 0.1 * step, 0.1, 3, 0.0, {"C": 3.0, "B": 2.0})
    with pytest.raises(ValueError, match="columns A"):
        second.write(kept + 3, 1.0, 0.1, 3, 0.0, {"A": 1.0, "C": 3.0, "B": 2.0})
    assert list(read_history(path))[5:] == ["A", "B", "C"]
    third = HistoryWriter(path, resume_after=kept + 2)
    third.write(kept + 3, 1.0, 0.1, 3, 0.0, {"A": 1.0, "C": 3.0})
    history, gone = read_history(path), [math.nan, math.nan]
    assert history["step"].tolist() == list(range(1, kept + 4))
    assert np.array_equal(history["A"], [1.0] * kept + gone + [1.0], equal_nan=True)
    assert np.array_equal(history["B"], [2.0] * (kept + 2) + [math.nan], equal_nan=True)
    assert np.array_equal(history["C"], [math.nan] * kept + [3.0] * 3, equal_nan=True)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("step,time\n", "line 1 is not that of a history: it begins with step, time, dt, iterations, wall"),
        ("step,time,dt,iterations,wall,../../x\n", "line 1 is not that of a history: '../../x' is not the name of a"),
        ("step,time,dt,iterations,wall,a\n1,1,1,1,1\n", "is not the history of a run: "),
        ("step,time,dt,iterations,wall\n1,1,1,1,x\n", "is not the history of a run: "),
    ],
)
def test_what_is_no_history_is_named(tmp_path, text, message):
    path = tmp_path / "history.csv"
    path.write_text(text)
    with pytest.raises(CaseError) as caught:
        read_history(path)
    assert str(caught.value).startswith(f"{path}: {message}")


def test_a_new_run_replaces_the_file_and_a_missing_one_may_be_resumed(tmp_path):
    path = tmp_path / "history.csv"
    HistoryWriter(path, resume_after=0).write(1, 1.0, 1.0, 1, 0.0, {"A": 1.0})
    HistoryWriter(path)
    assert read_history(path) == {}


def test_columns_that_begin_later_were_zero_before(tmp_path):
    """As those of contact with a wall. What is gone is an error still."""
    writer = HistoryWriter(tmp_path / "history.csv")
    writer.write(1, 0.1, 0.1, 3, 0.0, {"A": 1.0})
    writer.write(2, 0.2, 0.1, 3, 0.0, {"A": 2.0, "B": 5.0})
    with pytest.raises(ValueError, match="columns B"):
        writer.write(3, 0.3, 0.1, 3, 0.0, {"A": 1.0})
    writer.write(3, 0.3, 0.1, 3, 0.0, {"B": 6.0, "A": 3.0})
    history = read_history(tmp_path / "history.csv")
    assert history["A"].tolist() == [1.0, 2.0, 3.0]
    assert history["B"].tolist() == [0.0, 5.0, 6.0]
