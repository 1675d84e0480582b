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
from solvers.algebra.sparse import Sparse, sparse_from_entries
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
    if not ties and all(surface.mixture is None for surface in surfaces):
        return surfaces
    return joined(surfaces, [skin.points for skin in skins])


def bulge(skin: Skin) -> Sparse | None:
    """Vertices from the nodes of a second-order surface, (n, n); None: all are nodes.

    A vertex in the middle of corners lies farther from their mean m than its node x, at m + 4/3 (x - m). So segments
    and triangles enclose what the parabolas of the facets enclose, up to fourth order. A uniform pressure on them has
    the nodal forces of the element, 1/6, 2/3, 1/6 of its resultant on a straight edge; through the nodes these would be
    1/4, 1/2, 1/4, and a plane surface would not stay plane.
    """
    if not skin.middles:
        return None
    count = len(skin.points)
    rows, columns, values = [np.arange(count)], [np.arange(count)], [np.ones(count)]
    for middles in skin.middles:
        share = np.full(middles.shape, -1.0 / 3.0 / (middles.shape[1] - 1))
        share[:, 0] = 1.0 / 3.0
        rows.append(np.repeat(middles[:, 0], middles.shape[1]))
        columns.append(middles.ravel())
        values.append(share.ravel())
    at = np.concatenate(rows), np.concatenate(columns)
    return sparse_from_entries(*at, np.concatenate(values), (count, count))


def _wetted_surface(
    structure: Structure, index: int, skin: Skin, ties: Sequence[Tie], touching: NDArray[np.int64]
) -> WettedSurface:
    bodies = structure.bodies
    body = bodies[index]
    layout = Layout(body.domain.comm, [other.size for other in bodies])
    dofs = global_dofs(layout, index, body, skin.nodes)
    touches = np.isin(dofs[:, 0], touching)
    in_contact = touches[skin.facets].all(axis=1)
    candidates = candidate_facets(body.name, skin, ties)
    if not candidates:
        # surfaces in contact, and both sides of a tie, meet at their nodes
        bulged = None if touches.any() else bulge(skin)
        points = skin.points if bulged is None else bulged @ skin.points
        return WettedSurface(body.name, points, dofs, skin.facets, skin.wet, in_contact, mixture=bulged)
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
