"""Neighbours in a mesh that lie on the same side of a facet they share, and facets of more than two cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import cell_facets

Indices = NDArray[np.int64]


def folded(mesh: Mesh, ids: Indices) -> Indices:
    """Pairs of cells of positive volume that have a facet in common and overlap there, shape (k, 2).

    ids: `facet_ids` of the mesh.

    Both run around the facet in the same direction, so that it bounds both on the same side; or a third cell has it.
    Facets with coinciding corners, of collapsed cells, are left out.
    """
    per_cell = len(CELL_TYPES[mesh.cell_type].facets)
    corners = cell_facets(mesh)[:, : CELL_TYPES[CELL_TYPES[mesh.cell_type].facet].corners]
    turn = np.where(_forward(corners), 1, -1)
    whole = (np.diff(np.sort(corners, axis=1), axis=1) > 0).all(axis=1)
    count = np.bincount(ids[whole], minlength=ids.max() + 1)
    sums = np.bincount(ids[whole], turn[whole], minlength=len(count))
    wrong = np.flatnonzero(whole & ((count[ids] > 2) | ((count[ids] == 2) & (sums[ids] != 0))))
    order = wrong[np.argsort(ids[wrong], kind="stable")]
    same = ids[order[1:]] == ids[order[:-1]]
    return np.stack([order[:-1][same], order[1:][same]], axis=1) // per_cell


def _forward(corners: Indices) -> NDArray[np.bool_]:
    """Whether the corner after the one with the smallest number has a smaller one than that before it."""
    rows, count = np.arange(len(corners)), corners.shape[1]
    first = corners.argmin(axis=1)
    after, before = corners[rows, (first + 1) % count], corners[rows, first - 1]
    return np.asarray(after < before) if count > 2 else np.asarray(first == 0)
