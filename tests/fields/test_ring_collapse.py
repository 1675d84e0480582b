"""References of cases/ring_collapse: an elastic ring under outer pressure that touches itself.

Flaherty, Keller, Rubinow, SIAM J. Appl. Math. 23 (1972): radius and bending stiffness 1, no stretch, no shear. The
quarter from the bottom, where the tangent is horizontal, to the side, where it is vertical:

    x' = cos a, y' = sin a, a' = k, k' = H sin a - V cos a, H' = p sin a, V' = -p cos a

with the angle a of the tangent, the curvature k, and the force (H, V) that the rest of the ring exerts.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.optimize import brentq

from fsci.case import load_case

QUARTER = 0.5 * np.pi
CASE = Path(__file__).parents[2] / "cases" / "ring_collapse"
THICKNESS = 0.02


def start(pressure):
    """A flattened ring: curvature 1 - 1.5 cos 2s; arc length (n,), state (6, n)."""
    s = np.linspace(0.0, QUARTER, 100)
    angle = s - 0.75 * np.sin(2.0 * s)
    x, y = (np.append(0.0, np.cumsum(0.5 * (f[1:] + f[:-1])) * s[1]) for f in (np.cos(angle), np.sin(angle)))
    y -= y[-1]
    return s, np.stack([x, y, angle, 1.0 - 1.5 * np.cos(2.0 * s), pressure * y, -pressure * x])


def ring(pressure, guess, *, free, below=0.5 * THICKNESS):
    """Solution of the quarter, without contact, or with the bottom held below the middle."""

    def slope(s, state):
        _, _, a, k, H, V = state
        return np.stack(
            [np.cos(a), np.sin(a), k, H * np.sin(a) - V * np.cos(a), pressure * np.sin(a), -pressure * np.cos(a)]
        )

    def ends(bottom, side):
        held = bottom[5] if free else bottom[1] + below
        return np.array([bottom[0], bottom[2], held, side[1], side[2] - QUARTER, side[4]])

    found = solve_bvp(slope, ends, *guess, tol=1e-8, max_nodes=20000)
    assert found.success
    return found


def flat_ring(pressure, guess):
    """Solution from the end of the contact on, and the unknown half of its length; arc length over its whole."""

    def slope(s, state, flat):
        _, _, a, k, H, V = state
        rates = [np.cos(a), np.sin(a), k, H * np.sin(a) - V * np.cos(a), pressure * np.sin(a), -pressure * np.cos(a)]
        return (QUARTER - flat[0]) * np.stack(rates)

    def ends(end, side, flat):
        return np.array(
            [end[0] - flat[0], end[2], end[1] + 0.5 * THICKNESS, end[3], side[1], side[2] - QUARTER, side[4]]
        )

    found = solve_bvp(slope, ends, guess.x / QUARTER, guess.y, p=[0.1], tol=1e-8, max_nodes=20000)
    assert found.success
    return found, found.p[0]


def references():
    """References of the case by value and time: {("touch", None): 5.1883, ...}."""
    return {(check.value, check.end): check.reference for check in load_case(CASE).verify}


def test_references_are_those_of_the_elastic_line():
    wanted = references()
    at_4 = ring(4.0, start(4.0), free=True)
    at_5 = ring(5.0, (at_4.x, at_4.y), free=True)
    assert wanted["top.y", 5.0] == pytest.approx(-at_5.y[1, 0] - 0.5 * THICKNESS - (1.0 - 0.5 * THICKNESS), abs=1e-5)
    touch = brentq(lambda p: ring(p, (at_5.x, at_5.y), free=True).y[1, 0] + 0.5 * THICKNESS, 5.0, 5.4, xtol=1e-6)
    assert wanted["touch", None] == pytest.approx(touch, abs=1e-4)
    guess = at_5.x, at_5.y
    for pressure in (6.0, 8.0, 10.0):
        point = ring(pressure, guess, free=False)
        guess = point.x, point.y
    assert wanted["contact.inside.y", 10.0] == pytest.approx(2.0 * abs(point.y[5, 0]), rel=1e-4)
    flat, half = flat_ring(16.0, point)
    assert wanted["contact.inside.y", None] == pytest.approx(2.0 * (abs(flat.y[5, 0]) + 16.0 * half), rel=1e-4)
    assert wanted["side.x", None] == pytest.approx(flat.y[0, -1] - 1.0, abs=1e-4)


def test_published_pressures():
    """Without thickness: opposite sides touch at 5.247, and the curvature there vanishes at 10.34."""
    at_4 = ring(4.0, start(4.0), free=True)
    at_5 = ring(5.0, (at_4.x, at_4.y), free=True)
    touch = brentq(lambda p: ring(p, (at_5.x, at_5.y), free=True).y[1, 0], 5.0, 5.4, xtol=1e-6)
    assert touch == pytest.approx(5.247, abs=5e-4)
    at_8 = ring(8.0, (at_5.x, at_5.y), free=False, below=0.0)
    flat = brentq(lambda p: ring(p, (at_8.x, at_8.y), free=False, below=0.0).y[3, 0], 9.0, 11.0, xtol=1e-4)
    assert flat == pytest.approx(10.34, abs=5e-3)
