"""The largest and the least speed and pressure of the fluid in an axis-aligned box, and where they are.

The flow is evaluated at

- a lattice in each cell, or in its part in the box; in cut cells at points in the fluid,
- the corners of the parts of facets that are in a cell and in the box.

Linear fields are largest and least at such points. So is the pressure in cells without surface: it is linear along
each of their axes. Around the best points ever finer lattices follow, because a speed may be largest between points.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from solvers import fem
from solvers.api import Array, Indices
from solvers.fluid.flow.box_probes import MOST_CELLS_IN_BATCH
from solvers.fluid.flow.extreme_pressure import clipped
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.section import cell_bounds
from solvers.fluid.surfaces.inside import INSIDE, windings

#: Points of the lattice along each edge of a cell, and cells without surface with the best ones, around which finer
#: lattices follow. 3 or 9, and 8 or 128 find the same extremes of vortices (a test).
LATTICE, CANDIDATES = 5, 32
#: Finer lattices around a point, each of half the size: the last one is of a millionth of a cell.
HALVINGS = 20
#: Points that are looked for in bodies together, from the best one on, which mostly is in the fluid.
MOST_POINTS_IN_BATCH = 256
#: Largest value of a shape function's sum of absolute values along one axis, by degree: of 1 and of 2 (Lebesgue).
LEBESGUE = {1: 1.0, 2: 1.25}


@dataclass
class Best:
    """The largest value so far, and where it is."""

    value: float = -np.inf
    cell: int = -1  #: local cell
    at: Array = field(default_factory=lambda: np.empty(0))  #: in the coordinates from 0 to 1 of the cell

    def take(self, value: float, cell: int, at: Array) -> None:
        if value > self.value:
            self.value, self.cell, self.at = float(value), int(cell), at


def box_extreme(
    fluid: Fluid,
    quantity: str,
    extreme: Literal["largest", "least"],
    low: Sequence[float] | None = None,
    high: Sequence[float] | None = None,
) -> Callable[[], dict[str, float]]:
    """Probe of the largest or least `speed` [m/s] or `pressure` [Pa] between two corners [m], or of all fluid.

    Calls are collective.
    Its values are "", and the place [m] as "place.x", ...; nan where there is no fluid.
    """
    edges = fluid.grid.grid.edges
    start, to = [edge[0] for edge in edges], [edge[-1] for edge in edges]
    box = np.array([start if low is None else low, to if high is None else high], dtype=float)
    sign = 1.0 if extreme == "largest" else -1.0

    def probe() -> dict[str, float]:
        values = _Values(fluid, quantity, sign)
        parts = _PartsOfCells(fluid, box)
        best = Best()
        _at_lattice(fluid, values, parts, best)
        if fluid.bodies:
            _on_surfaces(fluid, values, parts, best)
        if best.cell >= 0:
            lowest, highest = (corner[best.cell] for corner in cell_bounds(fluid))
            place = lowest + best.at * (highest - lowest)
        else:
            place = np.full(fluid.dim, np.nan)
        value, place = max(fluid.comm.allgather((best.value, place)), key=lambda found: found[0])
        named = {f"place.{axis}": float(x) for axis, x in zip("xyz", place, strict=False)}
        return {"": sign * value if np.isfinite(value) else np.nan, **named}

    return probe


class _Values:
    """What is to be largest, at points of cells."""

    def __init__(self, fluid: Fluid, quantity: str, sign: float):
        self._fluid, self._sign, self._scalar = fluid, sign, quantity == "pressure"
        unknowns = fluid.unknowns
        self._degree = 1 if self._scalar else unknowns.degree
        self._dofs = unknowns.cell_pressure if self._scalar else unknowns.cell_velocity
        #: points along each edge of a cell, of which one is the largest if there is no surface and it is a pressure
        self.points = 2 if self._scalar else LATTICE

    def at(self, cells: Indices, reference: Array) -> Array:
        """Values (n, q) at points (n, q, dim) of cells (n,)."""
        shapes, _ = fem.tabulate_lagrange(self._fluid.grid.domain, self._degree, reference.reshape(-1, self._fluid.dim))
        shapes = shapes.reshape(*reference.shape[:2], -1)
        nodal = self._nodal(cells)
        if self._scalar:
            return self._sign * np.einsum("nqf,nf->nq", shapes, nodal[:, :, 0])
        return np.asarray(self._sign * np.linalg.norm(np.einsum("nqf,nfd->nqd", shapes, nodal), axis=2))

    def _nodal(self, cells: Indices) -> Array:
        """Values of the nodes of cells, shape (n, nodes, components)."""
        dofs = self._dofs[cells]
        return self._fluid.flow[dofs[:, :, None] if self._scalar and dofs.ndim == 2 else dofs]

    def bound(self, cells: Indices) -> Array:
        """What no value in cells exceeds, (n,)."""
        nodal = self._nodal(cells)
        if self._scalar:
            return (self._sign * nodal[:, :, 0]).max(axis=1, initial=-np.inf)
        if self._sign < 0.0:
            return np.zeros(len(cells))
        return LEBESGUE[self._degree] ** self._fluid.dim * np.linalg.norm(nodal, axis=2).max(axis=1, initial=0.0)


class _PartsOfCells:
    """The parts in the box of the cells that this process owns, in the coordinates from 0 to 1 of each cell."""

    def __init__(self, fluid: Fluid, box: Array):
        low, high = cell_bounds(fluid)
        size = high - low
        self.first = (np.maximum(low, box[0]) - low) / size
        self.last = (np.minimum(high, box[1]) - low) / size
        inside = (self.first < self.last).all(axis=1) & (np.arange(len(low)) < fluid.grid.owned)
        self.inside = inside
        unit = np.meshgrid(*[[-1.0, 0.0, 1.0]] * fluid.dim, indexing="ij")
        self.around = np.stack(unit, axis=-1).reshape(-1, fluid.dim)  #: directions of a finer lattice, and none
        self.uncut = fluid.cut.uncut[inside[fluid.cut.uncut]]
        self.cut = fluid.cut.cut[inside[fluid.cut.cut]]

    def lattice(self, cells: Indices, points: int) -> Array:
        """Points (n, points^dim, dim) of the parts, their corners among them."""
        dim = self.first.shape[1]
        steps = np.meshgrid(*[np.linspace(0.0, 1.0, points)] * dim, indexing="ij")
        unit = np.stack(steps, axis=-1).reshape(-1, dim)
        first, last = self.first[cells][:, None], self.last[cells][:, None]
        return np.where(unit == 1.0, last, first + unit * (last - first))


def _at_lattice(fluid: Fluid, values: _Values, parts: _PartsOfCells, best: Best) -> None:
    for start in range(0, len(parts.uncut), MOST_CELLS_IN_BATCH):
        cells = parts.uncut[start : start + MOST_CELLS_IN_BATCH]
        points = parts.lattice(cells, values.points)
        found = values.at(cells, points)
        rows, columns = np.argsort(-found.max(axis=1), kind="stable")[:CANDIDATES], found.argmax(axis=1)
        _refine(fluid, values, parts, cells[rows], points[rows, columns[rows]], best, cut=False)
    cells = parts.cut[values.bound(parts.cut) > best.value]
    if not len(cells):
        return
    points = parts.lattice(cells, LATTICE)
    found = values.at(cells, points)
    rows, columns = np.unravel_index(np.argsort(-found, axis=None, kind="stable"), found.shape)
    for start in range(0, len(rows), MOST_POINTS_IN_BATCH):
        row, column = rows[start : start + MOST_POINTS_IN_BATCH], columns[start : start + MOST_POINTS_IN_BATCH]
        wet = np.flatnonzero(_in_fluid(fluid, cells[row], points[row, column]))
        if len(wet):
            _, firsts = np.unique(row[wet], return_index=True)  # the best one of each cell
            some = wet[np.sort(firsts)[:CANDIDATES]]
            _refine(fluid, values, parts, cells[row[some]], points[row[some], column[some]], best, cut=True)
            return


def _refine(
    fluid: Fluid, values: _Values, parts: _PartsOfCells, cells: Indices, at: Array, best: Best, *, cut: bool
) -> None:
    """Finer lattices around a point (n, dim) of each of some cells, cut ones or not; the best one is taken."""
    first, last = parts.first[cells], parts.last[cells]
    now, size = values.at(cells, at[:, None])[:, 0], (last - first) / (LATTICE - 1)
    for _ in range(HALVINGS):
        size = 0.5 * size
        points = np.clip(at[:, None] + size[:, None] * parts.around, first[:, None], last[:, None])
        found = values.at(cells, points)
        which = found.argmax(axis=1)[:, None]
        point, value = np.take_along_axis(points, which[:, :, None], 1)[:, 0], np.take_along_axis(found, which, 1)[:, 0]
        better = np.flatnonzero(value > now)
        if cut:
            better = better[_in_fluid(fluid, cells[better], point[better])]
        at[better], now[better] = point[better], value[better]
    best.take(now.max(), cells[now.argmax()], at[now.argmax()])


def _in_fluid(fluid: Fluid, cells: Indices, reference: Array) -> np.ndarray:
    """Mask of the points (n, dim) of cut cells (n,) that no body covers, and that these cells have the fluid of."""
    low, high = (corner[cells] for corner in cell_bounds(fluid))
    images = fluid.cut.images
    wet = windings(low + reference * (high - low), images.motion(fluid.cut.motion), images.facets) < 1.0 - INSIDE
    if (sheets := fluid.grid.sheets) is not None:
        for i in np.flatnonzero(wet):
            there = sheets.cell_at(int(fluid.grid.numbers[cells[i]]), reference[i])
            wet[i] = there == fluid.grid.in_sheets[cells[i]]
    return wet


def _on_surfaces(fluid: Fluid, values: _Values, parts: _PartsOfCells, best: Best) -> None:
    """Of the pieces of surface in the box, from the one with the largest bound on."""
    interface = fluid.system.assemble_interface()
    pieces = np.flatnonzero(parts.inside[interface.cell])
    bound = values.bound(interface.cell[pieces])
    low, high = cell_bounds(fluid)
    for piece, limit in sorted(zip(pieces, bound, strict=True), key=lambda one: -one[1]):
        if limit <= best.value:
            break
        cell = interface.cell[piece]
        first, last = parts.first[cell], parts.last[cell]
        x = (interface.x[piece] - low[cell]) / (high[cell] - low[cell])
        corners = first + clipped((x - first) / (last - first)) * (last - first)
        if len(corners):
            found = values.at(np.array([cell]), corners[None])[0]
            which = int(found.argmax())
            if found[which] > best.value:
                _refine(fluid, values, parts, np.array([cell]), corners[[which]], best, cut=True)
