"""The constraint `Contact`: multipliers, active set and mortar terms of all pairs at one iterate."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.algebra.rows import RowTransformation
from solvers.algebra.sparse import Sparse, nothing
from solvers.api import Array, State
from solvers.contact.active_set import ActiveSet
from solvers.contact.components import components_of
from solvers.contact.condense import Condensed, Linearised, condense, recover
from solvers.contact.constraints import Constraints
from solvers.contact.directions import dependent
from solvers.contact.force import force_matrix, nodal_force
from solvers.contact.integration import Integrals, Integration
from solvers.contact.interface import ContactInterface, describe_interface
from solvers.contact.law.friction import FrictionBound, reversing
from solvers.contact.law.law import OPEN, STICK, Point, Slopes, Statuses
from solvers.contact.linearise import ActiveMultipliers, linearise
from solvers.contact.no_gap import NoGap
from solvers.contact.pair import Pair
from solvers.contact.reach import Reach, multiplier_dofs, touching_dofs
from solvers.contact.redistribute import redistributed
from solvers.contact.slip import Slip
from solvers.contact.stiffness import ContactStiffness
from solvers.contact.terms import Terms
from solvers.contact.unheld import Falling, Loose, Unheld
from solvers.contact.violation import rounding, violation
from solvers.contact.work import FrictionWork, GivenWork, along_surface


class Contact:
    """All pairs together. Arrays over `nodes` (N) and `multipliers` (C) are the same on every process.

    z are the multipliers [Pa]: the negative traction on the slave, with the contact pressure z_n = n.z >= 0.

    keep_overlap: for dynamics. A mean gap that is negative at the start of a step may stay, but not decrease. It occurs
    where a slave slides onto a master: a node enters the master before its area is covered. If one step closed this
    overlap, it would accelerate the node. If it stays, contact does no work. The first step closes all overlaps.
    periods: lengths [m] after which space repeats, infinite where it does not, shape (dim,); None: nowhere.
    unheld: the static bodies that only contact holds; see `unheld`.
    """

    def __init__(
        self,
        pairs: Sequence[Pair],
        *,
        names: Sequence[str] = (),
        c_n: float = 1.0,
        keep_overlap: bool = False,
        periods: Array | None = None,
        unheld: Sequence[Loose] = (),
        comm: MPI.Comm = MPI.COMM_WORLD,
    ):
        self.c_n = c_n
        self.names = tuple(names) or tuple(f"pair{i}" for i in range(len(pairs)))
        self.interface: ContactInterface = describe_interface(pairs, periods)
        self.pairs, self.nodes = self.interface.pairs, self.interface.nodes
        self.multipliers = self.interface.multipliers
        self.size, self.dim = self.nodes.points.shape
        count = len(self.multipliers.node)
        self.z = np.zeros((count, self.dim))
        self.x = self.nodes.points.copy()
        self.x_old = self.x.copy()
        self.active_set = ActiveSet(count)
        self._spans = self.interface.spans  # at the latest evaluation
        self._pieces = np.where(self.nodes.dofs[:, 0] < 0, -1, 0)
        self._keep_overlap = keep_overlap
        self._begun = False  # a step that has not ended
        self._gap = np.zeros(count)  # weighted gap at the latest evaluation
        self._mean_gap = np.zeros(count)  # weighted gap over D [m], zero where D is zero
        self._kept = np.zeros(count)  # mean gap that may stay in this step [m], <= 0
        #: mask of the pairs whose surfaces have no mass in dynamics
        self.present = np.ones(len(self.pairs), dtype=bool)
        self._constraints = Constraints(self.interface)
        self.merged = np.zeros(count, dtype=bool)  #: multipliers that are merged into another one of their node
        self.stiffness_per_area = np.zeros(count)  #: [Pa/m], at the latest evaluation
        self._stiffnesses = ContactStiffness(self.interface, np.zeros_like(self.x))
        self._no_gap = NoGap.among(self.nodes.points)
        self._tolerance = np.full(count, self._no_gap.others)  # gap that counts as closed, at the latest evaluation [m]
        self.unheld = Unheld(unheld)
        self._shared: Sparse | None = None  # redistribution at the latest evaluation
        self._tied = self.interface.spans == "space"
        self._integration = Integration(self.interface, comm)
        self.slip: Slip | None = None  # at the latest evaluation
        self._weight = 1.0  # of the new contact force in the balance
        self.work = FrictionWork((count, self.dim))
        #: nodes of obstacles, which may begin to move when a run is resumed
        self._obstacles = np.flatnonzero(self.nodes.dofs[:, 0] < 0)
        self._of_obstacles = GivenWork((len(self._obstacles), self.dim))
        self._of_interference = GivenWork((len(self.pairs),))
        self._interference = np.zeros(len(self.pairs))  # of each pair at the end of the last step [m]
        self.time = np.nan  #: of the latest evaluation [s]
        self.touched_at = np.full(len(self.pairs), np.inf)  #: time of the first contact of each pair [s], set by probes
        self.terms: Terms | None = None
        self._integrals: Integrals | None = None
        self._own, self._increment = self.z.copy(), np.zeros_like(self.z)  # before redistribution; of the last iterate
        self._D, self._covers = np.zeros(count), np.zeros(count, dtype=bool)  # at the latest evaluation
        self._condensation: tuple[list[ActiveMultipliers], Linearised, Condensed] | None = None  # the latest

    # ------------------------------------------------------------------------------------------------- steps

    def start(self, u: Array, stiffness: Array, t: float) -> None:
        """Set the displacements at the start [m] and what resists a contact [N/m], both of shape (N, dim)."""
        self._stiffnesses = ContactStiffness(self.interface, stiffness)
        self.x = self.positions(u, t)
        self.x_old = self.x.copy()
        self._integration.start(self.x)
        self._integration.interfere(t)
        self._interference = self._integration.interference  # what it takes to make it is energy of the start
        self._constraints.start(self.x)

    def take_pieces(self, pieces: NDArray[np.int64]) -> None:
        """Set the piece of a body that each node belongs to, -1 where rigid, shape (N,)."""
        self._pieces = pieces

    def positions(self, u: Array, t: float) -> Array:
        """Current positions [m] of all nodes from the displacements of the deformable ones, shape (N, dim)."""
        x = self.nodes.points + u
        for surface, numbers in zip(self.interface.surfaces, self.nodes.of_surface, strict=True):
            if surface.motion is not None:
                x[numbers] = surface.motion(t)
        return x

    def begin_step(self) -> None:
        """Store the positions and active set at the start of a step."""
        before, self.x_old = self.x_old, self.x.copy()
        if self._keep_overlap:
            self._kept = np.minimum(0.0, self._mean_gap)
        self._constraints.begin_step()
        self._stiffnesses.begin_step()
        cycled, self._begun = self.active_set.returned & self._begun, True
        self.active_set.begin_step()
        self._integration.begin_step(self.x, before, self.active_set.active, cycled)
        self._condensation = self.slip = None
        self._own, self._increment = self.z.copy(), np.zeros_like(self.z)

    def begin_solve(self) -> None:
        """New loads: sets that the old ones chose are no sign of a cycle."""
        self.active_set.begin_solve()

    def end_step(self, weight: float) -> None:
        """Accept the step; weight: that of the contact force at its end in the balance."""
        self._begun = False
        if self._integration.has_slip:
            self.work.end_step(weight, *self._force_and_slip())
        self._of_obstacles.end_step(-self.force()[self._obstacles], (self.x - self.x_old)[self._obstacles])
        before, self._interference = self._interference, self._integration.interference
        pressed = np.zeros(len(self.pairs)) if self.terms is None else self.terms.normal_forces(self.z)  # [N]
        self._of_interference.end_step(pressed, self._interference - before)
        self._set_multipliers(np.where(self.active_set.active[:, None], self.z, 0.0))
        self.slip = None

    @property
    def friction_work(self) -> float:
        """Energy that friction has dissipated since the start [J]."""
        return self.work.total

    @property
    def obstacle_work(self) -> Array:
        """(work of moved obstacles and of growing interference since the start, by how much it may be wrong) [J]."""
        parts = self._of_obstacles, self._of_interference
        return np.array([sum(part.total for part in parts), sum(part.doubt for part in parts)])

    def _force_and_slip(self) -> tuple[Array, Array]:
        """(force [N], slip in this step [m]) along the surface for multipliers in contact, shapes (C, dim)."""
        if self.terms is None or self.slip is None:
            return np.zeros_like(self.z), np.zeros_like(self.z)
        active = self.active_set.active[:, None]
        return along_surface(self.terms.normals, active * self._D[:, None] * self.z, active * self.slip.values)

    def evaluate(self, u: Array, t: float) -> None:
        """Compute mortar terms and active set at displacements u [m], shape (N, dim), and the time t [s]."""
        x = self.positions(u, t)
        self._integration.move(x - self.x)
        self.x, self.time = x, t
        self._integration.interfere(t)
        if self._integration.clear and not self.unheld.bodies:
            return
        self._choose()
        if not self.active_set.changed and self._integration.rims.press(self.active_set.active):
            self._choose()
        self._set_multipliers(np.where(self._constrained[:, None], self.z, 0.0))

    def _choose(self) -> None:
        """Integrate at the present positions, and choose the active set."""
        status, falling = self._statuses()
        if self._integration.look_farther(falling, self.x, self._constraints.coverage.enough):
            status, _ = self._statuses()
        self.active_set.take_components(components_of(self._pieces, *self.linked())[self.multipliers.node])
        self.active_set.choose(status)

    def _statuses(self) -> tuple[Statuses, list[Falling]]:
        """Statuses at the present positions, and the groups of bodies that contact alone would hold; see `unheld`."""
        self.terms = terms = self._integrate()
        self._mean_gap, status = np.zeros(len(self.z)), np.full(len(self.z), OPEN, dtype=np.int8)
        self._gap = np.zeros(len(self.z))
        if terms is not None:
            self._gap = self._redistributed(self._integration.own_gap(terms))
            self._D = self._redistributed(terms.D)
            np.divide(self._gap, self._D, out=self._mean_gap, where=self._D > 0.0)
            self._tolerance = self._no_gap.at(self.active_set.tried)
            status = self._by_laws()
        if not self.unheld.bodies:
            return status, []
        mask, gap, first, none = self._covers, self._mean_gap, self.active_set.first, self._no_gap.others
        tries, falling = self.unheld.tries(terms, mask, gap, status, self.z.any(axis=1), first=first, none=none)
        if tries.any() and self._integrals is not None:
            self._tolerance = self._tolerance + tries
            self.slip = self._integration.slip(self.x, self._integrals.with_fixed_normals(), self._shared)
            status = self._by_laws()
        return status, falling

    def _by_laws(self) -> Statuses:
        assert self.terms is not None
        status = np.full(len(self.z), OPEN, dtype=np.int8)
        for law, which in self.interface.laws:
            status[which] = law.status(self.point(which))
        several = (status != OPEN) & ~self.multipliers.only_one & (self._spans == "normal")
        status[dependent(self.terms.normals, self.multipliers.node, self.nodes.held, several)] = OPEN
        return status

    @property
    def _constrained(self) -> NDArray[np.bool_]:
        """Mask of the multipliers with a constraint at the latest evaluation, shape (C,)."""
        return self._covers if self.terms is not None else np.zeros(len(self.z), dtype=bool)

    def _integrate(self) -> Terms | None:
        """Mortar terms, slip and multipliers with a constraint at the present positions; None if no facets are near."""
        found = self._integrals = self._integration.integrate(self.x, self.x_old, self.z)
        if found is None:
            return None
        constrained = self._constraints.choose(found.terms)
        self._covers, self._shared = constrained.covers, constrained.shared
        self._spans, self.merged = constrained.spans, constrained.merged
        self.stiffness_per_area = self._stiffnesses.per_area(constrained.terms.M)
        self.slip = self._integration.slip(self.x, found, self._shared)
        return constrained.terms

    def point(self, which: NDArray[np.int64]) -> Point:
        """The arguments of a law for some multipliers."""
        assert self.terms is not None
        stiffness, slip = self.stiffness_per_area[which], self.slip
        return Point(
            z=self.z[which],
            normals=self.terms.normals[which],
            D=self._D[which],
            gap=(self._gap - self._kept * self._D)[which],
            covered=self._covers[which],
            stiffness=stiffness,
            slip=np.zeros((len(which), self.dim)) if slip is None else slip.values[which],
            slip_defined=np.zeros(len(which), dtype=bool) if slip is None else slip.defined[which],
            shares=np.zeros((len(which), len(self.pairs))) if slip is None else slip.shares[which],
            stuck=self.active_set.stuck[which],
            free=self.unheld.slips_freely(self.terms.D_of_pair, self._covers, self.active_set.status)[which],
            c_n=self.c_n * stiffness,
            c_t=self.c_n * stiffness,
            touching=self._tolerance[which],
        )

    def _set_multipliers(self, own: Array) -> None:
        self.z[:] = own if self._shared is None else own + self._shared @ own

    def _redistributed(self, rows):
        return redistributed(rows, self._shared)

    # ---------------------------------------------------------------------------- forces, laws and condensation

    def force(self) -> Array:
        """Contact force [N] on all nodes for the present multipliers, shape (N, dim)."""
        none = np.zeros((self.size, self.dim))
        return none if self.terms is None else nodal_force(self.interface, self.terms, self.z)

    def violation(self, weight: float) -> Array:
        """Norm [N] of the residual of the laws of multipliers in contact, by node, shape (N,)."""
        self._weight = weight
        parts = [] if self.terms is None else self.in_contact()
        found = violation(self.interface, self._spans, parts, weight)
        left = np.flatnonzero(self._constrained & ~self.active_set.active)
        squares = (weight * self._D[left]) ** 2 * np.sum(self.z[left] ** 2, axis=1)
        return np.sqrt(found**2 + np.bincount(self.multipliers.node[left], squares, self.size))

    def rounding(self, weight: float) -> tuple[Array, Array]:
        """Rounding errors [N] of the contact force in the balance, shape (N, dim), and of `violation`, shape (N,).

        Where this step eliminated the multipliers last.
        """
        if self.terms is None or not self.active_set.active.any():
            return np.zeros((self.size, self.dim)), np.zeros(self.size)
        if self._condensation is None:
            self.condense(weight)
        assert self._condensation is not None
        return rounding(self.interface, self._condensation[2], self.force(), self.x)

    def in_contact(self) -> list[ActiveMultipliers]:
        """The multipliers in contact, law by law."""
        parts = [(law, which[self.active_set.active[which]]) for law, which in self.interface.laws]
        status = self.active_set.status
        return [ActiveMultipliers(law, which, self.point(which), status[which]) for law, which in parts if len(which)]

    def linearised(self, parts: Sequence[ActiveMultipliers], weight: float) -> Linearised:
        """Contribution of the multipliers in contact to a Newton iteration, linearised."""
        assert self.terms is not None
        count, n, dgap = len(self.z), self.dim * self.size, self._redistributed(self.terms.dgap)
        slip = nothing((self.dim * count, n)) if self.slip is None else self.slip.slopes
        slopes = Slopes(gap=dgap, normals=self.terms.dnormals, slip=slip)
        force = force_matrix(self.interface, self.terms)
        if self._shared is not None:
            force = force + force @ self._shared
        return linearise(self.interface, self._spans, parts, slopes, force, self.terms.dforce, weight)

    def condense(self, weight: float) -> RowTransformation:
        """The transformation that eliminates the multipliers from the linearised balance without contact force.

        weight: that of the contact force at the end of the step in the balance.
        """
        parts = self.in_contact()
        linearised = self.linearised(parts, weight)
        condensed = condense(linearised)
        self._condensation = parts, linearised, condensed
        changed = np.zeros(self.size, dtype=bool)
        changed[self.multipliers.node[self.active_set.active]] = True
        if self.interface.basis is not None:
            changed[self.multipliers.node[self.multipliers.areas > 0.0]] = True
        return RowTransformation(
            dofs=self.nodes.dofs.ravel(),
            rows=condensed.rows,
            stiffness=condensed.stiffness,
            added=condensed.added,
            right=condensed.right,
            replaced=changed.repeat(self.dim),
        )

    def recover(self, balance: Array, du: Array) -> None:
        """Compute the multipliers in contact from the linearised balance J du + R [N] and du [m], shapes (N * dim,)."""
        own = np.zeros_like(self.z)
        assert self._condensation is not None, "condense comes first"
        parts, linearised, condensed = self._condensation
        found, reverses = recover(linearised, condensed, balance, du), np.zeros(len(own), dtype=bool)
        for part in parts:
            if isinstance(part.law, FrictionBound):
                reverses[part.which] = reversing(part.law, part.point, part.status)
        self.active_set.begin_increment(reverses)
        if parts:
            own[np.concatenate([part.which for part in parts])] = found.reshape(-1, self.dim)
        self._increment = own - np.where(self._constrained[:, None], self.z, 0.0)
        self._own = own
        self._set_multipliers(own)

    def retreat(self, fraction: Array) -> None:
        """Take back fractions of the last increment of the multipliers, by node, shape (N,)."""
        self._own = self._own - fraction[self.multipliers.node, None] * self._increment
        self._set_multipliers(self._own)

    def dofs(self) -> NDArray[np.int64]:
        """Global dofs of all nodes, -1 where rigid, shape (N, dim)."""
        return self.nodes.dofs

    def touching_dofs(self) -> NDArray[np.int64]:
        """Global dofs of the nodes of surfaces of present pairs that are not tied, each once."""
        return touching_dofs(self.interface, self.present)

    def multiplier_dofs(self) -> NDArray[np.int64]:
        """Global dofs of slave nodes of present pairs that are not tied."""
        return multiplier_dofs(self.interface, self.present)

    @cached_property
    def _reach(self) -> Reach:
        return Reach(self.interface)

    def find_present(self, u: Array, v: Array, t: float, dt: float) -> NDArray[np.bool_]:
        """Mask of the pairs that the step from t to t + dt [s] could bring into contact, or that are in contact.

        u, v: displacements [m] and velocities [m/s] of the deformable nodes, shape (N, dim).
        """
        x, pressed = self.positions(u, t), np.zeros(self.size, dtype=bool)
        pressed[self.multipliers.node[self.active_set.active & ~self._tied]] = True
        return self._reach.find(x, self.positions(u, t + dt) - x + dt * v, self.present, pressed)

    def approaching_dofs(self, u: Array, v: Array, t: float, dt: float) -> NDArray[np.int64]:
        """Global dofs of the nodes that their velocities could bring into contact in the step; u, v as above."""
        x = self.positions(u, t)
        dofs = self.nodes.dofs[self._reach.nodes(x, self.positions(u, t + dt) - x + dt * v, self.present)]
        return dofs[dofs >= 0]

    def largest_traction(self) -> float:
        """Largest traction [Pa] of multipliers that are not tied."""
        return float(np.linalg.norm(self.z[~self._tied], axis=1).max(initial=0.0))

    @property
    def near(self) -> bool:
        """Whether the latest `evaluate` found facets near each other."""
        return self.terms is not None

    @property
    def acts(self) -> bool:
        """Whether multipliers are in contact, or of some that left it the traction is not yet zero."""
        return self.near and bool(self.active_set.active.any() or self.z.any())

    @property
    def settled(self) -> bool:
        """Whether the latest `evaluate` left the active set unchanged, or returned to an earlier one.

        The residual covers all conditions. If it is small and sets recur, their nodes have neither pressure nor gap.
        """
        return self.active_set.settled

    def cycle(self) -> str:
        """What cycles, for messages; empty if no earlier active set has come back."""
        return self.active_set.cycle()

    def cycling(self) -> NDArray[np.bool_]:
        """Mask of the nodes whose status changed when an earlier active set came back, shape (N,)."""
        return np.bincount(self.multipliers.node[self.active_set.returned], minlength=self.size) > 0

    def linked(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Slave and master nodes that are opposite each other."""
        M = nothing((len(self.z), self.size)) if self.terms is None else self.terms.M
        return self.multipliers.node[M.row_numbers()], M.indices.astype(np.int64)

    # ------------------------------------------------------------------------------------------- results and state

    def active(self) -> NDArray[np.bool_]:
        """Mask of the multipliers in contact, shape (C,)."""
        return self.active_set.active

    def numbers(self) -> dict[str, float]:
        """Columns for the history."""
        found = {
            "contact.active": float(len(set(self.multipliers.node[self.active_set.active & ~self._tied].tolist()))),
            "contact.changes": float(self.active_set.changes),
        }
        if self._integration.slides:
            found["contact.sticking"] = float(np.sum((self.active_set.status == STICK) & ~self._tied))
            found["contact.friction"] = self.work.total + self.work.of_step(self._weight, *self._force_and_slip())
        for index, name in enumerate(self.names):
            for axis, force in zip("xyz", self.resultant(index), strict=False):
                found[f"contact.{name}.{axis}"] = float(force)
        return found

    def resultant(self, index: int) -> Array:
        """Contact force [N] of a pair on its slave, or on its master if the pair says so, shape (dim,)."""
        on_master = np.zeros(self.dim) if self.terms is None else self.terms.D_of_pair[index] @ self.z
        return on_master if self.pairs[index].others else -on_master

    @property
    def imbalance(self) -> dict[str, float]:
        """Imbalance of the contact work of the processes; see `Shares`."""
        return self._integration.shares.imbalance

    def mean_gap(self) -> Array:
        """Mean gap [m] at each multiplier, NaN where too little area is covered, shape (C,).

        Contact makes it zero: multipliers with a constraint have their share of those without one.
        """
        found = np.full(len(self.z), np.nan)
        if self.terms is None:
            return found
        covered = self._constraints.coverage.enough(self.terms.D)
        np.divide(self.terms.gap, self.terms.D, out=found, where=covered)
        np.divide(self._redistributed(self.terms.gap), self._D, out=found, where=self._constrained)
        return found

    def save(self) -> State:
        return {
            "z": self.z.copy(),
            "x": self.x.copy(),
            "x_old": self.x_old.copy(),
            "mean_gap": self._mean_gap.copy(),
            "status": self.active_set.status.copy(),
            "present": self.present.copy(),
            "failures": self._integration.rims.failures.copy(),
            "touched_at": self.touched_at.copy(),
            "work": self.work.save(),
            "obstacle_work": self._of_obstacles.save(),
            "interference_work": self._of_interference.save(),
            "interference": self._interference.copy(),
        }

    def restore(self, state: State) -> None:
        self._integration.search_anew()
        self.z[:] = state["z"]
        self.x[:] = state["x"]
        self.x_old = state["x_old"].copy()
        self._mean_gap = state["mean_gap"].copy()
        self.active_set.status = state["status"].copy()
        self.present = state["present"].copy()
        if not self._begun:  # what made a step fail counts when it is taken again
            self._integration.rims.failures = state["failures"].copy()
        self.touched_at[:] = state["touched_at"]
        self.work.restore(state["work"])
        self._of_obstacles.restore(state["obstacle_work"])
        self._of_interference.restore(state["interference_work"])
        self._interference = state["interference"].copy()
