"""A disk that is full, or a folder that cannot be written, ends a run with a message and the last good state."""

import resource
import tempfile

import numpy as np
import pytest
from small_cases import PLATE

from fsci.cli import execute
from fsci.running.checkpoint import list_checkpoints, write_checkpoint
from fsci.running.history import HistoryWriter, read_history

CASE = PLATE + "output: {fields_every: 0}\n"
FULL = (28, "No space left on device", "history.csv")


@pytest.fixture
def full_disk(monkeypatch):
    """The line of the third step does not fit."""
    write = HistoryWriter.write

    def fails(history, step, *numbers):
        if step == 3:
            raise OSError(*FULL)
        write(history, step, *numbers)

    monkeypatch.setattr(HistoryWriter, "write", fails)


def run(folder):
    (folder / "case.yaml").write_text(CASE)
    return execute(["run", str(folder), "-o", str(folder / "out")])


def test_full_disk(tmp_path, full_disk, monkeypatch, capfd):
    assert run(tmp_path) == 1
    errors = capfd.readouterr().err
    kept = tmp_path / "out" / "checkpoint" / "checkpoint_000002.h5"
    assert errors == (
        "fsci run: No space left on device: 'history.csv'. "
        f"The state after step 2 is in {kept}; continue with fsci resume.\n"
    )
    monkeypatch.undo()
    assert execute(["resume", str(tmp_path / "out")]) == 0
    assert read_history(tmp_path / "out" / "history.csv")["step"].tolist() == [1, 2, 3, 4, 5]


def test_full_disk_without_space_for_a_checkpoint(tmp_path, full_disk, monkeypatch, capfd):
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "elsewhere"))
    original = write_checkpoint

    def fails(folder, *what):
        if folder == tmp_path / "out" / "checkpoint":
            raise OSError(*FULL)
        return original(folder, *what)

    monkeypatch.setattr("fsci.running.run.write_checkpoint", fails)
    assert run(tmp_path) == 1
    errors = capfd.readouterr().err
    (folder,) = (tmp_path / "elsewhere").iterdir()
    (kept,) = list_checkpoints(folder)
    assert kept.name == "checkpoint_000002.h5"
    assert f"is in {kept}; move it into {tmp_path / 'out' / 'checkpoint'}; continue with fsci resume." in errors
    assert "Traceback" not in errors


def test_checkpoint_that_does_not_fit_leaves_nothing(tmp_path):
    """Neither a part of the new one, nor less of the old ones."""
    write_checkpoint(tmp_path, {}, {"step": 1})
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        with pytest.raises(OSError, match="cannot write a checkpoint"):
            write_checkpoint(tmp_path, {"u": np.zeros(100_000)}, {"step": 2})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [path.name for path in tmp_path.iterdir()] == ["checkpoint_000001.h5"]


def test_not_enough_memory(tmp_path, monkeypatch, capfd):
    def fails(*arguments):
        raise MemoryError

    monkeypatch.setattr("fsci.builder.build.build", fails)
    assert run(tmp_path) == 1
    assert capfd.readouterr().err == "fsci run: there is not enough memory\n"


def test_interrupted_before_the_first_step(tmp_path, monkeypatch, capfd):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("fsci.builder.build.build", interrupted)
    assert run(tmp_path) == 3
    assert capfd.readouterr().err == "fsci run: stopped before the first step\n"
