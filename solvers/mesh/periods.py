"""Ways by whole periods from a surface to those of its images that are near another one.

Where space repeats after the lengths L along the axes (infinite: it does not), a surface acts at x + k . L for all
whole k, too. Surfaces that move through several periods are compared with the images that are near.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array

#: Length relative to a period up to which something is not longer: rounding.
SAME_AS_PERIOD = 1e-9

Box = tuple[Array, Array]  #: lowest and highest coordinates [m]


def no_periods(dim: int) -> Array:
    """The lengths of a space that does not repeat."""
    return np.full(dim, np.inf)


def box_of(x: Array) -> Box:
    """The box of points [m], (n, dim)."""
    return x.min(axis=0), x.max(axis=0)


def gap_of_boxes(one: Box, other: Box, lengths: Array) -> Array:
    """The largest gap along an axis [m] between boxes and the nearest images of others; negative where they overlap.

    Arrays of boxes have the shape (..., dim).
    """
    apart = 0.5 * ((one[0] + one[1]) - (other[0] + other[1]))
    with np.errstate(invalid="ignore"):
        apart = np.where(np.isfinite(lengths), apart - lengths * np.round(apart / lengths), apart)
    half = 0.5 * ((one[1] - one[0]) + (other[1] - other[0]))
    found: Array = (np.abs(apart) - half).max(axis=-1)
    return found


def ways_to(one: Box, other: Box, lengths: Array, within: float = 0.0) -> list[tuple[int, ...]]:
    """Numbers of periods k whose images x + k . L of `other` have boxes nearer than `within` [m] to `one`."""
    first, last = (one[0] - within - other[1]) / lengths, (one[1] + within - other[0]) / lengths
    spans = []
    for axis, length in enumerate(lengths):
        if np.isfinite(length):
            spans.append(range(int(np.ceil(first[axis])), int(np.floor(last[axis])) + 1))
        else:
            near = one[0][axis] - within <= other[1][axis] and other[0][axis] <= one[1][axis] + within
            spans.append(range(1 if near else 0))
    return list(product(*spans))


def periods_before(one: Box, other: Box, lengths: Array) -> NDArray[np.int64]:
    """Numbers of periods to the last image of `other` whose middle is not behind that of `one`, by axis.

    Surfaces that are no longer than a period touch that image and the next one only.
    """
    apart = 0.5 * ((one[0] + one[1]) - (other[0] + other[1]))
    return np.floor(apart / lengths).astype(np.int64) * np.isfinite(lengths)


def way_of(periods: Sequence[int], lengths: Array) -> Array:
    """k . L [m], shape (dim,)."""
    return np.array([k * length if k else 0.0 for k, length in zip(periods, lengths, strict=True)])


def without_longer(x: Array, lengths: Array) -> Array:
    """The lengths of periods that points [m], (n, dim), span no more than: a longer surface covers its images."""
    return np.where(np.ptp(x, axis=0) > (1.0 + SAME_AS_PERIOD) * lengths, np.inf, lengths)
