"""Whether the tangent of rigid bodies is positive definite, by its pivots."""

import numpy as np

from solvers.algebra.sparse import sparse_from_entries
from solvers.rigid.coulomb import positive_definite


def test_pivots_tell_as_eigenvalues_do():
    """Random sparse matrices with a small skew part, of which about half are definite."""
    rng = np.random.default_rng(0)
    found = []
    for _ in range(100):
        A = rng.standard_normal((30, 30)) * (rng.random((30, 30)) < 0.1)
        A = A + A.T + rng.uniform(0.0, 8.0) * np.eye(30)
        B = A + 0.1 * (np.triu(A, 1) - np.tril(A, -1))
        rows, columns = np.nonzero(B)
        found.append(positive_definite(sparse_from_entries(rows, columns, B[rows, columns], B.shape)))
        assert found[-1] == (np.linalg.eigvalsh(A).min() > 0.0)
    assert 20 < sum(found) < 80
