"""Closed contact that fluid reaches: the pressure in the zone where surfaces touch and no cell has fluid.

Facets in contact are wet, dry, or both in part. On their dry part D the pressure P is that of a thin layer at rest, and
on the wet facets W around, the rim, it is the p of the flow; P is linear on facets, continuous, and minimises

    1/2 int_D |grad_t P|^2 ds + 1/2 sum_W beta / h^2 int_W (P - p)^2 ds,    h^(dim-1): size of a facet,

so that div_t(grad_t P) = 0 and P = p at the rim. The zone gives the body the force int_D P n N_b ds beside that of the
flow. With a facet that opens or closes, wet and dry part change by turns: what it feels stays p = P.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from solvers.api import Array
from solvers.fluid.cut import Cut
from solvers.fluid.interface import InterfaceTerms
from solvers.fluid.shape import normal_derivative
from solvers.tessellation import area_vectors

#: beta; what P misses of p at the rim is of its size^-1.
RIM = 1e4
#: Share of a facet that does not count: rounding of areas.
SLIVER = 1e-9
#: Share of beta with which P is zero where no rim is.
NO_RIM = 1e-15


@dataclass(frozen=True)
class Facets:
    """Those of the zone and of its rim, the same on every process; m facets with d = dim vertices."""

    numbers: NDArray[np.int64]  #: among those of all surfaces, shape (m,)
    corners: NDArray[np.int64]  #: numbers in `vertices`, shape (m, d)
    vertices: NDArray[np.int64]  #: of the flow's surfaces
    x: Array  #: shape (m, d, dim)
    n: Array  #: unit normals out of the fluid, shape (m, dim)
    size: Array  #: [m^(dim-1)], shape (m,)
    dry: Array  #: int_D lambda_v lambda_w ds, shape (m, d, d)
    wet: Array  #: int_W lambda_v lambda_w ds, zero where it is no rim, shape (m, d, d)

    @property
    def rim(self) -> Array:
        """beta / h^2."""
        return RIM * self.size ** (-2.0 / (self.x.shape[2] - 1))

    def add_up(self, by_facet: Array) -> Array:
        """Sums at the vertices of values (m, d, ...)."""
        total = np.zeros((len(self.vertices), *by_facet.shape[2:]))
        np.add.at(total, self.corners, by_facet)
        return total


def find_facets(cut: Cut, at: InterfaceTerms, may_close: NDArray[np.bool_], comm: MPI.Comm) -> Facets | None:
    """None without a zone; may_close: facets that take part in contact (collective)."""
    d, x = cut.facets.shape[1], cut.motion.x[cut.facets]
    wet = np.zeros((len(cut.facets), d, d))
    np.add.at(wet, at.facet, at.mass_of_pieces)
    wet = comm.allreduce(wet)
    along = area_vectors(x)
    size = np.linalg.norm(along, axis=1)
    whole = size[:, None, None] * (1.0 + np.eye(d)) / (d * (d + 1))
    dry = np.where(may_close[:, None, None], whole - wet, 0.0)
    dry[dry.sum(axis=(1, 2)) <= SLIVER * size] = 0.0
    wet[wet.sum(axis=(1, 2)) <= SLIVER * size] = 0.0
    closed = dry.any(axis=(1, 2))
    if not closed.any():
        return None
    near = np.isin(cut.facets, cut.facets[closed]).any(axis=1)
    chosen = np.flatnonzero(closed | near & wet.any(axis=(1, 2)))
    vertices, corners = np.unique(cut.facets[chosen], return_inverse=True)
    n = -along[chosen] / size[chosen, None]
    corners = corners.reshape(-1, d)
    return Facets(chosen, corners, vertices, x[chosen], n, size[chosen], dry[chosen], wet[chosen])


def find_zone(cut: Cut, at: InterfaceTerms, may_close: NDArray[np.bool_], comm: MPI.Comm) -> ClosedZone | None:
    """That of a cut; None if all facets that may close are wet (collective)."""
    facets = find_facets(cut, at, may_close, comm)
    return None if facets is None else ClosedZone(facets, at, comm)


class ClosedZone:
    """Pressure and force of the zone for the pressure of the flow."""

    def __init__(self, facets: Facets, at: InterfaceTerms, comm: MPI.Comm):
        self.facets, self.comm, m = facets, comm, len(facets.size)
        self._at, d = at, facets.corners.shape[1]
        row = np.searchsorted(facets.numbers, at.facet)
        row[row == m] = 0
        rim = facets.wet.any(axis=(1, 2))
        self._pieces = np.flatnonzero((facets.numbers[row] == at.facet) & rim[row])  #: those of the rim
        self._facet = row[self._pieces]
        self._p, self._psi = at.p[self._pieces], at.psi[self._pieces]
        ones = (1.0 + np.eye(d)) / (d * (d + 1))
        blocks = self.share[:, None, None] * stiffness(facets.x, facets.size) + facets.rim[:, None, None] * (
            facets.wet + NO_RIM * facets.size[:, None, None] * ones
        )
        rows, columns = np.repeat(facets.corners, d, axis=1), np.tile(facets.corners, (1, d))
        shape = (len(facets.vertices),) * 2
        self._solve = splu(csc_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape)).solve
        self._shape = m, d

    @property
    def share(self) -> Array:
        """Of each facet, what is dry, shape (m,)."""
        return self.facets.dry.sum(axis=(1, 2)) / self.facets.size

    def _at_rim(self, by_piece: Array) -> Array:
        """Sums over the pieces of each facet on all processes (collective)."""
        total = np.zeros((self._shape[0], *by_piece.shape[1:]))
        np.add.at(total, self._facet, by_piece)
        return self.comm.allreduce(total)

    def _trace(self, flow: Array) -> Array:
        """int_W p lambda_v ds, shape (m, d) (collective)."""
        return self._at_rim(np.einsum("pav,pa->pv", self._psi, flow[self._p]))

    def pressure(self, flow: Array) -> Array:
        """P [Pa] at `vertices` for the flow at local dofs (collective)."""
        facets = self.facets
        return self._solve(facets.add_up(facets.rim[:, None] * self._trace(flow)))

    def _load(self, P: Array) -> Array:
        """int_D P lambda_v ds, shape (m, d)."""
        return np.einsum("fvw,fw->fv", self.facets.dry, P[self.facets.corners])

    def force(self, P: Array) -> Array:
        """On `vertices` [N], shape (n, dim)."""
        return self.facets.add_up(self._load(P)[:, :, None] * self.facets.n[:, None, :])

    # ----------------------------------------------------------------------------------------------- derivatives

    @cached_property
    def by_pressure(self) -> tuple[NDArray[np.int32], Array]:
        """(local dofs of the rim's pressure, dP at `vertices` by them)."""
        dofs, column = np.unique(self._p, return_inverse=True)
        facets, column = self.facets, column.reshape(self._p.shape)
        right = np.zeros((len(facets.vertices), len(dofs)))
        values = facets.rim[self._facet][:, None, None] * self._psi
        np.add.at(right, (facets.corners[self._facet][:, None, :], column[:, :, None]), values)
        return dofs, self._solve(right) if len(dofs) else right

    def force_by_flow(self) -> tuple[NDArray[np.int32], Array]:
        """(dofs, d force at `vertices` by them, shape (n, dim, dofs))."""
        dofs, slope = self.by_pressure
        return dofs, self._force_by_pressure(slope)

    def _force_by_pressure(self, slope: Array) -> Array:
        facets = self.facets
        load = np.einsum("fvw,fwk->fvk", facets.dry, slope[facets.corners])
        return facets.add_up(facets.n[:, None, :, None] * load[:, :, None, :])

    def force_by_motion(self, flow: Array) -> Array:
        """d force by positions of `vertices` and the trace of p that moves with them, shape (n, dim, n, dim).

        Shares of the dry part stay, as those of the pieces do in `shape` (collective).
        """
        facets, (count, dim) = self.facets, (len(self.facets.vertices), self.facets.x.shape[2])
        P, trace = self.pressure(flow), self._trace(flow)
        turn = normal_derivative(facets.x, facets.n)
        grown = np.einsum("fl,flvj->fvj", facets.n, turn)
        missing = np.einsum("fvw,fw->fv", facets.wet, P[facets.corners]) - trace
        grad = np.einsum("pa,paj->pj", flow[self._p], self._at.pressure_slope[self._pieces])
        mass = self._at.mass_of_pieces[self._pieces]
        area = mass.sum(axis=(1, 2))
        moved = self._at_rim(np.einsum("pvw,pj,p->pvwj", mass, grad, np.where(area > 0.0, 1.0 / area, 0.0)))
        rows = (dim - 3.0) / (dim - 1.0) * facets.rim[:, None, None, None] * missing[:, :, None, None] * grown[:, None]
        rows -= facets.rim[:, None, None, None] * moved
        rows += self.share[:, None, None, None] * stiffness_by_motion(facets.x, facets.size, grown, P[facets.corners])
        right = np.zeros((count, count, dim))
        np.add.at(right, (facets.corners[:, :, None], facets.corners[:, None, :]), rows)
        slope = -self._solve(right.reshape(count, -1)) if count else right.reshape(count, -1)
        found = self._force_by_pressure(slope).reshape(count, dim, count, dim)
        turned = np.einsum("fv,flwj->fvwlj", self._load(P), turn)
        axes = np.arange(dim)
        at = facets.corners[:, :, None, None, None], axes[:, None], facets.corners[:, None, :, None, None], axes
        np.add.at(found, at, turned)
        return found


def stiffness(x: Array, size: Array) -> Array:
    """int grad_t lambda_v . grad_t lambda_w ds on simplices with corners x, shape (m, d, d)."""
    G, _, inverse = _edges(x)
    return size[:, None, None] * (G @ inverse @ G.T)


def stiffness_by_motion(x: Array, size: Array, grown: Array, P: Array) -> Array:
    """d (K P)_v by x_wj, shape (m, d, d, dim), K of `stiffness`; grown: d ln(size), shape (m, d, dim).

    With edges J = x^T G and g = J^T J: K = |f| G g^-1 G^T, dg = dJ^T J + J^T dJ.
    """
    G, J, inverse = _edges(x)
    y = np.einsum("fab,vb,fv->fa", inverse, G, P)
    gradient = np.einsum("fja,fa->fj", J, y)
    value = size[:, None] * (y @ G.T)
    both = G @ inverse @ G.T
    back = np.einsum("va,fab,fjb->fvj", G, inverse, J)
    found = both[..., None] * gradient[:, None, None, :] + back[:, :, None, :] * (y @ G.T)[:, None, :, None]
    return value[:, :, None, None] * grown[:, None] - size[:, None, None, None] * found


def _edges(x: Array) -> tuple[Array, Array, Array]:
    """(G, J, g^-1)."""
    d = x.shape[1]
    G = np.concatenate([-np.ones((1, d - 1)), np.eye(d - 1)])
    J = np.einsum("fvj,va->fja", x, G)
    return G, J, np.linalg.inv(np.swapaxes(J, 1, 2) @ J)
