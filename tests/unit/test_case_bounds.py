"""Case files that would take all memory or never end are refused at once, with a message."""

import os
import threading
from pathlib import Path

import pytest
from ruamel.yaml import YAML
from small_cases import BLOCK

from fsci.case import CaseError, load_case
from fsci.case.yaml_text import MOST_VALUES
from fsci.running.memory import require_memory


def message(tmp_path, text):
    (tmp_path / "case.yaml").write_text(text)
    with pytest.raises(CaseError) as error:
        load_case(tmp_path)
    return str(error.value)


def test_aliases_that_multiply(tmp_path):
    """Six lines stand for 10^6 values."""
    lines = [f"a{i}: &a{i} [" + ",".join(["1" if i == 0 else f"*a{i - 1}"] * 10) + "]" for i in range(6)]
    assert "the case has more than 20000 values up to here" in message(tmp_path, "\n".join(lines))


def test_the_bound_is_far_from_cases_that_are_meant():
    counts = {}
    for path in Path("cases").glob("*/case.yaml"):
        counts[path.parent.name] = count(YAML(typ="safe", pure=True).load(path))
    assert max(counts.values()) < MOST_VALUES / 50, counts


def count(data) -> int:
    """Settings and entries of lists."""
    parts = data.values() if isinstance(data, dict) else data if isinstance(data, list) else ()
    return 1 + sum((1 if isinstance(data, dict) else 0) + count(part) for part in parts)


def test_a_number_whose_square_overflows(tmp_path):
    text = BLOCK.replace("step: 1, end: 1", "step: 1e+300, end: 1")
    assert text != BLOCK
    assert "'step' must be at most 1e+100 in size, not 1e+300" in message(tmp_path, text)
    text = BLOCK.replace("end: 1", "start: -2e100, end: 1")
    assert "'start' must be at most 1e+100 in size, not -2e+100" in message(tmp_path, text)


def test_a_long_file(tmp_path):
    assert "case.yaml: is larger than 1 MB" in message(tmp_path, "# " + "x" * 1_100_000)


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "case.yaml")
    found = []

    def load():
        try:
            load_case(tmp_path / "case.yaml")
        except CaseError as error:
            found.append(str(error))

    waiting = threading.Thread(target=load, daemon=True)
    waiting.start()
    waiting.join(10)
    assert found == [f"{tmp_path}/case.yaml: is not a file"]


@pytest.mark.parametrize("time", ["step: 1, end: 1e90", "step: 1e-300, end: 1", "start: -1e20, step: 1, end: 0"])
def test_a_step_below_the_rounding_of_time(tmp_path, time):
    assert "is lost in rounding" in message(tmp_path, BLOCK.replace("step: 1, end: 1", time))


def test_a_long_line_is_cut_around_the_mistake(tmp_path):
    text = message(tmp_path, BLOCK.replace("E: 1,", f"{'rho: 1, ' * 1} E: '{' ' * 1000}1 + x + w',"))
    shown = max(text.split("\n"), key=len)
    assert "unknown" in text
    assert len(shown) < 400


class TwoMachines:
    def allgather(self, value):
        return [value, value]


@pytest.mark.parametrize(
    ("cells", "words"), [(30_000, "GB, and there are"), (100_000, "more than the 2,147,483,647 that can be numbered")]
)
def test_more_than_the_machine_holds(tmp_path, cells, words):
    (tmp_path / "case.yaml").write_text(BLOCK.replace("cells: [1, 1]", f"cells: [{cells}, {cells}]"))
    with pytest.raises(CaseError, match=words) as error:
        require_memory(load_case(tmp_path), TwoMachines())
    assert "case.yaml:5:13: the case has" in str(error.value)
