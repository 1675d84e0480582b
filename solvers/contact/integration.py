"""Mortar integration of all pairs: the facets that are near each other, their integrals, and the slip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse
from solvers.api import Array
from solvers.contact.as_meshed import gaps_as_meshed
from solvers.contact.interface import ContactInterface
from solvers.contact.law.by_pair import ByPair
from solvers.contact.law.tied import Tied
from solvers.contact.mortar import Mortar
from solvers.contact.redistribute import redistributed
from solvers.contact.rims import Rims
from solvers.contact.share import Shares
from solvers.contact.slip import Sliding, Slip
from solvers.contact.terms import Normals, Terms, find_normals, total_terms
from solvers.contact.ties import Ties
from solvers.contact.unheld import Falling, look_farther


@dataclass(frozen=True)
class Integrals:
    """The integrals at one iterate."""

    terms: Terms
    normals: Normals
    used: tuple[tuple[Mortar, NDArray[np.int32]], ...]  #: facet pairs of each mortar that contributed

    def with_fixed_normals(self) -> Integrals:
        """The same, whose slips do not depend on the turning of normals: far away it would be a lever."""
        return replace(self, normals=self.normals.fixed())


class Integration:
    """Integrates the mortars of an interface; each process takes its share of the slave facets. Calls are collective.

    As long as surfaces have moved less than the clearance that the last search found, nothing is searched again.
    """

    def __init__(self, interface: ContactInterface, comm: MPI.Comm):
        self._interface, self._multipliers = interface, interface.multipliers
        self.shares = Shares(comm)
        laws = [(mortar, interface.law_of(mortar.patch)) for mortar in interface.mortars]
        by_pair = [mortar for mortar, law in laws if isinstance(law, ByPair)]
        pairs = len(interface.pairs) if by_pair else 0  # whose shares a law depends on
        self._mortars = [mortar for mortar, law in laws if not isinstance(law, Tied)]
        tied = [mortar for mortar, law in laws if isinstance(law, Tied)]
        self._ties = Ties(tied, self._multipliers, interface.nodes.points, interface.unmoved(), pairs)
        sliding = [mortar for mortar, law in laws if law.slips]
        N, dim = interface.nodes.points.shape
        self._sliding = Sliding(sliding, by_pair, self._multipliers, self.shares, (N, dim, pairs))
        pressed = [
            patch for patch in self._multipliers.patches if any(mortar.patch is patch for mortar in self._mortars)
        ]
        self.rims = Rims(self._multipliers, interface.nodes.points, pressed)
        self._x_old = interface.nodes.points  # positions at the start of the step [m]
        self._travel = 0.0  # sum over iterates of the largest motion of a node [m]
        self._nothing_near = False  # the latest integration found no facet pairs
        self.interference = np.zeros(len(interface.pairs))  #: of each pair at present [m]
        self._as_meshed = np.zeros(len(self._multipliers.node))  # gaps of the meshes that are none [m]

    @property
    def slides(self) -> bool:
        """Whether any law depends on the slip of the step."""
        return bool(self._sliding.mortars)

    @property
    def has_slip(self) -> bool:
        """Whether any law depends on a slip: that of the step, or that of ties since the start."""
        return self.slides or bool(self._ties.pieces)

    def start(self, x: Array) -> None:
        """Begin a run at the positions x [m], shape (N, dim)."""
        self.search_anew()
        for mortar in self._mortars:
            mortar.start(x)
        if any(pair.off_curve for pair in self._interface.pairs):
            meshed = self._interface.nodes.points
            found = self.integrate(meshed, meshed, np.zeros((len(self._as_meshed), meshed.shape[1])))
            if found is not None:
                self._as_meshed = gaps_as_meshed(self._interface.pairs, found.terms)
            self.search_anew()

    def own_gap(self, terms: Terms) -> Array:
        """Weighted gaps of all multipliers [m^dim], less the interference of their pairs and `gaps_as_meshed`, (C,)."""
        return terms.gap - self.interference @ terms.D_of_pair - self._as_meshed * terms.D

    def interfere(self, t: float) -> None:
        """Set the interference of the pairs at the time t [s]."""
        if all(pair.interference is None for pair in self._interface.pairs):
            return
        before = self.interference
        self.interference = np.array(
            [pair.interference(t) if pair.interference else 0.0 for pair in self._interface.pairs]
        )
        for mortar in self._mortars:
            mortar.interference = float(self.interference[mortar.masters.pair].max())
        if (self.interference > before).any():
            self.search_anew()

    def search_anew(self) -> None:
        """Require a search in the next integration."""
        self._nothing_near, self._travel = False, 0.0
        for mortar in self._mortars:
            mortar.clear_until = -np.inf

    def look_farther(self, groups: Sequence[Falling], x: Array, enough: Callable[[Array], NDArray[np.bool_]]) -> bool:
        """Let groups of bodies find what is far away in this step; whether one does; see `unheld.look_farther`."""
        found = False
        for group in groups:
            mine = [mortar for mortar in self._mortars if np.isin(mortar.masters.pair, list(group[0])).any()]
            found |= bool(mine) and look_farther(mine, self._multipliers, x, self._x_old, group, enough)
        if found:
            self.search_anew()
            self._sliding.begin_farther(self._x_old, self._travel)
        return found

    def begin_step(self, x: Array, before: Array, active: NDArray[np.bool_], cycled: NDArray[np.bool_]) -> None:
        """Begin a step at the positions x [m], before: those at the beginning of the last one, (N, dim); masks, (C,).

        active: of the multipliers in contact; cycled: of those by which the step failed that is taken again.
        """
        self.shares.begin_step()
        self._x_old = x
        for mortar in self._mortars:
            mortar.begin_step(x, active)
        if self.slides:
            self._sliding.begin_step(x, before, active, self._travel)
        self.rims.begin_step(active, cycled)

    def move(self, dx: Array) -> None:
        """Note that the nodes have moved by dx [m] since the latest iterate, shape (N, dim)."""
        self._travel += float(np.abs(dx).max(initial=0.0))

    @property
    def clear(self) -> bool:
        """Whether the latest integration found no facet pairs, and the motion since then leaves some clearance."""
        apart = not self._ties.pieces and all(self._travel < mortar.clear_until for mortar in self._mortars)
        return self._nothing_near and apart

    def integrate(self, x: Array, x_old: Array, z: Array) -> Integrals | None:
        """The integrals at the positions x [m], None if no facets are near.

        x, x_old: now and at the start of the step, shape (N, dim); z: multipliers [Pa], shape (C, dim).
        """
        found = self._sum(x, x_old, z)
        self._nothing_near = found is None
        return found

    def _sum(self, x: Array, x_old: Array, z: Array) -> Integrals | None:
        near = [mortar.near(x, x_old, self._travel) for mortar in self._mortars]
        if not self._ties.pieces and all(len(facet_pairs) == 0 for facet_pairs, _ in near):
            return None
        shares = self.shares
        normals = find_normals(self._multipliers, x, self._near_nodes([pairs for pairs, _ in near]))
        pieces, met, work = [], bool(self._ties.pieces), np.zeros((2, shares.comm.size))
        for index, (mortar, (facet_pairs, motion)) in enumerate(zip(self._mortars, near, strict=True)):
            if len(facet_pairs) == 0:
                continue
            at = normals.at(self._multipliers, mortar.patch)
            mine = shares.mine(index, facet_pairs, len(mortar.facets))
            found = mortar.evaluate(x, *at, mine, motion, z[mortar.patch.multipliers])
            all_used = shares.together(found.used)
            mortar.keep(all_used)
            work += shares.measure(index, facet_pairs, all_used, len(mortar.facets))
            met |= bool(shares.combine(index, found.area).any())
            pieces.append((mortar, found))
        shares.note(work)
        if not met:
            return None
        pieces += self._ties.pieces if shares.comm.rank == 0 else []
        terms = total_terms(pieces, normals, shares, (len(self._interface.pairs), len(z), len(x)))
        used = tuple((mortar, found.used) for mortar, found in pieces)
        return Integrals(self.rims.turned(terms, normals, used, x, shares), normals, used)

    def _near_nodes(self, near: Sequence[NDArray[np.int32]]) -> list[NDArray[np.bool_] | None]:
        """For each patch, mask of the nodes of slave facets that are near; None where a surface is tied."""
        found: list[NDArray[np.bool_] | None] = []
        tied = [mortar.patch for mortar, _ in self._ties.pieces]
        for patch in self._multipliers.patches:
            mask = np.zeros(len(patch.nodes), dtype=bool)
            for mortar, facet_pairs in zip(self._mortars, near, strict=True):
                if mortar.patch is patch:
                    mask[mortar.facets[facet_pairs[:, 0]]] = True
            found.append(None if any(patch is other for other in tied) else mask)
        return found

    def slip(self, x: Array, integrals: Integrals, shared: Sparse | None) -> Slip | None:
        """The slip at the positions x [m] of these integrals; None if no law depends on it.

        shared: redistribution from multipliers with a constraint to those without, (C, C).
        """
        slip = None
        if self.slides:
            rule = partial(redistributed, shares=shared)
            slip = self._sliding.evaluate(x, integrals.normals, integrals.used, rule)
        if self._ties.pieces:
            tied = self._ties.slip(x, shared)
            slip = tied if slip is None else slip.plus(tied)
        return slip
