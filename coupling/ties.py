"""Ties between the bodies of a structure, as the flow around them sees these: two sides that no fluid separates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.cell_types import CELL_TYPES
from solvers.skin import Skin
from solvers.structure.field import Structure

if TYPE_CHECKING:
    from solvers.contact.surface import Surface


@dataclass(frozen=True)
class Tie:
    """One side of a tie, and the corners of the facets of the other side [m], shape (k, dim, dim)."""

    side: Surface
    other: Array


def tied_sides(structure: Structure) -> list[Tie]:
    """The sides on elastic bodies of all tied pairs, two for each pair between such bodies."""
    if structure.constraint is None:
        return []
    from solvers.contact.contact import Contact
    from solvers.contact.law.tied import Tied

    contact = structure.constraint
    pairs = contact.pairs if isinstance(contact, Contact) else ()
    tied = [pair for pair in pairs if pair.law == Tied()]
    sides = [(side, other) for p in tied for side, other in ((p.slave, p.master), (p.master, p.slave))]
    return [Tie(side, _simplices(other)) for side, other in sides if side.dofs is not None]


def candidate_facets(body: str, skin: Skin, ties: Sequence[Tie]) -> list[tuple[NDArray[np.bool_], Array]]:
    """For each tie of a body the mask of the facets of its skin that belong to it, and the facets of the other side."""
    found = []
    for tie in ties:
        if tie.side.body == body and tie.side.mesh_nodes is not None:
            mask = np.isin(skin.nodes, tie.side.mesh_nodes)[skin.facets].all(axis=1)
            found.append((mask, tie.other))
    return found


def _simplices(surface: Surface) -> Array:
    """Corners of the segments or triangles of a surface [m], shape (k, dim, dim)."""
    split = np.array(CELL_TYPES[surface.facet_type].simplices)
    return surface.points[surface.facets[:, split].reshape(-1, split.shape[1])]
