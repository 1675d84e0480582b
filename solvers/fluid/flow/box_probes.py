"""Integrals over the fluid in an axis-aligned box: means of velocity and pressure, volume, kinetic energy.

A cell that is whole in the box has the quadrature of the flow. Of one that the box cuts, the part in the box is a cell
of its own: it is cut by the bodies anew. Polynomials of the cell are polynomials of its part, so that all integrals are
exact for the flow as it is, whatever planes and bodies the faces of the box cross.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from solvers import fem, kernels
from solvers.api import Array, Indices
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.section import cell_bounds
from solvers.fluid.geometry.overlaps import Unions
from solvers.fluid.geometry.pieces import NOTHING, in_planes, without_slivers
from solvers.fluid.grid.box import Grid
from solvers.mesh.gauss import gauss, tensor_weights
from solvers.mesh.tessellation import unit_normals

#: Cells that are integrated together, which limits memory.
MOST_CELLS_IN_BATCH = 20_000
#: Faces of the box as near to a plane of the grid as this, in parts of the grid's extent, are in it.
FACE_AT_PLANE = 1e-12


class CrossesThinBody(ValueError):
    """A face of the box crosses cells of a flow that has cells for each side of thin bodies."""


@dataclass(frozen=True)
class PartsInBox:
    """Parts of cells in the box, each with the Gauss points of a tensor rule."""

    cells: Indices  #: local cells
    low: Array  #: lowest corners of the parts, in the coordinates from 0 to 1 of the cells, shape (n, dim)
    high: Array  #: their highest corners
    volume: Array  #: of the parts [m^3], with what bodies cover
    points: int  #: of the rule, in each direction
    fluid: Array | None  #: int_fluid L_q dx over that of the whole part, shape (n, points^dim); None: 1

    def batches(self) -> Iterator[tuple[Indices, Array, Array]]:
        """(cells (n,), reference points (n, q, dim), weights [m^3] (n, q)) of some parts at a time."""
        dim = self.low.shape[1]
        lattice = np.meshgrid(*[gauss(self.points)[0]] * dim, indexing="ij")
        at, weights = np.stack([x.ravel(order="F") for x in lattice], axis=1), tensor_weights(self.points, dim)
        for start in range(0, len(self.cells), MOST_CELLS_IN_BATCH):
            some = slice(start, start + MOST_CELLS_IN_BATCH)
            share = weights if self.fluid is None else weights * self.fluid[some]
            size = (self.high - self.low)[some, None]
            yield self.cells[some], self.low[some, None] + size * at, self.volume[some, None] * share


def box_probe(
    fluid: Fluid, quantity: str, low: Sequence[float], high: Sequence[float]
) -> Callable[[], dict[str, float]]:
    """Probe of the fluid between two corners [m] (collective).

    velocity [m/s], pressure [Pa]: means over its volume, nan where there is none; volume [m^3]; kinetic_energy [J].
    Raises CrossesThinBody.
    """
    ends = np.array([low, high], dtype=float)
    for axis, edge in enumerate(fluid.grid.grid.edges):
        for end in range(2):
            nearest = edge[np.abs(edge - ends[end, axis]).argmin()]
            if abs(nearest - ends[end, axis]) <= FACE_AT_PLANE * (edge[-1] - edge[0]):
                ends[end, axis] = nearest
            elif fluid.grid.sheets is not None and edge[0] < ends[end, axis] < edge[-1]:
                raise CrossesThinBody(
                    f"{'xyz'[axis]} = {ends[end, axis]:g} is no plane of the grid, which it has to be beside bodies of"
                    f" less than about three cells; the nearest one is {nearest:.12g}"
                )

    def probe() -> dict[str, float]:
        total, volume = np.zeros(fluid.dim), 0.0
        for parts in _parts(fluid, ends):
            for cells, reference, weights in parts.batches():
                volume += float(weights.sum())
                total += _integral(fluid, quantity, cells, reference, weights)
        both = fluid.comm.allreduce(np.append(total, volume))
        total, volume = both[:-1], float(both[-1])
        if quantity == "volume":
            return {"": volume}
        if quantity == "kinetic_energy":
            return {"": float(total[0])}
        mean = total / volume if volume > 0.0 else np.full_like(total, np.nan)
        if quantity == "pressure":
            return {"": float(mean[0])}
        return {axis: float(value) for axis, value in zip("xyz", mean, strict=False)}

    return probe


def _integral(fluid: Fluid, quantity: str, cells: Indices, reference: Array, weights: Array) -> Array:
    """Integral of a quantity, a vector; the first entry for others."""
    total = np.zeros(fluid.dim)
    if quantity == "volume" or not len(cells):
        return total
    of_pressure = quantity == "pressure"
    dofs = (fluid.unknowns.cell_pressure if of_pressure else fluid.unknowns.cell_velocity)[cells]
    degree = 1 if of_pressure else fluid.unknowns.degree
    shapes, _ = fem.tabulate_lagrange(fluid.grid.domain, degree, reference.reshape(-1, fluid.dim))
    shapes = shapes.reshape(*weights.shape, -1)
    if of_pressure:
        total[0] = np.einsum("nq,nqf,nf->", weights, shapes, fluid.flow[dofs].reshape(dofs.shape[:2]), optimize=True)
        return total
    velocity = np.einsum("nqf,nfd->nqd", shapes, fluid.flow[dofs])
    if quantity == "velocity":
        return np.asarray(np.einsum("nq,nqd->d", weights, velocity))
    total[0] = 0.5 * fluid.settings.density * float(np.einsum("nq,nqd,nqd->", weights, velocity, velocity))
    return total


def _parts(fluid: Fluid, ends: Array) -> Iterator[PartsInBox]:
    """The parts of this process's cells in the box: full cells, whole cut ones, and parts of cut ones."""
    corners = cell_bounds(fluid)
    low, high = np.maximum(corners[0], ends[0]), np.minimum(corners[1], ends[1])
    inside = (high > low).all(axis=1)
    whole = ((low == corners[0]) & (high == corners[1])).all(axis=1)
    size = corners[1] - corners[0]

    def parts(cells: Indices, points: int, share: Array | None) -> PartsInBox:
        first, last = (low - corners[0])[cells] / size[cells], (high - corners[0])[cells] / size[cells]
        return PartsInBox(cells, first, last, (high - low)[cells].prod(axis=1), points, share)

    owned = fluid.grid.owned
    uncut = fluid.cut.uncut[inside[fluid.cut.uncut] & (fluid.cut.uncut < owned)]
    yield parts(uncut, fluid.unknowns.degree + 1, None)
    rows = np.flatnonzero(inside[fluid.cut.cut] & (fluid.cut.cut < owned))
    points = len(fluid.system.weights.points)
    of_whole = rows[whole[fluid.cut.cut[rows]]]
    yield parts(fluid.cut.cut[of_whole], points, fluid.cut.fluid[of_whole])
    cells = fluid.cut.cut[rows[~whole[fluid.cut.cut[rows]]]]
    yield parts(cells, points, _cut_again(fluid, ends, 0.5 * (low + high)[cells]))


def _cut_again(fluid: Fluid, ends: Array, middle: Array) -> Array:
    """Shares, as `PartsInBox.fluid`, of parts of cut cells, which are of the finest level; middle: theirs [m]."""
    points, dim = fluid.system.weights.points, fluid.dim
    weights = tensor_weights(len(points), dim)
    if not len(middle):
        return np.ones((0, len(weights)))
    edges = []
    for edge, low, high in zip(fluid.grid.grid.edges, *ends, strict=True):
        first, last = max(low, edge[0]), min(high, edge[-1])
        edges.append(np.concatenate([[first], edge[(edge > first) & (edge < last)], [last]]))
    grid = Grid(tuple(edges))
    index = [np.searchsorted(edge, x) - 1 for edge, x in zip(edges, middle.T, strict=True)]
    numbers = np.ravel_multi_index(index, grid.shape, order="F")
    wanted = np.zeros(grid.size, dtype=bool)
    wanted[numbers] = True
    cutter, images = fluid.parts.cutter, fluid.cut.images
    facets, x = images.facets, images.x
    placed = without_slivers(grid, facets, x) if cutter.unions else in_planes(grid, x)
    moments = kernels.moments(grid.edges, points, placed, facets, wanted)
    if cutter.unions:
        moments, _ = Unions(grid, points)(moments, facets, placed, -unit_normals(x[facets]), None)
    fraction = moments.fraction[numbers]  # above 1 where bodies overlap, which are solid once
    found = np.tile(1.0 - np.clip(np.round(fraction)[:, None], 0.0, 1.0), (1, len(weights)))
    if len(moments.cells):
        row = np.minimum(np.searchsorted(moments.cells, numbers), len(moments.cells) - 1)
        cut = (moments.cells[row] == numbers) & (fraction < 1.0 - NOTHING)
        found[cut] = 1.0 - moments.solid[row[cut]] / weights
    return found
