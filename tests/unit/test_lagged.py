"""Factors that serve again: the answer is that of the matrix asked for, whatever was factored before."""

import numpy as np
import pytest
from petsc4py import PETSc
from scipy import sparse

from solvers.algebra.lagged import Lagged, LaggedFactors
from solvers.algebra.linear import LinearSolveFailed, flexible_solver

SIZE = 60
NUMBERS = np.random.default_rng(3)
NEAR = sparse.random(SIZE, SIZE, 0.1, random_state=1).tocsr()
BASE = (sparse.eye(SIZE) * 4.0 + sparse.random(SIZE, SIZE, 0.2, random_state=2)).tocsr()
LOAD = NUMBERS.standard_normal(SIZE)


def solve(factors: LaggedFactors, matrix: sparse.csr_matrix) -> np.ndarray:
    as_petsc, b, x = system(matrix)
    factors.solve(as_petsc, b, x)
    return x.array.copy()


def system(matrix: sparse.csr_matrix) -> tuple[PETSc.Mat, PETSc.Vec, PETSc.Vec]:
    as_petsc = PETSc.Mat().createAIJ(matrix.shape, csr=(matrix.indptr, matrix.indices, matrix.data))
    b, x = as_petsc.createVecs()
    b.array[:] = LOAD
    return as_petsc, b, x


def error(x: np.ndarray, matrix: sparse.csr_matrix) -> float:
    return float(np.linalg.norm(matrix @ x - LOAD) / np.linalg.norm(LOAD))


def test_near_matrices_are_solved_with_the_factors_there_are() -> None:
    factors = LaggedFactors(PETSc.COMM_SELF, fresh=1)
    assert error(solve(factors, BASE), BASE) < 1e-13
    for share in (0.01, 0.02, 0.03):
        matrix = (BASE + share * NEAR).tocsr()
        assert error(solve(factors, matrix), matrix) < 1e-8
    assert factors.factored == 1


def test_far_matrices_are_factored_and_serve_from_then_on() -> None:
    factors = LaggedFactors(PETSc.COMM_SELF, fresh=1)
    solve(factors, BASE)
    far = (BASE @ sparse.diags(10.0 ** NUMBERS.uniform(-3.0, 3.0, SIZE)) + 50.0 * NEAR).tocsr()
    assert error(solve(factors, far), far) < 1e-8
    assert factors.factored == 2
    near = (far * 1.01).tocsr()
    assert error(solve(factors, near), near) < 1e-8
    assert factors.factored == 2


@pytest.mark.parametrize("fresh", [1, 2, float("inf")])
def test_the_first_matrices_of_a_step_are_factored(fresh: float) -> None:
    factors = LaggedFactors(PETSc.COMM_SELF, fresh=fresh)
    for _ in range(2):
        factors.begin_step()
        for _ in range(4):
            solve(factors, BASE)
        assert factors.factored == min(fresh, 4)


def test_singular_matrices_are_an_error() -> None:
    factors = LaggedFactors(PETSc.COMM_SELF, fresh=1)
    singular = BASE.tolil()
    singular[7, :] = singular[:, 7] = 0.0
    singular[7, 7] = 0.0
    with pytest.raises(LinearSolveFailed):
        solve(factors, singular.tocsr())


def test_a_preconditioner_that_no_longer_serves_is_discarded() -> None:
    """After a solve that takes more than twice as many iterations as it took for its own matrix."""
    lagged, ksp = Lagged(), flexible_solver(PETSc.COMM_SELF, tolerance=1e-8)
    ksp.getPC().setType(PETSc.PC.Type.ILU)
    first = lagged.solve(ksp, *system((BASE + 0.5 * NEAR).tocsr()))
    again = lagged.solve_again(*system((BASE + 0.51 * NEAR).tocsr()))
    assert again is not None
    assert again <= 2 * first
    last = lagged.solve_again(*system((BASE + 2.0 * NEAR).tocsr()))
    assert last is not None
    assert last > 2 * first
    assert lagged.solve_again(*system(BASE)) is None


def test_a_solve_that_takes_as_long_as_a_new_preconditioner_ends() -> None:
    """With ten iterations more than twice as many as for its own matrix; the solver has its bound again then."""
    lagged, ksp = Lagged(), flexible_solver(PETSc.COMM_SELF, tolerance=1e-8)
    most = ksp.getTolerances()[3]
    ksp.getPC().setType(PETSc.PC.Type.ILU)
    first = lagged.solve(ksp, *system((BASE + 0.5 * NEAR).tocsr()))
    far = system((BASE @ sparse.diags(10.0 ** np.random.default_rng(4).uniform(-3.0, 3.0, SIZE))).tocsr())
    assert lagged.solve_again(*far) is None
    assert 2 * first < ksp.getIterationNumber() <= 2 * first + 11
    assert ksp.getTolerances()[3] == most
    assert lagged.solve_again(*system(BASE)) is None


def test_a_preconditioner_is_judged_by_iterations_per_digit() -> None:
    """A system that is solved less exactly takes fewer iterations; its preconditioner is not a better one for that."""
    lagged, ksp = Lagged(), flexible_solver(PETSc.COMM_SELF, tolerance=1e-8)
    ksp.getPC().setType(PETSc.PC.Type.ILU)
    rough = lagged.solve(ksp, *system((BASE + 0.5 * NEAR).tocsr()), reduction=1e-2)
    exact = lagged.solve_again(*system((BASE + 0.51 * NEAR).tocsr()))
    assert exact is not None
    assert exact > 2 * rough
    assert lagged.solve_again(*system((BASE + 0.51 * NEAR).tocsr())) == exact
