"""Pairs with `adjust`: slave nodes in the master's body, or near it, are moved onto its surface before the run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fsci.builder.overlap import PlacedSide
from fsci.case import Case
from fsci.meshes.valid import BadMesh, require_positive
from solvers.api import Array
from solvers.contact.overlap_at_start import SolidSide
from solvers.counted import counted
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.distance import nearest_points
from solvers.mesh.mesh import Mesh
from solvers.mesh.penetration import inside

#: How far from a node, in sizes of a facet, the point lies that is looked for in the master's body.
ASIDE = 1e-6

REMEDY = "the nodes lie deeper than its cells are high: leave 'adjust' out, so that the first step closes the overlap"


def adjusted(case: Case, meshes: Mapping[str, Mesh]) -> dict[str, Mesh]:
    """Meshes of elastic bodies, without strain in the new places. Raises CaseError where a cell would turn over."""
    found = dict(meshes)
    for name, pair in {} if case.contact is None else case.contact.pairs.items():
        if pair.adjust is False:
            continue
        (_, own), (_, other) = pair.sides
        slave, master = (PlacedSide(case, side, found) for side in (own, other))
        side, nodes = slave.cut_out()
        onto, _ = master.cut_out()
        to = nearest_points(side.x, onto.simplices)
        way = np.linalg.norm(to - side.x, axis=1)
        near = _nodes_inside(side, onto.solid)
        if pair.adjust is not True:
            near |= way <= float(pair.adjust)
        near &= way > 0.0
        if not near.any():
            continue
        points = slave.mesh.points + _ways(slave.mesh, nodes[near], (to - side.x)[near])
        count = counted(int(near.sum()), "node")
        moved = f"{count} moved onto the master of pair '{name}', by at most {way[near].max():.3g} {case.units.length}"
        note = f"{slave.mesh.note}; {moved}" if slave.mesh.note else moved
        mesh = replace(slave.mesh, points=points, note=note)
        try:
            require_positive(mesh, REMEDY)
        except BadMesh as error:
            raise case.error(("contact", "pairs", name, "adjust"), str(error)) from None
        found[own.body or ""] = mesh
    return found


def _ways(mesh: Mesh, nodes: NDArray[np.int64], way: Array) -> Array:
    """Displacements [m] of all nodes, shape (n, dim): middle nodes of cells follow their corners."""
    found = np.zeros_like(mesh.points)
    found[nodes] = way
    corners = found.copy()
    for local, group in enumerate(CELL_TYPES[mesh.cell_type].nodes):
        if len(group) > 1:
            found[mesh.cells[:, local]] = corners[mesh.cells[:, group]].mean(axis=1)
    found[nodes] = way
    return found


def _nodes_inside(side: SolidSide, solid: Array) -> NDArray[np.bool_]:
    """Mask of the nodes in a solid with these corners, also where sides of both bodies are flush, shape (n,)."""
    at_nodes = side.x[side.facets]
    at_nodes += ASIDE * (at_nodes.mean(axis=1, keepdims=True) - at_nodes)
    found = np.zeros(len(side.x), dtype=bool)
    found[side.facets[inside(at_nodes.reshape(-1, side.x.shape[1]), solid).reshape(side.facets.shape)]] = True
    return found
