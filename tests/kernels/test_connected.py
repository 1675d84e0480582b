"""Connected parts of a graph against those of scipy."""

import numpy as np
import pytest
import scipy.sparse as sp

from solvers.algebra.connected import connected_parts


@pytest.mark.parametrize("edges", [0, 10, 40, 70, 200])
def test_parts(edges):
    chance = np.random.default_rng(edges)
    first, second = chance.integers(80, size=(2, edges))
    part = connected_parts(first, second, 80)
    graph = sp.coo_matrix((np.ones(edges), (first, second)), shape=(80, 80))
    count, expected = sp.csgraph.connected_components(graph, directed=False)
    smallest = [np.flatnonzero(expected == k)[0] for k in range(count)]
    np.testing.assert_array_equal(part, np.array(smallest)[expected])


def test_a_long_chain():
    order = np.random.default_rng(1).permutation(1000)
    np.testing.assert_array_equal(connected_parts(order[:-1], order[1:], 1000), 0)
