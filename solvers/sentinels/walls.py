"""The sentinel of bodies that pass through walls of the fluid's box, or leave it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, FailureKind, Finding, State
from solvers.sentinels.bodies import LEFT_BETWEEN, Measures, MovingBody, arc_height
from solvers.sentinels.overlaps import place_of


@dataclass(frozen=True)
class Wall:
    """One face of the box, or the part of it that a patch has."""

    name: str  #: of the patch
    face: str  #: x-, x+, y-, ...
    position: float  #: coordinate of the face [m]
    within: Callable[[Array], NDArray[np.bool_]] | None = None  #: points of the face, (dim, n), that are on the patch

    def depth(self, x: Array) -> Array:
        """How far points (n, dim) are behind the face [m], zero beside the patch."""
        axis = "xyz".index(self.face[0])
        behind = self.position - x[:, axis] if self.face[1] == "-" else x[:, axis] - self.position
        if self.within is not None:
            on_face = x.T.copy()
            on_face[axis] = self.position
            behind = np.where(self.within(on_face), behind, 0.0)
        return np.maximum(behind, 0.0)


class BoxWalls:
    """Looks for vertices of elastic and free bodies, in the fluid, behind faces that hold it.

    A body that reaches through a face at the start may do so all the time. Contact with an obstacle at the wall lets
    vertices pass by the height of the arcs that facets replace, edges included.
    """

    def __init__(
        self,
        bodies: Sequence[MovingBody],
        walls: Sequence[Wall],
        box: tuple[Array, Array],
        ending: Collection[str] = (),
    ):
        """box: lowest and highest corner [m]; ending: names of the bodies that end the run when they have left it."""
        self._ending = frozenset(ending)
        self._bodies, self._walls, self._box = [body for body in bodies if body.free], list(walls), box
        self._allowed: list[list[bool]] = []  # by body and wall
        self._tolerance: list[Array] = []  # at the vertices of each body [m]
        self._edge: list[Array] = []  # longest edge at them [m]
        self._within: list[bool] = []  # bodies that are in the box at the start

    def start(self, t: float) -> None:
        """Keep what is on and behind the faces at the time t [s]."""
        for kept in (self._allowed, self._tolerance, self._edge, self._within):
            kept.clear()
        for body in self._bodies:
            x = body.positions(t)
            measures = Measures(body.facets, x[body.facets])
            rounding = LEFT_BETWEEN * measures.thickness
            heights = arc_height(measures.edge, measures.bends[0] + measures.bends[1])
            self._tolerance.append(rounding + _at_vertices(heights, body.facets, len(x)))
            self._edge.append(_at_vertices(measures.edge, body.facets, len(x)))
            self._allowed.append([bool((_depth(body, wall, x) > rounding).any()) for wall in self._walls])
            self._within.append(self._meets_box(x))

    def _meets_box(self, x: Array) -> bool:
        low, high = self._box
        return bool(((x.max(axis=0) > low) & (x.min(axis=0) < high)).all())

    def look(self, t: float, dt: float) -> list[Finding]:
        """Walls that bodies have passed at the end t [s] of a step, and bodies that have left the box."""
        found = []
        for k, body in enumerate(self._bodies):
            x = body.positions(t)
            through = [self._through(k, number, x) for number in range(len(self._walls))]
            found += [finding for finding in through if finding]
            if self._within[k] and not self._meets_box(x):
                ends = body.name in self._ending
                follows = "the run ends, by 'leaves: stop'" if ends else "what follows has no meaning for it"
                message = f"{body.name} has left the box of the fluid; {follows}"
                found.append(Finding("outside", body.name, 1.0, message, ends_run=ends))
        return found

    def _through(self, k: int, number: int, x: Array) -> Finding | None:
        wall, name = self._walls[number], self._bodies[k].name
        depth = _depth(self._bodies[k], wall, x)
        wrong = depth > self._tolerance[k]
        if self._allowed[k][number] or not wrong.any():
            return None
        deepest = int(np.where(wrong, depth, 0.0).argmax())
        where = tuple(x[deepest].tolist())
        message = (
            f"{name} has passed through the face {wall.face} of the box (patch {wall.name}) by {depth[deepest]:.3g} "
            f"{place_of(where)}: nothing holds it there; put an obstacle along the face and give both a pair of contact"
        )
        worthless = depth[deepest] > self._edge[k][deepest]
        return Finding("wall", name, float(depth[deepest]), message, FailureKind.NOT_HELD if worthless else None, where)

    def save(self) -> State:
        return {}

    def restore(self, state: State) -> None:
        """It keeps nothing from step to step."""


def _depth(body: MovingBody, wall: Wall, x: Array) -> Array:
    """How far the vertices of a body are behind a wall [m], zero of those without fluid."""
    depth = wall.depth(x)
    return depth if body.dry is None else np.where(body.dry, 0.0, depth)


def _at_vertices(values: Array, facets: NDArray[np.int64], count: int) -> Array:
    """The largest value of the facets at each vertex."""
    found = np.zeros(count)
    for corner in facets.T:
        np.maximum.at(found, corner, values)
    return found
