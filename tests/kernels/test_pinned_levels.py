"""Matrices that leave levels free, made regular."""

import numpy as np
from petsc4py import PETSc

from solvers.fluid.solve.linear_systems.pinned_levels import pinned


def dense(matrix):
    return matrix.convert("dense").getDenseArray()


def matrix_of(array):
    found = PETSc.Mat().createAIJ(array.shape, nnz=array.shape[1])
    found.setValues(range(array.shape[0]), range(array.shape[1]), array)
    found.assemble()
    return found


def with_levels(size, levels, rng):
    """A random matrix A with A z = 0 and z^T A = 0 for each level z."""
    away = np.eye(size) - levels @ np.linalg.solve(levels.T @ levels, levels.T)
    return away @ rng.standard_normal((size, size)) @ away


def test_solutions_stay_and_rounding_errors_are_not_amplified():
    rng = np.random.default_rng(5)
    levels = np.zeros((12, 2))
    levels[3:7, 0] = levels[8:, 1] = 1.0
    array = with_levels(12, levels, rng)
    regular = dense(pinned(matrix_of(array), levels, []))
    assert np.linalg.cond(regular) < 1e3 < np.linalg.cond(array)
    assert np.count_nonzero(regular != array) == 2
    exact = rng.standard_normal(12)
    exact[[3, 8]] = 0.0
    assert np.abs(np.linalg.solve(regular, array @ exact) - exact).max() < 1e-12


def test_the_unknown_with_most_of_a_level_on_the_coarsest_grid():
    rng = np.random.default_rng(6)
    to_fine = np.zeros((5, 3))
    to_fine[[0, 1, 1, 2, 3, 3, 4], [0, 0, 1, 1, 1, 2, 2]] = [1.0, 0.5, 0.5, 1.0, 0.5, 0.5, 1.0]
    array = with_levels(3, np.ones((3, 1)), rng)
    changed = dense(pinned(matrix_of(array), np.ones((5, 1)), [matrix_of(to_fine)])) - array
    assert np.argwhere(changed).tolist() == [[1, 1]]
    assert changed[1, 1] == np.abs(array[1]).sum()
