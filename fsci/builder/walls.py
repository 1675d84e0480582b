"""From the pairs of elastic bodies with faces of the box (`wall_pairs`) to surfaces, and to when they come in."""

from __future__ import annotations

from collections.abc import Sequence

from mpi4py import MPI

from coupling.contact_surfaces import contact_surface_of
from coupling.near_walls import NearWalls, WallPair
from fsci.builder.contact import contact_of
from fsci.builder.named import named
from fsci.builder.periods import periods
from fsci.builder.wall_pairs import FoundWall
from fsci.case import Case
from fsci.case.contact import PairSection
from solvers.contact import law as laws
from solvers.contact.contact import Contact
from solvers.contact.pair import Pair
from solvers.contact.surface import Surface
from solvers.structure.body import Body
from solvers.structure.field import Structure


def build_walls(case: Case, comm: MPI.Comm, structure: Structure, found: Sequence[FoundWall]) -> NearWalls:
    """The faces of the box that elastic bodies may reach (collective)."""
    masters: dict[str, Surface] = {}
    pairs = [_pair(case, structure.bodies, one, masters) for one in found]
    base = structure.constraint
    assert base is None or isinstance(base, Contact)
    own, names = ([], []) if base is None else (list(base.pairs), list(base.names))

    def create(chosen: Sequence[WallPair]) -> Contact:
        return contact_of(case, comm, [*names, *(one.name for one in chosen)], [*own, *(one.pair for one in chosen)])

    return NearWalls(structure, pairs, create)


def _pair(case: Case, bodies: Sequence[Body], found: FoundWall, masters: dict[str, Surface]) -> WallPair:
    wall = found.wall
    if wall.name not in masters:
        points, facets = wall.surface()
        masters[wall.name] = Surface(wall.name, points, facets, "line" if points.shape[1] == 2 else "quad", None)
    slave = contact_surface_of(bodies, found.body, found.name, found.facets)
    settings = PairSection.model_construct(friction=found.friction, tied=False)
    law = named(laws, settings.law)(*settings.law_parameters)
    pair = Pair(slave, masters[wall.name], law=law)
    return WallPair(found.name, wall.said, wall.axis, wall.position, wall.inward, pair, found.embedded, periods(case))
