"""Products with matrices in single precision: those of the matrix but for the rounding of its entries."""

from pathlib import Path

import numpy as np
import pytest
from petsc4py import PETSc
from programs import on_processes
from scipy import sparse

from solvers import kernels
from solvers.algebra.rounded_product import RoundedProducts

PROGRAM = Path(__file__).parents[1] / "setups" / "rounded_product.py"
NODES = 30
#: Largest relative error of an entry in single precision.
ROUNDING = 2.0**-24


def blocked(size: int, blocks: np.ndarray) -> PETSc.Mat:
    return PETSc.Mat().createBAIJ((NODES * size,) * 2, size, csr=(PATTERN.indptr, PATTERN.indices, blocks))


PATTERN = (sparse.random(NODES, NODES, 0.2, format="csr", random_state=5) + sparse.eye(NODES)).tocsr()
PATTERN.sort_indices()


@pytest.mark.parametrize("units", [1.0, 1e-9, 1e9])
def test_entries_are_rounded_whatever_their_units(units):
    """Rows and columns of velocity and pressure; some entries would be beyond the numbers of single precision."""
    rng = np.random.default_rng(1)
    scale = np.array([1.0, 1.0, 1.0, units])
    blocks = rng.standard_normal((PATTERN.nnz, 4, 4)) * scale[:, None] * scale * units**4
    matrix = blocked(4, blocks)
    x = matrix.createVecRight()
    x.array[:] = np.tile(1.0 / scale, NODES) * rng.standard_normal(4 * NODES)
    dense = sparse.bsr_matrix((blocks, PATTERN.indices, PATTERN.indptr)).toarray()
    found = RoundedProducts().of(matrix, 1e-4) * x
    error, bound = np.abs(found.array - dense @ x.array), ROUNDING * (np.abs(dense) @ np.abs(x.array))
    assert (error <= 1.01 * bound).all()
    assert (error > 1e-3 * bound).any()


def test_numbers_of_single_precision_are_exact():
    blocks = np.random.default_rng(2).integers(-8, 8, (PATTERN.nnz, 4, 4)).astype(float)
    matrix = blocked(4, blocks)
    x = matrix.createVecRight()
    x.array[:] = np.arange(4 * NODES)
    assert ((RoundedProducts().of(matrix, 1e-4) * x).array == (matrix * x).array).all()


def test_the_product_follows_the_values():
    """Those of the matrix that it was asked for last; the object is the same while the pattern is."""
    matrix, products = blocked(4, np.ones((PATTERN.nnz, 4, 4))), RoundedProducts()
    x = matrix.createVecRight()
    x.set(1.0)
    before = products.of(matrix, 1e-4)
    first = (before * x).array.copy()
    matrix.scale(2.0)
    assert products.of(matrix, 1e-4).handle == before.handle
    assert ((before * x).array == 2.0 * first).all()


def test_tight_tolerances_and_other_blocks_have_the_matrix_itself():
    matrix, other = (blocked(size, np.ones((PATTERN.nnz, size, size))) for size in (4, 3))
    assert RoundedProducts().of(matrix, 1e-8) is matrix
    assert RoundedProducts().of(other, 1e-4) is other


def test_mistakes():
    start, columns = np.array([0, 1], dtype=np.int32), np.array([1], dtype=np.int32)
    with pytest.raises(ValueError, match="no such column"):
        kernels.BlockProduct(start, columns, 1)
    product, blocks = kernels.BlockProduct(start, columns, 2), np.ones((1, 4, 4))
    with pytest.raises(ValueError, match="each column needs a block"):
        product.update(np.ones((1, 3, 3)), np.ones(4), np.ones(8))
    with pytest.raises(ValueError, match="each row and column needs a scale"):
        product.update(blocks, np.ones(4), np.ones(4))
    product.update(blocks, np.ones(4), np.ones(8))
    with pytest.raises(ValueError, match="vectors need a number for each row and column"):
        product.add(np.ones(4), np.ones(4))


@pytest.mark.parametrize("processes", [1, 2])
def test_of_a_flow(processes):
    on_processes(processes, PROGRAM)
