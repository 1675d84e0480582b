"""The contact interface: surfaces, nodes, multipliers, laws and mortars of all pairs, which a run does not change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, sparse
from solvers.api import Array
from solvers.contact.images import images_of
from solvers.contact.law.by_pair import ByPair
from solvers.contact.law.friction import FrictionBound
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.law.law import Law
from solvers.contact.law.tied import Tied
from solvers.contact.mortar import FacetSearch, Mortar, join_masters
from solvers.contact.pair import Pair
from solvers.contact.patch import Multipliers, SlavePatch, number_multipliers
from solvers.contact.self_search import SelfSearch
from solvers.contact.shared_facets import parts_of_slave
from solvers.contact.shared_nodes import SearchApart, shared_nodes
from solvers.contact.surface import ContactNodes, Surface, longest_edge, number_nodes
from solvers.mesh.search import Search

#: T with N~ = N T over all nodes, and its inverse.
Basis = tuple[Sparse, Sparse]


@dataclass(frozen=True)
class ContactInterface:
    """All pairs together."""

    pairs: tuple[Pair, ...]
    surfaces: tuple[Surface, ...]  #: each once
    nodes: ContactNodes
    multipliers: Multipliers
    laws: tuple[tuple[Law, NDArray[np.int64]], ...]  #: each with its multipliers
    spans: NDArray[np.str_]  #: directions that each multiplier may have by its law: normal, surface, space
    mortars: tuple[Mortar, ...]
    patch_of: dict[int, int]  #: patch of each slave surface, by its id
    facets_of: dict[int, NDArray[np.int64]]  #: facets of each slave surface in numbers of its patch, by its id
    basis: Basis | None  #: basis that multipliers are dual to; None: the nodal basis (all but tri6)
    shared: NDArray[np.bool_]  #: mask of the multipliers of nodes that are on both sides of a pair, shape (C,)
    periods: Array | None = None  #: lengths [m] after which space repeats, shape (dim,); None: it does not

    def nodes_of(self, surface: Surface) -> NDArray[np.int64]:
        """Numbers of the nodes of a surface among all nodes."""
        return self.nodes.of_surface[_index(self.surfaces, surface)]

    def mask(self, surfaces: Sequence[Surface]) -> NDArray[np.bool_]:
        """Mask of the nodes of some surfaces, shape (N,)."""
        found = np.zeros(len(self.nodes.points), dtype=bool)
        for surface in surfaces:
            found[self.nodes_of(surface)] = True
        return found

    def unmoved(self) -> Array:
        """Positions [m] of all nodes as meshed, before those of tied surfaces were relocated, shape (N, dim)."""
        x = self.nodes.points.copy()
        for surface, numbers in zip(self.surfaces, self.nodes.of_surface, strict=True):
            if surface.unmoved is not None:
                x[numbers] = surface.unmoved
        return x

    def law_of(self, patch: SlavePatch) -> Law:
        """The law of a patch, which all its multipliers have."""
        return next(law for law, which in self.laws if np.isin(patch.multipliers, which).all())

    def spans_among(self, constrained: NDArray[np.bool_]) -> NDArray[np.str_]:
        """Admissible directions of multipliers, shape (C,); of several constrained ones at a node only the normals.

        constrained: mask of the multipliers with a constraint, shape (C,).
        """
        if self.multipliers.only_one.all():
            return self.spans
        node = self.multipliers.node
        several = np.bincount(node[constrained], minlength=len(node))[node] > 1
        return np.where(several & (self.spans == "surface"), "normal", self.spans)

    def at_nodes(self, slave: Surface, values: Array, join: np.ufunc) -> Array:
        """Values at the nodes of a slave surface, shape (n,), from those of all multipliers, (C,).

        join: combines the values of several multipliers at a node, such as np.fmax.
        """
        which, node = self.multipliers_of(slave)
        found = np.full(len(slave.points), np.nan)
        join.at(found, node, values[which])
        return found

    def multipliers_of(self, slave: Surface) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(multipliers of a slave surface, the node of the surface that each belongs to)."""
        patch = self.multipliers.patches[self.patch_of[id(slave)]]
        split, first = np.unique(self.facets_of[id(slave)], return_index=True)
        return patch.multipliers[split], slave.facets.ravel()[first]


def describe_interface(pairs: Sequence[Pair], periods: Array | None = None) -> ContactInterface:
    """Number nodes and multipliers of all pairs, and make the mortars of each slave surface.

    periods: lengths [m] after which space repeats, infinite where it does not, shape (dim,); None: nowhere.
    """
    surfaces = _distinct([surface for pair in pairs for surface in (pair.slave, pair.master)])
    slaves = _distinct([pair.slave for pair in pairs])
    nodes = number_nodes(surfaces)
    numbers = {id(surface): found for surface, found in zip(surfaces, nodes.of_surface, strict=True)}
    law_of_slave = [_law_of_slave(slave, pairs) for slave in slaves]
    multipliers = number_multipliers(slaves, [numbers[id(slave)] for slave in slaves], nodes, law_of_slave)
    laws = _multipliers_by_law(multipliers, law_of_slave)
    mortars: list[Mortar] = []
    for k in range(len(slaves)):
        mortars += _mortars_of(slaves, k, pairs, numbers, multipliers, periods)
    return ContactInterface(
        pairs=tuple(pairs),
        surfaces=tuple(surfaces),
        nodes=nodes,
        multipliers=multipliers,
        laws=tuple(laws),
        spans=_spans(multipliers, laws),
        mortars=tuple(mortars),
        patch_of={id(slave): patch for slave, patch in zip(slaves, multipliers.patch_of_surface, strict=True)},
        facets_of={id(slave): own for slave, own in zip(slaves, multipliers.facets_of_surface, strict=True)},
        basis=_nodal_basis(multipliers, len(nodes.points)),
        shared=_shared(slaves, pairs, numbers, multipliers),
        periods=periods,
    )


def _law_of_slave(slave: Surface, pairs: Sequence[Pair]) -> Law:
    """The law of all pairs of a slave, or the mean of their frictions. Raises ValueError if there is no such mean."""
    own = [pair.law for pair in pairs if pair.slave is slave]
    if all(law == own[0] for law in own):
        return own[0]
    if not all(law == Frictionless() or isinstance(law, FrictionBound) for law in own):
        raise ValueError(f"pairs of the slave '{slave.name}' have laws of which there is no mean: {own}")
    # of all pairs, so that slaves that share nodes have the same law
    return ByPair(tuple(pair.law if isinstance(pair.law, FrictionBound) else None for pair in pairs))


def _multipliers_by_law(multipliers: Multipliers, law_of_slave: Sequence[Law]) -> list[tuple[Law, NDArray[np.int64]]]:
    law_of_patch = dict(zip(multipliers.patch_of_surface, law_of_slave, strict=True))
    found: list[tuple[Law, list[NDArray[np.int64]]]] = []
    for k, patch in enumerate(multipliers.patches):
        parts = next((parts for law, parts in found if law == law_of_patch[k]), None)
        if parts is None:
            found.append((law_of_patch[k], parts := []))
        parts.append(patch.multipliers)
    return [(law, np.sort(np.concatenate(parts))) for law, parts in found]


def _spans(multipliers: Multipliers, laws: Sequence[tuple[Law, NDArray[np.int64]]]) -> NDArray[np.str_]:
    spans = np.full(len(multipliers.node), "normal", dtype="<U7")
    for law, which in laws:
        spans[which] = law.span
    return spans


def _shared(
    slaves: Sequence[Surface], pairs: Sequence[Pair], numbers: dict[int, NDArray[np.int64]], multipliers: Multipliers
) -> NDArray[np.bool_]:
    found = np.zeros(len(multipliers.node), dtype=bool)
    for slave, index in zip(slaves, multipliers.patch_of_surface, strict=True):
        masters = [numbers[id(pair.master)] for pair in pairs if pair.slave is slave and pair.master is not slave]
        patch = multipliers.patches[index]
        found[patch.multipliers[np.isin(patch.nodes, shared_nodes(numbers[id(slave)], masters))]] = True
    return found


def _mortars_of(
    slaves: Sequence[Surface],
    k: int,
    pairs: Sequence[Pair],
    numbers: dict[int, NDArray[np.int64]],
    multipliers: Multipliers,
    periods: Array | None,
) -> list[Mortar]:
    """The mortars of the facets of slave k that no earlier slave has, against the masters of all slaves that have them.

    Facets are integrated once, each part of them against the master in front, also where they are in several slaves.
    """
    patch = multipliers.patches[multipliers.patch_of_surface[k]]
    found = []
    for part in parts_of_slave(slaves, k, pairs, multipliers):
        owners = [slaves[i] for i in part.slaves]
        edge = max(longest_edge(owner.corners) for owner in owners)
        for integration in ("segments", "elements"):
            mine = [
                i
                for i, pair in enumerate(pairs)
                if pair.integration == integration and any(pair.slave is owner for owner in owners)
            ]
            mine.sort(key=lambda i: pairs[i].master is not slaves[k])  # in self contact its own facets come first
            every = [(pairs[i].master, i, image) for i in mine for image in _images(pairs[i], periods)]
            masters = [master for master, _, _ in every]
            nodes, images = [numbers[id(master)] for master in masters], [image for _, _, image in every]
            for joined in join_masters(masters, nodes, [i for _, i, _ in every], images):
                search: FacetSearch
                if masters[0] is slaves[k] and mine[0] in joined.pair:
                    own = len(part.facets)
                    search = SelfSearch(owners[0].facets, owners[0].facet_type, owners[0].points, joined.facets[own:])
                else:
                    search = Search(part.facets, joined.facets)
                    if len(np.intersect1d(patch.nodes[part.facets], joined.nodes)):
                        search = SearchApart(search, patch.nodes[part.facets], joined.nodes[joined.facets])
                deep = part.deep_facets(joined, pairs)
                found.append(Mortar(patch, part.facets, edge, joined, integration, search, deep, periods))
    return found


def _images(pair: Pair, periods: Array | None) -> list[tuple[int, ...]]:
    """Numbers of the images of a master; ties are between surfaces as meshed."""
    return images_of(pair.slave, pair.master, None if pair.law == Tied() else periods)


def _nodal_basis(multipliers: Multipliers, size: int) -> Basis | None:
    curved = [patch for patch in multipliers.patches if patch.facet_type == "triangle6"]
    if not curved:
        return None
    both = []
    for which in (0, 1):
        total = sp.identity(size, format="lil")
        for patch in curved:
            entries = patch.basis()[which]
            total[patch.nodes[entries.row_numbers()], patch.nodes[entries.indices]] = entries.data
        both.append(sparse(total.tocsr(), (size, size)))
    return both[0], both[1]


def _index(surfaces: Sequence[Surface], one: Surface) -> int:
    return next(i for i, surface in enumerate(surfaces) if surface is one)


def _distinct(surfaces: Sequence[Surface]) -> list[Surface]:
    found: list[Surface] = []
    for surface in surfaces:
        if not any(surface is other for other in found):
            found.append(surface)
    return found
