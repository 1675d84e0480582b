"""Tied surfaces before the run: on curved surfaces, slave nodes are moved onto the master surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fsci.case import Case
from fsci.meshes.of_case import read_rigid_side
from solvers.contact.law.tied import Tied
from solvers.contact.pair import Pair
from solvers.contact.surface import Surface
from solvers.contact.ties import relocated
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import cut_out

#: Motion of nodes, relative to the surface, that is none.
LEAST_MOTION = 1e-13


def join_tied(case: Case, meshes: Mapping[str, Mesh]) -> dict[str, Mesh]:
    """Meshes of elastic bodies, with the slave nodes of tied pairs moved as the constraint requires. Raises CaseError.

    A tie between bent surfaces would otherwise resist a common rotation: its offset would keep its direction in space.
    """
    found, contact = dict(meshes), case.contact
    for name, settings in {} if contact is None else contact.pairs.items():
        if not settings.tied:
            continue
        assert contact is not None
        sides, nodes = [], []
        for _, side in settings.sides:
            if side.body is not None:
                mesh, names = meshes[side.body], side.on
            else:
                mesh, names = read_rigid_side(case, side.obstacle or "")
            points, facets, at = cut_out(mesh, names)
            sides.append(Surface(name, points, facets, CELL_TYPES[mesh.cell_type].facet, None))
            nodes.append(at)
        moved = relocated(Pair(sides[0], sides[1], settings.integration, Tied()))
        if moved is None:
            raise case.error(
                ("contact", "pairs", name), "the surfaces do not touch at the start: there is nothing to tie"
            )
        body = settings.sides[0][1].body or ""
        if np.abs(moved - sides[0].points).max() < LEAST_MOTION * np.ptp(moved, axis=0).max():
            continue
        points = found[body].points.copy()
        points[nodes[0]] = moved
        found[body] = replace(found[body], points=points, unmoved=meshes[body].points)
    return found
