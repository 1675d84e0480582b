"""The work of contact among processes: what is counted, how even it is, and results that do not depend on it."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from programs import fsci
from test_automatic_pairs import STACK

from fsci.running.history import read_history
from solvers.contact.share import OVERLAP_COST, Shares


def test_work_is_counted_and_divided():
    """Eight slave facets with a pair each, of which only the first two overlap."""
    pairs = np.stack([np.arange(8), np.zeros(8, dtype=int)], axis=1).astype(np.int32)
    met, used = np.arange(8) < 2, pairs[:2]
    total = 2 * OVERLAP_COST + 6
    sides = []
    for rank in (0, 1):
        shares = Shares(SimpleNamespace(size=2, rank=rank, allgather=lambda part: [part, 0 * part]))
        shares.note(shares.measure(0, pairs, used, 8))
        assert shares.imbalance["before"] == pytest.approx((2 * OVERLAP_COST + 2) / (0.5 * total))
        assert shares.imbalance["after"] > 1.5  # nothing is known yet
        shares.combine(0, met.astype(float))
        work = shares.measure(0, pairs, used, 8)
        assert work[1].tolist() == [OVERLAP_COST, OVERLAP_COST + 6]
        sides.append(shares.mine(0, pairs, 8))
    assert [len(side) for side in sides] == [1, 7]
    assert np.array_equal(np.concatenate(sides), pairs)


@pytest.mark.slow
def test_two_tori_on_two_processes(tmp_path):
    """Near each other from the start: the busiest process has 20 % more than the mean at most, not 80 %."""
    near = ["--set", "structure.bodies.upper.mesh.translate=[148, 0, 45]", "--set", "time.end=0.6"]
    short = ["--set", "verify=[]", "--set", "output.fields_every=0"]
    done = fsci("run", "cases/two_tori", "-o", tmp_path, *near, *short, processes=2, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert read_history(tmp_path / "history.csv")["contact.active"][-1] > 0
    imbalance = json.loads((tmp_path / "summary.json").read_text())["contact"]["imbalance"]
    assert imbalance["after"] < 1.2 < 1.5 < imbalance["before"]


@pytest.mark.slow
def test_one_master_of_two_slaves_on_three_processes(tmp_path):
    """A block between two others, as the master of both: 1, 2 and 3 processes agree."""
    pairs = """pairs:
    low: {slave: {body: low, on: top}, master: {body: soft, on: bottom}}
    high: {slave: {body: high, on: bottom}, master: {body: soft, on: top}}
    floor: {slave: {body: low, on: bottom}, master: {obstacle: floor}}"""
    (tmp_path / "case.yaml").write_text(STACK.replace("CONTACT", pairs))
    histories = []
    for processes in (1, 2, 3):
        out = tmp_path / str(processes)
        done = fsci("run", tmp_path / "case.yaml", "-o", out, processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        histories.append(read_history(out / "history.csv"))
    for other in histories[1:]:
        for name in histories[0].keys() - {"wall", "residual"}:
            size = max(np.abs(histories[0][name]).max(), 1e-3)
            assert np.abs(histories[0][name] - other[name]).max() <= 1e-9 * size, name
