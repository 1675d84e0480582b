"""Elastic bodies as the solid of a coupled system: a structure and its wetted surfaces."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from coupling.predict import Predictor
from coupling.wetted import WettedSurface
from solvers.algebra.rows import RowTransformation, TakenRows, gather_at
from solvers.algebra.sparse import Sparse, stack
from solvers.algebra.vertices import VertexJacobian
from solvers.api import Array, Indices, State, StepFailed, StepInfo
from solvers.generalised_alpha import BACKWARD_EULER
from solvers.structure.dynamics import Dynamics
from solvers.structure.field import Structure
from solvers.structure.saved import from_bodies, per_body

#: Halvings of the change of a load, where Newton's method fails for all of it. A flap on a stop under a pressure that
#: doubles needs one, with c_n from 0.02 to 1 times the stiffness of uniaxial strain. A step that must fail costs one
#: solution more for each.
HALVINGS_OF_LOAD = 2

Impulse = Literal["none", "next two", "next", "last"]


class Elastic:
    """Implements `Solid`. A vertex is a node of the structure, or on a facet between nodes, where a tie divides it."""

    def __init__(self, structure: Structure, surfaces: Sequence[WettedSurface]):
        self.structure = structure
        self.surfaces = {surface.name: surface.points for surface in surfaces}
        none = np.empty((0, structure.dim), dtype=np.int64)  # without a flow
        self.dofs = np.concatenate([none, *(surface.dofs for surface in surfaces)])  #: of the nodes, (m, dim)
        mixtures = [surface.mixture for surface in surfaces if surface.mixture is not None]
        self._mixture = stack(mixtures) if mixtures else None  #: vertices from the nodes; None: they are the same
        self.predictor = Predictor()
        #: whether the next step takes an impulse by backward Euler, the one after it, too, or the last one did
        self.impulse: Impulse = "none"
        self.name, self.comm, self.size = structure.name, structure.comm, structure.layout.size
        self._time = structure.time  #: the scheme of all other steps

    @property
    def force_weight(self) -> float:
        return self.structure.time.force_weight

    def mean_load(self, before: Array, after: Array) -> Array:
        return self.force_weight * after + (1.0 - self.force_weight) * before

    def weighted(self, rows: Sparse) -> Sparse:
        return self.force_weight * rows

    # ------------------------------------------------------------------------------------------------- steps

    def initialise(self, t: float, dt: float) -> None:
        self.structure.initialise(t, dt)

    def begin_step(self, t: float, dt: float) -> None:
        self.choose_scheme()
        if self.impulse.startswith("next"):
            self.structure.now.a[:] = 0.0  # Newmark's relations are those of backward Euler then
        before = self.structure.now.u.copy()  # surfaces that lose their mass move to their equilibrium, by a leap
        self.structure.begin_step(t, dt)
        self.predictor.add(t, before)

    def choose_scheme(self) -> None:
        """Set the time scheme of the structure: its own one, or backward Euler."""
        self.structure.time = own = self._time
        if self.impulse.startswith("next") and isinstance(own, Dynamics):
            self.structure.time = replace(own, scheme=BACKWARD_EULER)

    def predict(self, t: float) -> None:
        """Extrapolate displacements by a parabola, unless the structure has a predictor of its own."""
        held, now = self.structure.held, self.structure.now
        before = now.u.copy()
        own_predictor = not np.array_equal(held.free_part(now.u), held.free_part(self.structure.old.u))
        if not self.comm.allreduce(own_predictor, op=MPI.LOR):
            now.u[:] = held.part(now.u) + held.free_part(self.predictor.at(t))
        self.structure.increment = now.u - before

    def in_contact(self) -> bool:
        constraint = self.structure.constraint
        return constraint is not None and bool(constraint.active().any())

    def contact_pressure(self) -> float:
        constraint = self.structure.constraint
        return constraint.largest_traction() if constraint is not None else 0.0

    def solve(self) -> StepInfo:
        """Newton's method under the load of the flow; in parts, if it fails for all of its change in this step."""
        return self._solve_from(self.structure.old.surface, HALVINGS_OF_LOAD)

    def _solve_from(self, last: Array, halvings: int) -> StepInfo:
        """Under the present load [N]; if that fails, under the mean of it and the last one first. Raises StepFailed.

        The first iterate of a slender body moves by its whole deflection, through what will stop it, and contact begins
        from there.
        """
        structure = self.structure
        before, load = structure.now.u.copy(), structure.now.surface.copy()
        try:
            return structure.solve()
        except StepFailed:
            if halvings == 0:
                raise
        structure.now.u[:] = before
        middle = 0.5 * (last + load)
        structure.load(middle)
        first = self._solve_from(last, halvings - 1)
        structure.load(load)
        then = self._solve_from(middle, halvings - 1)
        residuals = (*first.residuals, *then.residuals)
        return replace(then, iterations=first.iterations + then.iterations, residuals=residuals)

    def check(self, info: StepInfo) -> None:
        self.structure.check_deformation(info.iterations, info.residuals)

    def end_step(self) -> None:
        self.structure.end_step()
        after: Mapping[str, Impulse] = {"next two": "next", "next": "last"}
        self.impulse = after.get(self.impulse, self.impulse)

    # ---------------------------------------------------------------------------------------------- the surface

    def displacement(self) -> Array:
        return self.at_vertices(self.structure.now.u)

    def jacobian(self) -> VertexJacobian:
        if self._mixture is None:
            columns = self.dofs.reshape(-1, 1)
            return VertexJacobian(columns, np.ones(columns.shape))
        nodes, shares = self._mixture.padded_rows()
        columns = np.swapaxes(self.dofs[nodes], 1, 2)
        return VertexJacobian(columns.reshape(-1, columns.shape[2]), np.repeat(shares, self.dofs.shape[1], axis=0))

    def load(self, force: Array) -> None:
        self.structure.load(self.spread(force))

    def spread(self, force: Array) -> Array:
        """Forces [N] at owned dofs of the structure, from those on vertices (n, dim)."""
        return self._owned(self._on_nodes(force))

    def spread_by_size(self, values: Array) -> Array:
        """As `spread`, but with the absolute values of its shares, whose signs differ on second-order surfaces."""
        if self._mixture is None:
            return self.spread(values)
        return self._owned(replace(self._mixture, data=np.abs(self._mixture.data)).T @ values)

    def _owned(self, at_nodes: Array) -> Array:
        local = self.dofs - self.structure.layout.start
        mine = (local >= 0) & (local < self.size)
        total = np.zeros(self.size)
        np.add.at(total, local[mine], at_nodes[mine])
        return total

    def reduced(self, force: Array) -> Array:
        return self._on_nodes(force).ravel()

    def taken(self) -> Array:
        """The residual of inertia, damping, internal forces, own loads and contact, averaged over the step.

        At prescribed components it is the load of the flow itself, because the reaction of a support balances any load.
        """
        structure, weight = self.structure, self.force_weight
        handed_over = weight * structure.now.surface + (1.0 - weight) * structure.old.surface
        free = structure.held.free_part(structure.time.averaged_load(structure))
        return self._at_nodes(free + structure.held.part(handed_over)).ravel()

    def taken_at_start(self) -> Array:
        structure = self.structure
        return self._at_nodes(structure.held.free_part(structure.time.reaction(structure))).ravel()

    def moved(self) -> Array:
        return self._at_nodes(self.structure.now.u - self.structure.old.u).ravel()

    def exchanged(self) -> float:
        return self.structure.energy.exchanged

    def at_vertices(self, owned: Array) -> Array:
        """Values at the vertices from those at owned dofs of the structure, shape (n, dim)."""
        found = self._at_nodes(owned)
        return found if self._mixture is None else self._mixture @ found

    def _at_nodes(self, owned: Array) -> Array:
        return gather_at(self.comm, owned, self.structure.layout.start, self.dofs)

    def _on_nodes(self, force: Array) -> Array:
        return force if self._mixture is None else self._mixture.T @ force

    # ------------------------------------------------------------------------------------- rows of a larger system

    def follow(self) -> None:
        self.structure.follow()

    def residual(self) -> Array:
        return self.structure.residual()

    def forces(self) -> Array:
        return self.structure.forces()

    def linearise(self) -> PETSc.Mat:
        return self.structure.linearise()

    def added_product(self) -> Callable[[Array], Array] | None:
        return self.structure.added_product()

    def right_side(self) -> Array:
        return self.structure.right_side()

    def advance(self, *, keep: bool = False, reduction: float = 0.0) -> Array:
        return self.structure.advance(keep=keep, reduction=reduction)

    def update(self, increment: Array) -> Array:
        return self.structure.update(increment)

    def retreat(self, fraction: Array) -> None:
        self.structure.retreat(fraction)

    def linked(self) -> Indices:
        return self.structure.linked()

    def parts_of(self, names: Collection[str]) -> NDArray[np.bool_]:
        own = np.concatenate([np.full(body.size, float(body.name in names)) for body in self.structure.bodies])
        return self.structure.pieces.norms([own])[0] > 0.0

    def cycle(self) -> str:
        return self.structure.cycle()

    def astray(self, risen: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
        return self.structure.astray(risen)

    def settled(self) -> bool:
        return self.structure.settled()

    def only_rounding(self) -> NDArray[np.bool_]:
        return self.structure.only_rounding()

    def rounded(self) -> Array:
        return self.structure.rounded()

    def add_rounding(self, error: Array) -> None:
        self.structure.add_rounding(error)

    def worst(self) -> tuple[float, ...] | None:
        return self.structure.worst()

    @property
    def near_contact(self) -> bool:
        """Whether contact changes the rows at this iterate."""
        return self.structure.constraint is not None and self.structure.constraint.near

    def rigid_unknowns(self) -> Indices:
        return np.empty(0, dtype=np.int64)

    def row_transformations(self) -> list[RowTransformation]:
        change = self.structure.row_transformation()
        return [] if change is None else [change]

    def recover(self, taken: Sequence[TakenRows], du: Array) -> None:
        for rows in taken:
            self.structure.recover(rows, du)

    def missing(self) -> Array:
        return self.structure.missing_displacement()

    def impose_rows(self, blocks: Sequence[PETSc.Mat], x: Array, b: Array) -> list[PETSc.Mat]:
        return self.structure.held.impose_rows(blocks, x, b)

    # ------------------------------------------------------------------------------------------- results and state

    def touching(self) -> NDArray[np.bool_] | None:
        contact = self.structure.constraint
        return None if contact is None else contact.active()

    def numbers(self) -> dict[str, float]:
        contact = self.structure.constraint
        return {} if contact is None else contact.numbers()

    def save(self) -> State:
        """All states have three displacements of the predictor, so that they have the same parts."""
        displacements = [*self.predictor.displacements, *[self.structure.now.u] * 3][:3]
        by_name: State = {str(i): per_body(self.structure, u) for i, u in enumerate(displacements)}
        of_start = {"impulse": self.impulse}
        return self.structure.save() | of_start | {"predictor": by_name | {"times": list(self.predictor.times)}}

    def restore(self, state: State) -> None:
        self.structure.restore(state)
        self.impulse = state["impulse"]
        self.choose_scheme()
        saved, self.predictor.times = state["predictor"], list(state["predictor"]["times"])
        self.predictor.displacements = [
            from_bodies(self.structure, saved[str(i)]) for i in range(len(self.predictor.times))
        ]
