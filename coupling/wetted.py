"""Wetted surfaces: the surfaces of bodies in the fluid, closed, of segments or triangles, with marked wet facets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from coupling.contact_surfaces import global_dofs
from coupling.divided_facets import divide_facets
from coupling.ties import Tie, candidate_facets, join_vertices, tied_sides
from solvers.algebra.blocks import Layout
from solvers.algebra.sparse import Sparse
from solvers.api import Array
from solvers.mesh.skin import Skin
from solvers.structure.field import Structure


@dataclass(frozen=True)
class WettedSurface:
    """The surface of one elastic body, the same on every process."""

    name: str  #: name of the body in structure and fluid
    points: Array  #: reference positions [m] of its vertices, shape (n, dim)
    dofs: NDArray[np.int64]  #: global dofs in the structure of the nodes that move them, shape (nodes, dim)
    facets: NDArray[np.int64]  #: vertices of segments or triangles, shape (m, dim)
    wet: NDArray[np.bool_] | None = None  #: wet facets; None: found by `find_wet`
    in_contact: NDArray[np.bool_] | None = None  #: facets that take part in contact
    tied: NDArray[np.bool_] | None = None  #: facets that lie on the other side of a tie; None: no one does
    #: vertices from the nodes of all surfaces, (n, nodes); None: each vertex is a node of this one
    mixture: Sparse | None = None


def wetted_surfaces(
    structure: Structure, skins: Sequence[Skin], near_walls: NDArray[np.int64] | None = None
) -> list[WettedSurface]:
    """The wetted surfaces of all bodies of a structure, from their skins (collective).

    near_walls: dofs of nodes that take part in contact beside those of the structure's constraint.
    """
    ties = tied_sides(structure)
    touching = [] if structure.constraint is None else [structure.constraint.touching_dofs().ravel()]
    touching += [] if near_walls is None else [near_walls.ravel()]
    dofs = np.concatenate([np.empty(0, dtype=np.int64), *touching])
    surfaces = [_wetted_surface(structure, index, skin, ties, dofs) for index, skin in enumerate(skins)]
    return joined(surfaces, [skin.points for skin in skins]) if ties else surfaces


def _wetted_surface(
    structure: Structure, index: int, skin: Skin, ties: Sequence[Tie], touching: NDArray[np.int64]
) -> WettedSurface:
    bodies = structure.bodies
    body = bodies[index]
    layout = Layout(body.domain.comm, [other.size for other in bodies])
    dofs = global_dofs(layout, index, body, skin.nodes)
    in_contact = np.isin(dofs[:, 0], touching)[skin.facets].all(axis=1)
    candidates = candidate_facets(body.name, skin, ties)
    if not candidates:
        return WettedSurface(body.name, skin.points, dofs, skin.facets, skin.wet, in_contact)
    divided = divide_facets(skin.points, skin.facets, candidates)
    mixture, of = divided.mixture, divided.parents
    return WettedSurface(
        body.name,
        skin.points if mixture is None else mixture @ skin.points,
        dofs,
        divided.facets,
        None if skin.wet is None else skin.wet[of],
        in_contact[of],
        divided.tied,
        mixture,
    )


def joined(surfaces: Sequence[WettedSurface], nodes: Sequence[Array]) -> list[WettedSurface]:
    """Wetted surfaces on whose ties both sides have the same vertices; nodes: positions of those of each [m]."""
    mixtures = [(surface.mixture, len(points)) for surface, points in zip(surfaces, nodes, strict=True)]
    tied = [np.unique(s.facets[s.tied]) if s.tied is not None else np.empty(0, dtype=np.int64) for s in surfaces]
    together = join_vertices(mixtures, [surface.points for surface in surfaces], tied)
    points = np.concatenate(list(nodes))
    return [replace(s, mixture=m, points=m @ points) for s, m in zip(surfaces, together, strict=True)]
