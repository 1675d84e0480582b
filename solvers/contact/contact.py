"""Frictionless contact between surfaces: multipliers, active set and the terms of one iterate."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.api import Array, State
from solvers.contact.active_set import ActiveSet
from solvers.contact.condense import Linearised, condense, expand, place_columns, recover
from solvers.contact.distance import distances
from solvers.contact.held import lent_shares
from solvers.contact.pair import KEEP_AFTER, Pair
from solvers.contact.share import Shares
from solvers.contact.surface import Nodes, Surface, nodal_areas, number_nodes
from solvers.contact.terms import Sides, Terms, total_terms
from solvers.rows import RowChanges

#: Share of a slave node's area that must see a master, and the share with which a node that did in this step still may.
LEAST_COVERED, LEAST_KEPT = 0.02, 0.01

#: Gap, as a share of the extent of all surfaces, up to which nodes without pressure touch: rounding of positions.
TOUCHING = 1e-12


class Contact:
    """All pairs together. Positions and multipliers are arrays over `nodes`, the same on every process.

    z are the multipliers [Pa]: the negative traction on the slave, z_n = n.z >= 0 the contact pressure.

    keep_overlap: a node whose gap is negative at the start of a step need not close it in the step, only not deepen it.
    That happens where a slave slides onto a master: a node bends into it unseen. Closed at once it would be shot away;
    kept, contact does no work: z_n (g_{n+1} - g_n) <= 0 always. For dynamics; the first step closes all there is.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        pairs: Sequence[Pair],
        *,
        names: Sequence[str] = (),
        c_n: float = 1.0,
        keep_overlap: bool = False,
    ):
        surfaces: list[Surface] = []
        for pair in pairs:
            surfaces += [s for s in (pair.slave, pair.master) if not any(s is known for known in surfaces)]
        self.comm, self.pairs, self.surfaces = comm, list(pairs), surfaces
        self.names = tuple(names) or tuple(f"pair{i}" for i in range(len(pairs)))
        self.nodes: Nodes = number_nodes(surfaces)
        numbers = self.nodes.of_surface
        self._sides: list[Sides] = [
            (numbers[_index(surfaces, pair.slave)], numbers[_index(surfaces, pair.master)]) for pair in pairs
        ]
        self.size, self.dim = self.nodes.points.shape
        self.z = np.zeros((self.size, self.dim))
        self.x = self.nodes.points.copy()
        self._x_old = self.x.copy()
        self.active_set = ActiveSet(self.size, c_n)
        self._keep_overlap = keep_overlap
        self._gap = np.zeros(self.size)  # weighted gap at the latest evaluation
        self._overlap = np.zeros(self.size)  # how much of it may stay negative, <= 0
        self._seen = np.zeros(self.size, dtype=bool)  # nodes that could have a constraint in this step
        self._evaluations = 0
        self._areas = nodal_areas(self.size, [pair.slave for pair in pairs], [slave for slave, _ in self._sides])
        self._scale = np.zeros(self.size)
        self._touching = TOUCHING * float(np.ptp(self.nodes.points, axis=0).max())
        self._shares = Shares(comm)
        self.time = np.nan  #: of the latest evaluation [s]
        self.touched_at = np.full(len(self.pairs), np.inf)  #: when each pair first touched [s], as probes have noted it
        self.terms: Terms | None = None
        facets = [slave[pair.slave.facets] for pair, (slave, _) in zip(self.pairs, self._sides, strict=True)]
        self._lent = lent_shares(facets, self.nodes.held.all(axis=1) & (self._areas > 0.0))
        #: rows of slave nodes in the basis of the multipliers, if that is not the nodal one (tri6)
        self.transformation = self._transformation()

    def _with_lent(self, rows):
        """Rows (of gap, D, M, ...) of nodes plus those of the functions that are lent to them."""
        return rows if self._lent is None else rows + self._lent.T @ rows

    def _transformation(self) -> sp.csr_matrix | None:
        if all(pair.slave.facet_type != "triangle6" for pair in self.pairs):
            return None
        total = sp.identity(self.size, format="lil")
        for pair, (slave, _) in zip(self.pairs, self._sides, strict=True):
            total[np.ix_(slave, slave)] = pair.transformation.toarray()
        return expand(total.tocsr(), self.dim)

    # ------------------------------------------------------------------------------------------------- steps

    def start(self, u: Array, stiffness: Array, t: float) -> None:
        """Take the positions at the start and the diagonal of the stiffness [N/m]; both of shape (N, dim)."""
        slaves = self._areas > 0.0
        self._scale[slaves] = stiffness.mean(axis=1)[slaves] / self._areas[slaves]
        self.x = self.positions(u, t)
        self._x_old = self.x.copy()

    def positions(self, u: Array, t: float) -> Array:
        """Current positions [m] of all nodes from the displacements of the deformable ones, shape (N, dim)."""
        x = self.nodes.points + u
        for surface, numbers in zip(self.surfaces, self.nodes.of_surface, strict=True):
            if surface.motion is not None:
                x[numbers] = surface.motion(t)
        return x

    def begin_step(self) -> None:
        """Facets may have moved from here on."""
        self._x_old = self.x.copy()
        if self._keep_overlap:
            self._overlap = np.minimum(0.0, self._gap)
        self._seen[:] = False
        self._evaluations = 0
        self.active_set.begin_step()
        self._shares.begin_step()
        for pair in self.pairs:
            pair.begin_step()

    def evaluate(self, u: Array, t: float) -> None:
        """Mortar terms and active set at the displacements u, shape (N, dim), of the present iterate."""
        self.x = self.positions(u, t)
        self.time = t
        self.terms = self._evaluate_pairs()
        self._gap = np.zeros(self.size) if self.terms is None else self._with_lent(self.terms.gap)
        if self.terms is None:
            self.active_set.clear()
        else:
            covered = self._may_touch(self.terms)
            D = self._with_lent(self.terms.D)
            mean_gap = np.divide(self._gap - self._overlap, D, out=np.ones(self.size), where=covered)
            pressure = np.einsum("nd,nd->n", self.z, self.terms.normals)
            self.active_set.update(pressure, mean_gap - self._touching, self._scale, covered)
        self._set_multipliers(np.where(self.active_set.active[:, None], self.z, 0.0))

    def _set_multipliers(self, own: Array) -> None:
        self.z[:] = own if self._lent is None else own + self._lent @ own

    def _may_touch(self, terms: Terms) -> NDArray[np.bool_]:
        """Nodes that can have a constraint. As for facet pairs: from some evaluation on none of them goes again."""
        found = self._covered(terms)
        found |= self._seen & self._covered(terms, LEAST_KEPT)
        self._evaluations += 1
        if self._evaluations >= KEEP_AFTER:
            self._seen |= found
        return found & ~self.nodes.held.all(axis=1)

    def _covered(self, terms: Terms, least: float = LEAST_COVERED) -> NDArray[np.bool_]:
        """Nodes that see enough of a master for a constraint: less is a sliver that comes and goes."""
        return terms.D > least * np.maximum(self._areas, np.finfo(float).tiny)

    def _evaluate_pairs(self) -> Terms | None:
        """Terms of all pairs, each process doing its share of the slave facets; None if no facets are near."""
        pieces = []
        for index, (pair, (slave, master)) in enumerate(zip(self.pairs, self._sides, strict=True)):
            facet_pairs, motion = pair.near(self.x[slave], self.x[master], self._x_old[slave], self._x_old[master])
            if len(facet_pairs) == 0:
                continue
            mine = self._shares.mine(index, facet_pairs, len(pair.slave.facets))
            found = pair.evaluate(self.x[slave], self.x[master], mine, motion, self.z[slave])
            pair.keep(self._shares.together(found.used))
            area = self._shares.combine(index, found.area)
            if area.any():
                pieces.append(((slave, master), found))
        return total_terms(pieces, self._shares, self.size, self.dim) if pieces else None

    # ------------------------------------------------------------------------------------- what the balance needs

    def force(self) -> Array:
        """Contact force [N] on all nodes for the present multipliers, shape (N, dim)."""
        if self.terms is None:
            return np.zeros_like(self.z)
        on_slave = -self.terms.D[:, None] * self.z
        if self.transformation is not None:
            on_slave = sp.linalg.spsolve(self.transformation.T.tocsc(), on_slave.ravel()).reshape(on_slave.shape)
        return on_slave + self.terms.M.T @ self.z

    def violation(self, weight: float) -> float:
        """Norm [N] of what the active nodes miss: the closed gap, and a traction along the normal."""
        active = self.active_set.active
        if self.terms is None or not active.any():
            return 0.0
        normals, z, D = self.terms.normals[active], self.z[active], self.terms.D[active]
        oblique = z - np.einsum("nd,nd->n", z, normals)[:, None] * normals
        closing = self._scale[active] * (self._gap - self._overlap)[active]
        return float(np.sqrt(np.sum(closing**2) + np.sum((weight * D[:, None] * oblique) ** 2)))

    def condense(self, weight: float, fetch: Callable[[NDArray[np.int64]], sp.csr_matrix], R: Array) -> RowChanges:
        """The linearised balance without multipliers.

        `weight` is that of the new contact force in the balance, `fetch(rows)` gives rows of the tangent without
        contact, R is the balance without the new contact force at all nodes, shape (N, dim).
        """
        assert self.terms is not None
        columns = self.nodes.dofs.ravel()
        slaves = self._condensed_nodes()
        place = self._dofs_of(slaves)
        J = fetch(columns[place])
        stiffness = place_columns(-weight * self.terms.dforce, columns, J.shape[1])
        J = J + stiffness[place]
        right = R.ravel()[place]
        if self.transformation is not None:
            basis = self.transformation[place][:, place].T
            J, right = basis @ J, basis @ right
        active = self.active_set.active[slaves].repeat(self.dim)
        self._linearised = self._linearise(weight)
        self._rows, self._right = J[active], right[active]
        self._condensed = condense(self._linearised, self._rows, self._right, columns)
        others = np.flatnonzero(self.nodes.deformable.repeat(self.dim))
        others = np.setdiff1d(others, place)
        kept = place[~active]
        return RowChanges(
            replaced=np.concatenate([columns[place[active]], columns[kept]]),
            replaced_rows=sp.vstack(
                [self._condensed.slave_rows, J[~active] + self._condensed.added_rows[kept]], format="csr"
            ),
            replaced_right=np.concatenate(
                [self._condensed.slave_right, self._condensed.added_right[kept] - right[~active]]
            ),
            added=columns[others],
            added_rows=(stiffness + self._condensed.added_rows)[others],
            added_right=self._condensed.added_right[others],
        )

    def _condensed_nodes(self) -> NDArray[np.int64]:
        """Active nodes, and all slave nodes if their rows change basis."""
        if self.transformation is None:
            return np.flatnonzero(self.active_set.active)
        return np.flatnonzero(self._areas > 0.0)

    def _dofs_of(self, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        return (self.dim * nodes[:, None] + np.arange(self.dim)).ravel()

    def recover(self, du: Array) -> None:
        """Multipliers of the active nodes from the increment of all unknowns."""
        own = np.zeros_like(self.z)
        own[self._linearised.active] = recover(self._linearised, self._condensed, self._rows @ du + self._right)
        self._set_multipliers(own)

    def _linearise(self, weight: float) -> Linearised:
        assert self.terms is not None
        active = np.flatnonzero(self.active_set.active)
        normals = self.terms.normals[active]
        rows = self._dofs_of(active)
        on_master = expand(self._with_lent(self.terms.M)[active], self.dim).T.tocsr()
        if self.transformation is not None:
            on_master = (self.transformation.T @ on_master).tocsr()
        return Linearised(
            weight=weight,
            active=active,
            normals=normals,
            pressure=np.einsum("nd,nd->n", self.z[active], normals),
            D=self.terms.D[active],
            free=~self.nodes.held[active].ravel(),
            on_master=on_master,
            gap=(self._gap - self._overlap)[active],
            scale=self._scale[active],
            dgap=self._with_lent(self.terms.dgap)[active],
            dnormals=self.terms.dnormals[rows],
        )

    def dofs(self) -> NDArray[np.int64]:
        """Global dofs of all nodes, -1 where rigid, shape (N, dim)."""
        return self.nodes.dofs

    def multiplier_dofs(self) -> NDArray[np.int64]:
        """Global dofs of the slave nodes, each once."""
        return self.nodes.dofs[self._areas > 0.0].ravel()

    @property
    def near(self) -> bool:
        """Any facets within reach of each other at the latest `evaluate`."""
        return self.terms is not None

    @property
    def settled(self) -> bool:
        """The latest `evaluate` left the active set as it was."""
        return not self.active_set.changed

    # ------------------------------------------------------------------------------------------- results and state

    def active(self) -> NDArray[np.bool_]:
        """Which nodes touch, shape (N,)."""
        return self.active_set.active.copy()

    def numbers(self) -> dict[str, float]:
        """Columns for the history."""
        found = {
            "contact.active": float(self.active_set.active.sum()),
            "contact.changes": float(self.active_set.changes),
        }
        for index, name in enumerate(self.names):
            for axis, force in zip("xyz", self.resultant(index), strict=False):
                found[f"contact.{name}.{axis}"] = float(force)
        return found

    def resultant(self, index: int) -> Array:
        """Contact force [N] of a pair on its slave side, shape (dim,)."""
        slave, _ = self._sides[index]
        if self.terms is None:
            return np.zeros(self.dim)
        return -(self.terms.D[slave, None] * self.z[slave]).sum(axis=0)

    def distances(self, index: int) -> Array:
        """Distances [m] of the slave nodes of a pair to its master, as of the latest `evaluate`."""
        slave, master = self._sides[index]
        surface = self.pairs[index].master
        return distances(self.x[slave], self.x[master], surface.facets, surface.facet_type)

    def mean_gap(self) -> Array:
        """Mean gap [m] around each slave node, NaN where no master is near, shape (N,)."""
        if self.terms is None:
            return np.full(self.size, np.nan)
        covered = self._covered(self.terms)
        return np.divide(self.terms.gap, self.terms.D, out=np.full(self.size, np.nan), where=covered)

    def fields(self) -> dict[str, dict[str, tuple[NDArray[np.int64], Array]]]:
        """Nodal results on slave surfaces: body -> name -> (nodes in its mesh, values).

        contact_traction [Pa] acts on the slave, contact_pressure is its normal part, contact_gap [m] the mean gap.
        """
        gap, active = self.mean_gap(), self.active_set.active
        normals = np.zeros_like(self.z) if self.terms is None else self.terms.normals
        found: dict[str, dict[str, tuple[NDArray[np.int64], Array]]] = {}
        for pair, (slave, _) in zip(self.pairs, self._sides, strict=True):
            if pair.slave.mesh_nodes is None:
                continue
            values = {
                "contact_pressure": np.einsum("nd,nd->n", self.z[slave], normals[slave]),
                "contact_traction": -self.z[slave],
                "contact_gap": gap[slave],
                "contact_active": active[slave].astype(float),
            }
            of_body = found.setdefault(pair.slave.body, {})
            for name, array in values.items():
                nodes, before = of_body.get(name, (np.empty(0, dtype=np.int64), array[:0]))
                of_body[name] = np.concatenate([nodes, pair.slave.mesh_nodes]), np.concatenate([before, array])
        return found

    def save(self) -> State:
        arrays = {"z": self.z, "x": self.x, "gap": self._gap, "active": self.active_set.active}
        arrays["touched_at"] = self.touched_at
        return {name: array.copy() for name, array in arrays.items()}

    def restore(self, state: State) -> None:
        self.z[:] = state["z"]
        self.x[:] = state["x"]
        self._gap = state["gap"].copy()
        self.active_set.active[:] = state["active"]
        self.touched_at[:] = state["touched_at"]


def _index(surfaces: Sequence[Surface], wanted: Surface) -> int:
    return next(i for i, surface in enumerate(surfaces) if surface is wanted)
