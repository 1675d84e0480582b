"""Distribution of the work of the mortar kernel over processes, and the sum of its results."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.api import Array

#: Cost of a facet pair that overlaps relative to one that does not, measured in the benchmark of the kernel.
OVERLAP_COST = 10.0


class Shares:
    """Slave facets in contiguous ranges of equal cost, estimated from the overlaps of the last evaluation."""

    def __init__(self, comm: MPI.Comm):
        self.comm = comm
        self._met: dict[int, NDArray[np.bool_]] = {}
        self._most = np.zeros(2)  # sums over evaluations of the work of the busiest process ...
        self._mean = 0.0  # ... and of the mean

    def begin_step(self) -> None:
        """Discard the overlaps of the last step: a resumed run does not have them, and must give the same results."""
        self._met.clear()

    def mine(self, pair: int, facet_pairs: NDArray[np.int32], facets: int) -> NDArray[np.int32]:
        """The facet pairs that this process integrates; all pairs of a slave facet have the same process."""
        if self.comm.size == 1 or len(facet_pairs) == 0:
            return facet_pairs
        return np.ascontiguousarray(facet_pairs[self.owners(pair, facet_pairs, facets) == self.comm.rank])

    def owners(self, pair: int, facet_pairs: NDArray[np.int32], facets: int) -> NDArray[np.int64]:
        """Process of each facet pair, shape (p,); facets: count of slave facets."""
        met = self._met.get(pair, np.ones(facets, dtype=bool))
        cost = np.cumsum(np.where(met[facet_pairs[:, 0]], OVERLAP_COST, 1.0))
        owner = np.minimum((cost / cost[-1] * self.comm.size).astype(int), self.comm.size - 1)
        return owner[np.searchsorted(facet_pairs[:, 0], facet_pairs[:, 0])]  # the first pair of a facet decides

    def measure(
        self, pair: int, facet_pairs: NDArray[np.int32], used: NDArray[np.int32], facets: int
    ) -> NDArray[np.float64]:
        """Work of each process with equal counts of facets, and with the present distribution, shape (2, processes).

        used: the pairs that overlap. Call it before `combine`.
        """
        size = self.comm.size
        if size == 1:
            return np.zeros((2, 1))
        overlaps = np.isin(_codes(facet_pairs), _codes(used))
        cost = np.where(overlaps, OVERLAP_COST, 1.0)
        owners = facet_pairs[:, 0].astype(np.int64) * size // facets, self.owners(pair, facet_pairs, facets)
        return np.stack([np.bincount(owner, cost, size) for owner in owners])

    def note(self, work: NDArray[np.float64]) -> None:
        """Add the work of one evaluation, shape (2, processes)."""
        self._most += work.max(axis=1)
        self._mean += float(work[0].mean())

    @property
    def imbalance(self) -> dict[str, float]:
        """Work of the busiest process over the mean, of all evaluations: `before` with equal counts of facets."""
        if self._mean == 0.0:
            return {}
        return {"before": float(self._most[0] / self._mean), "after": float(self._most[1] / self._mean)}

    def combine(self, pair: int, area: Array) -> Array:
        """Covered area of all slave facets, from that of this process; the next distribution uses it."""
        total = self.total(area)
        self._met[pair] = total > 0.0
        return total

    def together(self, part: NDArray[np.int32]) -> NDArray[np.int32]:
        """The rows of all processes together."""
        return part if self.comm.size == 1 else np.concatenate(self.comm.allgather(part))

    def total(self, part: Any) -> Any:
        """Sum of arrays or sparse matrices over the processes, in the order of ranks: the same on all of them."""
        if self.comm.size == 1:
            return part
        parts = self.comm.allgather(part)
        return sum(parts[1:], parts[0])

    def total_of(self, *parts: Any) -> tuple[Any, ...]:
        """`total` of several arrays or matrices in one message."""
        if self.comm.size == 1:
            return parts
        gathered = self.comm.allgather(parts)
        return tuple(sum(found[1:], found[0]) for found in zip(*gathered, strict=True))


def _codes(facet_pairs: NDArray[np.int32]) -> NDArray[np.int64]:
    return facet_pairs[:, 0].astype(np.int64) << 32 | facet_pairs[:, 1]
