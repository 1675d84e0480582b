"""Incomplete factors of dense blocks in single precision: those of PETSc in double precision, but for rounding."""

import numpy as np
import pytest
from petsc4py import PETSc
from scipy import sparse

from solvers import kernels
from solvers.algebra import linear
from solvers.algebra.incomplete import Incomplete
from solvers.algebra.petsc_blocks import entry_rows

PETSC_SELF = PETSc.COMM_SELF

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


def permuted(pattern, blocks, order):
    """The matrix whose rows and columns are those of another one in this order."""
    A = sparse.bsr_matrix((blocks, pattern.indices, pattern.indptr)).tocsr()
    unknowns = (blocks.shape[1] * order[:, None] + np.arange(blocks.shape[1])).ravel()
    P = A[unknowns][:, unknowns].tobsr((blocks.shape[1],) * 2)
    P.sort_indices()
    return P, unknowns


@pytest.mark.parametrize("size", [3, 4])
def test_factors_in_another_order(size):
    """They are those of the matrix with rows and columns in this order, which differ from those in the first one."""
    pattern, blocks = example(size, 0.2)
    order = np.random.default_rng(3).permutation(30).astype(np.int32)
    b = np.random.default_rng(1).standard_normal(30 * size)
    factors = kernels.BlockFactors(pattern.indptr, pattern.indices, size, order)
    found = np.empty(len(b))
    assert factors.update(blocks.transpose(0, 2, 1).copy())
    factors.solve(b, found)
    P, unknowns = permuted(pattern, blocks, order)
    expected = np.empty(len(b))
    expected[unknowns] = solve(P, P.data, b[unknowns])
    assert found == pytest.approx(expected, abs=ROUNDING * np.abs(expected).max())
    first = solve(pattern, blocks, b)
    assert np.abs(found - first).max() > 100.0 * ROUNDING * np.abs(first).max()


def test_blocks_of_nodes():
    """Of rows with different patterns, and of a node without entries: the matrix is the same; and back."""
    A = sparse.random(30, 30, 0.1, format="csr", random_state=np.random.default_rng(2))
    A = sparse.diags((np.arange(30) // 3 != 2).astype(float)) @ A
    A.eliminate_zeros()
    A.sort_indices()
    start, columns, blocks = kernels.node_blocks(A.indptr, A.indices, A.data, 3)
    B = sparse.bsr_matrix((blocks.transpose(0, 2, 1), columns, start), shape=(30, 30))
    assert np.array_equal(B.toarray(), A.toarray())
    assert all((np.diff(row) > 0).all() for row in np.split(columns, start[1:-1]))
    assert all(i in columns[start[i] : start[i + 1]] for i in range(10))
    full = B.copy()
    full.data[:] = np.random.default_rng(4).standard_normal(full.data.shape)
    entries = np.empty(full.data.size)
    kernels.spread_blocks(start, full.data.transpose(0, 2, 1).copy(), entries)
    C = full.tocsr()
    C.sort_indices()
    assert np.array_equal(entries, C.data)


def stretched_cube():
    """A matrix of elasticity whose rows at one node differ in their patterns, as those of contact do."""
    rng = np.random.default_rng(5)
    A = sparse.random(90, 90, 0.05, format="csr", random_state=rng)
    return (A + A.T + 20.0 * sparse.eye(90)).tocsr()


@pytest.mark.parametrize(("dim", "kind"), [(3, "python"), (2, "ilu")])
def test_solver_of_solids(dim, kind):
    A = stretched_cube()
    matrix = PETSc.Mat().createAIJ((90, 90), csr=(A.indptr, A.indices, A.data), comm=PETSC_SELF)
    ksp = linear.incomplete_solver(PETSC_SELF, linear.Task(dim, 90, symmetric=False, tolerance=1e-12))
    assert ksp.getPC().getType() == kind
    b, x = matrix.createVecs()
    b.set(1.0)
    for factor in (1.0, -3.0):
        matrix.scale(factor)
        linear.solve(ksp, matrix, b, x)
        assert (matrix * x - b).norm() < 1e-11 * b.norm()
    assert ksp.getIterationNumber() < 15


def test_solution_that_is_good_enough():
    """A Krylov method stops at the reduction that is asked for, or at its square if it takes few iterations."""
    A = sparse.diags([np.full(299, -1.0), np.full(300, 2.02), np.full(299, -1.0)], [-1, 0, 1], format="csr")
    matrix = PETSc.Mat().createAIJ((300, 300), csr=(A.indptr, A.indices, A.data), comm=PETSC_SELF)
    ksp = PETSc.KSP().create(PETSC_SELF)
    ksp.setType(PETSc.KSP.Type.GMRES)
    ksp.getPC().setType(PETSc.PC.Type.NONE)
    ksp.setTolerances(rtol=1e-9, max_it=1000)
    b, x = matrix.createVecs()
    b.set(1.0)

    def missed(reduction, few=linear.FEW):
        x.set(7.0)  # solvers start from zero
        linear.solve(ksp, matrix, b, x, reduction=reduction, few=few)
        return (matrix * x - b).norm() / b.norm()

    assert missed(0.0) <= 1e-9
    assert 1e-9 < missed(1e-3) <= 1e-3
    assert missed(1e-10) <= 1e-9
    assert 1e-9 < missed(1e-3, 1000) <= 1e-6
    assert missed(1e-5, 1000) <= 1e-9
    assert ksp.getTolerances()[0] == 1e-9


def test_solver_of_solids_without_factors_of_blocks():
    """A singular block on the diagonal: factors of entries take over, which exist by fill outside of it."""
    A = sparse.lil_matrix(stretched_cube())
    A[0, :3], A[1, :3], A[2, :3] = [1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]
    A[0, 5] = A[5, 0] = A[1, 7] = A[7, 1] = 9.0
    A = A.tocsr()
    found = kernels.node_blocks(A.indptr, A.indices, A.data, 3)
    assert not kernels.BlockFactors(*found[:2], 3).update(found[2])
    matrix = PETSc.Mat().createAIJ((90, 90), csr=(A.indptr, A.indices, A.data), comm=PETSC_SELF)
    ksp = linear.incomplete_solver(PETSC_SELF, linear.Task(3, 90, symmetric=False, tolerance=1e-10))
    b, x = matrix.createVecs()
    b.set(1.0)
    linear.solve(ksp, matrix, b, x)
    assert (matrix * x - b).norm() < 1e-9 * b.norm()


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


@pytest.mark.parametrize("order", [numbers(0, 0), numbers(0), numbers(1, 2)])
def test_an_order_that_is_none(order):
    with pytest.raises(ValueError, match="each row once"):
        kernels.BlockFactors(numbers(0, 1, 2), numbers(0, 1), 3, order)


def test_rows_that_are_no_nodes():
    start, columns = numbers(0, 1, 2), numbers(0, 1)
    with pytest.raises(ValueError, match="whole nodes"):
        kernels.node_blocks(start, columns, np.ones(2), 3)
    with pytest.raises(ValueError, match="needs a value"):
        kernels.node_blocks(start, columns, np.ones(3), 3)
    with pytest.raises(ValueError, match="3 or 4 rows"):
        kernels.node_blocks(start, columns, np.ones(2), 2)
    with pytest.raises(ValueError, match="needs an entry"):
        kernels.spread_blocks(start, np.ones((2, 3, 3)), np.ones(17))
    with pytest.raises(ValueError, match="needs a block"):
        kernels.spread_blocks(start, np.ones((3, 3, 3)), np.ones(27))
    with pytest.raises(ValueError, match="2 or 3 rows"):
        kernels.spread_blocks(start, np.ones((2, 4, 4)), np.ones(32))


def test_arrays_of_other_sizes():
    factors = kernels.BlockFactors(numbers(0, 1, 2), numbers(0, 1), 4)
    with pytest.raises(ValueError, match="each column needs a square block"):
        factors.update(np.zeros((1, 4, 4)))
    with pytest.raises(ValueError, match="a number for each unknown"):
        factors.solve(np.zeros(4), np.zeros(8))


def test_blocks_of_full_and_other_rows():
    """Most rows of contact consist of full blocks, those of nodes in contact do not."""
    rng = np.random.default_rng(7)
    pattern = sparse.kron(sparse.random(8, 8, 0.3, random_state=rng) + sparse.eye(8), np.ones((3, 3)))
    A = sparse.lil_matrix(pattern.multiply(rng.uniform(1.0, 2.0, (24, 24))))
    A[4, 20], A[9:12, 9:12] = 3.0, 0.0  # an entry alone; a node without a block on the diagonal
    A = A.tocsr()
    A.eliminate_zeros()
    A.sort_indices()
    start, columns, blocks = kernels.node_blocks(A.indptr, A.indices, A.data, 3)
    assert np.array_equal(
        sparse.bsr_matrix((blocks.transpose(0, 2, 1), columns, start), shape=(24, 24)).toarray(), A.toarray()
    )
    assert all((np.diff(row) > 0).all() for row in np.split(columns, start[1:-1]))
    assert all(i in columns[start[i] : start[i + 1]] for i in range(8))


def test_changed_rows():
    """Rows are replaced, and added to, by rows whose columns have any order; the sum is that of arrays."""
    rng = np.random.default_rng(3)
    A = sparse.random(40, 40, 0.2, format="csr", random_state=rng)
    new = sparse.random(6, 40, 0.3, format="csr", random_state=rng)
    A.sort_indices()
    for i in range(6):
        own = slice(new.indptr[i], new.indptr[i + 1])
        order = rng.permutation(own.stop - own.start)
        new.indices[own], new.data[own] = new.indices[own][order], new.data[own][order]
    rows = np.array([31, 0, 7, 39, 12, 8], dtype=np.int32)
    before = A.copy()
    values, columns, start = kernels.changed_rows(
        A.indptr, A.indices, A.data, rows, 2, new.indptr, new.indices, new.data
    )
    expected = A.toarray()
    expected[rows[:2]] = 0.0
    expected[rows] += new.toarray()
    assert np.array_equal(sparse.csr_matrix((values, columns, start), shape=A.shape).toarray(), expected)
    assert all((np.diff(row) > 0).all() for row in np.split(columns, start[1:-1]))
    assert (A != before).nnz == 0


@pytest.mark.parametrize(
    ("rows", "replaced", "message"),
    [([1, 40], 1, "no such row"), ([1, -1], 1, "no such row"), ([1, 2], 3, "more rows"), ([1], 1, "needs its entries")],
)
def test_changed_rows_that_do_not_fit(rows, replaced, message):
    A = sparse.random(40, 40, 0.2, format="csr", random_state=np.random.default_rng(3))
    new = A[:2]
    with pytest.raises(ValueError, match=message):
        kernels.changed_rows(
            A.indptr, A.indices, A.data, np.array(rows, dtype=np.int32), replaced, new.indptr, new.indices, new.data
        )


def test_entries_of_a_matrix_are_seen_not_copied():
    A = sparse.random(30, 30, 0.2, format="csr", random_state=np.random.default_rng(3))
    A.sort_indices()
    matrix = PETSc.Mat().createAIJ((30, 30), csr=(A.indptr, A.indices, A.data), comm=PETSC_SELF)
    start, columns, values = entry_rows(matrix)
    assert all(map(np.array_equal, (start, columns, values), (A.indptr, A.indices, A.data)))
    before = matrix.stateGet()
    entry_rows(matrix)
    assert matrix.stateGet() == before  # else a solver would compute its factors again
    matrix.scale(2.0)
    assert np.array_equal(values, 2.0 * A.data)
    dense = matrix.convert("dense")
    assert np.array_equal(entry_rows(dense)[2], dense.getValuesCSR()[2])
