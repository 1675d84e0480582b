"""Values of settings: numbers, or functions of position and time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np

from solvers.api import Array

#: A number, or f(x, t) with positions x [m] of shape (3, n) or (dim, n) and the time t [s] -> values of shape (n,).
Value: TypeAlias = float | Callable[[Array, float], Array]


def evaluate(value: Value, x: Array, t: float) -> Array:
    """A value at points x [m], (3, n) or (dim, n), and the time t [s], shape (n,)."""
    if callable(value):
        return value(x, t)
    return np.full(x.shape[1], float(value))


def evaluate_components(values: Sequence[Value], x: Array, t: float) -> Array:
    """Components of a vector at points, shape (components, n)."""
    return np.stack([evaluate(value, x, t) for value in values])


def combine(function: Callable[..., Any], *values: Value) -> Value:
    """function(*values): a number if all of them are, else a function of position and time."""
    if not any(callable(value) for value in values):
        return float(function(*values))

    def combined(x: Array, t: float) -> Array:
        return function(*(value(x, t) if callable(value) else value for value in values))

    return combined
