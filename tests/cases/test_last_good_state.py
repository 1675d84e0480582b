"""Any error in the loop of a run: the state of the last good step is written first, and the message names it."""

from dataclasses import replace

import pytest
from small_cases import PLATE

import fsci.builder.build as build
from fsci.case import CaseError
from fsci.case.errors import Place, Problem
from fsci.cli import execute
from fsci.running.history import read_history
from fsci.running.run import Run

ERRORS = [
    ValueError("a probe went wrong"),
    MemoryError(),
    ZeroDivisionError("float division by zero"),
    CaseError([Problem(Place("case.yaml", 3, 5), "the motion is not a number")]),
    OSError(28, "No space left on device", "history.csv"),
]


@pytest.fixture
def breaks(monkeypatch):
    """The probes of the third step, or whatever method of a run is named, raise an error."""

    def function(error, part="probes"):
        original, calls = build.build, []

        def fails(*arguments):
            calls.append(1)
            if len(calls) == 3:
                raise error
            return {}

        if part == "probes":
            monkeypatch.setattr(build, "build", lambda *arguments: replace(original(*arguments), probes=fails))
        else:
            method = getattr(Run, part)
            monkeypatch.setattr(Run, part, lambda run, *a: fails() or method(run, *a))

    return function


def run(folder):
    (folder / "case.yaml").write_text(PLATE)
    try:
        return execute(["run", str(folder), "-o", str(folder / "out")]), ""
    except Exception as error:  # the interpreter prints it, with its notes
        return 1, "\n".join([str(error), *error.__notes__])


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_the_state_is_written_first(tmp_path, breaks, monkeypatch, capfd, error):
    breaks(error)
    code, words = run(tmp_path)
    kept = tmp_path / "out" / "checkpoint" / "checkpoint_000002.h5"
    assert kept.exists()
    assert code == (2 if isinstance(error, CaseError) else 1)
    said = words + capfd.readouterr().err
    assert f"The state after step 2 is in {kept}; continue with fsci resume." in said
    assert {"MemoryError": "there is not enough memory", "OSError": "No space left"}.get(
        type(error).__name__, str(error)
    ) in said
    monkeypatch.undo()
    assert execute(["resume", str(tmp_path / "out")]) == 0
    assert read_history(tmp_path / "out" / "history.csv")["step"].tolist() == [1, 2, 3, 4, 5]


@pytest.mark.parametrize("part", ["_write_fields", "_asked_to_stop"])
def test_so_it_is_between_steps(tmp_path, breaks, part):
    """The state before the third output is that after the first step, as the second one is not complete."""
    breaks(RuntimeError("broken"), part)
    code, words = run(tmp_path)
    step = 1 if part == "_write_fields" else 2
    assert code == 1
    assert f"The state after step {step} is in {tmp_path / 'out' / 'checkpoint'}" in words
