"""The cut of the grid by surfaces: active cells, and the moments that give the quadrature weights of cut cells."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from solvers import kernels
from solvers.api import Array, Indices32
from solvers.fluid.cut.film import Films, Walls, creeping_cells, walls_of
from solvers.fluid.cut.gaps import GapFinder, NarrowGaps
from solvers.fluid.cut.images import Images, Periods
from solvers.fluid.geometry.closed_facets import without_closed
from solvers.fluid.geometry.overlaps import Unions
from solvers.fluid.geometry.pieces import (
    NOTHING,
    Pieces,
    cells_across,
    in_planes,
    off_boundary,
    put_where_fluid_is,
    without_slivers,
)
from solvers.fluid.geometry.tied_slits import filled, slivers_of, without_slits
from solvers.fluid.grid.box import FLUSH, Grid
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.sheet_cells import on_sheets
from solvers.fluid.surfaces.surface import Motion
from solvers.mesh.gauss import tensor_weights
from solvers.mesh.tessellation import unit_normals

#: Layers of cells around those of a process that it cuts too, beyond those of the strip: roots may lie there.
MARGIN = 4

#: Share of fluid up to which a cell stays solid if surfaces touch in it, in steady flows. Forces and displacements of a
#: flap on a stop are the same to six digits from 1e-5 to 1e-3; 1e-2 takes wedges beside the contact for slits (8 %),
#: with 1e-6 and 1e-8 slits that contact leaves are open (force 4 and 11 % less).
SLIT = 1e-3


@dataclass(frozen=True)
class Cut:
    """The grid as cut by the surfaces at one time; cells are local and sorted."""

    uncut: Indices32  #: cells full of fluid
    cut: Indices32  #: cells with a piece of surface, or partly solid
    strip: Indices32  #: solid cells behind the surface to which the flow is extended
    ghost_faces: NDArray[np.int32]  #: faces between active cells, one of them cut or of the strip
    contact_cells: Indices32  #: solid cells where surfaces touch each other or the box's boundary
    special: NDArray[np.bool_]  #: cells of the box that were cut, or of the strip, in this step
    reach: NDArray[np.bool_]  #: local cells that the surfaces may cut or uncover in the next steps
    #: active cells of the whole mesh, for the cells that this process cuts: its own and those near
    is_active: NDArray[np.bool_]
    share: Array  #: share of fluid in these cells of the mesh, zero elsewhere and in the strip
    depth: int  #: layers of cells in the strip
    fluid: Array  #: int_fluid L_q dx / (w_q |K|) on cut cells, shape (cut, points)
    fraction: Array  #: share of fluid in each local cell
    pieces: Pieces
    film: Array | None  #: factor of the penalty, by cells of the box, below 1 in films; None: there are none
    creeping: NDArray[np.bool_] | None  #: cells of the box whose flow is that of films, `creeping_cells`
    gaps: NarrowGaps | None  #: gaps of a few cells, with first-order velocities; None: there are none
    facets: NDArray[np.int64]
    motion: Motion
    images: Images  #: of the surfaces, in the box and as far around it as the strip reaches

    @property
    def active(self) -> Indices32:
        """All cells with unknowns."""
        return np.sort(np.concatenate([self.uncut, self.cut, self.strip]))


class Cutter:
    """Cuts one grid by surfaces that move; `points` (n,) are the 1D points of the quadrature on cut cells.

    unions: where bodies overlap, the solid is their union. Else volumes are added up: bodies in contact overlap
    by facets that do not match, and slivers of fluid beside a contact zone would come and go.

    Within a step a cell that the cut penalty has acted on keeps it. Otherwise iterates that alternate between two
    sides of a face would change the system each time, and Newton's method would not converge. Surfaces that have not
    moved are not cut again. Films and gaps, where they are detected, are those of the first cut of a step.
    """

    def __init__(
        self,
        grid: DistributedGrid,
        points: Array,
        films: Films | None = None,
        gaps: GapFinder | None = None,
        *,
        unions: bool = False,
        tied: NDArray[np.bool_] | None = None,
        closing: NDArray[np.bool_] | None = None,
        steady: bool = True,
        periodic: tuple[int, ...] = (),
    ):
        """Masks of facets, None: of no one. tied: to another body; closing: whose slits stay closed in a step.

        periodic: axes of the box. With `sheets` around thin bodies no surface has images.

        In a steady flow those stay closed that have touched, up to a width. An unsteady one has a history on each side:
        there a cell that loses its fluid for the second time in a step stays solid until the step ends. Fluid in a
        wedge beside contact pulls it shut, and without fluid it opens.
        """
        self.grid, self.points, self.films, self.gaps, self.unions = grid, points, films, gaps, unions
        self._tied, self._closing, self._steady = tied, closing, steady
        self.periods, self._thin = Periods(grid.grid, periodic), grid.sheets is not None
        #: box cells in which surfaces touch in the latest cut, and those in which they did in this step, with `closing`
        self.closed, self._closed = (np.zeros(grid.grid.size, dtype=bool) for _ in range(2))
        self._open = np.full(grid.grid.size, steady)  #: box cells that had fluid in this step; steady: all
        #: box cells that had fluid again after they had closed in this step, and those that closed once more
        self._again, self._shut = (np.zeros(grid.grid.size, dtype=bool) for _ in range(2))
        self._own = grid.grid.as_box(grid.in_box)
        self._special = np.zeros(grid.grid.size, dtype=bool)
        self._depth = 0
        self._slivers = slivers_of(grid.grid)
        self._smallest = min(float(np.diff(edge).min()) for edge in grid.grid.edges)
        self._first: _First | None = None
        self._of_step: Cut | None = None
        self._whole: Cut | None = None  #: without surfaces
        self._unions = Unions(grid.grid, points)

    def on_coarse_cells(self, layers: int) -> bool:
        """Whether a coarser cell is within some layers of those with cut penalty, among the cells of this process."""
        nested = self.grid.nested
        if nested is None or not self._special.any():
            return False
        near = _grow(self.grid.grid.as_box(self._special), layers).ravel(order="F")
        return bool((near & nested.coarse).any())

    def begin_step(self) -> None:
        """Discard the cells with cut penalty of the last step, and those whose surfaces touch no more."""
        self._closed, self._open = self.closed & self._steady, np.full(len(self.closed), self._steady)
        self._again[:] = self._shut[:] = False
        self.forget()

    def restore(self, closed: NDArray[np.int64]) -> None:
        """Begin a step in which these cells of the box are closed."""
        self.closed[:] = False
        self.closed[closed] = True
        self.begin_step()

    def forget(self) -> None:
        """Discard the cells that have a cut penalty."""
        self._special[:] = False
        self._of_step = None
        self._depth = 0

    def __call__(
        self, facets: NDArray[np.int64], motion: Motion, layers: int, wet: NDArray[np.bool_] | None = None
    ) -> Cut:
        """The cut by surfaces, with so many layers of cells behind them kept active.

        wet: facets that the flow acts on. The others, and those on the boundary of the box, only close the solid.
        """
        if not len(facets):
            self._whole = self._whole or self._without_surfaces(facets, motion)
            return self._whole
        first, begins = self._first, not self._special.any()
        if first is not None and (begins or np.array_equal(self._special, first.special)):
            if (same := first.where(facets, motion, layers)) is not None:
                self._first = same
                self._special[:] = same.special
                self._of_step = self._of_step or same.cut
                return same.cut
        cut = self._cut(facets, motion, layers, wet)
        self._of_step = self._of_step or cut
        self._first = _First(cut, layers, self._special.copy()) if begins else None
        return cut

    def _cut(self, facets: NDArray[np.int64], motion: Motion, layers: int, wet: NDArray[np.bool_] | None) -> Cut:
        grid, box = self.grid, self.grid.grid
        if grid.sheets is not None:
            self._special[:] = False  # a cell behind a thin body is one of its other side
        self._depth = max(self._depth, layers)
        nearby = self._grow(self._own, self._depth + MARGIN)
        from_table = self.unions or grid.sheets is not None
        images = self.periods.images(facets, motion.x, 0 if self._thin else self._depth + 1)
        if self._thin:
            images.require_bodies(facets, motion.x)
        of, periodic = images.facet, self.periods.axes
        bodies, facets, given, motion = facets, images.facets, motion, images.motion(motion)
        tied, closing = (None if mask is None else mask[of] for mask in (self._tied, self._closing))
        x = without_slivers(box, facets, motion.x) if from_table else in_planes(box, motion.x)
        moments = kernels.moments(box.edges, self.points, x, facets, nearby.ravel(order="F"))
        normal = -unit_normals(motion.x[facets])
        off = off_boundary(box, motion.x[facets], periodic)
        counts = off & self.periods.inwards(images)
        counts = counts if wet is None else counts & wet[of]
        if tied is not None:
            moments = without_slits(moments, self.points, tied, counts, self._slivers)
        if closing is not None:
            still = self._closed & (moments.fraction > 1.0 - SLIT) if self._steady else self._shut
            moments = filled(moments, self.points, still)
            if grid.sheets is None:
                moments = without_closed(moments, facets, x, closing, FLUSH * self._smallest)
        piece_normal = normal[moments.piece_facet]
        if self.unions:
            moments, piece_normal = self._unions(moments, facets, x, normal, tied)
        # on sheets, and where contact is dry, cells that are solid except for rounding have no fluid
        dry = np.full(box.size, grid.sheets is not None)
        if closing is not None:
            dry[moments.cells[moments.piece_cell[closing[moments.piece_facet]]]] = True
        overlap = moments.fraction > np.where(dry, 1.0 - NOTHING, 1.0 + NOTHING)
        cells, piece_moments = put_where_fluid_is(box, self.points, moments, piece_normal, overlap)
        touched = counts[moments.piece_facet] & (cells >= 0)
        is_cut, in_use = self._cut_cells(moments, cells, touched)
        if grid.sheets is not None:
            is_cut[grid.sheets.touching] = True  # where bodies overlap, the sum of their volumes may exceed the cell
        solid = (moments.fraction >= 1.0 - NOTHING) & ~is_cut  # surfaces that touch keep their cells: they may part
        near = self._grow(box.as_box(is_cut), layers).ravel(order="F") if layers else is_cut
        strip = solid & (near | self._special)
        self._special |= is_cut | strip
        touching = solid & (self._facing(moments, counts, piece_normal) | self._covered(motion.x[facets[~off]]))
        if closing is not None:
            touching |= still
            self.closed = still.copy()
            self.closed[moments.cells[moments.piece_cell[closing[moments.piece_facet]]]] = True
            self.closed &= touching
            self._shut |= self.closed & self._again
            self._again |= self._closed & ~solid
            self._closed |= self.closed & self._open
            self._open |= ~solid
        if layers:
            touching |= solid & self._entered(motion.x[facets], layers)
        local_cut, local_strip = is_cut[grid.numbers], strip[grid.numbers]
        is_active = (~solid | strip) & np.isfinite(moments.fraction)
        active = is_active[grid.numbers]
        faces, sides = grid.find_interior_faces()
        special = self._special[grid.numbers][sides].any(axis=1) & active[sides].all(axis=1)
        cut = np.flatnonzero(local_cut).astype(np.int32)
        fluid = self._fluid_weights(moments, cut)
        row_of = np.full(box.size, -1, dtype=np.int64)
        row_of[grid.numbers[cut]] = np.arange(len(cut))
        rows = np.where(touched, row_of[cells], -1)
        mine = np.flatnonzero((rows >= 0) & in_use[cells])
        mine = mine[np.argsort(rows[mine], kind="stable")]
        pieces = Pieces(
            rows[mine],
            of[moments.piece_facet[mine]],
            piece_moments[mine],
            moments.piece_mass[mine],
            piece_normal[mine],
            moments.piece_facet[mine],
        )
        narrow = motion, facets, moments, piece_normal, np.where(touched & in_use[cells], cells, -1)
        film, gaps = self._film(*narrow, solid), self._gaps(*narrow, solid)
        share = np.where(is_active & ~strip, np.clip(1.0 - moments.fraction, 0.0, 1.0), 0.0)
        creeping = None if self._of_step is None else self._of_step.creeping
        if film is not None and self._of_step is None:
            creeping = creeping_cells(box, film, solid, share, periodic)
        found = Cut(
            uncut=np.flatnonzero(active & ~local_cut & ~local_strip).astype(np.int32),
            cut=cut,
            strip=np.flatnonzero(local_strip).astype(np.int32),
            ghost_faces=faces[special],
            contact_cells=np.flatnonzero(touching[grid.numbers]).astype(np.int32),
            special=self._special.copy(),
            reach=self._reach(box.as_box(self._special), layers),
            is_active=is_active,
            share=share,
            depth=self._depth,
            fluid=fluid,
            # cells that two bodies fill are solid once
            fraction=np.where(solid, 0.0, 1.0 - moments.fraction)[grid.numbers],
            pieces=pieces,
            film=film,
            creeping=creeping,
            gaps=gaps,
            facets=bodies,
            motion=given,
            images=images,
        )
        return found if grid.sheets is None else on_sheets(grid, self.points, found, counts)

    def _without_surfaces(self, facets: NDArray[np.int64], motion: Motion) -> Cut:
        """The cut without surfaces."""
        dim, points = self.grid.dim, len(self.points) ** self.grid.dim
        none, nothing = np.empty(0, dtype=np.int32), np.empty(0, dtype=np.int64)
        moments, mass, normal = np.empty((0, points, dim)), np.empty((0, dim, dim)), np.empty((0, dim))
        pieces = Pieces(nothing, nothing, moments, mass, normal, nothing)
        everything = np.arange(len(self.grid.numbers), dtype=np.int32)
        return Cut(
            everything,
            none,
            none,
            none,
            none,
            np.zeros(self.grid.grid.size, dtype=bool),
            np.zeros(len(everything), dtype=bool),
            np.ones(self.grid.grid.size, dtype=bool),
            np.ones(self.grid.grid.size),
            0,
            np.empty((0, points)),
            np.ones(len(everything)),
            pieces,
            None,
            None,
            None,
            facets,
            motion,
            Images(facets, motion.x, nothing, nothing),
        )

    def _film(self, motion: Motion, facets, moments, normal, cells, solid) -> Array | None:
        """Factor of the penalty in cells of the box, `Films.factor`; cells: that of each piece, negative: neglected."""
        if self._of_step is not None or self.films is None:
            return None if self._of_step is None else self._of_step.film
        return self.films.factor(self.grid.grid, self._walls(motion, facets, moments, normal, cells), solid)

    def _gaps(self, motion: Motion, facets, moments, normal, cells, solid) -> NarrowGaps | None:
        """Gaps of a few cells; arguments as in `_film`."""
        if self._of_step is not None or self.gaps is None:
            return None if self._of_step is None else self._of_step.gaps
        return self.gaps(self.grid.grid, self._walls(motion, facets, moments, normal, cells), solid)

    def _walls(self, motion: Motion, facets, moments, normal, cells) -> Walls:
        at = np.flatnonzero(cells >= 0)
        corners, lengths = facets[moments.piece_facet[at]], moments.piece_mass[at].sum(axis=2)
        return walls_of(cells[at], corners, motion.x, lengths, normal[at])

    def _reach(self, special: NDArray[np.bool_], layers: int) -> NDArray[np.bool_]:
        """Cells with cut penalty and one layer around them; without the layer around bodies at rest."""
        return self._grow(special, 1 if layers else 0).ravel(order="F")[self.grid.numbers]

    def _cut_cells(self, moments, cells, touched) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Box cells that are cut, and those whose pieces of surface are more than slivers."""
        area = np.bincount(cells[touched], moments.piece_mass[touched].sum(axis=(1, 2)), len(self._slivers))
        in_use = area > self._slivers
        return (moments.fraction > NOTHING) & (moments.fraction < 1.0 - NOTHING) | in_use, in_use

    def _facing(self, moments, counts, normal) -> NDArray[np.bool_]:
        """Box cells with surfaces that face each other, in them or in their faces: fluid enters if they separate."""
        number, size = moments.cells[moments.piece_cell], self.grid.grid.size
        across = cells_across(self.grid.grid, self.points, moments, self.periods.axes)
        area = moments.piece_mass.sum(axis=(1, 2)) * counts[moments.piece_facet]
        in_face = across >= 0
        number = np.concatenate([number, across[in_face]])
        area = np.concatenate([area, area[in_face]])
        outward = np.concatenate([normal, normal[in_face]])
        total = np.bincount(number, area, size)
        net = np.stack([np.bincount(number, area * n, size) for n in outward.T])
        return (total > 0.0) & (np.linalg.norm(net, axis=0) < 0.5 * total)

    def _covered(self, corners: Array) -> NDArray[np.bool_]:
        """Box cells around facets on the box's boundary: fluid enters them if the facets leave it."""
        box = self.grid.grid
        marked = np.zeros(box.size, dtype=bool)
        marked[cells_between(box, corners.min(axis=1), corners.max(axis=1))] = True
        return marked

    def _entered(self, corners: Array, layers: int) -> NDArray[np.bool_]:
        """Box cells that facets beyond the box's boundary may reach by a way of so many cells: fluid enters them."""
        box = self.grid.grid
        low, high = corners.min(axis=1), corners.max(axis=1)
        ends = np.array([[edge[0], edge[-1]] for edge in box.edges]).T
        way = layers * np.array([[edge[1] - edge[0], edge[-1] - edge[-2]] for edge in box.edges]).T
        near = ((high >= ends[0] - way[0]) & (low <= ends[1] + way[1])).all(axis=1)
        closed = [axis for axis in range(box.dim) if axis not in self.periods.axes]
        beyond = ((high <= ends[0]) | (low >= ends[1]))[:, closed].any(axis=1) & near
        marked = np.zeros(box.size, dtype=bool)
        marked[cells_between(box, low[beyond], high[beyond])] = True
        return self._grow(box.as_box(marked), layers - 1).ravel(order="F")

    def _grow(self, marked: NDArray[np.bool_], layers: int) -> NDArray[np.bool_]:
        """Marked cells and so many layers of neighbours, across vertices and ends of periods."""
        if layers == 0 or marked.all() or not self.periods.axes:
            return _grow(marked, layers)
        around = [(layers, layers) if axis in self.periods.axes else (0, 0) for axis in range(marked.ndim)]
        grown = _grow(np.pad(marked, around, mode="wrap"), layers)
        return grown[tuple(slice(a, n + a) for (a, _), n in zip(around, marked.shape, strict=True))]

    def _fluid_weights(self, moments, cut: Indices32) -> Array:
        """int_fluid L_q dx / (w_q |K|) on local cut cells, shape (cut, points)."""
        weights, numbers = tensor_weights(len(self.points), self.grid.dim), self.grid.numbers[cut]
        fluid = np.tile(1.0 - np.round(moments.fraction[numbers])[:, None], (1, len(weights)))
        row = np.minimum(np.searchsorted(moments.cells, numbers), len(moments.cells) - 1)
        has_moments = moments.cells[row] == numbers if len(moments.cells) else np.zeros(len(cut), dtype=bool)
        fluid[has_moments] = 1.0 - moments.solid[row[has_moments]] / weights
        return fluid


@dataclass(frozen=True)
class _First:
    """The first cut of a step, which is used again while the surfaces do not move."""

    cut: Cut
    layers: int
    special: NDArray[np.bool_]  #: box cells under the cut penalty

    def where(self, facets: NDArray[np.int64], motion: Motion, layers: int) -> _First | None:
        """This cut with the present velocities of the surfaces; None if their positions have changed."""
        cut = self.cut
        if (
            layers != self.layers
            or not np.array_equal(cut.motion.x, motion.x)
            or not np.array_equal(cut.facets, facets)
        ):
            return None
        return self if np.array_equal(cut.motion.v, motion.v) else replace(self, cut=replace(cut, motion=motion))


def cells_between(box: Grid, low: Array, high: Array) -> NDArray[np.int64]:
    """Numbers of the cells that boxes overlap, with repetitions; low, high: corners of the boxes [m], (boxes, dim)."""
    first, last = (
        [
            np.clip(np.searchsorted(edge, x[:, axis], side="right") - 1, 0, len(edge) - 2)
            for axis, edge in enumerate(box.edges)
        ]
        for x in (low, high)
    )
    spans = [b - a + 1 for a, b in zip(first, last, strict=True)]
    count = np.prod(spans, axis=0, dtype=np.int64)
    of = np.repeat(np.arange(len(low)), count)
    offset = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    number, stride = np.zeros(len(of), dtype=np.int64), 1
    for start, span, cells in zip(first, spans, box.shape, strict=True):
        number += stride * (start[of] + offset % span[of])
        offset //= span[of]
        stride *= cells
    return number


def _grow(marked: NDArray[np.bool_], layers: int) -> NDArray[np.bool_]:
    """Marked cells and so many layers of neighbours, across vertices."""
    if layers == 0 or marked.all():
        return marked
    return ndimage.binary_dilation(marked, np.ones((3,) * marked.ndim, dtype=bool), iterations=layers)
