"""Probes of contact: pressure and gap at a slave node, or their extremes.

A probe is a function without arguments that every process calls. It returns values by component.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from solvers.api import Array
from solvers.contact.contact import Contact
from solvers.distance import distances

Probe = Callable[[], dict[str, float]]

Extreme = Literal["largest", "least"]


def at_slave(contact: Contact, pair: int, quantity: str, where: Sequence[float] | Extreme) -> Probe:
    """Probe of the pressure [Pa] or gap [m] of a pair, at the slave node nearest to a point, or of an extreme.

    where: the point in the reference configuration [m], or 'largest' or 'least'. The pressure is the normal part of
    the traction, zero without contact.
    """
    values = {"pressure": lambda: pressures(contact, pair), "gap": lambda: gaps(contact, pair)}[quantity]
    if where == "largest":
        return lambda: {"": float(np.fmax.reduce(values()))}
    if where == "least":
        return lambda: {"": float(np.fmin.reduce(values()))}
    away = np.linalg.norm(contact.pairs[pair].slave.points - np.asarray(where, dtype=float), axis=1)
    node = int(np.argmin(away))
    return lambda: {"": float(values()[node])}


def pressures(contact: Contact, pair: int) -> Array:
    """Contact pressure [Pa] at the slave nodes of a pair, the largest on sharp edges, shape (n,)."""
    slave = contact.pairs[pair].slave
    if contact.terms is None:
        return np.zeros(len(slave.points))
    found = np.einsum("nd,nd->n", contact.z, contact.terms.normals)
    return contact.interface.at_nodes(slave, found, np.fmax)


def gaps(contact: Contact, pair: int) -> Array:
    """Distances [m] of the slave nodes of a pair to its master, shape (n,).

    In self contact the mean gaps, nan where nothing is near.
    """
    slave, master = contact.pairs[pair].slave, contact.pairs[pair].master
    if master is slave:
        return contact.interface.at_nodes(slave, contact.mean_gap(), np.fmin)
    x, at_master = (contact.x[contact.interface.nodes_of(surface)] for surface in (slave, master))
    return distances(x, at_master, master.facets, master.facet_type)


def first_contact(contact: Contact, pair: int) -> Probe:
    """Probe of the time [s] at the end of the first step in which a pair touches, nan before."""

    def probe() -> dict[str, float]:
        if contact.touched_at[pair] == np.inf and contact.resultant(pair).any():
            contact.touched_at[pair] = contact.time
        time = float(contact.touched_at[pair])
        return {"": time if time < np.inf else np.nan}

    return probe
