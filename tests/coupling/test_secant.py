"""Secant correction of Newton's method with a tangent that is not exact."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from fsi1_cells import grid_fsi1
from mpi4py import MPI

from coupling.secant import Secant
from fsci.builder.build import build
from fsci.case import load_case
from solvers.timing import Timer

CASES = Path(__file__).parents[2] / "cases"


def test_one_wrong_direction_takes_two_more_iterates():
    """A x = b with A = 1 + 0.54 n n^T and the tangent 1: without the secant the error is halved in each iterate."""
    rng = np.random.default_rng(1)
    n = rng.normal(size=6)
    n /= np.linalg.norm(n)
    exact = np.eye(6) + 0.54 * np.outer(n, n)
    b, x, secant, errors = rng.normal(size=6) + n, np.zeros(6), Secant(), []
    for _ in range(4):
        r = b - exact @ x
        x = x + secant.corrected(r, r)
        errors.append(float(np.linalg.norm(b - exact @ x)))
    assert errors[0] > 0.1
    assert max(errors[2:]) < 1e-14


def test_part_of_an_increment_that_was_taken_back_does_not_count():
    """The same with only a quarter of the first increment: the secant is that of the states."""
    n = np.array([0.6, 0.8])
    exact = np.eye(2) + 0.54 * np.outer(n, n)
    b, x, secant = np.array([1.0, -0.3]), np.zeros(2), Secant()
    for share in (0.25, 1.0, 1.0, 1.0):
        r = b - exact @ x
        x = x + share * secant.corrected(r, r)
        secant.retreat(1.0 - share)
    assert np.linalg.norm(b - exact @ x) < 1e-14


def test_no_change_is_no_division():
    secant = Secant()
    for _ in range(2):
        assert np.array_equal(secant.corrected(np.ones(3), np.zeros(2)), np.ones(3))


def test_steady_flag_converges_fast_in_the_end():
    """FSI1 on half of its cells: 9 steps; without the secant 24, of which the last 17 halve the residual."""
    case = load_case(CASES / "fsi1", [(name, str(value)) for name, value in grid_fsi1(0.5).items()])
    scheme = build(case, MPI.COMM_WORLD, Timer()).scheme
    scheme.initialise(0.0, 1.0)
    info = scheme.step(0.0, 1.0)
    assert info.iterations <= 12
    before, middle, last = np.array(info.residuals[-3:])
    assert last < 1e-2 * middle < 1e-3 * before
