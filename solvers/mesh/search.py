"""Search: pairs of slave and master facets that may touch. Only these are passed to the mortar kernel."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.api import Array, FailureKind, StepFailed
from solvers.kernels import KdopTree2, KdopTree3

#: Volume of a tree's nodes, relative to that when it was built, above which it is rebuilt, at the cost of 4 refits.
REBUILD_ABOVE = 2.0

#: Product of the unit normals below which facets can touch: they face each other within 60 degrees. From -0.35 to -0.65
#: results are the same.
OPPOSED = -0.5

Facets = NDArray[np.int64]  #: node indices in VTK order, shape (k, nodes per facet)
Tree: TypeAlias = KdopTree2 | KdopTree3


class Search:
    """Facet pairs of two surfaces, by a tree of k-DOPs on each, which is built when they first come near.

    Facets: line2, line3 (2D), tri3, quad4, tri6, quad9 (3D). The result depends on the arguments of `pairs` only, not
    on earlier calls. An object must not be used by several threads at a time.
    """

    def __init__(self, slave_facets: Facets, master_facets: Facets):
        self._slave_facets = np.ascontiguousarray(slave_facets, dtype=np.int64)
        self._master_facets = np.ascontiguousarray(master_facets, dtype=np.int64)
        self.trees: tuple[Tree, Tree] | None = None
        self.clearance = -np.inf  #: distance [m] of the inflated boxes in the latest search; negative: they overlap

    def begin_step(self, pressed: NDArray[np.int64]) -> None:
        """Nothing to do: slave and master are given."""

    def pairs(
        self,
        xs: Array,
        xm: Array,
        inflation: ArrayLike,
        xs_previous: Array | None = None,
        xm_previous: Array | None = None,
    ) -> NDArray[np.int32]:
        """All (slave facet, master facet) closer than `inflation`, and some others, shape (p, 2), sorted.

        xs, xm: positions of the nodes [m], (n, dim); inflation [m]: one number, or one per slave facet. With previous
        positions, pairs that come so close on straight paths of the nodes are included.
        Raises ValueError if shapes do not fit, StepFailed if a position is not finite.
        """
        path_s, path_m = _path(xs, xs_previous), _path(xm, xm_previous)
        if not all(np.isfinite(x).all() for x in path_s + path_m):
            reason = "positions of contact surfaces are not finite: take a smaller time step"
            raise StepFailed("contact", FailureKind.NOT_FINITE, reason)
        radii = np.ascontiguousarray(np.broadcast_to(np.asarray(inflation, float), len(self._slave_facets)))
        if self.trees is None:
            kdop_tree = KdopTree2 if np.shape(xs)[1] == 2 else KdopTree3
            self.trees = kdop_tree(self._slave_facets), kdop_tree(self._master_facets)
        slave, master = self.trees

        low_s, high_s = slave.box(*path_s)
        low_m, high_m = master.box(*path_m)
        self.clearance = float(np.maximum(low_s - high_m, low_m - high_s).max() - radii.max())
        if self.clearance > 0.0:
            return np.empty((0, 2), np.int32)
        update(slave, path_s, radii)
        update(master, path_m, np.zeros(len(self._master_facets)))
        return slave.candidates(master)[0]


def _path(x: Array, x_previous: Array | None) -> list[Array]:
    return [np.ascontiguousarray(y, float) for y in (x, x_previous) if y is not None]


def update(tree: Tree, path: list[Array], radii: Array) -> None:
    x, *previous = path
    tree.refit(x, radii, *previous)
    if tree.quality() > REBUILD_ABOVE:
        tree.build(x, radii, *previous)
