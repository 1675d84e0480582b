"""What can be measured where surfaces touch: at a node of the slave, or the largest and the least of them.

A probe is a function without arguments that every process calls; it returns the values by component.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from solvers.api import Array
from solvers.contact.contact import Contact

Probe = Callable[[], dict[str, float]]

Extreme = Literal["largest", "least"]


def at_slave(contact: Contact, pair: int, quantity: str, where: Sequence[float] | Extreme) -> Probe:
    """pressure [Pa] or gap [m] of a pair at the slave node nearest to a point (reference coordinates), or an extreme.

    The pressure is the normal part of the traction between the surfaces, zero where they are apart. The gap is the
    distance of a slave node from the master surface; of a surface to itself the mean gap, nan while nothing is near.
    """
    values = {"pressure": lambda: pressures(contact, pair), "gap": lambda: contact.distances(pair)}[quantity]
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


def first_contact(contact: Contact, pair: int) -> Probe:
    """Time [s] of the end of the first step in which a pair touches, nan before."""

    def probe() -> dict[str, float]:
        if contact.touched_at[pair] == np.inf and contact.resultant(pair).any():
            contact.touched_at[pair] = contact.time
        time = float(contact.touched_at[pair])
        return {"": time if time < np.inf else np.nan}

    return probe
