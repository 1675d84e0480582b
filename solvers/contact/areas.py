"""Areas in which a pair touches or sticks, with a rim that runs between nodes.

Nodes are in contact or not, each with the area A_j = int Phi_j around it: alone they give the area to a ring of facets.
The rim of smooth bodies runs where the pressure p, which falls as the root of the distance from it, vanishes. So in a
facet with nodes on both sides it is where p^2 - (c g)^2, linear between p^2 at nodes in contact and the gap g at the
others, changes its sign; c: the stiffness of both sides per area [Pa/m].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.contact import Contact
from solvers.contact.law.law import OPEN, STICK
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.tessellation import area_vectors


def touching_area(contact: Contact, pair: int, *, sticking: bool = False) -> float:
    """Area [m^2] (length in 2D) in which a pair touches, or its part that sticks; zero without contact."""
    if contact.terms is None:
        return 0.0
    interface, slave = contact.interface, contact.pairs[pair].slave
    status, pressure = contact.active_set.status, np.einsum("nd,nd->n", contact.z, contact.terms.normals)
    which, node = interface.multipliers_of(slave)
    area = np.bincount(node, contact.terms.D_of_pair[pair][which], len(slave.points))
    touches = interface.at_nodes(slave, (status != OPEN).astype(float), np.fmax) > 0.0
    sticks = touches & (interface.at_nodes(slave, (status == STICK).astype(float), np.fmax) > 0.0)
    gap = interface.at_nodes(slave, contact.mean_gap(), np.fmin)
    pressure = interface.at_nodes(slave, pressure, np.fmax)
    apart = interface.at_nodes(slave, contact.stiffness_per_area, np.fmax) * gap
    if not touches.any():
        return 0.0
    simplices = slave.facets[:, np.array(CELL_TYPES[slave.facet_type].simplices)].reshape(-1, contact.dim)
    sizes = np.linalg.norm(area_vectors(contact.x[interface.nodes_of(slave)][simplices]), axis=1)
    around = np.bincount(simplices.ravel(), np.repeat(sizes, contact.dim), len(area))
    shares = np.divide(area, around, out=np.zeros_like(area), where=around > 0.0)
    covered = sizes * shares[simplices].sum(axis=1)
    inside = part_within(np.where(touches, pressure, -np.abs(apart))[simplices], touches[simplices])
    if sticking:
        inside *= sticks[simplices].sum(axis=1) / np.maximum(touches[simplices].sum(axis=1), 1)
    return float(covered @ inside)


def part_within(values: Array, touches: NDArray[np.bool_]) -> Array:
    """Parts of segments or triangles in contact, shape (n,), by pressures or minus c g at their corners, (n, dim).

    touches: which corners are in contact. Where the pressure is not positive, as of a tie that is pulled, or a gap is
    not known, each corner has its share.
    """
    count = touches.sum(axis=1)
    share = count / touches.shape[1]
    known = np.where(touches, values > 0.0, values < 0.0).all(axis=1) & (count > 0) & (share < 1.0)
    squared = np.where(touches, 1.0, -1.0) * np.nan_to_num(values) ** 2
    # a corner that is alone on its side of the rim, and the others
    alone = np.argmax(touches == (count == 1)[:, None], axis=1)
    rows = np.arange(len(values))
    at = squared[rows, alone]
    others = squared[np.arange(touches.shape[1])[None] != alone[:, None]].reshape(len(values), -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        cut = np.prod(at[:, None] / (at[:, None] - others), axis=1)
    return np.where(known, np.where(count == 1, cut, 1.0 - cut), share)
