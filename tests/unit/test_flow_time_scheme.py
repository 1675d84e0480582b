"""Difference formulas of the flow's time schemes."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.fluid.settings.time_scheme import BLEND, SCHEMES, bdf2, bdf3, blended


def derivative(difference, function, lengths):
    """The formula's derivative at t = 0 of a function; lengths: of the steps before, newest first."""
    times = -np.cumsum(lengths)[: len(difference.beta)]
    return difference.alpha * function(0.0) - sum(b * function(t) for b, t in zip(difference.beta, times, strict=True))


@pytest.mark.parametrize("lengths", [(0.1, 0.1, 0.1), (0.1, 0.2, 0.05), (0.3, 0.3, 0.6)])
def test_formulas_are_exact_for_polynomials(lengths):
    """BDF2 up to the second degree, BDF3 up to the third, the blend as BDF2, with any steps."""
    dt, *before = lengths
    for formula, degree in ((bdf2(dt, before[0]), 2), (bdf3(dt, before), 3), (blended(dt, before), 2)):
        for power in range(degree + 1):
            found = derivative(formula, lambda t, n=power: (t - 0.7) ** n, lengths)
            assert found == pytest.approx(power * (-0.7) ** (power - 1) if power else 0.0, abs=1e-12)


def test_equal_steps():
    """The weights of Vatsa, Carpenter and Lockard: those of BDF2 and a part of BDF3's."""
    found = blended(0.5, (0.5, 0.5))
    assert 0.5 * found.alpha == pytest.approx(1.5 + BLEND / 3)
    assert 0.5 * np.array(found.beta) == pytest.approx([2.0 + BLEND, -0.5 - BLEND, BLEND / 3])


def amplification(difference, rate):
    """Largest |u_{n+1} / u_n| of u' = rate u with equal steps of length 1."""
    return np.abs(np.roots([difference.alpha - rate, *(-np.array(difference.beta))])).max()


def test_damping_of_an_oscillation():
    """At 40 steps per period the blend loses less than a tenth of what BDF2 loses."""
    two, both = (1.0 - amplification(rule, 2j * np.pi / 40) for rule in (bdf2(1.0, 1.0), blended(1.0, (1.0, 1.0))))
    assert 0.0 <= both < 0.1 * two


def test_blend_is_stable_along_the_imaginary_axis():
    for part in np.logspace(-3, 4, 400):
        assert amplification(blended(1.0, (1.0, 1.0)), 1j * part) <= 1.0 + 1e-12


def test_start_and_growing_steps():
    """The blend needs three velocities before it; a longer step takes BDF2."""
    scheme = SCHEMES["bdf2_optimized"]
    assert scheme.difference(0.1, (0.1, 0.1)) == bdf2(0.1, 0.1)
    assert scheme.difference(0.2, (0.1, 0.1, 0.1)) == bdf2(0.2, 0.1)
    assert scheme.difference(0.1, (0.1, 0.1, 0.1)) == blended(0.1, (0.1, 0.1))
    assert scheme.difference(0.05, (0.1, 0.1, 0.1)) == blended(0.05, (0.1, 0.1))
