"""Bodies that could meet but are no pair: those that move towards each other, and surfaces of bodies that may turn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.builder.automatic_pairs import Candidate, candidates
from fsci.builder.facing import meeting
from fsci.case import Case
from fsci.case.contact import PairSection
from fsci.case.errors import listed
from fsci.case.fluid import Movement
from fsci.expression import Expression
from solvers.mesh.mesh import Mesh

Array = NDArray[np.float64]


def unpaired(case: Case, meshes: Mapping[str, Mesh], pairs: Mapping[str, PairSection]) -> Iterator[str]:
    """Notes on elastic bodies with these meshes, and obstacles and rigid bodies beside them."""
    known = [{side.body or side.obstacle for _, side in pair.sides} for pair in pairs.values()]
    reach = None if case.contact is None else case.contact.reach
    for first, second in combinations(candidates(case, meshes), 2):
        if first.rigid or not first.faces or not second.faces:
            continue
        if {first.name, second.name} in known:
            yield from _beside(case, first, second, pairs)
            continue
        if not _approach(case, first, second) or not meeting(first.faces, second.faces):
            continue
        apart = f"{_distance(first, second):.3g} {case.units.length}"
        names = f"'{first.name}' and '{second.name}' move towards each other"
        if reach is not None:
            limit = f"{reach:.3g} {case.units.length}"
            yield f"{names}, but are farther apart ({apart}) than 'reach' ({limit}): they are no pair of contact"
        else:
            yield f"{names}, {apart} apart, but are no pair of contact: nothing will hold them apart"


def _beside(case: Case, first: Candidate, second: Candidate, pairs: Mapping[str, PairSection]) -> Iterator[str]:
    """Surfaces of bodies that nothing keeps from turning, while other surfaces of them are in pairs of contact."""
    for one, other in ((first, second), (second, first)):
        if not _may_turn(case, one.name):
            continue
        named: set[str] = set()
        for pair in pairs.values():
            sides = [side for _, side in pair.sides]
            if {side.body or side.obstacle for side in sides} == {one.name, other.name}:
                named |= {name for side in sides if side.body == one.name for name in side.on or ()}
        free = [face.name for face in one.faces if not face.cavity and face.name not in named]
        if named and free:
            which = listed(free, "and")
            yield (
                f"'{one.name}' may turn, but its surfaces {which} are no pair with '{other.name}': if they can meet, "
                f"name all of them in 'on' of one side"
            )


def _may_turn(case: Case, name: str) -> bool:
    """Whether neither supports nor springs hold a body that moves."""
    if case.structure is None or case.structure.dynamics is None or name not in case.elastic_bodies:
        return False
    body = case.elastic_bodies[name]
    return not (body.supports or body.springs or body.point_springs)


def _approach(case: Case, first: Candidate, second: Candidate) -> bool:
    """Whether a motion of one of them leads to the other."""
    away = _middle(second) - _middle(first)
    own, other = _motions(case, first.name, len(away)), _motions(case, second.name, len(away))
    return any(v @ away > 0.0 for v in own) or any(v @ away < 0.0 for v in other)


def _middle(candidate: Candidate) -> Array:
    return np.asarray(np.concatenate([face.middles for face in candidate.faces]).mean(axis=0))


def _distance(first: Candidate, second: Candidate) -> float:
    """Between the middles of the nearest facets."""
    a, b = (np.concatenate([face.middles for face in side.faces]) for side in (first, second))
    a, b = a[:: max(len(a) // 1000, 1)], b[:: max(len(b) // 1000, 1)]
    return float(np.linalg.norm(a[:, None] - b[None], axis=2).min())


def _motions(case: Case, name: str, dim: int) -> list[Array]:
    """Directions into which a body is driven: initial velocity, gravity, and the way of supports or of the obstacle."""
    begin, end = case.time.start, case.time.end
    if name in case.elastic_bodies:
        body = case.elastic_bodies[name]
        vectors: list[Sequence[Any] | None] = [body.initial_velocity, body.gravity]
        found = [_values(vector, end, dim) for vector in vectors if vector is not None]
        for support in body.supports:
            if isinstance(support.displacement, tuple):
                found.append(_values(support.displacement, end, dim) - _values(support.displacement, begin, dim))
        return found
    motion: Movement | Sequence[Expression] | None = None
    if case.contact is not None and name in case.contact.obstacles:
        motion = case.contact.obstacles[name].motion
    elif case.fluid is not None and name in case.fluid.bodies:
        motion = case.fluid.bodies[name].motion
    if isinstance(motion, Movement):
        if motion.velocity is not None:
            return [_values(motion.velocity, end, dim)]
        motion = motion.displacement
    return [] if motion is None else [_values(motion, end, dim) - _values(motion, begin, dim)]


def _values(vector: Sequence[Expression | None], t: float, dim: int) -> Array:
    """A vector at the origin; free components are zero."""
    at = np.zeros((dim, 1))
    return np.array([0.0 if component is None else float(component(at, t)[0]) for component in vector])
