"""Statics of bodies that only contact holds.

Without a node in contact their equilibrium has no solution, although they may be free just until they touch. So the
first iterate of a solve tries the node that is nearest, at any distance. If it would pull, the next iterate opens it,
and what is left is singular as before: which nodes are tried does not change a solution.

If friction alone holds a body along its contacts and all its nodes slip in an iterate, it has no stiffness there:
rounding would decide how far it moves. Such nodes get a slope of the traction over the slip (see `friction_rows`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.law.law import SLIP, STICK, Statuses
from solvers.contact.mortar import Mortar
from solvers.contact.patch import Multipliers
from solvers.contact.terms import Terms


def untouched(bodies: Sequence[Sequence[int]], terms: Terms | None, active: NDArray[np.bool_]) -> list[Sequence[int]]:
    """The bodies without a multiplier in contact; terms: None where no facets are near, the rest as below."""
    if terms is None:
        return list(bodies)
    return [pairs for pairs in bodies if not active[(terms.D_of_pair[list(pairs)] > 0.0).any(axis=0)].any()]


def look_farther(
    mortars: Sequence[Mortar],
    multipliers: Multipliers,
    x: Array,
    x_old: Array,
    enough: Callable[[Array], NDArray[np.bool_]],
) -> None:
    """Let the mortars of a body reach as far as it takes to cover one multiplier, at most the extent of all nodes.

    x, x_old: positions [m], now and at the start of the step; enough: mask of the multipliers that areas (C,) cover.
    """
    distance, farthest = 0.0, float(np.ptp(x, axis=0).max())
    while not enough(_areas(mortars, multipliers, x, x_old)).any() and distance < farthest:
        distance = max(2.0 * distance, min(mortar.edge for mortar in mortars))
        for mortar in mortars:
            mortar.farther = distance


def _areas(mortars: Sequence[Mortar], multipliers: Multipliers, x: Array, x_old: Array) -> Array:
    """Covered areas [m^(dim-1)], shape (C,)."""
    found = np.zeros(len(multipliers.node))
    for mortar in mortars:
        mortar.clear_until = -np.inf
        facet_pairs, motion = mortar.near(x, x_old)
        if len(facet_pairs):
            normals = mortar.patch.normals(x[mortar.patch.nodes])[0]
            found[mortar.patch.multipliers] += mortar.areas(x, normals, facet_pairs, motion)
    return found


def nearest_gaps(bodies: Sequence[Sequence[int]], of_pair: Array, mean_gap: Array, active: NDArray[np.bool_]) -> Array:
    """Mean gap [m] up to which multipliers are to be tried, zero of those of other bodies, shape (C,).

    bodies: numbers of the pairs of each; of_pair: area [m^(dim-1)] that each pair covers, shape (pairs, C); mean_gap:
    [m]; active: mask of the multipliers in contact, (C,).
    """
    found = np.zeros_like(mean_gap)
    for pairs in bodies:
        mine = (of_pair[list(pairs)] > 0.0).any(axis=0)
        if mine.any() and not active[mine].any():
            found[mine] = np.maximum(found[mine], mean_gap[mine].min())
    return found


def slips_freely(
    bodies: Sequence[Sequence[int]], of_pair: Array, covered: NDArray[np.bool_], status: Statuses
) -> NDArray[np.bool_]:
    """Mask of the multipliers that slip on bodies which no node holds by sticking, shape (C,).

    bodies, of_pair: as above; covered: mask of the multipliers with a constraint, (C,). A body is held if it sticks to
    one that is, or to one that is not among these.
    """
    if not bodies:
        return np.zeros(len(status), dtype=bool)
    covers = (of_pair > 0.0) & covered
    stuck = (covers & (status == STICK)).any(axis=1)
    free, before = [set(pairs) for pairs in bodies], -1
    while len(free) != before:
        before = len(free)
        free = [one for one in free if not any(stuck[p] and sum(p in other for other in free) == 1 for p in one)]
    pairs = sorted(set().union(*free))
    return (status == SLIP) & covers[pairs].any(axis=0)
