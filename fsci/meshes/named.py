"""Surfaces that the case names: facets of a mesh's boundary by their normal, and by a box that they lie in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.meshes.files import MeshError
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import boundary_facets

Array = NDArray[np.float64]

#: How far outside of a box nodes may be, relative to the mesh's size: files have seven digits.
ROUNDED_BOX = 1e-6


def with_surfaces(mesh: Mesh, named: Mapping[str, Any]) -> Mesh:
    """The mesh with more named surfaces; each has `normal`, `within` [degrees] and `box`.

    Raises MeshError for names that the file has, vectors of another dimension, and surfaces without a facet.
    """
    if not named:
        return mesh
    facets = boundary_facets(mesh)[:, : CELL_TYPES[CELL_TYPES[mesh.cell_type].facet].corners]
    x = mesh.points[facets]
    found = dict(mesh.surfaces)
    for name, section in named.items():
        if name in mesh.surfaces:
            raise MeshError(f"the mesh has a surface '{name}': take another name", "surfaces", name)
        chosen = np.ones(len(x), dtype=bool)
        if section.normal is not None:
            _require_entries(mesh, section.normal, name, "normal")
            chosen &= _angles(x, np.array(section.normal, dtype=float)) <= section.within
        if section.box is not None:
            for end, corner in enumerate(section.box):
                _require_entries(mesh, corner, name, "box", end)
            low, high = np.array(section.box, dtype=float)
            rounded = ROUNDED_BOX * float(np.ptp(mesh.points, axis=0).max())
            chosen &= ((x >= low - rounded) & (x <= high + rounded)).all(axis=(1, 2))
        if not chosen.any():
            raise MeshError(f"no facet of the boundary is there: {_nearest(x, section)}", "surfaces", name)
        found[name] = facets[chosen]
    return replace(mesh, surfaces=found)


def _angles(x: Array, normal: Array) -> Array:
    """Angles [degrees] between outward normals of facets (n, corners, dim) and a direction."""
    if x.shape[2] == 2:
        along = x[:, 1] - x[:, 0]
        outward = np.column_stack([along[:, 1], -along[:, 0]])
    else:  # of a quadrilateral by its diagonals
        outward = np.cross(x[:, 2] - x[:, 0], x[:, -1] - x[:, 1])
    cosine = outward @ normal / (np.linalg.norm(outward, axis=1) * np.linalg.norm(normal))
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _nearest(x: Array, section: Any) -> str:
    """What would have to change for a facet."""
    if section.box is None:
        return f"the nearest normal is {_angles(x, np.array(section.normal, dtype=float)).min():.3g} degrees away"
    ends = (", ".join(f"{one:.6g}" for one in end(axis=(0, 1))) for end in (x.min, x.max))
    return "the boundary is in the box from ({}) to ({}), and facets count that are whole in it".format(*ends)


def _require_entries(mesh: Mesh, vector: tuple[float, ...], name: str, *keys: str | int) -> None:
    dim = mesh.points.shape[1]
    if len(vector) != dim:
        raise MeshError(f"it has {len(vector)} entries, but the mesh has {dim} dimensions", "surfaces", name, *keys)
