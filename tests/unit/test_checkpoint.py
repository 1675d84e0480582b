"""Checkpoints keep every bit, survive kills and never hand out a damaged state."""

from __future__ import annotations

import math
import random
import signal
import struct
import subprocess
import sys
import time

import numpy as np
import pytest

from fsci.running.checkpoint import read_checkpoint, write_checkpoint


def same(left, right) -> bool:
    """Equal in structure, types, order and bits."""
    if isinstance(left, dict):
        return (
            isinstance(right, dict)
            and list(left) == list(right)
            and all(same(left[name], right[name]) for name in left)
        )
    if isinstance(left, np.ndarray):
        return (
            isinstance(right, np.ndarray)
            and (left.dtype, left.shape) == (right.dtype, right.shape)
            and left.tobytes() == right.tobytes()
        )
    if isinstance(left, list):
        return isinstance(right, list) and len(left) == len(right) and all(map(same, left, right))
    if isinstance(left, float) and isinstance(right, float):
        return struct.pack("d", left) == struct.pack("d", right)
    return type(left) is type(right) and left == right


def test_round_trip_is_exact(tmp_path):
    rng = np.random.default_rng(0)
    state = {
        "zeta": {
            "u": rng.standard_normal((50, 3)),
            "fortran": np.asfortranarray(rng.random((4, 5))),
            "special": np.array([math.nan, math.inf, -0.0, 5e-324]),
            "index": np.arange(7, dtype=np.int32),
            "large": np.array([2**62 + 1]),
            "active": np.array([True, False]),
            "complex": np.array([1 + 2j]),
            "empty": np.empty((0, 3)),
            "scalar": np.array(0.1),
        },
        "alpha": {"count": 2**80, "third": 1 / 3, "minus_zero": -0.0, "infinite": -math.inf, "nan": math.nan},
        "flag": True,
        "nothing": None,
        "text": "Reynolds 100 \u00b5 / \u03c1\n",
        "a/b.c%": {"..": [1, 2.5, None, True, [1, 2]], "no items": {}, "no list": []},
        "numpy": [np.float64(0.1), np.int64(3), np.bool_(True)],
    }
    meta = {"step": 12, "time": 0.1 + 0.2, "case": "title: x\n" * 20_000}
    path = write_checkpoint(tmp_path, state, meta)
    assert path.name == "checkpoint_000012.h5"
    read_state, read_meta = read_checkpoint(tmp_path)
    state["numpy"] = [0.1, 3, True]
    state["zeta"]["fortran"] = np.ascontiguousarray(state["zeta"]["fortran"])
    assert same({"state": state}, {"state": read_state})
    assert same(meta, read_meta)


@pytest.mark.parametrize("value", [(1.0, 2.0), {1, 2}, np.array(["text"]), np.array([None]), [np.zeros(2)], object()])
def test_what_cannot_be_kept_exactly_is_refused_by_name(tmp_path, value):
    with pytest.raises(TypeError, match="state/flag/bad"):
        write_checkpoint(tmp_path, {"flag": {"bad": value}}, {"step": 1})


def test_the_last_two_are_kept(tmp_path):
    for step in (1, 2, 9, 10, 1_000_000):
        write_checkpoint(tmp_path, {}, {"step": step})
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "checkpoint_000010.h5",
        "checkpoint_1000000.h5",
    ]
    assert read_checkpoint(tmp_path)[1]["step"] == 1_000_000


def test_writing_after_a_restart_removes_what_came_later(tmp_path):
    for step in (10, 20):
        write_checkpoint(tmp_path, {"run": 1}, {"step": step})
    write_checkpoint(tmp_path, {"run": 2}, {"step": 15})
    assert read_checkpoint(tmp_path)[1]["step"] == 15
    assert [path.name for path in sorted(tmp_path.iterdir())] == [
        "checkpoint_000010.h5",
        "checkpoint_000015.h5",
    ]


@pytest.mark.parametrize("damage", ["truncated", "flipped", "empty", "header", "longer"])
def test_a_damaged_file_is_skipped_with_a_warning_that_names_it(tmp_path, damage):
    write_checkpoint(tmp_path, {"u": np.arange(1000.0)}, {"step": 1})
    path = write_checkpoint(tmp_path, {"u": np.arange(1000.0) + 1}, {"step": 2})
    data = bytearray(path.read_bytes())
    if damage == "truncated":
        data = data[: len(data) * 2 // 3]
    elif damage == "flipped":
        data[data.index(np.float64(500).tobytes())] ^= 1
    elif damage == "empty":
        data = bytearray()
    elif damage == "header":
        data[:512] = bytes(512)
    elif damage == "longer":
        data += b"x"
    path.write_bytes(data)
    with pytest.warns(UserWarning, match=r"checkpoint_000002\.h5"):
        state, meta = read_checkpoint(tmp_path)
    assert meta["step"] == 1
    assert np.array_equal(state["u"], np.arange(1000.0))


def test_no_checkpoint_is_an_error(tmp_path):
    with pytest.raises(FileNotFoundError, match="no usable checkpoint"):
        read_checkpoint(tmp_path)


def test_hdf5_tools_open_it(tmp_path):
    import h5py

    path = write_checkpoint(tmp_path, {"structure": {"u": np.arange(3.0)}}, {"step": 1})
    with h5py.File(path) as file:
        assert file["state/structure/u"][1] == 1.0


WRITER = """
import sys
from pathlib import Path
import numpy as np
from fsci.running.checkpoint import write_checkpoint
folder, step = Path(sys.argv[1]), int(sys.argv[2])
while True:
    step += 1
    state = {"u": np.full(1_500_000, float(step)), "v": {"w": np.full(500_000, -step)}}
    write_checkpoint(folder, state, {"step": step})
    print(step, flush=True)
"""


def test_kill_in_the_middle_of_a_write_loses_nothing(tmp_path):
    chance = random.Random(1)
    step, interrupted = 0, 0
    for trial in range(20):
        writer = subprocess.Popen(
            [sys.executable, "-c", WRITER, str(tmp_path), str(step)], stdout=subprocess.PIPE, text=True
        )
        assert writer.stdout is not None
        assert writer.stdout.readline() == f"{step + 1}\n"
        time.sleep(chance.uniform(0.0, 0.15))
        while trial % 3 and not list(tmp_path.glob("*.tmp")):  # at any time, or while a file is being written
            pass
        writer.send_signal(signal.SIGKILL)
        finished = [step + 1, *map(int, writer.stdout.read().split())][-1]
        writer.wait()
        interrupted += bool(list(tmp_path.glob("*.tmp")))

        state, meta = read_checkpoint(tmp_path)
        assert meta["step"] in (finished, finished + 1), "a checkpoint that was reported is lost"
        step = meta["step"]
        assert np.all(state["u"] == step)
        assert np.all(state["v"]["w"] == -step)
        if interrupted == 5:
            break
    assert interrupted >= 3, "no kill came while a file was being written: the test showed nothing"
