"""The surfaces and nodes in the mesh of a body on which supports and loads of a case act."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case
from fsci.meshes.files import unknown
from fsci.meshes.mesh import MeshError, require_surface
from solvers.mesh.mesh import Mesh

#: A named surface, or nodes by their numbers.
Where = str | NDArray[np.int64]

#: Distance, in sizes of the body, within which a node is the one that is meant.
MEANT_NODE = 1e-6


#: (setting of the body, number of the entry) -> where it acts: a surface, nodes, or (nodes, positions) of lines
Locations = dict[tuple[str, int], list[Any]]

PLACE_KINDS = {"supports": ("surface", "line", "points"), "springs": ("surface", "points"), "point_forces": ("points",)}


def find_locations(case: Case, name: str, mesh: Mesh) -> Locations:
    """Surfaces and nodes on which supports, springs and loads of a body act. Raises CaseError."""
    body, locations = case.elastic_bodies[name], {}
    for section in (*PLACE_KINDS, "tractions", "pressures", "line_forces"):
        for index, entry in enumerate(getattr(body, section)):
            at = getattr(entry, "at", None)
            key = "on" if at is None else "at"
            try:
                found = (
                    [find_node(mesh, at)] if at is not None else [_find(mesh, section, entry, on) for on in entry.on]
                )
            except MeshError as error:
                raise case.error(("structure", "bodies", name, section, index, key), str(error)) from None
            locations[section, index] = found
    return locations


def _find(mesh: Mesh, section: str, entry: Any, name: str) -> Any:
    if section in ("tractions", "pressures"):
        require_surface(mesh, name)
        return name
    if section == "line_forces":
        lines = find_lines(mesh, name)
        return lines, mesh.points[lines]
    flat = getattr(entry, "normal", False) or getattr(entry, "symmetry", False)
    return find_group(mesh, name, ("surface",) if flat else PLACE_KINDS[section])


def find_node(mesh: Mesh, at: Sequence[float]) -> NDArray[np.int64]:
    """The node at a position [m], shape (1,). Raises MeshError if none is there, or positions have another length."""
    dim = mesh.points.shape[1]
    if len(at) != dim:
        raise MeshError(f"'at' has {len(at)} entries, but the mesh is of {dim} dimensions")
    distance = np.linalg.norm(mesh.points - np.asarray(at, dtype=float), axis=1)
    nearest = int(np.argmin(distance))
    if distance[nearest] > MEANT_NODE * np.ptp(mesh.points, axis=0).max():
        place, there = (", ".join(f"{x:.6g}" for x in point) for point in (at, mesh.points[nearest]))
        raise MeshError(f"no node is at ({place}); the nearest one is at ({there})")
    return np.array([nearest])


def find_group(mesh: Mesh, name: str, kinds: Sequence[str]) -> Where:
    """A group of these kinds (surface, line, points) by its name; MeshError lists the names there are."""
    if "surface" in kinds and name in mesh.surfaces:
        return name
    if "line" in kinds and name in mesh.lines:
        return np.unique(mesh.lines[name])
    if "points" in kinds and name in mesh.nodes:
        return mesh.nodes[name]
    there = {"surface": mesh.surfaces, "line": mesh.lines, "points": mesh.nodes}
    raise unknown(_listed(kinds), name, [group for kind in kinds for group in there[kind]])


def find_lines(mesh: Mesh, name: str) -> NDArray[np.int64]:
    """Nodes of the lines of a group, shape (lines, 2 or 3). Raises MeshError."""
    if mesh.points.shape[1] == 2:
        raise MeshError("a line in 2D is a surface: use 'tractions'")
    if name not in mesh.lines:
        raise unknown("line", name, mesh.lines)
    return mesh.lines[name]


def _listed(kinds: Sequence[str]) -> str:
    return kinds[0] if len(kinds) == 1 else f"{', '.join(kinds[:-1])} or {kinds[-1]}"
