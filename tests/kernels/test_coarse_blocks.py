"""Coarse matrices of dense blocks: the products that scipy and PETSc find."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from petsc4py import PETSc
from programs import on_processes
from scipy import sparse

from solvers import kernels
from solvers.fluid.solve.linear_systems import coarse_matrix
from solvers.fluid.solve.linear_systems.coarse_matrix import CoarseMatrix

PROGRAM = Path(__file__).parents[1] / "setups" / "coarse_parallel.py"


def example(size, seed=3):
    """(node pattern of A, its blocks, node table of P, marks of unknowns), 40 nodes and 11 coarse ones."""
    rng = np.random.default_rng(seed)
    pattern = sparse.random(40, 40, 0.2, format="csr", random_state=rng) + sparse.eye(40)
    table = sparse.random(40, 11, 0.25, format="csr", random_state=rng)
    pattern.sort_indices()
    return pattern, rng.standard_normal((pattern.nnz, size, size)), table, (rng.random(40 * size) < 0.8).astype(float)


@pytest.mark.parametrize("size", [3, 4])
def test_product_is_that_of_scipy(size):
    pattern, blocks, table, marks = example(size)
    A = sparse.bsr_matrix((blocks, pattern.indices, pattern.indptr)).tocsr()
    P = sparse.diags(marks) @ sparse.kron(table, sparse.eye(size))
    expected = (P.T @ A @ P).toarray()
    rows = table.indptr, table.indices
    start, columns = kernels.coarse_pattern(pattern.indptr, pattern.indices, *rows, 11)
    found = np.zeros((len(columns), size, size))
    values = blocks.transpose(0, 2, 1).copy()
    kernels.coarse_product(pattern.indptr, pattern.indices, values, *rows, table.data, marks, start, columns, found)
    C = sparse.bsr_matrix((found.transpose(0, 2, 1), columns, start), shape=expected.shape).toarray()
    assert np.abs(C - expected).max() < 1e-13 * np.abs(expected).max()
    assert all((np.diff(columns[a:b]) > 0).all() for a, b in itertools.pairwise(start))


@pytest.mark.parametrize("size", [3, 4])
def test_both_ways_give_the_same_matrix(size, monkeypatch):
    """By blocks and by PETSc; twice, because the second one is written over the first."""
    pattern, blocks, table, marks = example(size)
    fine = PETSc.Mat().createBAIJ((40 * size,) * 2, size, csr=(pattern.indptr, pattern.indices, blocks))
    P = sparse.kron(table, sparse.eye(size), format="csr")
    interpolation = PETSc.Mat().createAIJ(P.shape, csr=(P.indptr, P.indices, P.data))
    found = []
    for by_rows in (False, True):
        if by_rows:
            monkeypatch.setattr(coarse_matrix, "shared_block_rows", lambda matrix: None)
        coarse = CoarseMatrix(interpolation)
        for factor in (1.0, 3.0):
            fine.scale(factor)
            coarse.mark(marks)
            found.append(dense(coarse.update(fine, marks)))
            fine.scale(1.0 / factor)
    for one, other in zip(found[:2], found[2:], strict=True):
        assert np.abs(one - other).max() < 1e-13 * np.abs(other).max()
    assert np.abs(found[0]).max() > 0.0


@pytest.mark.parametrize("processes", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_both_ways_give_the_same_matrix_on_several_processes(processes):
    on_processes(processes, PROGRAM)


def dense(matrix):
    start, columns, values = matrix.convert(PETSc.Mat.Type.AIJ, PETSc.Mat()).getValuesCSR()
    return sparse.csr_matrix((values, columns, start), shape=matrix.size).toarray()


def test_arrays_that_do_not_fit():
    pattern, blocks, table, marks = example(4)
    rows = table.indptr, table.indices
    with pytest.raises(ValueError, match="A: no compressed rows"):
        kernels.coarse_pattern(pattern.indptr[1:], pattern.indices, *rows, 11)
    with pytest.raises(ValueError, match="P: a column is not below 5"):
        kernels.coarse_pattern(pattern.indptr, pattern.indices, *rows, 5)
    C = kernels.coarse_pattern(pattern.indptr, pattern.indices, *rows, 11)
    result = np.zeros((len(C[1]), 4, 4))
    with pytest.raises(ValueError, match="each unknown needs a mark"):
        kernels.coarse_product(pattern.indptr, pattern.indices, blocks, *rows, table.data, marks[1:], *C, result)
    with pytest.raises(ValueError, match="blocks must have 3 or 4 rows"):
        kernels.coarse_product(
            pattern.indptr, pattern.indices, np.zeros((pattern.nnz, 2, 2)), *rows, table.data, np.ones(80), *C,
            np.zeros((len(C[1]), 2, 2)),
        )  # fmt: skip
