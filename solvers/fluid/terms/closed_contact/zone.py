"""Fluid pressure in closed contact: on facets that touch another surface, so that no cell of the flow is in front.

On the dry part D of facets the pressure P is that of a thin layer of fluid, continued from the pressure p of the flow
on the wet parts W around (docs/theory_fsci.md, Wetted zone). P is linear on facets, and minimises

    1/2 int_D |grad_t P|^2 ds + 1/2 sum_W beta / h^2 int_W (P - p)^2 ds,    h^(dim-1): size of a facet.

The force of the zone on the body is int_D P n N_b ds, in addition to that of the flow.
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
from solvers.fluid.cut.cut import Cut
from solvers.fluid.terms.interface import InterfaceTerms
from solvers.fluid.terms.shape_derivatives.shape import normal_derivative
from solvers.mesh.tessellation import area_vectors

#: beta; the difference of P and p at the rim is proportional to 1 / beta. Forces are the same to 3e-4 from 1e3 to 1e7.
RIM = 1e4
#: Smallest dry or wet share of a facet, above the rounding of areas.
SLIVER = 1e-9
#: Share of beta that penalises P everywhere: it makes P zero in a zone without rim.
NO_RIM = 1e-15


@dataclass(frozen=True)
class Facets:
    """Facets of the zone and of its rim, the same on every process: m facets with d = dim vertices each."""

    numbers: NDArray[np.int64]  #: number of each among the facets of all surfaces, shape (m,)
    corners: NDArray[np.int64]  #: indices into `vertices`, shape (m, d)
    vertices: NDArray[np.int64]  #: numbers among the vertices of all surfaces, shape (n,)
    x: Array  #: positions of the corners [m], shape (m, d, dim)
    n: Array  #: unit normals out of the fluid, shape (m, dim)
    size: Array  #: [m^(dim-1)], shape (m,)
    dry: Array  #: int_D lambda_v lambda_w ds, shape (m, d, d)
    wet: Array  #: int_W lambda_v lambda_w ds, zero on facets that are not of the rim, shape (m, d, d)

    @property
    def rim(self) -> Array:
        """beta / h^2 [1/m^2], shape (m,)."""
        return RIM * self.size ** (-2.0 / (self.x.shape[2] - 1))

    def add_up(self, by_facet: Array) -> Array:
        """Sums at the vertices of values (m, d, ...)."""
        total = np.zeros((len(self.vertices), *by_facet.shape[2:]))
        np.add.at(total, self.corners, by_facet)
        return total


def find_facets(cut: Cut, at: InterfaceTerms, may_close: NDArray[np.bool_], comm: MPI.Comm) -> Facets | None:
    """Facets of the zone of a cut; None if there is no zone (collective).

    at: terms of the wet pieces of surface; may_close: which facets take part in contact.
    """
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
    """The zone of a cut; None if all facets that may close are wet (collective)."""
    facets = find_facets(cut, at, may_close, comm)
    return None if facets is None else ClosedZone(facets, at, comm)


class ClosedZone:
    """Pressure and force of the zone as linear functions of the pressure of the flow."""

    def __init__(self, facets: Facets, at: InterfaceTerms, comm: MPI.Comm):
        self.facets, self.comm, m = facets, comm, len(facets.size)
        self._at, d = at, facets.corners.shape[1]
        row = np.searchsorted(facets.numbers, at.facet)
        row[row == m] = 0
        rim = facets.wet.any(axis=(1, 2))
        self._pieces = np.flatnonzero((facets.numbers[row] == at.facet) & rim[row])  #: pieces of the rim
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
        """Dry share of each facet, shape (m,)."""
        return self.facets.dry.sum(axis=(1, 2)) / self.facets.size

    def _at_rim(self, by_piece: Array) -> Array:
        """Sums over the rim's pieces of each facet on all processes, shape (m, ...) (collective)."""
        total = np.zeros((self._shape[0], *by_piece.shape[1:]))
        np.add.at(total, self._facet, by_piece)
        return self.comm.allreduce(total)

    def _trace(self, flow: Array) -> Array:
        """int_W p lambda_v ds, shape (m, d) (collective)."""
        return self._at_rim(np.einsum("pav,pa->pv", self._psi, flow[self._p]))

    def pressure(self, flow: Array) -> Array:
        """P [Pa] at `vertices`, shape (n,), for the flow at local dofs (collective)."""
        facets = self.facets
        return self._solve(facets.add_up(facets.rim[:, None] * self._trace(flow)))

    def _load(self, P: Array) -> Array:
        """int_D P lambda_v ds [N], shape (m, d)."""
        return np.einsum("fvw,fw->fv", self.facets.dry, P[self.facets.corners])

    def force(self, P: Array) -> Array:
        """Force [N] of the zone on `vertices`, shape (n, dim)."""
        return self.facets.add_up(self._load(P)[:, :, None] * self.facets.n[:, None, :])

    # ----------------------------------------------------------------------------------------------- derivatives

    @cached_property
    def by_pressure(self) -> tuple[NDArray[np.int32], Array]:
        """(local pressure dofs of the rim, derivatives of P at `vertices` by them, shape (n, dofs))."""
        dofs, column = np.unique(self._p, return_inverse=True)
        facets, column = self.facets, column.reshape(self._p.shape)
        right = np.zeros((len(facets.vertices), len(dofs)))
        values = facets.rim[self._facet][:, None, None] * self._psi
        np.add.at(right, (facets.corners[self._facet][:, None, :], column[:, :, None]), values)
        return dofs, self._solve(right) if len(dofs) else right

    def force_by_flow(self) -> tuple[NDArray[np.int32], Array]:
        """(local pressure dofs of the rim, derivatives of the force on `vertices` by them, shape (n, dim, dofs))."""
        dofs, slope = self.by_pressure
        return dofs, self._force_by_pressure(slope)

    def _force_by_pressure(self, slope: Array) -> Array:
        facets = self.facets
        load = np.einsum("fvw,fwk->fvk", facets.dry, slope[facets.corners])
        return facets.add_up(facets.n[:, None, :, None] * load[:, :, None, :])

    def force_by_motion(self, flow: Array) -> Array:
        """Derivatives of the force by the positions of `vertices`, shape (n, dim, n, dim) (collective).

        They include that of the trace of p, which moves with the surface. The dry share of a facet is held constant, as
        the shares of pieces are in `shape`.
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
    """Derivatives of (K P)_v by x_wj, shape (m, d, d, dim), with K of `stiffness`; grown: d ln(size), (m, d, dim).

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
    """(G: gradients in the reference simplex, (d, d - 1); J, (m, dim, d - 1); g^-1, (m, d - 1, d - 1))."""
    d = x.shape[1]
    G = np.concatenate([-np.ones((1, d - 1)), np.eye(d - 1)])
    J = np.einsum("fvj,va->fja", x, G)
    return G, J, np.linalg.inv(np.swapaxes(J, 1, 2) @ J)
