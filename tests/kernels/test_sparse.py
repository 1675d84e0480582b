"""Sparse matrices of an interface against dense ones."""

import subprocess
import sys

import numpy as np
import pytest
import scipy.sparse as sp

from solvers.algebra import sparse as module
from solvers.algebra import sparse_public
from solvers.algebra.sparse import (
    counted_order,
    diagonal,
    nothing,
    sparse,
    sparse_from_array,
    sparse_from_entries,
    stack,
)

NUMBERS = np.random.default_rng(3)


def random(rows, columns):
    found = sp.random(rows, columns, 0.3, format="csr", random_state=int(NUMBERS.integers(1000)))
    return sparse(found, found.shape), found.toarray()


A, DENSE_A = random(7, 5)
B, DENSE_B = random(5, 6)
C, DENSE_C = random(7, 5)


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (A @ B, DENSE_A @ DENSE_B),
        (A + C, DENSE_A + DENSE_C),
        (A - C, DENSE_A - DENSE_C),
        ((A @ B) @ (A @ B).T + 2.0 * (A @ A.T), DENSE_A @ DENSE_B @ DENSE_B.T @ DENSE_A.T + 2 * DENSE_A @ DENSE_A.T),
        (-A, -DENSE_A),
        (A.T, DENSE_A.T),
        (A[np.array([4, 0, 0])], DENSE_A[[4, 0, 0]]),
        (A[np.arange(7) > 3], DENSE_A[4:]),
        (A[np.zeros(0, dtype=int)], DENSE_A[:0]),
        (A.columns(np.array([3, 1])), DENSE_A[:, [3, 1]]),
        (A.with_columns(np.array([2, -1, 0, -1, 8]), 9), DENSE_A[:, [0, 2, 4]] @ np.eye(9)[[2, 0, 8]]),
        (A.with_columns(np.arange(5)[::-1], 5), DENSE_A[:, ::-1]),
        (A.with_rows(np.array([8, 0, 1, 2, 3, 4, 5]), 10), np.eye(10)[:, [8, 0, 1, 2, 3, 4, 5]] @ DENSE_A),
        (A.scaled_rows(np.arange(7.0)), np.arange(7.0)[:, None] * DENSE_A),
        ((A @ B).ordered(), DENSE_A @ DENSE_B),
        (A.without_small(0.5), np.where(DENSE_A > 0.5, DENSE_A, 0.0)),
        (stack([A, C]), np.vstack([DENSE_A, DENSE_C])),
        (nothing((2, 3)) @ sparse_from_entries(np.zeros(0), np.zeros(0), np.zeros(0), (3, 4)), np.zeros((2, 4))),
        (sparse_from_array(DENSE_A), DENSE_A),
        (diagonal(np.arange(5.0)) @ B, np.arange(5.0)[:, None] * DENSE_B),
        (sparse_from_entries([1, 0, 1], [2, 1, 2], np.array([1.0, 2.0, 4.0]), (2, 3)), [[0, 2, 0], [0, 0, 5]]),
    ],
)  # fmt: skip
def test_operations(found, expected):
    assert found.shape == np.shape(expected)
    np.testing.assert_allclose(found.toarray(), expected, rtol=0, atol=1e-15)
    assert len(found.data) == len(found.indices) == found.indptr[-1]
    assert all(len(set(row)) == len(row) for row in np.split(found.indices, found.indptr[1:-1]))


@pytest.mark.parametrize("shape", [(5,), (5, 3)])
def test_times_vectors(shape):
    values = NUMBERS.random(shape)
    np.testing.assert_allclose(A @ values, DENSE_A @ values, rtol=1e-14)
    np.testing.assert_allclose(A @ np.asfortranarray(values), DENSE_A @ values, rtol=1e-14)


def test_entries_of_equal_indices_add_up():
    rows, columns, data = NUMBERS.integers(5, size=200), NUMBERS.integers(4, size=200), NUMBERS.random(200)
    found, expected = sparse_from_entries(rows, columns, data, (5, 4)), np.zeros((5, 4))
    np.add.at(expected, (rows, columns), data)
    np.testing.assert_allclose(found.toarray(), expected, rtol=1e-14)
    np.testing.assert_array_equal(found.indices, np.tile(np.arange(4), 5))


def test_in_order():
    found = (A @ B).ordered()
    assert all((np.diff(row) > 0).all() for row in np.split(found.indices, found.indptr[1:-1]))
    np.testing.assert_array_equal(A.row_numbers(), sp.csr_matrix(DENSE_A).nonzero()[0])


@pytest.mark.parametrize("wrong", [lambda: A @ C, lambda: A + B, lambda: A @ np.zeros(4)])
def test_shapes_that_do_not_fit(wrong):
    with pytest.raises(ValueError, match="shapes do not fit"):
        wrong()


# ------------------------------------------------------------------------------------------------------------------
# scipy's compiled routines are private: what happens when they change


def test_scipy_still_has_the_compiled_routines():
    """If not, results stay but small contacts take three times as long: `algebra/sparse.py` must learn new names."""
    assert module.compiled.__name__ == "scipy.sparse._sparsetools"
    used = {name for name in vars(sparse_public) if name.startswith(("csr_", "coo_"))}
    assert used <= set(dir(module.compiled))


def operations(seed):
    """What all operations give, one after the other."""
    chance = np.random.default_rng(seed)
    rows, columns = chance.integers(9, size=60), chance.integers(9, size=60)
    a, b = (sparse_from_entries(rows, columns, chance.normal(size=60), (9, 9)) for _ in range(2))
    found = [a, b.T @ a, a + b, a - b.T, (a @ b)[np.array([4, 0, 0])], ((a @ b) + b).ordered()]
    return [
        part
        for m in found
        for part in (m.data, m.indices, m.indptr, m.toarray(), m @ np.arange(9.0), m @ np.ones((9, 2)))
    ]


@pytest.mark.parametrize("seed", range(5))
def test_public_classes_give_the_same_bits(seed, monkeypatch):
    compiled = operations(seed)
    monkeypatch.setattr(module, "compiled", sparse_public)
    for found, expected in zip(operations(seed), compiled, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_without_the_compiled_routines_the_public_classes_serve():
    code = (
        "import scipy.sparse, sys; from solvers.api import Array; import numpy\n"
        "del scipy.sparse._sparsetools; sys.modules['scipy.sparse._sparsetools'] = None\n"
        "from solvers.algebra import sparse; print(sparse.compiled.__name__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "solvers.algebra.sparse_public", done.stderr


def test_counted_order():
    """Equal keys stay in their order."""
    keys = NUMBERS.integers(0, 6, 50).astype(np.int32)
    np.testing.assert_array_equal(counted_order(keys, 9), np.argsort(keys, kind="stable"))
    assert len(counted_order(np.empty(0, dtype=np.int32), 9)) == 0
