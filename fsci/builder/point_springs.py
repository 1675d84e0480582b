"""From a case to the springs that have an end on an elastic body."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from fsci.case import Case
from fsci.case.free_body import PointSpringSection
from fsci.case.yaml_text import Keys
from solvers.structure.point_springs import SpringBetween, SpringEnd

if TYPE_CHECKING:
    from solvers.rigid.field import RigidBodies


def point_springs(case: Case, rigid: RigidBodies | None) -> list[tuple[tuple[Keys, Keys], SpringBetween]]:
    """All springs with an end on an elastic body, after the places of both ends in the case."""
    found = []
    for name, body in case.elastic_bodies.items():
        for i, spring in enumerate(body.point_springs):
            found.append(_spring(case, name, spring, ("structure", "bodies", name, "point_springs", i), rigid))
    for name, free in (case.rigid or {}).items():
        base = case.rigid_surfaces[name].keys
        keys = base if base[0] == "rigid" else (*base, "free")
        for i, spring in enumerate(free.springs):
            if spring.to is not None and spring.to.body in case.elastic_bodies:
                found.append(_spring(case, name, spring, (*keys, "springs", i), rigid))
    return found


def _spring(
    case: Case, name: str, spring: PointSpringSection, keys: Keys, rigid: RigidBodies | None
) -> tuple[tuple[Keys, Keys], SpringBetween]:
    assert spring.to is not None
    ends = _end(case, name, spring.at, rigid), _end(case, spring.to.body, spring.to.at, rigid)
    return ((*keys, "at"), (*keys, "to", "at")), SpringBetween(ends, spring.law())


def _end(case: Case, name: str | None, at: Sequence[float], rigid: RigidBodies | None) -> SpringEnd:
    if name is None or name in case.elastic_bodies:
        return SpringEnd(name, at)
    from solvers.rigid.line_springs import point_motion

    assert rigid is not None
    index = [body.name for body in rigid.bodies].index(name)
    return SpringEnd(name, at, partial(point_motion, rigid, index, at))
