"""What the picture and the page of a preview share: what is seen, where names and arrows stand, outlines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from fsci.preview.parts import DistantPair, NamedSurface, Preview
from solvers.api import Array

FILLED = {"elastic": 0.55, "free": 0.55, "moved": 0.35, "rigid": 0.25, "obstacle": 0.25}  #: kind -> opacity
ARROW_LENGTH = 0.08  #: of the scene's size


def extent(scene: Preview) -> tuple[Array, Array]:
    """Low and high corner of what is drawn [m]; a body that reaches far out of the box would make all else small."""
    corners = np.concatenate([part.corners.reshape(-1, part.corners.shape[2]) for part in scene.bodies + scene.patches])
    low, high = corners.min(axis=0), corners.max(axis=0)
    if scene.box is None:
        return low, high
    margin = 0.15 * (scene.box[1] - scene.box[0])
    return np.maximum(low, scene.box[0] - margin), np.minimum(high, scene.box[1] + margin)


def name_place(part: NamedSurface, low: Array, high: Array) -> Array:
    """Where the name of a body stands [m]: in its middle, in the plane amid its widest piece at that height.

    The middle of a ring is in its hole.
    """
    middle = np.clip(part.middle, low, high)
    if len(middle) == 3:
        return middle
    (ax, ay), (bx, by) = part.corners.transpose(1, 2, 0)
    cut = (ay > middle[1]) != (by > middle[1])
    places = ax[cut] + (bx - ax)[cut] * (middle[1] - ay[cut]) / (by - ay)[cut]
    pieces = np.clip(np.sort(places), low[0], high[0]).reshape(-1, 2)
    widest = pieces[np.argmax(np.ptp(pieces, axis=1))] if len(pieces) else middle[[0, 0]]
    return np.array([widest.mean(), middle[1]])


def opacity(part: NamedSurface, bodies: Sequence[NamedSurface]) -> float:
    """In space a body is solid unless it would hide another one that is within the box around it."""
    if part.corners.shape[2] == 2:
        return FILLED[part.kind]
    low, high = part.corners.min(axis=(0, 1)), part.corners.max(axis=(0, 1))
    others = [body.corners for body in bodies if body is not part]
    return 0.3 if any(np.all(corners >= low) and np.all(corners <= high) for corners in others) else 1.0


def arrow_ends(scene: Preview, size: float) -> Iterator[tuple[Array, str]]:
    """(from, to) of each arrow, shape (2, dim) [m], and its kind: loads end at the point that has them.

    Motions and velocities begin there. size: of the scene [m].
    """
    for arrow in scene.arrows:
        ends = np.array([0.0, 1.0] if arrow.kind in ("motion", "velocity") else [-1.0, 0.0])
        yield arrow.at + ARROW_LENGTH * size * np.outer(ends, arrow.direction), arrow.kind


def closest(pairs: list[DistantPair]) -> list[DistantPair]:
    """Of all pairs of the same two bodies the one that is least apart: lines of all of them would cover each other."""
    found: dict[tuple[str, ...], DistantPair] = {}
    for pair in pairs:
        bodies = tuple(side.name.partition(".")[0] for side in pair.sides)
        if bodies not in found or pair.distance < found[bodies].distance:
            found[bodies] = pair
    return list(found.values())


def loops_of(segments: NDArray[np.int64]) -> list[list[int]]:
    """Points of closed lines, the first one again at the end, from segments that follow one another, shape (n, 2)."""
    following: dict[int, list[int]] = {}
    for first, last in segments.tolist():
        following.setdefault(first, []).append(last)
    loops = []
    while following:
        point = next(iter(following))
        loop = [point]
        while point in following:
            ends = following[point]
            after = ends.pop()
            if not ends:
                del following[point]
            loop.append(point := after)
        loops.append(loop)
    return loops
