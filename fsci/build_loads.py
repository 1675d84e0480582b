"""From supports, springs and loads of a body in a case to those of the solver, each at its place in the mesh."""

from __future__ import annotations

from typing import Any

import numpy as np

from fsci.case import Case
from fsci.case.structure import Body as Section
from fsci.case.supports import Spring as SpringSection
from fsci.case.supports import Support as SupportSection
from fsci.mesh import MeshError, require_surface
from fsci.places import find_group, find_lines, find_node
from solvers.mesh import Mesh
from solvers.structure.body import Spring, Support, Symmetry
from solvers.structure.loads import LineForce, PointForce, Pressure, Traction
from solvers.structure.supports import Roller

#: (setting of the body, number of the entry) -> where it acts: a surface, nodes, or (nodes, positions) of lines
Places = dict[tuple[str, int], list[Any]]

KINDS = {"supports": ("surface", "line", "points"), "springs": ("surface", "points"), "point_forces": ("points",)}


def find_places(case: Case, name: str, mesh: Mesh) -> Places:
    """Where supports, springs and loads of a body act. Raises CaseError."""
    body, places = case.elastic_bodies[name], {}
    for section in (*KINDS, "tractions", "pressures", "line_forces"):
        for index, entry in enumerate(getattr(body, section)):
            at = getattr(entry, "at", None)
            key = "on" if at is None else "at"
            try:
                found = (
                    [find_node(mesh, at)] if at is not None else [_find(mesh, section, entry, on) for on in entry.on]
                )
            except MeshError as error:
                raise case.error(("structure", "bodies", name, section, index, key), str(error)) from None
            places[section, index] = found
    return places


def _find(mesh: Mesh, section: str, entry: Any, name: str) -> Any:
    if section in ("tractions", "pressures"):
        require_surface(mesh, name)
        return name
    if section == "line_forces":
        lines = find_lines(mesh, name)
        return lines, mesh.points[lines]
    flat = getattr(entry, "normal", False) or getattr(entry, "symmetry", False)
    return find_group(mesh, name, ("surface",) if flat else KINDS[section])


def build_loads(body: Section, places: Places) -> dict[str, tuple[Any, ...]]:
    """Supports, springs and loads as `BodySettings` takes them."""

    def each(section: str, build: Any) -> tuple[Any, ...]:
        entries = enumerate(getattr(body, section))
        return tuple(build(entry, where) for index, entry in entries for where in places[section, index])

    return {
        "supports": each("supports", _support),
        "springs": each("springs", _spring),
        "tractions": each("tractions", lambda load, where: Traction(where, load.value)),
        "pressures": each("pressures", lambda load, where: Pressure(where, load.value)),
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
