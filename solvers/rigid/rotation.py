"""Finite rotations in 3D: rotation vectors theta [rad], rotation matrices, and their derivatives."""

from __future__ import annotations

import numpy as np

from solvers.api import Array

#: Angle below which series replace quotients of small numbers; the neglected terms are about angle^4 / 1e4.
SMALL_ANGLE = 1e-3


def skew(a: Array) -> Array:
    """[a] with [a] b = a x b, shape (3, 3)."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def rotation(theta: Array) -> Array:
    """exp [theta], the rotation by |theta| about theta, by Rodrigues' formula."""
    angle, K = float(np.linalg.norm(theta)), skew(theta)
    if angle < SMALL_ANGLE:
        first, second = 1.0 - angle**2 / 6.0, 0.5 - angle**2 / 24.0
    else:
        first, second = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle**2
    return np.eye(3) + first * K + second * K @ K


def vector_rate(theta: Array) -> Array:
    """T with d(theta) = T w for a small further rotation w in space: exp [theta + T w] = exp [w] exp [theta] + O(w^2).

    T = 1 - [theta] / 2 + (1 - (a / 2) cot(a / 2)) / a^2 [theta]^2, a = |theta|.
    Source: Cardona, Geradin, Int. J. Numer. Meth. Engng 26 (1988) 2403-2438.
    """
    angle, K = float(np.linalg.norm(theta)), skew(theta)
    if angle < SMALL_ANGLE:
        factor = 1.0 / 12.0 + angle**2 / 720.0
    else:
        factor = (1.0 - 0.5 * angle / np.tan(0.5 * angle)) / angle**2
    return np.eye(3) - 0.5 * K + factor * K @ K
