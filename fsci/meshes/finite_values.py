"""Formulas of a body that have no finite value where the run evaluates them: at nodes, cells and facets of its mesh."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case
from fsci.case.expressions import FEW_TIMES, MOST_POINTS, expressions, first_not_finite, needs_start, run_times
from fsci.case.messages import subject
from fsci.expression import Expression
from fsci.meshes.locations import Locations
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import surface_facets

Array = NDArray[np.float64]
Keys = tuple[str | int, ...]

#: Settings of a body whose values are those at nodes.
AT_NODES = ("initial_displacement", "initial_velocity", "supports", "point_forces")


def require_finite(case: Case, name: str, mesh: Mesh, locations: Locations) -> None:
    """Raises CaseError for the first formula of position that is infinite or not a number."""
    whole = run_times(case, FEW_TIMES)
    for keys, formula, x in _formulas(case, name, mesh, locations):
        times = whole if needs_start(case, keys) else whole[1:]
        if formula.uses - {"t"} and (found := first_not_finite(formula, x, times)) is not None:
            raise case.error(keys, f"{subject(keys)}: {found}")


def _formulas(case: Case, name: str, mesh: Mesh, locations: Locations) -> Iterator[tuple[Keys, Expression, Array]]:
    """(path, formula, points (dim, n) at which it is evaluated)."""
    body, base = case.elastic_bodies[name], ("structure", "bodies", name)
    for key in type(body).model_fields:
        value = getattr(body, key)
        found = list(expressions(value, (*base, key)))
        if not any(formula.uses - {"t"} for _, formula in found):
            continue
        for keys, formula in found:
            where = locations.get((key, keys[4])) if len(keys) > 4 and isinstance(keys[4], int) else None  # type: ignore[arg-type]
            points = _whole(mesh, key) if where is None else _parts(mesh, key, where)
            yield keys, formula, points[:: max(len(points) // MOST_POINTS, 1)].T


def _whole(mesh: Mesh, key: str) -> Array:
    if key in AT_NODES:
        return mesh.points
    corners = mesh.cells[:: max(len(mesh.cells) // MOST_POINTS, 1), : CELL_TYPES[mesh.cell_type].corners]
    return np.asarray(mesh.points[corners].mean(axis=1))


def _parts(mesh: Mesh, key: str, where: list[Any]) -> Array:
    """Nodes, or middles of facets, of the places at which an entry acts."""
    found = []
    for place in where:
        if isinstance(place, str):
            facets = surface_facets(mesh, place)
            corners = facets[:, : CELL_TYPES[CELL_TYPES[mesh.cell_type].facet].corners]
            nodes = mesh.points[np.unique(facets)]
            found.append(nodes if key in AT_NODES else mesh.points[corners].mean(axis=1))
        elif isinstance(place, tuple):
            found.append(place[1][:, :2].mean(axis=1))
        else:
            found.append(mesh.points[place])
    return np.concatenate(found)
