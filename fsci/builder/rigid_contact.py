"""From a case to the contact of its free rigid bodies: with each other, with given ones, obstacles, faces of the box.

Bodies do not pass each other, except those that a spring without length joins. `contact: none` turns it off.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fsci.builder.closed_faces import closed_faces
from fsci.builder.obstacle_motion import motion_of_obstacle
from fsci.builder.on_first import shared
from fsci.builder.periods import periods
from fsci.case import Case
from fsci.case.contact import ContactSection, Friction
from fsci.meshes.of_case import read_obstacle
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import Motion
from solvers.mesh.periods import box_of, no_periods, way_of, ways_to, without_longer
from solvers.mesh.tessellation import tessellate
from solvers.rigid.body import RigidBody
from solvers.rigid.contact import Obstacle, RigidContact, RigidPair
from solvers.rigid.gaps import RigidWall, gaps

Array = NDArray[np.float64]

#: Gap of bodies in contact in a flow, in smallest cells. Surfaces that touch divide the fluid at once: the pressure
#: beside jumps, it may push bodies apart that touch and pull them together when they part, and no state is a solution.
#: From 1e-4 to 1e-2 discs in a hopper move alike.
STANDOFF = 1e-3

#: Overlap relative to the extent of a body up to which it is rounding of meshes.
MESH_OVERLAP = 1e-6


def build_rigid_contact(
    case: Case, bodies: Sequence[RigidBody], given: Sequence[ImmersedBody], comm: MPI.Comm
) -> RigidContact | None:
    """Contact of free bodies; given: bodies in the flow with a motion of their own. None: nothing is there to touch.

    Raises CaseError (collective).
    """
    if case.contact_off:
        return None
    t = case.time.start
    settings = case.contact
    friction = _Friction.of(settings)
    pairs = [
        RigidPair(one, other, friction(bodies[one].name, bodies[other].name))
        for one, other in combinations(range(len(bodies)), 2)
        if frozenset((bodies[one].name, bodies[other].name)) not in case.joined
    ]
    others: list[Obstacle | RigidWall] = [*_immersed(given), *_obstacles(case, comm), *_walls(case)]
    pairs += [
        RigidPair(index, other, friction(bodies[index].name, other.name))
        for index in range(len(bodies))
        for other in others
    ]
    repeat = periods(case)
    pairs = [pair for pair in pairs if not _overlaps(bodies, pair, t, repeat)]
    restitution = 0.0 if settings is None else settings.restitution
    standoff = 0.0 if case.fluid is None else STANDOFF * float(case.fluid.grid.smallest.min())
    return RigidContact(bodies, pairs, restitution=restitution, standoff=standoff, periods=repeat) if pairs else None


@dataclass(frozen=True)
class _Friction:
    """Coefficients of friction of what touches, by names."""

    default: float
    own: Mapping[frozenset[str], float]  #: of pairs with a section of their own

    @classmethod
    def of(cls, settings: ContactSection | None) -> _Friction:
        if settings is None:
            return cls(0.0, {})
        default = settings.friction or Friction()
        own = {
            frozenset(pair.bodies): (pair.friction or Friction()).coefficient or 0.0
            for pair in settings.rigid_pairs.values()
        }
        return cls(default.coefficient or 0.0, own)

    def __call__(self, one: str, other: str) -> float:
        return self.own.get(frozenset((one, other)), self.default)


def _obstacles(case: Case, comm: MPI.Comm) -> Iterator[Obstacle]:
    """With the whole boundary of their meshes: rigid bodies do not enter them at other sides, either."""
    for name, settings in ({} if case.contact is None else case.contact.obstacles).items():
        if settings.free is None:
            points, facets = shared(comm, partial(_boundary, case, name))
            yield Obstacle(name, points, facets, motion_of_obstacle(case, name, points))


def _boundary(case: Case, name: str) -> tuple[Array, NDArray[np.int64]]:
    mesh = read_obstacle(case, name)
    facets, nodes = tessellate(mesh)
    return mesh.points[nodes], facets


def _immersed(given: Sequence[ImmersedBody]) -> Iterator[Obstacle]:
    for body in given:
        if (motion := body.motion) is not None:
            moves = None if body.rests else _positions_of(motion)
            yield Obstacle(body.surface.name, motion(0.0).x, body.surface.facets, moves)


def _positions_of(motion: Callable[[float], Motion]) -> Callable[[float], Array]:
    return lambda t: motion(t).x


def _walls(case: Case) -> Iterator[RigidWall]:
    for wall in closed_faces(case):
        assert case.fluid is not None
        normal = np.zeros(case.fluid.grid.dimension)
        normal["xyz".index(wall.face[0])] = 1.0 if wall.face[1] == "-" else -1.0
        yield RigidWall(wall.name, wall.position * np.abs(normal), normal, wall.within)


def _overlaps(bodies: Sequence[RigidBody], pair: RigidPair, t: float, repeat: Array | None) -> bool:
    """Whether a body lies in the other one at the start, as where a plane of symmetry cuts it."""
    body, other = bodies[pair.body], pair.other
    if isinstance(other, RigidWall):
        return float(other.gaps(body.points).gap.min()) < -MESH_OVERLAP * body.extent
    points, facets = (
        (bodies[other].points, bodies[other].facets) if isinstance(other, int) else (other.at(t), other.facets)
    )
    lengths = no_periods(body.dim) if repeat is None else repeat
    lengths = without_longer(points, lengths)
    for numbers in ways_to(box_of(body.points), box_of(points), lengths):
        image = points + way_of(numbers, lengths)
        ways = (body.points, image[facets]), (image, body.points[body.facets])
        if any(float(gaps(x, corners).gap.min()) < -MESH_OVERLAP * body.extent for x, corners in ways):
            return True
    return False
