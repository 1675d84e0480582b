"""Probes of contact: pressure, gap and mean gap at a slave node, or their extremes; areas in contact.

A probe is a function without arguments that every process calls. It returns values by component.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from solvers.api import Array
from solvers.contact.areas import touching_area
from solvers.contact.contact import Contact
from solvers.contact.surface import Surface
from solvers.kernels import nodal_normals
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.distance import signed_distances

Probe = Callable[[], dict[str, float]]

Extreme = Literal["largest", "least"]


def at_slave(contact: Contact, pair: int, quantity: str, where: Sequence[float] | Extreme) -> Probe:
    """Probe of pressure [Pa], gap or mean gap [m] of a pair, at the slave node nearest to a point, or of an extreme.

    where: the point in the reference configuration [m], or 'largest' or 'least'. The pressure is the normal part of
    the traction, zero without contact.
    """
    values = {"pressure": pressures, "gap": gaps, "mean_gap": mean_gaps}[quantity]
    if where == "largest":
        return lambda: {"": float(np.fmax.reduce(values(contact, pair)))}
    if where == "least":
        return lambda: {"": float(np.fmin.reduce(values(contact, pair)))}
    away = np.linalg.norm(contact.pairs[pair].slave.points - np.asarray(where, dtype=float), axis=1)
    node = int(np.argmin(away))
    return lambda: {"": float(values(contact, pair)[node])}


def pressures(contact: Contact, pair: int) -> Array:
    """Contact pressure [Pa] at the slave nodes of a pair, the largest on sharp edges, shape (n,)."""
    slave = contact.pairs[pair].slave
    if contact.terms is None:
        return np.zeros(len(slave.points))
    found = np.einsum("nd,nd->n", contact.z, contact.terms.normals)
    return contact.interface.at_nodes(slave, found, np.fmax)


def gaps(contact: Contact, pair: int) -> Array:
    """Gaps [m] of the slave nodes of a pair: their distances to its master, negative where they are behind it, (n,).

    In self contact the mean gaps, nan where nothing is near.
    """
    slave, master = contact.pairs[pair].slave, contact.pairs[pair].master
    return mean_gaps(contact, pair) if master is slave else _signed(contact, slave, master)


def mean_gaps(contact: Contact, pair: int) -> Array:
    """Mean gaps [m] around the slave nodes of a pair, which contact makes zero, (n,); nan where too little is near.

    Those of all masters of the slave together.
    """
    return contact.interface.at_nodes(contact.pairs[pair].slave, contact.mean_gap(), np.fmin)


AreaQuantity = Literal["contact_area", "stick_area", "mean_pressure"]


def of_area(contact: Contact, pair: int, quantity: AreaQuantity) -> Probe:
    """Probe of the area [m^2] (length in 2D) in which a pair touches or sticks, or the mean pressure [Pa] in contact.

    Mean pressure times area is the normal force. All are zero without contact.
    """

    def probe() -> dict[str, float]:
        area = touching_area(contact, pair, sticking=quantity == "stick_area")
        if quantity != "mean_pressure" or contact.terms is None:
            return {"": area}
        force = float(contact.terms.D_of_pair[pair] @ np.einsum("nd,nd->n", contact.z, contact.terms.normals))
        return {"": force / area if area > 0.0 else 0.0}

    return probe


def overlap(contact: Contact, pair: int) -> Probe:
    """Probe of the largest depth [m] of nodes of one side behind the other one, zero without.

    In self contact that of the mean gaps.
    """
    slave, master = contact.pairs[pair].slave, contact.pairs[pair].master

    def probe() -> dict[str, float]:
        sides = [gaps(contact, pair)] + ([] if master is slave else [_signed(contact, master, slave)])
        return {"": max(0.0, *(-float(np.fmin.reduce(side, initial=0.0)) for side in sides))}

    return probe


def _signed(contact: Contact, one: Surface, other: Surface) -> Array:
    x, at_other = (contact.x[contact.interface.nodes_of(surface)] for surface in (one, other))
    normals = nodal_normals(
        np.ascontiguousarray(x), one.facets, CELL_TYPES[one.facet_type].kernel, None, derivatives=False
    )[0]
    return signed_distances(x, normals, at_other, other.facets, other.facet_type)


def first_contact(contact: Contact, pair: int) -> Probe:
    """Probe of the time [s] at the end of the first step in which a pair touches, nan before."""

    def probe() -> dict[str, float]:
        if contact.touched_at[pair] == np.inf and contact.resultant(pair).any():
            contact.touched_at[pair] = contact.time
        time = float(contact.touched_at[pair])
        return {"": time if time < np.inf else np.nan}

    return probe
