"""Cases with mistakes: written to `case.yaml` in the present folder, loaded, and what is said about them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fsci.case import Case, CaseError, load_case


def load(text: str, overrides: tuple[Any, ...] = ()) -> Case:
    Path("case.yaml").write_text(text, encoding="utf-8")
    return load_case("case.yaml", overrides)


def refused(text: str, then: Callable[[Case], Any] = lambda case: None, overrides: tuple[Any, ...] = ()) -> CaseError:
    """The error of a case when it is loaded, or by what is done with it `then`."""
    with pytest.raises(CaseError) as caught:
        then(load(text, overrides))
    return caught.value


def first_lines(error: CaseError) -> list[str]:
    """What is said of each problem, without the line of the case."""
    return [str(problem).split("\n")[0] for problem in error.problems]


def assert_located(text: str, error: CaseError, message: str, at: str) -> None:
    """One of the messages begins so, and the place that it names in the case begins with `at`."""
    found = [problem for problem in error.problems if str(problem).startswith(f"case.yaml:{message}")]
    assert found, first_lines(error)
    place = found[0].place
    assert text.split("\n")[place.line - 1][place.column - 1 :].startswith(at)
