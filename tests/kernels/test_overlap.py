"""Sums of small dense blocks against loops over them."""

import numpy as np
import pytest

from solvers.overlap import OverlappingBlocks


@pytest.mark.parametrize(("r", "c"), [(2, 3), (3, 1), (1, 1)])
def test_against_a_loop(r: int, c: int):
    rng = np.random.default_rng(0)
    n, rows, columns = 300, 20, 15
    at, beside = rng.integers(0, rows - 3, n), rng.integers(0, columns, n)  # the last row blocks are empty
    table = rng.permutation(c * columns + 5)[: c * columns].reshape(columns, c)
    blocks = OverlappingBlocks(at, beside, table[beside], (rows, columns), c * columns + 5)
    for _ in range(2):  # the places serve again
        values = rng.standard_normal((n, r, c))
        expected = np.zeros((rows * r, c * columns + 5))
        for i, j, block in zip(at, beside, values, strict=True):
            expected[r * i : r * i + r, table[j]] += block
        found = blocks.matrix(values)
        assert found.toarray() == pytest.approx(expected, abs=1e-13)
        assert len(found.data) == r * c * len(set(zip(at, beside, strict=True)))


def test_nothing():
    none = np.empty(0, dtype=np.int64)
    blocks = OverlappingBlocks(none, none, none.reshape(0, 2), (4, 3), 6)
    assert blocks.matrix(np.empty((0, 3, 2))).toarray() == pytest.approx(np.zeros((12, 6)))
