"""Sums of small dense blocks against loops over them."""

import numpy as np
import pytest

from solvers.algebra.overlap import OverlappingBlocks


@pytest.mark.parametrize(("r", "c"), [(2, 3), (3, 1), (1, 1)])
@pytest.mark.parametrize("factors", [1, 4])
def test_against_a_loop(r: int, c: int, factors: int):
    rng = np.random.default_rng(0)
    n, rows, columns, sources = 300, 20, 15, 40
    numbers = [rng.integers(0, below, n).astype(np.int32) for below in (rows - 3, columns, sources - 2)]
    at, beside, of = numbers  # the last row blocks are empty, the last given blocks unused
    table = rng.permutation(c * columns + 5)[: c * columns].reshape(columns, c).astype(np.int32)
    weights = rng.standard_normal((n, factors))
    blocks = OverlappingBlocks(at, beside, table[beside], weights, of, (rows, columns), c * columns + 5)
    for _ in range(2):  # the places serve again
        given = rng.standard_normal((sources, factors, r, c))
        expected = np.zeros((rows * r, c * columns + 5))
        for i, j, weight, source in zip(at, beside, weights, of, strict=True):
            expected[r * i : r * i + r, table[j]] += np.tensordot(weight, given[source], 1)
        found = blocks.matrix(given)
        assert found.toarray() == pytest.approx(expected, abs=1e-13)
        assert len(found.data) == r * c * len(set(zip(at, beside, strict=True)))


def test_nothing():
    none = np.empty(0, dtype=np.int32)
    blocks = OverlappingBlocks(none, none, none.reshape(0, 2), np.empty((0, 4)), none, (4, 3), 6)
    assert blocks.matrix(np.empty((0, 4, 3, 2))).toarray() == pytest.approx(np.zeros((12, 6)))
