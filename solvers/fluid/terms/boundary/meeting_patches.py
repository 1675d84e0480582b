"""Nodes on the boundary of the box at which patches with a given normal velocity meet.

A velocity that jumps from one patch to the next has at a common node the mean

    u_i = sum_p g_p(x_i) m_ip / sum_p m_ip,    m_ip = int_{faces of p} phi_i dA,

so that what flows through all faces is the sum over the patches p of what each lets in on its own, in any order. Only
faces across the component count: an inlet keeps its velocity up to the wall that begins at the edge of the box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array, Indices
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.space import Unknowns
from solvers.mesh.gauss import gauss, tensor_weights


@dataclass(frozen=True)
class MeetingPatches:
    """Pairs of a local velocity dof and a patch on faces around it, sorted by both."""

    dofs: Indices
    patches: Indices
    measures: Array  #: m_ip [m^(dim-1)], negative on faces at the start of an axis

    def last(self) -> tuple[Indices, Indices]:
        """(dofs, each once, the last patch of each)."""
        ends = np.flatnonzero(np.diff(self.dofs, append=-1))
        return self.dofs[ends], self.patches[ends]

    def shared(self) -> MeetingPatches:
        """The pairs of dofs with several patches."""
        _, place, count = np.unique(self.dofs, return_inverse=True, return_counts=True)
        several = count[place] > 1
        return MeetingPatches(self.dofs[several], self.patches[several], self.measures[several])

    def means(self, given: Array) -> tuple[Indices, Array]:
        """(dofs, each once, u_i) from g_p(x_i) by pairs."""
        dofs, place = np.unique(self.dofs, return_inverse=True)
        return dofs, np.bincount(place, self.measures * given) / np.bincount(place, self.measures)


def meeting_patches(
    grid: DistributedGrid, unknowns: Unknowns, cells: Sequence[tuple[int, str, NDArray[np.int32]]]
) -> MeetingPatches:
    """All pairs of a normal velocity and a patch that prescribes it (collective).

    cells: (number of a patch, face of the box such as 'x-', local cells of the faces of the patch on it), on every
    process the same patches and faces.
    """
    points, weights = gauss(unknowns.degree + 1)[0], tensor_weights(unknowns.degree + 1, grid.dim - 1)
    by_patch: dict[int, Array] = {}
    for number, face, all_cells in cells:
        axis, side = "xyz".index(face[0]), int(face[1] == "+")
        shapes, _ = fem.tabulate_lagrange(grid.domain, unknowns.degree, points_on_face(points, grid.dim, axis, side))
        on_face = fem.node_steps(grid.domain, unknowns.degree)[:, axis] == unknowns.degree * side
        own = all_cells[all_cells < grid.owned]
        areas = np.delete(grid.sizes[own], axis, axis=1).prod(axis=1)
        found = by_patch.setdefault(number, np.zeros(unknowns.local))
        shares = (2 * side - 1) * (weights @ shapes[:, on_face])
        np.add.at(found, unknowns.cell_velocity[own][:, on_face, axis], areas[:, None] * shares)
    pairs = []
    for number, found in by_patch.items():
        fem.add_ghosts(unknowns.space, found)
        if unknowns.hanging is not None:
            found[: unknowns.owned] = unknowns.hanging.rows(found[: unknowns.owned])
        found = fem.share_owned(unknowns.space, found)
        dofs = np.flatnonzero(found)
        pairs.append((dofs, np.full(len(dofs), number), found[dofs]))
    if not pairs:
        none = np.empty(0, dtype=np.int64)
        return MeetingPatches(none, none, np.empty(0))
    dofs, patches, measures = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    order = np.lexsort((patches, dofs))
    return MeetingPatches(dofs[order], patches[order], measures[order])


def points_on_face(points: Array, dim: int, axis: int, side: int) -> Array:
    """Tensor products of points on [0, 1] on a face of the unit cell, the lowest direction fastest, (points, dim)."""
    others = [i for i in range(dim) if i != axis]
    reference = np.full((len(points) ** len(others), dim), float(side))
    for k, i in enumerate(others):
        reference[:, i] = np.tile(np.repeat(points, len(points) ** k), len(points) ** (len(others) - 1 - k))
    return reference
