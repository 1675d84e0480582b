"""Elastic and free rigid bodies together as the solid of a coupled system, with one vector of unknowns.

The unknowns of the elastic bodies come first, with the numbers that they have alone. Those of the rigid bodies follow;
the last process owns them. Bodies with a given motion have no unknowns, and are no part of the solid.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from coupling.elastic import Elastic
from coupling.free_masters import FreeMasters
from coupling.ports import Solid
from coupling.rigid_springs import RigidSprings
from solvers.algebra.added_product import with_product
from solvers.algebra.blocks import block_diagonal
from solvers.algebra.connected import connected_parts
from solvers.algebra.lagged import LaggedFactors
from solvers.algebra.linear import LinearSolveFailed
from solvers.algebra.rows import RowTransformation, TakenRows, gather, transform_rows
from solvers.algebra.sparse import Sparse
from solvers.algebra.vertices import VertexJacobian, one_below_the_other
from solvers.api import Array, Indices, State, StepFailed, StepInfo
from solvers.constraint import Constraint
from solvers.contact.contact import Contact
from solvers.newton import converge
from solvers.rigid.field import RigidBodies


class Composite:
    """Implements `Solid`. The parts of Newton's method are the elastic pieces, then the rigid bodies."""

    name = "solid"

    def __init__(self, elastic: Elastic, rigid: RigidBodies):
        self.elastic, self.rigid, self.comm = elastic, rigid, elastic.comm
        self.parts: tuple[Solid, Solid] = (elastic, rigid)
        self._elastic_unknowns = self.comm.allreduce(elastic.size)
        rigid.behind(self._elastic_unknowns)
        self.size = elastic.size + rigid.size
        self.surfaces = elastic.surfaces | rigid.surfaces
        self._vertices = sum(len(points) for points in elastic.surfaces.values())
        self._pieces = elastic.structure.pieces.count  # of the elastic bodies
        self._springs = RigidSprings(elastic.structure, rigid)
        self._known: Constraint | None = None  #: the constraint that `_masters` belongs to
        self._masters: FreeMasters | None = None
        self._factors = LaggedFactors(self.comm, fresh=math.inf)
        self._residuals: list[Array] = []  #: of both parts, at the latest iterate

    def _find_masters(self) -> FreeMasters | None:
        """The free bodies that elastic ones may touch; None: the parts do not touch."""
        contact = self.elastic.structure.constraint
        if contact is not self._known:
            masters = FreeMasters(contact, self.rigid) if isinstance(contact, Contact) else None
            self._known, self._masters = contact, masters if masters is not None and masters.any else None
        return self._masters

    def _of_parts(self, owned: Array) -> tuple[Array, Array]:
        """Owned unknowns of the elastic and of the rigid bodies."""
        return owned[: self.elastic.size], owned[self.elastic.size :]

    # ------------------------------------------------------------------------------------------------- steps

    def initialise(self, t: float, dt: float) -> None:
        self.rigid.initialise(t, dt)
        self.elastic.initialise(t, dt)
        if self._springs.any:  # whose forces need the motion of the elastic bodies
            self.rigid.initialise(t, dt)

    def step(self, t: float, dt: float) -> StepInfo:
        """One step from t to t + dt without a flow. Raises StepFailed."""
        self.begin_step(t, dt)
        self.rigid.extrapolate()  # the structure begins with the predictor of its own
        info = self.solve()
        self.end_step()
        return info

    def begin_step(self, t: float, dt: float) -> None:
        self.rigid.begin_step(t, dt)
        self.elastic.begin_step(t, dt)

    def predict(self, t: float) -> None:
        self.rigid.predict(t)
        self.elastic.predict(t)

    def solve(self) -> StepInfo:
        """Solve both parts: together if they may touch or springs join them, else one after the other."""
        if self._find_masters() is not None or self._springs.any:
            structure = self.elastic.structure
            if structure.constraint is not None:
                structure.constraint.begin_solve()
            self._factors.begin_step()
            try:
                info = converge(self, structure.settings.newton)
            except StepFailed as failure:
                structure.check_deformation(failure.iteration, failure.history)  # an inverted element is the reason
                raise
            self.check(info)
            return StepInfo(info.iterations, info.residuals, self.numbers())
        infos = [part.solve() for part in self.parts]
        residuals = tuple(value for info in infos for value in info.residuals)
        return StepInfo(sum(info.iterations for info in infos), residuals, self.numbers())

    def check(self, info: StepInfo) -> None:
        for part in self.parts:
            part.check(info)

    def end_step(self) -> None:
        for part in self.parts:
            part.end_step()

    def in_contact(self) -> bool:
        return self.elastic.in_contact() or self.rigid.in_contact()

    def contact_pressure(self) -> float:
        return self.elastic.contact_pressure()

    # ---------------------------------------------------------------------------------------------- the surface

    def displacement(self) -> Array:
        return np.concatenate([part.displacement() for part in self.parts])

    def jacobian(self) -> VertexJacobian:
        return one_below_the_other([part.jacobian() for part in self.parts])

    def _by_part(self, at_vertices: Array) -> tuple[Array, Array]:
        return at_vertices[: self._vertices], at_vertices[self._vertices :]

    def load(self, force: Array) -> None:
        for part, own in zip(self.parts, self._by_part(force), strict=True):
            part.load(own)

    def reduced(self, force: Array) -> Array:
        parts = zip(self.parts, self._by_part(force), strict=True)
        return np.concatenate([part.reduced(own) for part, own in parts])

    def taken(self) -> Array:
        return np.concatenate([part.taken() for part in self.parts])

    def taken_at_start(self) -> Array:
        return np.concatenate([part.taken_at_start() for part in self.parts])

    def moved(self) -> Array:
        return np.concatenate([part.moved() for part in self.parts])

    def mean_load(self, before: Array, after: Array) -> Array:
        count = len(after) - self.rigid.unknowns
        elastic = self.elastic.mean_load(before[:count], after[:count])
        return np.concatenate([elastic, self.rigid.mean_load(before[count:], after[count:])])

    def weighted(self, rows: Sparse) -> Sparse:
        weights = np.full(rows.shape[0], self.rigid.force_weight)
        weights[: self._elastic_unknowns] = self.elastic.force_weight
        return rows.scaled_rows(weights)

    def exchanged(self) -> float:
        return self.elastic.exchanged() + self.rigid.exchanged()

    # ------------------------------------------------------------------------------------- rows of a larger system

    def follow(self) -> None:
        for part in self.parts:
            part.follow()

    def residual(self) -> Array:
        of_elastic = self.elastic.residual()
        if (masters := self._find_masters()) is not None:
            masters.press(self.elastic.force_weight)
        self._springs.follow()
        self._residuals = [of_elastic, self.rigid.residual()]
        return np.concatenate(self._residuals)

    def forces(self) -> Array:
        return np.concatenate([part.forces() for part in self.parts])

    def linearise(self) -> PETSc.Mat:
        return self._springs.added_to(block_diagonal([part.linearise() for part in self.parts]))

    def added_product(self) -> Callable[[Array], Array] | None:
        product, own = self.elastic.added_product(), self.elastic.size
        if product is None:
            return None
        return lambda du: np.concatenate([product(du[:own]), np.zeros(len(du) - own)])

    def right_side(self) -> Array:
        return np.concatenate([part.right_side() for part in self.parts])

    def advance(self, *, keep: bool = False, reduction: float = 0.0) -> Array:
        """One Newton iteration of both parts without the flow; returns relative increments. Raises StepFailed."""
        matrix, b = self.linearise(), PETSc.Vec().createMPI((self.size, None), comm=self.comm)
        x, taken = b.duplicate(), []
        b.array[:] = self.right_side()
        for change in self.row_transformations():
            matrix, rows = transform_rows(matrix, b, change)
            taken.append(rows)
        x.array[:] = self.missing()
        (matrix,) = self.impose_rows([matrix], x.array, b.array)
        product = self.added_product()
        try:
            self._factors.solve(matrix if product is None else with_product(matrix, product), b, x, matrix)
        except LinearSolveFailed as failure:
            raise StepFailed(self.name, failure.kind, str(failure), where=self.worst()) from failure
        if taken:
            self.recover(taken, gather(self.comm, x.array))
        return self.update(x.array)

    def update(self, increment: Array) -> Array:
        parts = zip(self.parts, self._of_parts(increment), strict=True)
        return np.concatenate([part.update(own) for part, own in parts])

    def retreat(self, fraction: Array) -> None:
        self.elastic.retreat(fraction[: self._pieces])
        self.rigid.retreat(fraction[self._pieces :])

    def linked(self) -> Indices:
        own = np.concatenate([self.elastic.linked(), self._pieces + self.rigid.linked()])
        masters = self._find_masters()
        between = [*self._springs.linked(), *([] if masters is None else masters.linked(self.elastic.structure))]
        piece, body = np.array(between, dtype=np.int64).reshape(-1, 2).T
        first, second = np.append(np.arange(len(own)), piece), np.append(own, self._pieces + body)
        return connected_parts(first, second, len(own))

    def parts_of(self, names: Collection[str]) -> NDArray[np.bool_]:
        return np.concatenate([part.parts_of(names) for part in self.parts])

    def cycle(self) -> str:
        return self.elastic.cycle()

    def astray(self, risen: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
        elastic = self.elastic.astray([rise[: self._pieces] for rise in risen])
        return np.concatenate([elastic, self.rigid.astray([rise[self._pieces :] for rise in risen])])

    def settled(self) -> bool:
        found = [part.settled() for part in self.parts]
        return all(found)

    def only_rounding(self) -> NDArray[np.bool_]:
        return np.concatenate([part.only_rounding() for part in self.parts])

    def rounded(self) -> Array:
        return np.concatenate([part.rounded() for part in self.parts])

    def add_rounding(self, error: Array) -> None:
        for part, own in zip(self.parts, self._of_parts(error), strict=True):
            part.add_rounding(own)

    def worst(self) -> tuple[float, ...] | None:
        """Position [m] of the largest residual, of the part with the larger one relative to its forces (collective)."""
        places = [part.worst() for part in self.parts]
        relative = [_relative(r, part.forces()) for r, part in zip(self._residuals, self.parts, strict=True)]
        return places[int(np.argmax(relative))]

    def rigid_unknowns(self) -> Indices:
        return np.concatenate([part.rigid_unknowns() for part in self.parts])

    def row_transformations(self) -> list[RowTransformation]:
        elastic = self.elastic.row_transformations()
        if (masters := self._find_masters()) is not None:
            elastic = [masters.transformation(change) for change in elastic]
        return [*elastic, *self.rigid.row_transformations()]

    def recover(self, taken: Sequence[TakenRows], du: Array) -> None:
        """Those of the elastic bodies come first; rigid bodies compute their contact forces anew."""
        if not self.elastic.near_contact:
            return
        if (masters := self._find_masters()) is None:
            self.elastic.recover(taken[:1], du)
        else:
            masters.recover(taken[0], du)

    def missing(self) -> Array:
        return np.concatenate([part.missing() for part in self.parts])

    def impose_rows(self, blocks: Sequence[PETSc.Mat], x: Array, b: Array) -> list[PETSc.Mat]:
        (x_elastic, x_rigid), (b_elastic, b_rigid) = self._of_parts(x), self._of_parts(b)
        changed = self.elastic.impose_rows(blocks, x_elastic, b_elastic)
        return self.rigid.impose_rows(changed, x_rigid, b_rigid)

    # ------------------------------------------------------------------------------------------- results and state

    def touching(self) -> NDArray[np.bool_] | None:
        masks = [mask for part in self.parts if (mask := part.touching()) is not None]
        return np.concatenate(masks) if masks else None

    def numbers(self) -> dict[str, float]:
        """Columns of the history; those of the same name add up."""
        elastic, rigid = self.elastic.numbers(), self.rigid.numbers()
        return elastic | rigid | {name: elastic[name] + rigid[name] for name in elastic.keys() & rigid.keys()}

    def save(self) -> State:
        return {"elastic": self.elastic.save(), "rigid": self.rigid.save()}

    def restore(self, state: State) -> None:
        self.rigid.restore(state["rigid"])
        self.elastic.restore(state["elastic"])


def _relative(residual: Array, forces: Array) -> float:
    """The largest residual relative to the forces on its part."""
    found = np.divide(residual, forces, out=residual.copy(), where=forces > 0.0)
    return float(np.nan_to_num(found, nan=np.inf).max(initial=0.0))
