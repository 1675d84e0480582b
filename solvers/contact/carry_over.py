"""The state of a contact interface in another one that has the same pairs first, and more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.contact import Contact


def carry_over(before: Contact | None, after: Contact, x: Array) -> None:
    """Give `after` the present state of `before`, whose pairs are its first ones; None: it had none.

    after has just been started; x: its present positions [m], shape (N, dim). Its other pairs are not present.
    """
    state = after.save()
    state["x"] = x
    state["present"][:] = False
    if before is not None:
        old, count = before.save(), len(before.pairs)
        which = _numbers_in(before, after)
        for name in ("z", "mean_gap", "status"):
            state[name][which] = old[name]
        for name in ("present", "touched_at", "interference"):
            state[name][:count] = old[name]
        for name in ("slip", "force"):
            state["work"][name][which] = old["work"][name]
        state["work"]["total"] = old["work"]["total"]
        for name in ("obstacle_work", "interference_work"):
            state[name]["force"][: len(old[name]["force"])] = old[name]["force"]
            state[name] |= {key: old[name][key] for key in ("total", "doubt")}
    after.restore(state)


def _numbers_in(before: Contact, after: Contact) -> NDArray[np.int64]:
    """The number that each multiplier of `before` has in `after`: that of the same node on the same facet."""
    found = np.arange(len(before.multipliers.node))
    there = {key: number for number, key in _on_facets(after)}
    for number, key in _on_facets(before):
        found[number] = there[key]
    return found


def _on_facets(contact: Contact):
    """(multiplier, (node, nodes of the facet)) of all multipliers and the slave facets around their nodes."""
    for patch in contact.multipliers.patches:
        nodes, multipliers = patch.nodes[patch.facets], patch.multipliers[patch.facets]
        for facet, own in zip(nodes.tolist(), multipliers.tolist(), strict=True):
            key = tuple(sorted(facet))
            yield from ((number, (node, key)) for node, number in zip(facet, own, strict=True))
