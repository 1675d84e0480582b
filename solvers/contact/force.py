"""The contact force on the nodes: -D^T z on slaves, M^T z on masters."""

from __future__ import annotations

import numpy as np

from solvers.algebra.sparse import Sparse, sparse_from_entries
from solvers.api import Array
from solvers.contact.interface import ContactInterface
from solvers.contact.terms import Terms


def force_matrix(interface: ContactInterface, terms: Terms) -> Sparse:
    """Force on the nodes per unit multiplier [m^(dim-1)], shape (N, C)."""
    node, count = interface.multipliers.node, len(terms.D)
    on_slave = sparse_from_entries(node, np.arange(count), -terms.D, (len(interface.nodes.points), count))
    if interface.basis is not None:
        on_slave = interface.basis[1].T @ on_slave
    return on_slave + terms.M.T


def nodal_force(interface: ContactInterface, terms: Terms, z: Array) -> Array:
    """Contact force [N] on the nodes for multipliers z [Pa], shape (N, dim)."""
    on_slave = np.zeros(interface.nodes.points.shape)
    np.add.at(on_slave, interface.multipliers.node, -terms.D[:, None] * z)
    if interface.basis is not None:
        on_slave = interface.basis[1].T @ on_slave
    return on_slave + terms.M.T @ z
