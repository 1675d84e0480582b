"""The parts of the faces of the box that patches without through-flow have, by the faces of its cells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fsci.builder.closed_faces import is_closed
from fsci.case import Case
from fsci.case.fluid import FluidSection

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ClosedPart:
    """What one patch that no fluid passes has of a face of the box."""

    patch: str
    face: str  #: x-, x+, y-, ...
    symmetry: bool  #: a plane of symmetry, which may cut bodies
    axis: int
    position: float  #: coordinate of the face [m]
    inward: float  #: 1 or -1: direction of the axis into the box
    #: lowest and highest corners of rectangles (2D: segments) on the face [m], shape (n, 2, dim); those that end at an
    #: edge of the box go on behind it by half of its size, but not along periods, where they have images
    rectangles: Array

    @property
    def name(self) -> str:
        return f"{self.patch}_{self.face[0]}_{'low' if self.inward > 0.0 else 'high'}"

    @property
    def said(self) -> str:
        """Its name for messages."""
        return f"the face {self.face} of the box (patch {self.patch})"

    def gap(self, x: Array) -> Array:
        """Distance [m] of points (n, dim) from the plane of the face, negative behind it."""
        return self.inward * (x[:, self.axis] - self.position)

    def surface(self) -> tuple[Array, NDArray[np.int64]]:
        """(points [m], facets) of the rectangles, lines or quads whose right-hand normal points into the box."""
        axes = [axis for axis in range(self.rectangles.shape[2]) if axis != self.axis]
        ends = self.rectangles[:, :, axes]  # (n, 2, dim - 1)
        turns = [(0,), (1,)] if len(axes) == 1 else [(0, 0), (1, 0), (1, 1), (0, 1)]
        corners = np.full((len(ends), len(turns), len(axes) + 1), self.position)
        for corner, which in enumerate(turns):
            for axis, (column, end) in zip(axes, enumerate(which), strict=True):
                corners[:, corner, axis] = ends[:, end, column]
        # a segment along +x has its right-hand normal along -y, one along +y along +x; x to y runs about z, x to z
        # about -y, y to z about x
        normal = {2: (1.0, -1.0), 3: (1.0, -1.0, 1.0)}[len(axes) + 1][self.axis]
        if normal != self.inward:
            corners = corners[:, ::-1]
        return corners.reshape(-1, len(axes) + 1), np.arange(corners.shape[0] * corners.shape[1]).reshape(len(ends), -1)


def closed_parts(case: Case) -> Iterator[ClosedPart]:
    """Those of all closed patches, face by face. Where patches overlap, the one named last has the face of a cell."""
    if case.fluid is None:
        return
    fluid = case.fluid
    low, high = np.array(fluid.grid.start), np.array(fluid.grid.to)
    names = list(fluid.patches)
    for axis, letter in enumerate("xyz"[: len(low)]):
        for sign, position, inward in (("-", low[axis], 1.0), ("+", high[axis], -1.0)):
            face = letter + sign
            whole = all(patch.where is None for patch in fluid.patches.values() if face in patch.on)
            edges = _edges(fluid, axis, whole=whole)
            owner = _owner(fluid, face, axis, float(position), edges)
            for number in np.unique(owner[owner >= 0]):
                patch = fluid.patches[names[number]]
                if is_closed(patch, axis):
                    found = _corners(fluid, axis, float(position), edges, _rectangles(owner == number))
                    yield ClosedPart(names[number], face, patch.symmetry, axis, float(position), inward, found)


def _owner(fluid: FluidSection, face: str, axis: int, position: float, edges: list[Array]) -> NDArray[np.int64]:
    """Number of the patch of each cell's face on a face of the box, -1 where there is none, shape (n,) or (n, m)."""
    middles = [0.5 * (x[1:] + x[:-1]) for x in edges]
    owner = np.full([len(x) for x in middles], -1)
    x = np.empty((len(middles) + 1, *owner.shape))
    x[axis] = position
    for other, values in zip(_others(fluid, axis), np.meshgrid(*middles, indexing="ij"), strict=True):
        x[other] = values
    for number, patch in enumerate(fluid.patches.values()):
        if face in patch.on:
            on = np.ones(owner.size, dtype=bool)
            if patch.where is not None:
                on = np.broadcast_to(patch.where(x.reshape(len(x), -1), 0.0), owner.size) > 0.0
            owner[on.reshape(owner.shape)] = number
    return owner


def _others(fluid: FluidSection, axis: int) -> list[int]:
    return [other for other in range(fluid.grid.dimension) if other != axis]


def _edges(fluid: FluidSection, axis: int, *, whole: bool) -> list[Array]:
    """Coordinates [m] of the finest cells along the other axes; whole: of the box alone."""
    if whole:
        return [np.array([fluid.grid.start[other], fluid.grid.to[other]]) for other in _others(fluid, axis)]
    parts = 2**fluid.grid.levels
    planes = [np.asarray(fluid.grid.planes[other]) for other in _others(fluid, axis)]
    return [np.interp(np.arange(parts * (len(x) - 1) + 1) / parts, np.arange(len(x)), x) for x in planes]


def _rectangles(mask: NDArray[np.bool_]) -> list[list[tuple[int, int]]]:
    """Rectangles that cover a mask of one or two axes, each as (first, behind the last) along them."""
    if mask.ndim == 1:
        return [[run] for run in _runs(mask)]
    found: list[list[tuple[int, int]]] = []
    growing: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for row, along in enumerate(mask):
        runs = _runs(along)
        growing = {run: growing[run] for run in runs if run in growing}
        for run in runs:
            if run not in growing:
                found.append(growing.setdefault(run, [(row, row), run]))
            growing[run][0] = growing[run][0][0], row + 1
    return found


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """(first, behind the last) of the stretches of a mask of one axis."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in zip(ends[::2], ends[1::2], strict=True)]


def _corners(
    fluid: FluidSection, axis: int, position: float, edges: list[Array], found: list[list[tuple[int, int]]]
) -> Array:
    low, high = np.array(fluid.grid.start), np.array(fluid.grid.to)
    corners = np.full((len(found), 2, len(low)), position)
    for k, (other, inner) in enumerate(zip(_others(fluid, axis), edges, strict=True)):
        repeats = any(patch.periodic and "xyz"[other] == patch.on[0][0] for patch in fluid.patches.values())
        x, beyond = inner.copy(), 0.0 if repeats else 0.5 * (high - low)[other]
        x[0], x[-1] = low[other] - beyond, high[other] + beyond
        corners[:, :, other] = [[x[first], x[last]] for first, last in (one[k] for one in found)]
    return corners
