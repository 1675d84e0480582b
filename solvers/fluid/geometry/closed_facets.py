"""Facets in closed contact: they lie on a facet of another body, and no fluid is between the two.

A cell beside the end of a contact has fluid and closed surfaces. There the closed parts of both bodies bound no fluid,
or its pressure would act in the contact up to the end of the cell. The part of a facet M that a facet S on it covers
has the integrals of S: the barycentric coordinates of M are linear on S, so that with those of its vertices X_k in M

    int_S L_q mu_v ds = sum_k mu_v(X_k) int_S L_q lambda_k ds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices
from solvers.fluid.geometry.overlaps import Moments
from solvers.fluid.geometry.pieces import NOTHING
from solvers.mesh.tessellation import area_vectors


def without_closed(moments, facets: Indices, x: Array, closing: NDArray[np.bool_], flush: float):
    """Moments without the parts of surfaces that touch, in cells that have fluid.

    moments: of `kernels.moments`; x: vertices [m]; closing: mask of the facets that may lie on others; flush: distance
    [m] that is rounding.
    """
    cell = moments.cells[moments.piece_cell]
    some = _with_facing(moments, cell, area_vectors(x[facets])[moments.piece_facet])
    first, second = _pairs(cell[some], closing[moments.piece_facet[some]])
    corners = x[facets[moments.piece_facet[some]]]
    vectors = area_vectors(corners)
    facing = np.einsum("ni,ni->n", vectors[first], vectors[second]) < 0.0
    first, second = first[facing], second[facing]
    inside, there = _lies_on(corners[first], corners[second], flush)
    if not inside.any():
        return moments
    first, second, there = some[first[inside]], some[second[inside]], there[inside]
    kept = np.ones(len(cell), dtype=bool)
    kept[first] = False
    first, second, there = first[kept[second]], second[kept[second]], there[kept[second]]
    found, mass = moments.piece_moments.copy(), moments.piece_mass.copy()
    np.subtract.at(found, second, moments.piece_moments[first] @ there)
    np.subtract.at(mass, second, np.swapaxes(there, 1, 2) @ moments.piece_mass[first] @ there)
    pieces = (moments.piece_cell, moments.piece_facet, found, mass)
    return Moments(moments.fraction, moments.cells, moments.solid, *(part[kept] for part in pieces))


def _with_facing(moments, cell: Indices, vectors: Array) -> Indices:
    """Numbers of the pieces in cells with fluid and surfaces that face each other; vectors: of their facets [m^(d-1)].

    Of two pieces with opposite normals one does not look along the sum of the normals in the cell.
    """
    area, size = moments.piece_mass.sum(axis=(1, 2)), np.linalg.norm(vectors, axis=1)
    share = np.divide(area, size, out=np.zeros_like(area), where=size > 0.0)
    net = np.stack([np.bincount(cell, share * part, len(moments.fraction)) for part in vectors.T], axis=1)
    facing = np.zeros(len(moments.fraction), dtype=bool)
    facing[cell[np.einsum("ni,ni->n", vectors, net[cell]) <= 0.0]] = True
    return np.flatnonzero((facing & (moments.fraction < 1.0 - NOTHING))[cell])


def _pairs(cell: Indices, closing: NDArray[np.bool_]) -> tuple[Indices, Indices]:
    """Numbers of pieces in the same cell, the first one of a facet that may lie on another."""
    order = np.argsort(cell, kind="stable")
    start, end = (np.searchsorted(cell[order], cell[closing], side) for side in ("left", "right"))
    first = np.repeat(np.flatnonzero(closing), end - start)
    before = np.repeat(np.cumsum(end - start) - (end - start), end - start)
    second = order[np.arange(len(first)) - before + np.repeat(start, end - start)]
    others = first != second
    return first[others], second[others]


def _lies_on(corners: Array, others: Array, flush: float) -> tuple[NDArray[np.bool_], Array]:
    """(whether facets lie on others, coordinates of the vertices X_k in these), (n, k, v).

    corners, others: (n, dim, dim) [m].
    """
    edges = others[:, 1:] - others[:, :1]
    gram = edges @ np.swapaxes(edges, 1, 2)
    away = corners - others[:, :1]
    size = np.sqrt(np.trace(gram, axis1=1, axis2=2))
    flat = np.linalg.det(gram) <= 0.0
    gram[flat] = np.eye(edges.shape[1])
    inner = np.swapaxes(np.linalg.solve(gram, edges @ np.swapaxes(away, 1, 2)), 1, 2)
    there = np.concatenate([1.0 - inner.sum(axis=2, keepdims=True), inner], axis=2)
    distance = np.linalg.norm(there @ others - corners, axis=2).max(axis=1)
    within = there.min(axis=(1, 2)) >= -flush / np.maximum(size, flush)
    return (distance <= flush) & within & ~flat, there
