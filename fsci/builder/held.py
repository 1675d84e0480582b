"""Rigid motions of bodies that nothing holds: static equilibrium does not determine them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case
from fsci.meshes.locations import find_locations
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.tessellation import area_vectors, tessellate
from solvers.mesh.topology import surface_facets

Array = NDArray[np.float64]

#: Size of a motion at the supports, relative to that of the body, below which they do not hold it.
UNHELD = 1e-6


def free_motions(case: Case, name: str, mesh: Mesh) -> str | None:
    """The warning about a static body whose supports and springs leave a rigid motion free; None if they leave none.

    A pair of contact or a spring to another body may hold it; which motions depends on the solution.
    """
    assert case.structure is not None
    pairs = {} if case.contact is None else case.contact.pairs
    if case.structure.dynamics is not None or case.coupling is not None:
        return None
    if any(name == side.body for pair in pairs.values() for _, side in pair.sides) or _sprung(case, name):
        return None
    dim = mesh.points.shape[1]
    matrix, free = _held(case, name, mesh)
    names = [*(f"translation along {axis}" for axis in "xyz"[:dim]), *_rotations(dim)]
    if not free:
        return None
    alone = [word for word, column in zip(names, matrix.T, strict=True) if np.abs(column).max(initial=0.0) < UNHELD]
    # a rotation about another point than the centre, or a translation along no axis
    words = [*alone, *(["a combination of translation and rotation"] if free > len(alone) else [])]
    return f"no support, spring or pair holds {_listed(words)} of the body, which static equilibrium does not determine"


def is_held(case: Case, name: str, mesh: Mesh) -> bool:
    """Whether supports and springs leave a static body no rigid motion."""
    return _sprung(case, name) or not _held(case, name, mesh)[1]


def free_translations(case: Case, name: str, mesh: Mesh) -> Array:
    """Projection onto the translations of the centre in the motions that supports and springs leave, (dim, dim)."""
    dim = mesh.points.shape[1]
    matrix, free = _held(case, name, mesh)
    if len(matrix) == 0:
        return np.eye(dim)
    motions = np.linalg.svd(matrix)[2][matrix.shape[1] - free :, :dim]
    along, sizes, _ = np.linalg.svd(motions.T, full_matrices=False)
    kept = along[:, sizes > UNHELD]
    return kept @ kept.T


def _held(case: Case, name: str, mesh: Mesh) -> tuple[Array, int]:
    """(conditions of supports and springs on rigid motions, as in `_conditions`; count of motions that are free)."""
    dim, extent = mesh.points.shape[1], float(np.ptp(mesh.points, axis=0).max())
    conditions = [row for rows in _conditions(case, name, mesh, mesh.points.mean(axis=0), extent) for row in rows]
    modes = dim + (1 if dim == 2 else 3)
    matrix = np.array(conditions).reshape(-1, modes)
    tolerance = UNHELD * max(len(matrix), 1) ** 0.5
    return matrix, modes - (int(np.linalg.matrix_rank(matrix, tol=tolerance)) if len(matrix) else 0)


def _sprung(case: Case, name: str) -> bool:
    """Whether a spring leads from a point of the body to another one."""
    own = case.elastic_bodies[name].point_springs
    all_bodies = [*case.elastic_bodies.values(), *(case.rigid or {}).values()]
    springs = [spring for body in all_bodies for spring in getattr(body, "point_springs", getattr(body, "springs", ()))]
    return bool(own) or any(spring.to is not None and spring.to.body == name for spring in springs)


def _rotations(dim: int) -> list[str]:
    return ["rotation"] if dim == 2 else [f"rotation about {axis}" for axis in "xyz"]


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _conditions(case: Case, name: str, mesh: Mesh, centre: Array, extent: float) -> list[Array]:
    """Work of unit forces along the held directions in the rigid motions, (conditions, motions) of each support."""
    body, dim = case.elastic_bodies[name], mesh.points.shape[1]
    locations = find_locations(case, name, mesh)
    found = []
    for kind in ("supports", "springs"):
        for index, entry in enumerate(getattr(body, kind)):
            for place in locations[kind, index]:
                points, normals = _points(mesh, place)
                for directions in _directions(entry, points, normals, dim):
                    arms = (points - centre) / extent
                    if dim == 2:
                        turns = (arms[:, 0] * directions[:, 1] - arms[:, 1] * directions[:, 0])[:, None]
                    else:
                        turns = np.cross(arms, directions)
                    found.append(np.concatenate([directions, turns], axis=1))
    return found


def _points(mesh: Mesh, place: Any) -> tuple[Array, Array | None]:
    """(points, their normals) of a surface, by its facets, or of nodes."""
    if not isinstance(place, str):
        return mesh.points[np.unique(place)], None
    simplices, nodes = tessellate(mesh, [place])
    x = mesh.points[nodes][simplices]
    along = area_vectors(x)
    size = np.linalg.norm(along, axis=1, keepdims=True)
    normals = np.divide(along, size, out=np.zeros_like(along), where=size > 0.0)
    corners = CELL_TYPES[CELL_TYPES[mesh.cell_type].facet].corners
    ends = mesh.points[np.unique(surface_facets(mesh, place)[:, :corners])]
    # the nodes of a plane surface, whose normal is that of its facets; of a curved one the middles of its facets
    if np.abs(normals - normals[0]).max() < UNHELD:
        return ends, np.broadcast_to(normals[0], ends.shape)
    return x.mean(axis=1), normals


def _directions(entry: Any, points: Array, normals: Array | None, dim: int) -> list[Array]:
    """Directions in which an entry holds its points, each (n, dim)."""
    displacement = getattr(entry, "displacement", None)
    if getattr(entry, "symmetry", False) or getattr(entry, "normal", False):
        return [] if normals is None else [normals]
    if entry.direction is not None:
        direction = np.array(entry.direction, dtype=float)
        return [np.broadcast_to(direction / np.linalg.norm(direction), points.shape)]
    held = [i for i in range(dim) if not isinstance(displacement, tuple) or displacement[i] is not None]
    return [np.broadcast_to(np.eye(dim)[i], points.shape) for i in held]
