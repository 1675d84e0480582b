"""The shape of bodies in cells: across them, and in the gaps between them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.background.box import Grid
from solvers.fluid.boundary.patch_kinds import PatchKind
from solvers.fluid.resolution.cells import BodyCells, GapCells
from solvers.fluid.resolution.gaps import Gaps, Plane, Samples, gaps, samples_of
from solvers.tessellation import unit_normals

#: Gaps up to so many cells count as such; the flow in wider ones is that around the body.
NARROW = 5.0
#: Cosine of the least angle between facets that meet in an edge of the body.
EDGE = 0.7


def walls_of_box(patches: Iterable[tuple[Sequence[str], PatchKind]]) -> list[tuple[Plane, str]]:
    """Faces of the box that hold the normal velocity, with their names; those that hold no other one mirror the flow.

    patches: faces and kind of each.
    """
    return [
        (Plane("xyz".index(face[0]), int(face[1] == "+"), kind.prescribed == "normal"), face)
        for faces, kind in patches
        if kind.normal_given
        for face in faces
    ]


def at_start(grid: Grid, planes: Sequence[tuple[Plane, str]], surfaces: Sequence[tuple[str, Array]]) -> list[BodyCells]:
    """Of bodies by (name, corners of their facets (facets, dim, dim) [m]), without a flow; planes: walls and names.

    Shares of the force are those of a film: what acts is proportional to 1 / gap^2.
    """
    if not surfaces:
        return []
    corners = np.concatenate([corners for _, corners in surfaces])
    owner = np.repeat(np.arange(len(surfaces)), [len(corners) for _, corners in surfaces])
    samples, names = samples_of(grid, corners), [name for name, _ in surfaces]
    found = gaps(grid, samples, [plane for plane, _ in planes])
    names += [face for _, face in planes]
    weight = samples.area / np.minimum(found.cells, 1e6) ** 2
    return [
        shape_of(number, samples, found, owner, names, weight, corners)
        for number in np.unique(owner[samples.facet]).tolist()
    ]


def shape_of(
    number: int, samples: Samples, found: Gaps, owner: NDArray[np.int64], names: list[str], weight: Array,
    corners: Array,
) -> BodyCells:  # fmt: skip
    """Of one body; owner: of each facet; names: of bodies and planes; weight: what acts at each sample."""
    some = np.flatnonzero(owner[samples.facet] == number)
    facets = np.unique(samples.facet[some])
    points = corners[owner == number].reshape(-1, corners.shape[2])
    extent = np.sort(np.ptp(points, axis=0))[1]
    across = np.average(1.0 / samples.across[some], weights=samples.area[some])
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)[facets].mean()
    total = max(float(weight[some].sum()), 1e-300)
    gap_list = tuple(_gaps_of(number, some, found, owner[samples.facet], names, weight / total))
    share = 1.0 - sum(gap.share for gap in gap_list)
    sharp = has_edges(corners[facets])
    return BodyCells(
        names[number], float(extent * across), np.nan, sharp, float(1.0 / (edges * across)), share, gap_list
    )


def _gaps_of(
    number: int, some: NDArray[np.int64], found: Gaps, owner: NDArray[np.int64], names: list[str], weight: Array
) -> Iterator[GapCells]:
    """The narrow gaps of a body, by what is opposite."""
    some = some[found.cells[some] < NARROW]
    bodies = len(names) - max((-found.partner).max(initial=0), 0)
    opposite = np.where(found.partner < 0, bodies - 1 - found.partner, owner[np.maximum(found.partner, 0)])
    for other in np.unique(opposite[some]).tolist():
        here = some[opposite[some] == other]
        w, cells = weight[here], np.maximum(found.cells[here], 1e-6)
        share = float(w.sum())
        mean = float(np.exp(np.average(np.log(cells), weights=w))) if share > 0.0 else float(cells.min())
        yield GapCells(names[number], names[other], mean, float(cells.min()), share)


def has_edges(corners: Array) -> bool:
    """Whether facets meet at an angle; corners: (facets, dim, dim), those that meet have equal corners."""
    normal = unit_normals(corners)
    dim = corners.shape[2]
    _, vertex = np.unique(corners.reshape(-1, dim), axis=0, return_inverse=True)
    vertex = vertex.reshape(corners.shape[:2])
    sides = (
        vertex
        if dim == 2
        else np.sort(np.concatenate([vertex[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]), axis=1)
    )
    keys = sides.reshape(-1) if dim == 2 else sides[:, 0] * (vertex.max(initial=0) + 1) + sides[:, 1]
    facet = np.repeat(np.arange(len(corners)), 2) if dim == 2 else np.tile(np.arange(len(corners)), 3)
    order = np.argsort(keys, kind="stable")
    keys, facet = keys[order], facet[order]
    meet = keys[1:] == keys[:-1]
    return bool((np.einsum("ni,ni->n", normal[facet[1:]], normal[facet[:-1]])[meet] < EDGE).any())
