"""Springs with dampers between material points of elastic bodies, points of other fields, and points at rest.

A material point X of a body has the place x = X + sum N_a(X) u_a, with the shape functions N_a of its cell. The force F
of a spring (`solvers.spring_law`) is N_a(X) F on the node a. It counts as a load of the bodies.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.algebra.blocks import Layout
from solvers.algebra.rows import distributed, gather_at, owned_rows
from solvers.algebra.sparse import sparse_from_entries
from solvers.api import Array, Indices
from solvers.spring_law import PointMotion, SpringLaw
from solvers.structure.body import Body
from solvers.structure.instant import MovingStructure
from solvers.structure.time_scheme import TimeScheme


class SpringOutside(ValueError):
    """An end of a spring is not in its body."""

    def __init__(self, spring: int, end: int, message: str):
        super().__init__(message)
        self.spring, self.end = spring, end


@dataclass(frozen=True)
class SpringEnd:
    """A point of a body, or of something else."""

    body: str | None  #: name of the body; None: the point is at rest
    at: Sequence[float]  #: the point at the start [m], shape (dim,)
    motion: PointMotion | None = None  #: of a body of another field


@dataclass(frozen=True)
class SpringBetween:
    """A spring and a damper between two points."""

    ends: tuple[SpringEnd, SpringEnd]
    law: SpringLaw


@dataclass(frozen=True)
class EndPlace:
    """The end of a spring at present; of a point that this field does not move without nodes."""

    dofs: NDArray[np.int64]  #: global, shape (k, dim)
    weights: Array  #: shape functions, shape (k,)
    x: Array  #: [m], shape (3,)
    v: Array  #: [m/s], shape (3,)
    slope: Array  #: derivative of the velocity of the nodes by their displacement [1/s], shape (k, dim)

    def rows(self, dim: int) -> Array:
        """Derivative of x by the displacements of the nodes, shape (3, k * dim)."""
        return np.kron(self.weights, np.eye(3)[:, :dim])

    def rates(self, dim: int) -> Array:
        """Derivative of v by the displacements of the nodes, shape (3, k * dim)."""
        return self.rows(dim) * self.slope.ravel()


class SprungStructure(MovingStructure, Protocol):
    """A structure with its time scheme."""

    time: TimeScheme


class PointSprings:
    """All springs of a structure."""

    def __init__(self, springs: Sequence[SpringBetween], bodies: Sequence[Body], layout: Layout):
        """Raises SpringOutside (collective)."""
        self.springs = list(springs)
        self._nodes = [
            [_nodes(bodies, layout, number, side, end) for side, end in enumerate(spring.ends)]
            for number, spring in enumerate(springs)
        ]

    def place(self, structure: SprungStructure, spring: int, side: int, slope: Array | None = None) -> EndPlace:
        """Where an end is; slope: derivative of the velocity of owned dofs, None: zero (collective)."""
        end, nodes, dim = self.springs[spring].ends[side], self._nodes[spring][side], structure.dim
        at = np.pad(np.asarray(end.at, dtype=float), (0, 3 - dim))
        if nodes is None:
            none = np.empty((0, dim))
            x, v = (at, np.zeros(3)) if end.motion is None else end.motion()
            return EndPlace(none.astype(np.int64), none[:, 0], x, v, none)
        dofs, weights = nodes
        own = np.zeros(structure.layout.size) if slope is None else slope
        u, v, rate = (
            gather_at(structure.comm, values, structure.layout.start, dofs)
            for values in (structure.now.u, structure.now.v, own)
        )
        u, v = (np.pad(weights @ values, (0, 3 - dim)) for values in (u, v))
        return EndPlace(dofs, weights, at + u, v, rate)

    def linked(self, structure: SprungStructure, numbers: Indices) -> list[tuple[Indices, Indices]]:
        """Pairs of numbers of the bodies that springs join; numbers: at owned dofs (collective)."""
        ends = [[self.number(structure, numbers, i, side) for side in (0, 1)] for i in range(len(self.springs))]
        return [(one, other) for one, other in ends if len(one) and len(other)]

    def number(self, structure: SprungStructure, numbers: Indices, spring: int, side: int) -> Indices:
        """That of the body at an end, shape (1,), empty without one; numbers: at owned dofs (collective)."""
        nodes = self._nodes[spring][side]
        if nodes is None:
            return np.empty(0, dtype=np.int64)
        found = gather_at(structure.comm, numbers.astype(float), structure.layout.start, nodes[0][0, :1])
        return found.astype(np.int64)

    def motion(self, structure: SprungStructure, spring: int, side: int) -> tuple[Array, Array]:
        """Position [m] and velocity [m/s] of an end, for other fields (collective)."""
        place = self.place(structure, spring, side)
        return place.x, place.v

    def places(
        self, structure: SprungStructure, slope: Array | None = None
    ) -> Iterator[tuple[SpringLaw, EndPlace, EndPlace]]:
        """The law and both ends of all springs, as `place`."""
        for number, spring in enumerate(self.springs):
            yield spring.law, self.place(structure, number, 0, slope), self.place(structure, number, 1, slope)

    def slope(self, structure: SprungStructure) -> Array | None:
        """Derivative of the velocity of owned dofs by their displacement [1/s]; None without a damper."""
        if not any(spring.law.damping for spring in self.springs):
            return None
        weighted = structure.time.damping_slope(structure, structure.current.dt)
        return None if weighted is None else weighted / structure.time.force_weight

    def force(self, structure: SprungStructure) -> Array:
        """Force [N] on the bodies at owned dofs (collective)."""
        found, dim = np.zeros(structure.layout.size), structure.dim
        for law, one, other in self.places(structure):
            force = law.force(one.x - other.x, one.v - other.v)[0][:dim]
            for place, sign in ((one, 1.0), (other, -1.0)):
                mine, local = structure.layout.among_owned(place.dofs)
                np.add.at(found, local, (sign * place.weights[:, None] * force)[mine])
        return found

    @property
    def turning_dampers(self) -> bool:
        """Whether the derivative of the force is not symmetric."""
        return any(spring.law.damping and spring.law.length for spring in self.springs)

    def added_to(self, structure: SprungStructure, matrix: PETSc.Mat) -> PETSc.Mat:
        """The matrix less the weighted derivative of the force by the displacements; a new one if any (collective)."""
        if not self.springs:
            return matrix
        weight, dim = structure.time.force_weight, structure.dim
        rows, columns, entries = [], [], []
        for law, one, other in self.places(structure, self.slope(structure)):
            _, by_d, by_rate = law.force(one.x - other.x, one.v - other.v)
            d = np.hstack([one.rows(dim), -other.rows(dim)])
            rate = np.hstack([one.rates(dim), -other.rates(dim)])
            dofs = np.concatenate([one.dofs.ravel(), other.dofs.ravel()])
            block = -weight * d.T @ (by_d @ d + by_rate @ rate)
            rows.append(np.repeat(dofs, len(dofs)))
            columns.append(np.tile(dofs, len(dofs)))
            entries.append(block.ravel())
        return added_entries(matrix, rows, columns, entries)

    def energy(self, structure: SprungStructure) -> float:
        """Energy [J] of all springs at present (collective)."""
        return sum(law.energy(one.x - other.x) for law, one, other in self.places(structure))


def added_entries(
    matrix: PETSc.Mat,
    rows: Sequence[NDArray[np.int64]],
    columns: Sequence[NDArray[np.int64]],
    entries: Sequence[Array],
) -> PETSc.Mat:
    """A new matrix with further entries, which add up; all processes have the same ones (collective)."""
    start, end = matrix.getOwnershipRange()
    row, column, entry = np.concatenate(rows), np.concatenate(columns), np.concatenate(entries)
    mine = (row >= start) & (row < end)
    shape = end - start, matrix.size[1]
    more = sparse_from_entries(row[mine] - start, column[mine], entry[mine], shape)
    return distributed(owned_rows(matrix) + more, matrix.getSizes(), matrix.comm)


def _nodes(
    bodies: Sequence[Body], layout: Layout, spring: int, side: int, end: SpringEnd
) -> tuple[NDArray[np.int64], Array] | None:
    """(dofs, shape functions) of the nodes of a material point; None if the end is no point of the bodies."""
    index = next((i for i, body in enumerate(bodies) if body.name == end.body), None)
    if index is None:
        return None
    body, comm = bodies[index], layout.comm
    found = fem.locate_point(body.domain, np.asarray(end.at, dtype=float))
    mine = None
    if found is not None:
        cell, reference = found
        mine = body.nodes[body.space.dofmap.cell_dofs(cell)], fem.tabulate(body.domain, reference)
    given = [part for part in comm.allgather(mine) if part is not None]
    if not given:
        raise SpringOutside(spring, side, f"the point {tuple(end.at)} is not in body '{body.name}'")
    nodes, weights = given[0]
    owned = np.asarray(body.nodes[: body.owned])
    here, local = np.nonzero(np.asarray(nodes)[:, None] == owned)
    dofs = np.zeros((len(nodes), body.dim), dtype=np.int64)
    first = layout.start + layout.offsets[index]
    dofs[here] = first + body.dim * local[:, None] + np.arange(body.dim)
    return comm.allreduce(dofs), weights
