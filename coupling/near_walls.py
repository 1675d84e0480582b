"""Faces of the box as contact surfaces of elastic bodies, from the step on that could bring a body to them.

Until then a structure has the constraint of the case alone, or none: bodies that stay away from all walls move as if
there were no contact. From then on the pair comes and goes like others (`solvers.contact.reach`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from coupling.wall_passed import WallPassed
from solvers.algebra.rows import gather_at
from solvers.api import Array, FailureKind, State
from solvers.contact.carry_over import carry_over
from solvers.contact.contact import Contact
from solvers.contact.pair import Pair
from solvers.contact.reach import EDGES, WAYS
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.periods import gap_of_boxes, no_periods
from solvers.mesh.tessellation import unit_normals
from solvers.structure.field import Structure
from solvers.structure.time_scheme import Statics

#: Product of the normals of facet and wall below which they face each other. Contact needs -0.5, a turn by 18 degrees
#: more. From -0.5 to 0 the motion of a bouncing disc is the same, bit for bit.
FACING_WALL = -0.2


@dataclass(frozen=True)
class WallPair:
    """Part of the surface of a body, the slave, and one face of the box or parts of it, the master."""

    name: str  #: of the pair
    wall: str  #: name of the wall for messages
    axis: int  #: of the normal of the face
    position: float  #: coordinate of the face [m]
    inward: float  #: 1 or -1: direction of the axis into the box
    pair: Pair
    embedded: bool = False  #: some of the body is behind the face at the start
    periods: Array | None = None  #: lengths [m] after which space repeats, shape (dim,); None: it does not

    @cached_property
    def simplices(self) -> NDArray[np.int64]:
        """Nodes of segments or triangles of the slave, shape (facets, simplices of a facet, dim)."""
        split = np.array(CELL_TYPES[self.pair.slave.facet_type].simplices)
        return self.pair.slave.facets[:, split]

    @cached_property
    def edge(self) -> float:
        """Mean length [m] of an edge of the slave."""
        x, facets = self.pair.slave.points, self.pair.slave.facets
        return float(np.linalg.norm(x[facets[:, 1]] - x[facets[:, 0]], axis=1).mean())

    def away(self, x: Array) -> float:
        """A lower bound of `least_gap` that costs less: most pairs are far apart."""
        return float((self.inward * (x[:, self.axis] - self.position)).min(initial=np.inf))

    def least_gap(self, x: Array, ways: Array | None = None) -> float:
        """The least gap [m] of facets that face the wall and are beside it, of the slave at x [m].

        ways: lengths [m] by which the gap at each node is to count less.
        """
        corners = x[self.simplices]
        facing = self.inward * unit_normals(corners)[..., self.axis] < FACING_WALL
        beside = self._beside(corners)
        gaps = self.inward * (corners[..., self.axis] - self.position)
        if ways is not None:
            gaps -= ways[self.simplices]
        return float(np.where((facing & beside)[..., None], gaps, np.inf).min(initial=np.inf))

    def _beside(self, corners: Array) -> NDArray[np.bool_]:
        """Simplices (facets, simplices of a facet, dim corners, dim) whose boxes meet those of the wall's parts."""
        along = [axis for axis in range(corners.shape[-1]) if axis != self.axis]
        low, high = corners.min(axis=-2)[..., along], corners.max(axis=-2)[..., along]
        parts = self.pair.master.corners[:, :, along]
        found = np.zeros(corners.shape[:2], dtype=bool)
        lengths = (no_periods(corners.shape[-1]) if self.periods is None else self.periods)[along]
        for start, end in zip(parts.min(axis=1), parts.max(axis=1), strict=True):
            found |= gap_of_boxes((low, high), (start, end), lengths) <= 0.0
        return found


class NearWalls:
    """Adds pairs with walls to the contact of a structure. All calls are collective."""

    def __init__(
        self, structure: Structure, pairs: Sequence[WallPair], create: Callable[[Sequence[WallPair]], Contact]
    ):
        """create: contact of the pairs of the case, then of some of these."""
        self._structure, self._pairs, self._create = structure, list(pairs), create
        self._alone = structure.constraint, structure.exchanges_mass  #: without walls
        self._present: list[str] = []  #: names of the pairs that have come in
        self._needed: list[str] = []  #: of those that a failed step has shown to be needed
        self._said: set[str] = set()
        dofs = [self._dofs_of(pair) for pair in pairs]
        first, where = np.unique(np.concatenate([own[:, 0] for own in dofs]), return_inverse=True)
        self._dofs = first[:, None] + np.arange(structure.dim)  #: of the nodes of all slaves, shape (n, dim)
        self._nodes = np.split(where.ravel(), np.cumsum([len(own) for own in dofs])[:-1])  #: of each pair

    @staticmethod
    def _dofs_of(pair: WallPair) -> NDArray[np.int64]:
        assert pair.pair.slave.dofs is not None
        return pair.pair.slave.dofs

    @property
    def dofs(self) -> NDArray[np.int64]:
        """Global dofs of the nodes of all slaves, shape (n, dim)."""
        return self._dofs

    @property
    def waiting(self) -> bool:
        """Whether any pair has not come in yet."""
        return len(self._present) < len(self._pairs)

    def start(self, t: float, dt: float) -> list[str]:
        """Before the structure starts at t [s]: add what the first step of length dt [s] could reach; notes on it."""
        self._structure.set_first_motion(t)
        return self._add(self._reached(self._at_slaves(self._structure.now.v), dt))

    def approach(self, dt: float) -> list[str]:
        """Add the pairs that a step of length dt [s] could bring into contact; returns notes to the user."""
        if not self.waiting:
            return []
        structure = self._structure
        if isinstance(structure.time, Statics):
            scale = 1.0 / structure.last_length if structure.last_length else 0.0
            v = scale * (structure.now.u - structure.old.u)
        else:
            v = structure.now.v
        return self._enter(self._reached(self._at_slaves(v), dt))

    def require_apart(self) -> None:
        """Raise WallPassed if a body is behind a wall whose pair has not come in."""
        if not self.waiting:
            return
        u = self._at_slaves(self._structure.now.u)
        passed = [
            (pair, -gap)
            for pair, x in self._waiting(u)
            if not pair.embedded and pair.away(x) < 0.0 and (gap := pair.least_gap(x)) < -EDGES * pair.edge
        ]
        if passed:
            self._needed += [pair.name for pair, _ in passed]
            pair, depth = passed[0]
            reason = f"{pair.pair.slave.body} has come {depth:.3g} [length] behind {pair.wall} in one step"
            raise WallPassed(self._structure.name, FailureKind.NOT_HELD, reason)

    def _at_slaves(self, owned: Array) -> Array:
        """Values at the nodes of all slaves, shape (n, dim), from those at owned dofs."""
        return gather_at(self._structure.comm, owned, self._structure.layout.start, self._dofs)

    def _waiting(self, u: Array):
        """(pair, positions of its slave [m]) of those that have not come in."""
        for pair, nodes in zip(self._pairs, self._nodes, strict=True):
            if pair.name not in self._present:
                yield pair, pair.pair.slave.points + u[nodes]

    def _reached(self, v: Array, dt: float) -> list[str]:
        """Names of the pairs that a step could bring into contact, with the velocities v [m/s] of all slave nodes."""
        u = self._at_slaves(self._structure.now.u)
        nodes = {pair.name: own for pair, own in zip(self._pairs, self._nodes, strict=True)}
        found = []
        for pair, x in self._waiting(u):
            ways = WAYS * dt * np.maximum(0.0, -pair.inward * v[nodes[pair.name]][:, pair.axis])
            near = EDGES * pair.edge
            if pair.away(x) <= near + ways.max(initial=0.0) and pair.least_gap(x, ways) <= near:
                found.append(pair.name)
        return found

    def _enter(self, names: Sequence[str]) -> list[str]:
        """Add pairs to a structure that moves."""
        if not names:
            return []
        structure, before = self._structure, self._structure.constraint
        notes = self._add(names)
        structure.start_constraint()
        after = structure.constraint
        assert isinstance(after, Contact)
        assert before is None or isinstance(before, Contact)
        carry_over(before, after, after.positions(structure.at_constraint(structure.now.u), structure.current.t))
        structure.forget_mass()
        return notes

    def _add(self, names: Sequence[str]) -> list[str]:
        if not names:
            return []
        self._set([*self._present, *names])
        new = [pair for pair in self._pairs if pair.name in names and pair.name not in self._said]
        self._said |= {pair.name for pair in new}
        return [f"{pair.pair.slave.body} is near {pair.wall}: contact {pair.name}" for pair in new]

    def _set(self, names: Sequence[str]) -> None:
        """Let the structure have the contact of these pairs, in the order in which they came in."""
        if list(names) == self._present:
            return
        self._present = list(names)
        constraint, exchanges = self._alone
        if names:
            by_name = {pair.name: pair for pair in self._pairs}
            constraint = self._create([by_name[name] for name in names])
            exchanges = not isinstance(self._structure.time, Statics)
        self._structure.constrain(constraint, exchanges_mass=exchanges)

    # ---------------------------------------------------------------------------------------- save and restore

    def save(self) -> State:
        return {"present": " ".join(self._present)}

    def begin_restore(self, state: State) -> None:
        """Let the structure have the contact of a saved state, before that is restored."""
        names = state["present"].split()
        if names != self._present:
            self._set(names)
            if names:
                self._structure.start_constraint()

    def end_restore(self) -> None:
        """Add what a failed step has shown to be needed."""
        self._enter([name for name in dict.fromkeys(self._needed) if name not in self._present])
