"""Connected parts of a graph."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def connected_parts(first: NDArray, second: NDArray, n: int) -> NDArray[np.int64]:
    """For each of n nodes, the smallest number in its connected part, shape (n,); edges: first - second.

    The smaller number is passed along every edge, and every node takes the number of its number, until nothing changes.
    """
    part = np.arange(n)
    across = first != second
    first, second = first[across], second[across]
    while len(first):
        before = part.copy()
        least = np.minimum(part[first], part[second])
        for end in (first, second):
            np.minimum.at(part, part[end], least)
            np.minimum.at(part, end, least)
        part = part[part]
        if (part == before).all():
            break
    return part
