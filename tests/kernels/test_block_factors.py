"""Incomplete factors of dense blocks in single precision: those of PETSc in double precision, but for rounding."""

import numpy as np
import pytest
from petsc4py import PETSc
from scipy import sparse

from solvers import kernels, linear
from solvers.incomplete import Incomplete

#: Relative rounding error of single precision, times a few hundred operations.
ROUNDING = 1e-4


def example(size, density, units=1.0):
    """(node pattern, its blocks) of a matrix with a dominant diagonal; rows have units of their own."""
    rng = np.random.default_rng(7)
    pattern = sparse.random(30, 30, density, format="csr", random_state=rng) + sparse.eye(30, format="csr")
    pattern.sort_indices()
    blocks = rng.standard_normal((pattern.nnz, size, size))
    rows = np.repeat(np.arange(30), np.diff(pattern.indptr))
    blocks[rows == pattern.indices] += 60.0 * density * np.eye(size) + 4.0 * np.eye(size)
    scale = units ** np.arange(size)
    return pattern, blocks * scale[:, None] * scale * units


def solve(pattern, blocks, b):
    factors = kernels.BlockFactors(pattern.indptr, pattern.indices, blocks.shape[1])
    x = np.empty(len(b))
    assert factors.update(blocks.transpose(0, 2, 1).copy())
    factors.solve(b, x)
    return x


@pytest.mark.parametrize("units", [1.0, 1e-8, 1e8])
@pytest.mark.parametrize("size", [3, 4])
def test_factors_of_a_full_pattern_are_exact(size, units):
    """Whatever the units: squares of such numbers are beyond those of single precision."""
    pattern, blocks = example(size, 1.0, units)
    A = sparse.bsr_matrix((blocks, pattern.indices, pattern.indptr)).toarray()
    b = A @ (expected := np.tile(units ** -np.arange(size, dtype=float), 30))
    assert np.abs(solve(pattern, blocks, b) / expected - 1.0).max() < ROUNDING


@pytest.mark.parametrize("size", [3, 4])
def test_factors_are_those_of_petsc(size):
    pattern, blocks = example(size, 0.2)
    matrix = PETSc.Mat().createBAIJ((30 * size,) * 2, size, csr=(pattern.indptr, pattern.indices, blocks))
    b, expected = matrix.createVecs()
    b.array[:] = np.random.default_rng(1).standard_normal(30 * size)
    other = PETSc.PC().create(matrix.comm)
    other.setType(PETSc.PC.Type.ILU)
    other.setOperators(matrix)
    other.apply(b, expected)
    found = solve(pattern, blocks, b.array)
    assert np.abs(found - expected.array).max() < ROUNDING * np.abs(expected.array).max()
    exact = sparse.linalg.spsolve(sparse.bsr_matrix((blocks, pattern.indices, pattern.indptr)).tocsc(), b.array)
    assert np.abs(found - exact).max() > 100.0 * ROUNDING * np.abs(exact).max()  # they are incomplete


@pytest.mark.parametrize("size", [1, 2, 3, 4])
def test_preconditioner_of_any_matrix(size):
    """PETSc's factors take over for other blocks; new values give new factors."""
    pattern, blocks = example(size, 0.2)
    matrix = PETSc.Mat().createBAIJ((30 * size,) * 2, size, csr=(pattern.indptr, pattern.indices, blocks))
    ksp = linear.flow_solver(PETSc.COMM_SELF, tolerance=1e-10)
    b, x = matrix.createVecs()
    b.set(1.0)
    for factor in (1.0, -3.0):
        matrix.scale(factor)
        linear.solve(ksp, matrix, b, x)
        assert (matrix * x - b).norm() < 1e-9 * b.norm()
    assert isinstance(ksp.getPC().getPythonContext(), Incomplete)


def test_factors_that_do_not_exist():
    """A block of zeros on the diagonal: no factors, and the solver fails, so that the next of a sequence takes over."""
    pattern, blocks = example(4, 0.2)
    rows = np.repeat(np.arange(30), np.diff(pattern.indptr))
    blocks[rows == 0] = 0.0
    assert not kernels.BlockFactors(pattern.indptr, pattern.indices, 4).update(blocks)
    matrix = PETSc.Mat().createBAIJ((120,) * 2, 4, csr=(pattern.indptr, pattern.indices, blocks))
    b, x = matrix.createVecs()
    b.set(1.0)
    with pytest.raises(linear.LinearSolveFailed, match="stalled"):
        linear.solve(linear.flow_solver(PETSc.COMM_SELF, tolerance=1e-10), matrix, b, x)


def numbers(*values):
    return np.array(values, dtype=np.int32)


@pytest.mark.parametrize(
    ("start", "columns", "size", "message"),
    [
        (numbers(0, 1, 2), numbers(0, 1), 5, "3 or 4 rows"),
        (numbers(0, 1, 2), numbers(0, 0), 4, "block on the diagonal"),
        (numbers(0, 2, 3), numbers(1, 0, 1), 4, "increasing columns"),
        (numbers(0, 1, 2), numbers(0, 2), 4, "no square matrix"),
        (numbers(0, 1, 3), numbers(0, 1), 4, "no compressed rows"),
        (numbers(0, 3, 2), numbers(0, 1), 4, "no compressed rows"),
    ],
)
def test_mistakes(start, columns, size, message):
    with pytest.raises(ValueError, match=message):
        kernels.BlockFactors(start, columns, size)


def test_arrays_of_other_sizes():
    factors = kernels.BlockFactors(numbers(0, 1, 2), numbers(0, 1), 4)
    with pytest.raises(ValueError, match="each column needs a square block"):
        factors.update(np.zeros((1, 4, 4)))
    with pytest.raises(ValueError, match="a number for each unknown"):
        factors.solve(np.zeros(4), np.zeros(8))
