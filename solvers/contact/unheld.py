"""Statics of bodies that only contact holds.

Without a node in contact their equilibrium has no solution, although they may be free just until they touch. So an
iterate that leaves a body without contact tries what the body meets first along its load, at any distance. Bodies that
hold each other fall together. Where supports leave no way for the load, the first iterate of a solve tries the node
that is nearest. A node that would pull is open in the next iterate: which nodes are tried does not change a solution.

If friction alone holds a body along its contacts and all its nodes slip in an iterate, it has no stiffness there:
rounding would decide how far it moves. Such nodes get a slope of the traction over the slip (see `friction_rows`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.law.law import OPEN, SLIP, STICK, Statuses
from solvers.contact.mortar import Mortar
from solvers.contact.patch import Multipliers
from solvers.contact.terms import Terms

#: Sum of loads relative to their sizes, below which it is their rounding error.
ROUNDING_OF_LOAD = 1e-12

#: Pairs of a group of bodies with what is not in it, with 1 if the group is the slave and -1 if it is the master.
Outside = Mapping[int, float]

#: A group by its pairs, and the direction of its load, shape (dim,); None: unknown.
Falling = tuple[Outside, Array | None]


@dataclass(frozen=True)
class Loose:
    """A body that only contact holds."""

    name: str
    pairs: Outside
    ways: Array  #: projection onto the translations that its supports leave, shape (dim, dim)


class Unheld:
    """The bodies that only contact holds."""

    def __init__(self, bodies: Sequence[Loose]):
        self.bodies = list(bodies)
        self.loads: Callable[[], Array] | None = None  #: loads of the bodies [N], shape (bodies, dim); None: unknown
        self._pairs = 1 + max((max(body.pairs) for body in bodies), default=0)

    def groups(self, closed: NDArray[np.bool_]) -> list[list[int]]:
        """Bodies that hold each other, but that nothing else holds; closed: mask of the pairs that hold, (pairs,)."""
        found: list[list[int]] = []
        for number, body in enumerate(self.bodies):
            own = {pair for pair in body.pairs if closed[pair]}
            joined = [group for group in found if any(own & self.bodies[other].pairs.keys() for other in group)]
            together = [other for group in joined for other in group]
            found = [*(group for group in found if group not in joined), [*together, number]]
        return [group for group in found if not any(closed[pair] for pair in self._outside(group))]

    def _outside(self, group: Sequence[int]) -> dict[int, float]:
        pairs = [pair for number in group for pair in self.bodies[number].pairs]
        signs = {pair: sign for number in group for pair, sign in self.bodies[number].pairs.items()}
        return {pair: sign for pair, sign in signs.items() if pairs.count(pair) == 1}

    def tries(
        self,
        terms: Terms | None,
        covered: NDArray[np.bool_],
        gap: Array,
        status: Statuses,
        pressed: NDArray[np.bool_],
        *,
        first: bool,
        none: float,
    ) -> tuple[Array, list[Falling]]:
        """(gap [m] up to which each multiplier is tried, shape (C,); the groups that have nothing to try).

        Of nodes that touch at the start of a solve without a force, those that loads lead away are not tried.

        terms: None where no facets are near; covered: mask of the multipliers with a constraint, (C,); gap: mean gap
        [m], (C,); pressed: mask of those with a force, (C,); first: whether it is the first iterate of a solve; none:
        rounding of gaps [m].
        """
        found, nothing = np.zeros(len(gap)), list[list[int]]()
        covers, normals = np.zeros((self._pairs, len(gap)), dtype=bool), np.zeros((len(gap), len(self.bodies[0].ways)))
        if terms is not None:
            covers, normals = (terms.D_of_pair > 0.0) & covered, terms.normals
        loads = None if self.loads is None else self.loads()
        away = self._led_away(covers, normals, loads) & ~pressed if first else np.zeros(len(gap), dtype=bool)
        found[away] = -np.inf
        closed = (covers & (status != OPEN) & ~away).any(axis=1)
        if not self.groups(closed):
            return found, []
        while left := [group for group in self.groups(closed) if group not in nothing]:
            outside, load = self._falling(left[0], loads)
            ways = np.full(len(gap), np.inf)
            if first or load is not None:
                for pair, sign in outside.items():
                    mine = covers[pair] & facing(sign * normals, load)
                    ways[mine] = gap[mine] / (1.0 if load is None else sign * normals[mine] @ load)
            if np.isinf(ways).all():
                nothing.append(left[0])
                continue
            met = ways <= ways.min() + none
            found[met] = gap[met]
            closed |= (covers & met).any(axis=1)
        falling = [self._falling(group, loads) for group in self.groups(closed)]
        return found, [(outside, load) for outside, load in falling if first or load is not None]

    def _led_away(self, covers: NDArray[np.bool_], normals: Array, loads: Array | None) -> NDArray[np.bool_]:
        """Mask of the multipliers against what is no such body that the load of their body leads away, shape (C,)."""
        found = np.zeros(len(normals), dtype=bool)
        for number, one in enumerate(self.bodies):
            load = self._falling([number], loads)[1]
            for pair, sign in one.pairs.items():
                if load is not None and sum(pair in body.pairs for body in self.bodies) == 1:
                    found |= covers[pair] & (sign * normals @ load < -ROUNDING_OF_LOAD)
        return found

    def _falling(self, group: Sequence[int], loads: Array | None) -> Falling:
        outside = self._outside(group)
        if loads is None:
            return outside, None
        load = np.sum([self.bodies[number].ways @ loads[number] for number in group], axis=0)
        size, whole = float(np.linalg.norm(load)), float(np.linalg.norm(loads[group], axis=1).sum())
        return outside, load / size if size > ROUNDING_OF_LOAD * whole else None

    def slips_freely(self, of_pair: Array, covered: NDArray[np.bool_], status: Statuses) -> NDArray[np.bool_]:
        """Mask of the multipliers that slip on bodies which no node holds by sticking, shape (C,).

        of_pair: area [m^(dim-1)] that each pair covers, shape (pairs, C); covered: mask of the multipliers with a
        constraint, (C,).
        """
        if not self.bodies:
            return np.zeros(len(status), dtype=bool)
        covers = (of_pair > 0.0) & covered
        groups = self.groups((covers & (status == STICK)).any(axis=1))
        pairs = sorted({pair for group in groups for number in group for pair in self.bodies[number].pairs})
        return (status == SLIP) & covers[pairs].any(axis=0)


def facing(normals: Array, load: Array | None) -> NDArray[np.bool_]:
    """Mask of the surfaces that a load presses against something, shape (n,)."""
    return np.ones(len(normals), dtype=bool) if load is None else normals @ load > 0.0


def look_farther(
    mortars: Sequence[Mortar],
    multipliers: Multipliers,
    x: Array,
    x_old: Array,
    group: Falling,
    enough: Callable[[Array], NDArray[np.bool_]],
) -> bool:
    """Let the mortars of a group reach as far as it takes to cover a multiplier that its load presses; whether one is.

    The farthest is the extent of all nodes. x, x_old: positions [m], now and at the start of the step; enough: mask of
    the multipliers that areas (C,) cover.
    """
    before = [mortar.farther for mortar in mortars]
    distance, farthest = min(before), float(np.ptp(x, axis=0).max())
    while distance < farthest:
        distance = max(2.0 * distance, min(mortar.edge for mortar in mortars))
        for mortar in mortars:
            mortar.farther = distance
        if enough(_pressed_areas(mortars, multipliers, x, x_old, group)).any():
            return True
    for mortar, own in zip(mortars, before, strict=True):
        mortar.farther = own
    return False


def _pressed_areas(
    mortars: Sequence[Mortar], multipliers: Multipliers, x: Array, x_old: Array, group: Falling
) -> Array:
    """Covered areas [m^(dim-1)] of multipliers that the load of a group presses, shape (C,)."""
    found = np.zeros(len(multipliers.node))
    outside, load = group
    for mortar in mortars:
        mortar.clear_until = -np.inf
        facet_pairs, motion = mortar.near(x, x_old)
        if len(facet_pairs) == 0:
            continue
        normals = mortar.patch.normals(x[mortar.patch.nodes])[0]
        for pair, sign in outside.items():
            mine = facet_pairs[mortar.masters.pair_of_facet[facet_pairs[:, 1]] == pair]
            if len(mine):
                areas = mortar.areas(x, normals, mine, motion)
                found[mortar.patch.multipliers] += np.where(facing(sign * normals, load), areas, 0.0)
    return found
