"""The lengths after which the space of a case repeats: those between its periodic faces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case

Array = NDArray[np.float64]


def periods(case: Case) -> Array | None:
    """Length [m] along each axis, infinite where nothing repeats, shape (dim,); None: nothing repeats at all."""
    if case.fluid is None:
        return None
    grid = case.fluid.grid
    axes = {face[0] for patch in case.fluid.patches.values() if patch.periodic for face in patch.on}
    if not axes:
        return None
    sizes = np.array(grid.to, dtype=float) - np.array(grid.start, dtype=float)
    return np.where([letter in axes for letter in "xyz"[: grid.dimension]], sizes, np.inf)


def put_within(case: Case, x: Array) -> Array:
    """Points [m], shape (dim, n), put into the box by whole periods."""
    lengths = periods(case)
    if lengths is None:
        return x
    assert case.fluid is not None
    found = x.copy()
    for axis in np.flatnonzero(np.isfinite(lengths)):
        start = case.fluid.grid.start[axis]
        found[axis] = start + (x[axis] - start) % lengths[axis]
    return found
