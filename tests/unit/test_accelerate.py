"""Accelerated fixed-point iterations on maps with a known answer."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.accelerate import Aitken, QuasiNewton, Relaxation


def iterate(accelerator, G, b, steps: int):
    """Residuals of d -> G d + b, from d = 0."""
    d, residuals = np.zeros_like(b), []
    accelerator.begin_step()
    for _ in range(steps):
        found = (G @ d.ravel()).reshape(d.shape) + b
        residuals.append(float(np.linalg.norm(found - d)))
        if residuals[-1] < 1e-13:
            break
        d = accelerator.next(d, found)
    return d, residuals


def random_map(n: int, radius: float, rank: int):
    """A symmetric negative map of given rank and spectral radius: plain iterations diverge if radius > 1."""
    rng = np.random.default_rng(3)
    Q = np.linalg.qr(rng.standard_normal((2 * n, 2 * n)))[0]
    values = np.zeros(2 * n)
    values[:rank] = -np.linspace(radius, 0.3 * radius, rank)
    return Q @ np.diag(values) @ Q.T, rng.standard_normal((n, 2))


def test_plain_iterations_contract_by_the_spectral_radius():
    G, b = random_map(4, 0.5, 1)
    _, residuals = iterate(Relaxation(1.0), G, b, 20)
    assert residuals[10] / residuals[9] == pytest.approx(0.5, rel=1e-6)
    G, b = random_map(4, 2.0, 1)
    _, residuals = iterate(Relaxation(1.0), G, b, 10)
    assert residuals[-1] / residuals[-2] == pytest.approx(2.0, rel=1e-2)


def test_aitken_is_exact_for_one_mode():
    """One eigenvalue g: after the second iterate omega = 1 / (1 - g), and the third is the answer."""
    G, b = np.full((1, 1), -9.0), np.array([[1.0]])
    d, residuals = iterate(Aitken(0.5), G, b, 10)
    assert len(residuals) == 3
    assert d[0, 0] == pytest.approx(0.1, rel=1e-12)


def test_aitken_converges_where_plain_iterations_diverge():
    G, b = random_map(4, 5.0, 2)
    _, residuals = iterate(Aitken(0.3), G, b, 40)
    assert residuals[-1] < 1e-10


@pytest.mark.parametrize("rank", [1, 3, 5])
def test_quasi_newton_needs_one_iteration_per_mode(rank: int):
    """On a linear map with k modes the k differences span them: the iterate after is exact."""
    G, b = random_map(6, 8.0, rank)
    _, residuals = iterate(QuasiNewton(0.1, filter=1e-10), G, b, 30)
    assert residuals[-1] < 1e-9
    assert len(residuals) <= rank + 4


def test_quasi_newton_reuses_earlier_steps_until_reset():
    G, b = random_map(6, 8.0, 3)
    accelerator = QuasiNewton(0.1, filter=1e-10)
    first = len(iterate(accelerator, G, b, 30)[1])
    second = len(iterate(accelerator, G, 1.7 * b, 30)[1])
    assert second <= 3 < first
    accelerator.forget()
    assert len(iterate(accelerator, G, 0.4 * b, 30)[1]) > 3


def test_dependent_columns_are_dropped():
    accelerator = QuasiNewton()
    V = np.array([[1.0, 1.0, 0.0], [0.0, 1e-9, 1.0], [0.0, 0.0, 0.0]])
    assert accelerator.independent(V) == [0, 2]


@pytest.mark.parametrize("make", [Aitken, QuasiNewton])
def test_state_survives(make):
    G, b = random_map(5, 3.0, 3)
    accelerator, copy = make(), make()
    iterate(accelerator, G, b, 4)
    copy.restore(accelerator.save())
    one, two = (iterate(a, G, 2.0 * b, 5)[0] for a in (accelerator, copy))
    assert np.array_equal(one, two)
