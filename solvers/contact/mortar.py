"""The mortar integrals of one slave surface and its masters, with full derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, nothing, sparse, stack
from solvers.api import Array
from solvers.contact.blocks import expand
from solvers.contact.images import ALONE, ways
from solvers.contact.patch import SlavePatch
from solvers.contact.surface import Surface
from solvers.kernels import MortarResult, mortar
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.search import OPPOSED

#: Largest distance to a master at which slave facets take part, relative to the longest edge; the motion is added.
REACH_OF_SLAVES = 0.3

#: Evaluations of a step after which facet pairs stay in use. With 12 instead of 3, the two tori need up to 14 Newton
#: iterations instead of 6.
KEEP_AFTER = 3

Integration = Literal["segments", "elements"]


@dataclass(frozen=True)
class MortarTerms:
    """Mortar integrals of ns slave and nm master nodes; columns: dofs of the patch, then of the masters."""

    D: Array  #: diagonal of D [m^(dim-1)], shape (ns,)
    M: Sparse  #: coupling [m^(dim-1)], shape (ns, nm)
    gap: Array  #: weighted gap [m^dim], positive where open, shape (ns,)
    dgap: Sparse  #: shape (ns, dim * (ns + nm))
    dforce: Sparse  #: derivative of the contact force at fixed multipliers, shape (dim * (ns + nm),) * 2
    area: Array  #: covered area of each slave facet [m^(dim-1)], shape (k,)
    used: NDArray[np.int32]  #: facet pairs that contributed, shape (p, 2)


@dataclass(frozen=True)
class Masters:
    """The masters of a slave surface as one surface; each keeps its own nodes."""

    facets: NDArray[np.int64]
    facet_type: str
    nodes: NDArray[np.int64]  #: among all nodes, shape (nm,)
    pair: NDArray[np.int64]  #: pair that each node belongs to, shape (nm,)
    pair_of_facet: NDArray[np.int64]  #: shape (k,)
    image: NDArray[np.int64]  #: number of the image of each node, see `solvers.contact.images`, shape (nm, dim)


def join_masters(
    surfaces: Sequence[Surface],
    nodes: Sequence[NDArray[np.int64]],
    pairs: Sequence[int],
    images: Sequence[tuple[int, ...]],
) -> list[Masters]:
    """Join masters by type of facet; triangles beside quadrilaterals become degenerate quadrilaterals."""
    kinds = {surface.facet_type for surface in surfaces}
    as_quads = {"triangle", "quad"} <= kinds
    found = []
    for kind in sorted(kinds - {"triangle"} if as_quads else kinds):
        facets, numbers, owner, of_facet, numbered, first = [], [], [], [], [], 0
        for surface, number, pair, image in zip(surfaces, nodes, pairs, images, strict=True):
            widen = as_quads and kind == "quad" and surface.facet_type == "triangle"
            if surface.facet_type != kind and not widen:
                continue
            facets.append(first + (surface.facets[:, [0, 1, 2, 2]] if widen else surface.facets))
            numbers.append(number)
            owner.append(np.full(len(number), pair))
            of_facet.append(np.full(len(surface.facets), pair))
            numbered.append(np.tile(image, (len(number), 1)))
            first += len(number)
        joined = np.ascontiguousarray(np.concatenate(facets), dtype=np.int64)
        found.append(Masters(joined, kind, *map(np.concatenate, (numbers, owner, of_facet, numbered))))
    return found


class FacetSearch(Protocol):
    """Finds facet pairs (slave, master) that may touch."""

    @property
    def clearance(self) -> float:
        """Distance [m] between the inflated boxes around both surfaces in the latest search; negative: they overlap."""
        ...

    def begin_step(self, pressed: NDArray[np.int64]) -> None:
        """Start a step; pressed: count of multipliers in contact of each slave facet."""
        ...

    def pairs(
        self, xs: Array, xm: Array, inflation: float, xs_previous: Array, xm_previous: Array
    ) -> NDArray[np.int32]:
        """Facet pairs that come closer than `inflation` [m] between previous and present positions, shape (p, 2)."""
        ...


class Mortar:
    """A slave surface, given by facets of a patch, and its masters: other surfaces, or itself in self contact."""

    def __init__(
        self,
        patch: SlavePatch,
        facets: NDArray[np.int64],
        edge: float,
        masters: Masters,
        integration: Integration,
        search: FacetSearch,
        deep: NDArray[np.int32] | None = None,
        periods: Array | None = None,
    ):
        """deep: facets that lie deep in each other's body at the start, see `overlap_at_start`, shape (p, 2).

        periods: lengths [m] after which space repeats, shape (dim,); None: it does not.
        """
        self._periods = periods if (masters.image != ALONE).any() else None
        self.way = np.zeros(masters.image.shape)  #: from the nodes of the masters to their images in this step [m]
        self.patch, self.masters, self.integration = patch, masters, integration
        self.search = search
        self._types = CELL_TYPES[patch.facet_type].kernel, CELL_TYPES[masters.facet_type].kernel
        self.facets = np.ascontiguousarray(facets, dtype=np.int64)
        self.edge = edge
        self._evaluations = 0
        self._kept = np.empty(0, dtype=np.int64)
        self._deep = np.empty(0, dtype=np.int64) if deep is None else np.unique(self._codes(deep))
        self._first: list[Array] = []  # positions [m] of both sides at the start, if facets are deep there
        self.interference = 0.0  #: largest overlap [m] that a pair asks for at present
        self.farther = 0.0  #: by which the reach is larger in this step [m], see `unheld`
        self.clear_until = -np.inf  #: travel [m], see `near`, up to which no facets can be near

    def start(self, x: Array) -> None:
        """Keep the facet pairs that lie deep in each other at the start; x: positions [m] of all nodes, (N, dim)."""
        self.clear_until = -np.inf
        self._place_images(x)
        if len(self._deep):
            self._first = [x[nodes] for nodes in (self.patch.nodes, self.masters.nodes)]
            self._kept = self._deep

    def begin_step(self, x: Array, active: NDArray[np.bool_]) -> None:
        """Discard the kept facet pairs, but for those that are deep in each other until something moves.

        x: positions [m] of all nodes, (N, dim); active: mask of the multipliers in contact, (C,).
        """
        self._evaluations, self.farther = 0, 0.0
        self._place_images(x)
        sides = (self.patch.nodes, self.masters.nodes)
        same = all(np.array_equal(x[nodes], first) for nodes, first in zip(sides, self._first, strict=False))
        self._kept = self._deep if same else np.empty(0, dtype=np.int64)
        self.search.begin_step(active[self.patch.multipliers][self.facets].sum(axis=1))

    def _place_images(self, x: Array) -> None:
        if self._periods is not None:
            slave, masters = x[self.patch.nodes[self.facets].ravel()], self.masters
            self.way = ways(slave, x[masters.nodes], masters.pair, masters.image, self._periods)

    def _at_masters(self, x: Array) -> Array:
        """Positions [m] of the nodes of the masters, or of their images, from those of all nodes."""
        return x[self.masters.nodes] if self._periods is None else x[self.masters.nodes] + self.way

    def _codes(self, facet_pairs: NDArray[np.int32]) -> NDArray[np.int64]:
        """One number for each facet pair, increasing with the pairs."""
        return facet_pairs[:, 0].astype(np.int64) * len(self.masters.facets) + facet_pairs[:, 1]

    def keep(self, used: NDArray[np.int32]) -> None:
        """Keep the used facet pairs of all processes until the next step, after KEEP_AFTER evaluations.

        The decision whether two facets contribute is discontinuous. Newton's method could alternate between two sets
        of pairs. Pairs may still be added, but none is removed.
        """
        self._evaluations += 1
        if self._evaluations >= KEEP_AFTER:
            self._kept = np.union1d(self._kept, self._codes(used))

    def near(
        self, x: Array, x_previous: Array, travel: float = 0.0, beyond: float = 0.0
    ) -> tuple[NDArray[np.int32], float]:
        """(facet pairs that may touch, the length [m] by which their reach is larger); x: positions [m] of all nodes.

        The reach grows by the largest motion of a node in this step, by the interference, by what a body that nothing
        holds looks farther, and by `beyond` [m], at most one edge.

        travel: upper bound of the path of any node so far [m]. When it has increased by s, each of the two boxes has
        grown by s at most, and the motion of a step, which inflates them, by 2 s. Hence boxes with a clearance of 4 s
        do not overlap, whatever `beyond` is.
        """
        if travel < self.clear_until and not len(self._kept):
            return np.empty((0, 2), dtype=np.int32), 0.0
        slave, master = self.patch.nodes, self.masters.nodes
        ways = (np.linalg.norm(x[nodes] - x_previous[nodes], axis=1) for nodes in (slave, master))
        motion = max(float(way.max(initial=0.0)) for way in ways) + max(self.interference, 0.0) + self.farther + beyond
        at_masters = self._at_masters(x), self._at_masters(x_previous)
        found = self.search.pairs(x[slave], at_masters[0], self.edge + motion, x_previous[slave], at_masters[1])
        self.clear_until = travel + (self.search.clearance - (self.edge - beyond)) / 4.0
        codes = self._codes(found)
        if len(self._kept) == 0 or np.isin(self._kept, codes).all():
            return found, motion
        together = np.union1d(codes, self._kept)
        count = len(self.masters.facets)
        return np.stack([together // count, together % count], axis=1).astype(np.int32), motion

    def evaluate(
        self,
        x: Array,
        normals: Array,
        dnormals: Sparse,
        facet_pairs: NDArray[np.int32],
        motion: float,
        z: Array,
    ) -> MortarTerms:
        """All terms at the positions x [m] of all nodes.

        normals, their derivatives and multipliers z [Pa] are those of the patch, shape (ns, dim); motion: see `near`.
        """
        slave, master = self.patch.nodes, self.masters.nodes
        ns, nm, dim = len(slave), len(master), x.shape[1]
        kept = np.isin(self._codes(facet_pairs), self._kept).astype(np.uint8)
        result = self._kernel(x, normals, facet_pairs, z=np.ascontiguousarray(z), kept=kept, **self._reach(motion))
        columns = dim * (ns + nm)
        dforce = self._total(result.dforce, result.dforce_dn, dnormals, columns, columns)
        if self._types[0] == "tri6":
            back, of_slave = expand(self.patch.basis()[1].T, dim), np.arange(columns) < dim * ns
            dforce = stack([back @ dforce[of_slave], dforce[~of_slave]])
        return MortarTerms(
            D=result.D,
            M=sparse(result.M, (ns, nm)),
            gap=result.gap,
            dgap=self._total(result.dgap, result.dgap_dn, dnormals, ns, columns),
            dforce=dforce,
            area=result.area,
            used=facet_pairs[result.used.astype(bool)],
        )

    def _kernel(self, x: Array, normals: Array, facet_pairs: NDArray[np.int32], **settings: Any) -> MortarResult:
        slave, master = np.ascontiguousarray(x[self.patch.nodes]), np.ascontiguousarray(self._at_masters(x))
        surfaces = slave, self.facets, self._types[0], master, self.masters.facets, self._types[1]
        return mortar(*surfaces, normals, facet_pairs, method=self.integration, **settings)

    def tie(self, x: Array, normals: Array, facet_pairs: NDArray[np.int32]) -> tuple[MortarTerms, Sparse, Sparse]:
        """(terms without derivatives, W, M) of tied surfaces at the positions x [m]."""
        slave, master = self.patch.nodes, self.masters.nodes
        ns, nm, columns = len(slave), len(master), x.shape[1] * (len(slave) + len(master))
        result = self._kernel(x, normals, facet_pairs, derivatives=False, own=True, **self._reach(0.0))
        W = sparse(result.W, (ns, ns)) @ self.patch.basis()[1]
        M = sparse(result.M, (ns, nm))
        none = nothing((ns, columns)), nothing((columns, columns))
        used = facet_pairs[result.used.astype(bool)]
        return MortarTerms(result.D, M, np.zeros(ns), *none, result.area, used), W, M

    def _reach(self, motion: float) -> dict[str, float]:
        return {"reach": self.edge + motion, "near": REACH_OF_SLAVES * self.edge + motion, "facing": OPPOSED}

    @staticmethod
    def _total(direct, by_normals, dnormals: Sparse, rows: int, columns: int) -> Sparse:
        """Derivative with respect to positions, directly and through the normals."""
        derivative = sparse(direct, (rows, columns))
        through = sparse(by_normals, (rows, dnormals.shape[0])) @ dnormals
        return derivative + _widen(through, columns) if len(through.data) else derivative

    def begin(self, x: Array, normals: Array, facet_pairs: NDArray[np.int32]) -> tuple[Array, Sparse, Sparse]:
        """(D, W, M) at the beginning of a step, for the slip, of facets up to one edge, or as `farther` says."""
        slave, master = self.patch.nodes, self.masters.nodes
        result = self._at_beginning(x, normals, facet_pairs)
        W = sparse(result.W, (len(slave), len(slave))) @ self.patch.basis()[1]
        return result.D, W, sparse(result.M, (len(slave), len(master)))

    def _at_beginning(self, x: Array, normals: Array, facet_pairs: NDArray[np.int32]) -> MortarResult:
        reach = self._reach(self.edge + self.farther)
        return self._kernel(x, normals, facet_pairs, derivatives=False, own=True, **reach)

    def covered(self, x: Array, normals: Array, facet_pairs: NDArray[np.int32]) -> Array:
        """int N~_k where masters cover the slave at the beginning of a step [m^(dim-1)]; none is negative.

        The dual functions have the sum 1, so that these are sums of int Phi_j N~_k.
        """
        slave = self.patch.nodes
        result = self._at_beginning(x, normals, facet_pairs)
        return sparse(result.W, (len(slave), len(slave))).T @ np.ones(len(slave))

    def areas(self, x: Array, normals: Array, facet_pairs: NDArray[np.int32], motion: float) -> Array:
        """Covered areas [m^(dim-1)], shape (ns,); arguments as of `evaluate`."""
        return self._kernel(x, normals, facet_pairs, derivatives=False, **self._reach(motion)).D

    def gap_vectors(
        self, x: Array, normals: Array, dnormals: Sparse, used: NDArray[np.int32]
    ) -> tuple[Array, list[Sparse]]:
        """(int Phi (x_m - x_s) over the used facet pairs, shape (ns, dim); derivatives of each component)."""
        return self._along_axes(x, normals, dnormals, used)[:2]

    def rises(
        self, x: Array, normals: Array, dnormals: Sparse, used: NDArray[np.int32]
    ) -> tuple[Array, list[Sparse], Sparse]:
        """(growth of the weighted gaps as the masters move along each axis, (ns, dim); its derivatives; those of D).

        int Phi n_m / (n_m . n) with the normals n_m of the masters, over the used facet pairs.
        """
        values, slopes, last = self._along_axes(x, normals, dnormals, used, rise=True)
        columns = x.shape[1] * (len(self.patch.nodes) + len(self.masters.nodes))
        return values, slopes, self._total(last.dD, last.dD_dn, dnormals, len(values), columns)

    def _along_axes(self, x: Array, normals: Array, dnormals: Sparse, used: NDArray[np.int32], **settings: Any):
        ns, nm, dim = len(self.patch.nodes), len(self.masters.nodes), x.shape[1]
        values, slopes = np.zeros((ns, dim)), []
        kept = np.ones(len(used), dtype=np.uint8)
        for axis in range(dim):
            result = self._kernel(x, normals, used, kept=kept, along=np.eye(dim)[axis], **settings)
            values[:, axis] = result.gap
            slopes.append(self._total(result.dgap, result.dgap_dn, dnormals, ns, dim * (ns + nm)))
        return values, slopes, result


def _widen(matrix: Sparse, columns: int) -> Sparse:
    return Sparse(matrix.data, matrix.indices, matrix.indptr, (matrix.shape[0], columns))
