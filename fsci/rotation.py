"""Rotations by an axis and an angle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def rotation_matrix(axis: Sequence[float] | None, angle: float, dim: int) -> NDArray[np.float64]:
    """Matrix of the right-handed rotation by `angle` degrees about k: cos I + sin [k] + (1 - cos) k k^T.

    Raises ValueError for an axis that does not fit the dimension.
    """
    if axis is None and dim == 3:
        raise ValueError("rotate: a mesh of three dimensions needs an axis")
    k = np.array([0, 0, 1] if axis is None else axis, dtype=float)
    if k.shape != (3,) or not k.any():
        raise ValueError(f"rotate: the axis must be three numbers, not all zero, got {list(k)}")
    if dim == 2 and k[:2].any():
        raise ValueError("rotate: a mesh of two dimensions turns in its plane, give the angle only")
    k /= np.linalg.norm(k)
    cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return (cos * np.eye(3) + sin * cross + (1 - cos) * np.outer(k, k))[:dim, :dim]
