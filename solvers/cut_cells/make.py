"""Makes the table of the fluid in cut cells."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from solvers import kernels
from solvers.api import Array
from solvers.cut_cells.layer import flattened, wall_vertices, walls
from solvers.cut_cells.surfaces import ClosedSurfaces
from solvers.cut_cells.table import CutTable


class CrossingSurfaces(RuntimeError):
    """A surface crosses itself or another one in such a way that it has no inside."""


class CellCutter:
    """Makes tables of the same grid and facets: cells none of whose facets moved since the latest one are kept.

    A table is the same as that of `cut_cells` to the last bit. Arguments and errors are those of `cut_cells`.
    """

    def __init__(
        self,
        edges: Sequence[Array],
        points: Array,
        surfaces: ClosedSurfaces,
        *,
        closing: float = 0.0,
        only_exact: bool = False,
    ) -> None:
        self._dim = surfaces.dim
        lines = [np.asarray(edge, float) for edge in edges]
        if len(lines) != self._dim:
            raise ValueError(f"{self._dim} arrays of grid lines must fit the facets, not {len(lines)}")
        smallest = min(float(np.diff(edge).min()) for edge in lines)
        if closing and not 0.0 < closing <= 0.5 * smallest:
            raise ValueError(f"the closing length must be from 0 to half of the smallest cell, {0.5 * smallest:g}")
        self._surfaces, self._shape = surfaces, tuple(len(edge) - 1 for edge in lines)
        self._facets, self._body = surfaces.facets, surfaces.body
        self._height = smallest
        if self._dim == 2:
            self._facets, self._body = walls(surfaces.facets, surfaces.body)
            lines.append(np.array([0.0, smallest]))
        choices = (
            [np.ascontiguousarray(edge) for edge in lines],
            np.ascontiguousarray(points, dtype=float),
            np.ascontiguousarray(self._facets, dtype=np.int64),
            np.ascontiguousarray(self._body, dtype=np.int64),
            closing,
        )
        layer = self._dim == 2
        self._kernel = kernels.CellCutter(*choices, only_exact, layer)
        self._exact = partial(kernels.CellCutter, *choices, True, layer)

    def cut(self, x: Array, *, keep: bool = True) -> CutTable:
        """The table of vertices x [m], shape (vertices, dim); keep: cells for the next one. Raises CrossingSurfaces."""
        if x.ndim != 2 or x.shape[1] != self._dim:
            raise ValueError(f"vertices must have the shape (n, {self._dim}), not {x.shape}")
        if not np.isfinite(x).all():
            raise ValueError(f"vertex {np.flatnonzero(~np.isfinite(x).all(axis=1))[0]} is not finite")
        vertices = x if self._dim == 3 else wall_vertices(x, self._height)
        vertices = np.ascontiguousarray(vertices, dtype=float)
        try:
            found = self._kernel.cut(vertices, keep)
        except RuntimeError:  # cells of the fast kernel disagree on a face: a surface crosses itself
            try:
                found = self._exact().cut(vertices, False)
            except RuntimeError as error:
                raise CrossingSurfaces(*error.args) from None
        table = CutTable(
            shape=(*self._shape, 1) if self._dim == 2 else self._shape,
            quantum=found.quantum,
            vertices=found.vertices,
            state=found.state,
            exact=found.kernel == 2,
            cell=found.cell,
            share=found.share,
            moments=found.moments,
            piece_region=found.piece_region,
            piece_facet=found.piece_facet,
            piece_body=self._body[found.piece_facet],
            piece_moments=found.piece_moments,
            face_axis=found.face_axis,
            face_cells=found.face_cells,
            face_regions=found.face_regions,
            face_area=found.face_area,
            face_moments=found.face_moments,
            closed_cell=found.closed_cell,
            closed_facet=found.closed_facet,
            closed_moments=found.closed_moments,
        )
        return table if self._dim == 3 else flattened(table, self._height)


def cut_cells(
    edges: Sequence[Array],
    points: Array,
    surfaces: ClosedSurfaces,
    x: Array,
    *,
    closing: float = 0.0,
    only_exact: bool = False,
) -> CutTable:
    """The fluid outside of all bodies in the cells between grid lines.

    edges: increasing grid lines [m] of each direction, 2 or 3 arrays; points: n = 2, 3 or 5 increasing numbers in
    (0, 1), in 2D also 7, for L_q; x: vertices of the surfaces [m], shape (vertices, dim); closing: length [m], fluid
    between facets that face each other is solid where the gap is at most this, 0: nowhere; only_exact: the exact kernel
    for all cells, slower by ten times and more.
    ValueError for arrays and lengths that do not fit, for cells that are too small beside the extent of the box and the
    surfaces (2^-41 of it), and for a surface whose facets do not turn the same way.
    """
    return CellCutter(edges, points, surfaces, closing=closing, only_exact=only_exact).cut(x, keep=False)
