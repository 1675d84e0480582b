"""Supports, springs and loads of a body from a case, with their surfaces and nodes in the mesh."""

from __future__ import annotations

from typing import Any

import numpy as np

from fsci.case.structure import BodySection
from fsci.case.supports import SpringSection, SupportSection
from fsci.case.values import value_of
from fsci.meshes.locations import Locations
from solvers.structure.active import Active
from solvers.structure.body import Spring, Support, Symmetry
from solvers.structure.loads import LineForce, PointForce, Pressure, Traction
from solvers.structure.pre_stretch import PreStretch
from solvers.structure.supports import Roller


def build_loads(body: BodySection, locations: Locations) -> dict[str, tuple[Any, ...]]:
    """Supports, springs and loads as `Body` takes them."""

    def each(section: str, build: Any) -> tuple[Any, ...]:
        entries = enumerate(getattr(body, section))
        return tuple(build(entry, where) for index, entry in entries for where in locations[section, index])

    return {
        "supports": each("supports", _support),
        "springs": each("springs", _spring),
        "tractions": each("tractions", lambda load, where: Traction(where, load.value)),
        "pressures": each("pressures", lambda load, where: Pressure(where, load.value)),
        "active": tuple(Active(one.direction, one.stress) for one in body.active),
        "pre_stretch": tuple(PreStretch(value_of(one.stretch), one.direction) for one in body.pre_stretch),
        "line_forces": each("line_forces", lambda load, where: LineForce(where[0], where[1], load.value)),
        "point_forces": each("point_forces", lambda load, where: PointForce(where, load.value)),
    }


def _support(support: SupportSection, where: Any) -> Support | Symmetry | Roller:
    if support.symmetry:
        return Symmetry(where)
    if isinstance(support.displacement, tuple):
        return Support(where, support.displacement)
    return Roller(where, support.direction, support.displacement or _zero)


def _spring(spring: SpringSection, where: Any) -> Spring:
    return Spring(where, spring.stiffness, spring.direction, spring.normal)


def _zero(x: Any, t: float) -> Any:
    return np.zeros(x.shape[1])
