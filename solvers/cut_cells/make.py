"""Makes the table of the fluid in cut cells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from solvers import kernels
from solvers.api import Array
from solvers.cut_cells.layer import flattened, walls
from solvers.cut_cells.surfaces import ClosedSurfaces
from solvers.cut_cells.table import CutTable


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
    (0, 1), for L_q; x: vertices of the surfaces [m], shape (vertices, dim); closing: length [m], fluid between facets
    that face each other is solid where the gap is at most this, 0: nowhere; only_exact: the exact kernel for all cells,
    slower by ten times and more.
    ValueError for arrays and lengths that do not fit, for cells that are too small beside the extent of the box and the
    surfaces (2^-41 of it), and for a surface whose facets do not turn the same way.
    """
    dim = surfaces.dim
    if len(edges) != dim or x.ndim != 2 or x.shape[1] != dim:
        raise ValueError(f"{dim} arrays of grid lines and vertices of shape (n, {dim}) must fit the facets")
    if not np.isfinite(x).all():
        raise ValueError(f"vertex {np.flatnonzero(~np.isfinite(x).all(axis=1))[0]} is not finite")
    smallest = min(float(np.diff(np.asarray(edge, float)).min()) for edge in edges)
    if closing and not 0.0 < closing <= 0.5 * smallest:
        raise ValueError(f"the closing length must be from 0 to half of the smallest cell, {0.5 * smallest:g}")
    facets, body, vertices, lines = surfaces.facets, surfaces.body, x, [np.asarray(edge, float) for edge in edges]
    height = 0.0
    if dim == 2:
        height = smallest
        facets, body, vertices = walls(facets, body, x, height)
        lines.append(np.array([0.0, height]))
    found = kernels.cut_cells(
        [np.ascontiguousarray(edge) for edge in lines],
        np.ascontiguousarray(points, dtype=float),
        np.ascontiguousarray(vertices, dtype=float),
        np.ascontiguousarray(facets, dtype=np.int64),
        np.ascontiguousarray(body, dtype=np.int64),
        closing,
        only_exact,
    )
    table = CutTable(
        shape=tuple(len(edge) - 1 for edge in lines),
        quantum=found.quantum,
        vertices=found.vertices,
        state=found.state,
        exact=found.kernel == 2,
        cell=found.cell,
        share=found.share,
        moments=found.moments,
        piece_region=found.piece_region,
        piece_facet=found.piece_facet,
        piece_body=body[found.piece_facet],
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
    return table if dim == 3 else flattened(table, len(x), height)
