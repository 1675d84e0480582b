"""How long films are, in cells, and whether they end at edges.

Between round walls the gap is g (1 + s^2 / l^2) at the distance s from its narrowest place, l^2 = 2 a g between a
cylinder or a sphere of the radius a and a plane. Flow and pressure change over l; a force ~ 1 / gap^2 acts in 0.8 pi l.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from solvers.api import Array

#: Gap up to which a film is measured, over its least one: a ninth of the force per area acts there. With 2 to 10 l is
#: the same to 10 % for gaps up to half of the radius.
WIDER = 3.0
#: l over the radius of a cylinder where the gap is two radii: in wider ones the flow is that around it.
LONGEST = 2.0
#: Cosine of the least angle between the film and the side on which it ends, and minus that of the largest.
SIDE = 0.7


def cells_along(cells: Array, covers: Array, normal: Array) -> float:
    """0.8 pi l of a film, counted in cells; infinite between parallel planes, along which nothing changes.

    cells: across the gap, at samples; covers: how many cells each covers; normal: unit normals, (n, dim).
    """
    order = np.argsort(cells)
    wider = cells[order] / max(float(cells[order[0]]), 1e-300)
    covered = np.cumsum(covers[order])
    reached = min(WIDER, float(wider[-1]))
    area = float(np.interp(reached, wider, covered - 0.5 * covers[order]) if wider[-1] > WIDER else covered[-1])
    length = _half(area, normal.shape[1]) / np.sqrt(max(reached - 1.0, 1e-12))
    mean = normal.mean(axis=0)
    turned = np.arccos(np.clip((normal @ mean).min() / max(float(np.linalg.norm(mean)), 1e-300), -1.0, 1.0))
    radius = _half(float(covered[-1]), normal.shape[1]) / max(float(turned), 1e-6)
    return float(0.8 * np.pi * min(length, LONGEST * radius))


def _half(area: float, dim: int) -> float:
    """Distance of the ends from the middle."""
    return 0.5 * area if dim == 2 else float(np.sqrt(area / np.pi))


def ends_at_edges(index: Array, normal: Array, film: Array, sharp: Array) -> bool:
    """Whether within a cell of the film another facet of its walls turns away from it, by an edge.

    index: position of all samples, counted in cells; film: numbers of the samples in the film; sharp: mask of the
    samples of bodies with edges.
    """
    film, others = film[sharp[film]], np.flatnonzero(sharp)
    if not len(film):
        return False
    near = cKDTree(index[film]).sparse_distance_matrix(cKDTree(index[others]), 1.0, output_type="coo_matrix")
    slope = np.einsum("ni,ni->n", normal[film[near.row]], normal[others[near.col]])
    return bool((np.abs(slope) < SIDE).any())
