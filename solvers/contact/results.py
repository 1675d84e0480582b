"""Nodal results of contact on the slave surfaces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.contact import Contact

#: Body -> name -> (nodes in its mesh, values)
PartFields = dict[str, dict[str, tuple[NDArray[np.int64], Array]]]


def surface_fields(contact: Contact) -> PartFields:
    """Results on slave surfaces.

    contact_traction [Pa] acts on the slave. contact_pressure is its normal part, contact_gap [m] the mean gap, and
    contact_status 0 without contact, 1 with slip, 2 with stick. With friction there are also the tangential part of the
    traction, contact_friction [Pa], and the slip of the last step, contact_slip [m]. A node of several surfaces has the
    sum of the tractions, the largest pressure and the smallest gap.
    """
    z, gap = contact.z, contact.mean_gap()
    normals = np.zeros_like(z) if contact.terms is None else contact.terms.normals
    values: dict[str, tuple[Array, np.ufunc]] = {
        "contact_pressure": (np.einsum("nd,nd->n", z, normals), np.fmax),
        "contact_traction": (-z * ~contact.merged[:, None], np.add),
        "contact_gap": (gap, np.fmin),
        "contact_status": (contact.active_set.status.astype(float), np.fmax),
    }
    if any(law.slips for law, _ in contact.interface.laws):
        pressure = np.einsum("nd,nd->n", z, normals)
        values["contact_friction"] = ((pressure[:, None] * normals - z) * ~contact.merged[:, None], np.add)
        values["contact_slip"] = (contact.work.slip, np.add)
    nodal = {name: _at_nodes(contact, array, join) for name, (array, join) in values.items()}
    found: PartFields = {}
    for surface, nodes in _slaves(contact):
        of_body = found.setdefault(surface.body, {})
        for name, array in nodal.items():
            own, before = of_body.get(name, (np.empty(0, dtype=np.int64), array[:0]))
            of_body[name] = np.concatenate([own, surface.mesh_nodes]), np.concatenate([before, array[nodes]])
    return found


def _slaves(contact: Contact):
    for surface, nodes in zip(contact.interface.surfaces, contact.nodes.of_surface, strict=True):
        if surface.mesh_nodes is not None and any(pair.slave is surface for pair in contact.pairs):
            yield surface, nodes


def _at_nodes(contact: Contact, values: Array, join: np.ufunc) -> Array:
    """Values at nodes from those at multipliers, shape (N, ...)."""
    nodal = values[: contact.size].copy()
    further = np.arange(contact.size, len(values))
    join.at(nodal, contact.multipliers.node[further], values[further])
    return nodal
