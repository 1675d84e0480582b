"""Pairs of contact that the case leaves to the program: `contact: {bodies: all}`.

Candidates are the named surfaces of the bodies that no support holds across. Two of them are a pair if they face each
other (see `facing`), at any distance: a pair that is far apart costs no more than the bounds of its motion. The softer
body is the slave; of two that are equally stiff the one with the smaller facets; then the first one in the case.
Obstacles and rigid bodies are masters. Free rigid bodies may come to any side of an elastic
one. Bodies that a pair of the case names are left to such pairs. Faces of the box need none (`wall_pairs`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fsci.builder.elements import lame_at_cells
from fsci.builder.facing import Face, face, faces, images, meeting
from fsci.builder.on_first import shared
from fsci.builder.periods import periods
from fsci.case import Case
from fsci.case.contact import Friction, PairSection, Side
from fsci.case.supports import SupportSection
from fsci.meshes.of_case import read_body, read_obstacle, read_rigid_body
from solvers.mesh.mesh import Mesh
from solvers.structure.elastic_constants import young

if TYPE_CHECKING:
    from mpi4py import MPI

Array = NDArray[np.float64]

#: Relative difference of two stiffnesses or sizes that is none: above the rounding of meshes that are moved, below what
#: a user would set. From 1e-12 to 1e-3 the slaves are the same in cases.
EQUAL_SIZES = 1e-6


@dataclass(frozen=True)
class Candidate:
    """A body, an obstacle or a rigid body of the flow with its surfaces."""

    side: dict[str, str]  #: body or obstacle -> name
    faces: list[Face]
    stiffness: float  #: mean of Young's modulus [Pa], infinite if rigid
    free: bool = False  #: a rigid body that forces move

    @property
    def name(self) -> str:
        return next(iter(self.side.values()))

    @property
    def rigid(self) -> bool:
        return "obstacle" in self.side


def with_pairs(case: Case, comm: MPI.Comm | None = None) -> Case:
    """The case with all its pairs named, with their friction; comm: processes that read it together.

    Raises CaseError (collective).
    """
    assert case.contact is not None
    if case.contact.bodies is None or not case.elastic_bodies:  # rigid bodies touch each other without pairs
        contact = case.contact.model_copy(update={"pairs": case.contact.complete_pairs, "bodies": None})
        return case.model_copy(update={"contact": contact})
    chosen = list(case.elastic_bodies) if case.contact.bodies == "all" else list(case.contact.bodies)

    def find() -> dict[str, PairSection]:
        assert case.contact is not None
        pairs = find_pairs(case, {name: read_body(case, name) for name in chosen})
        return {name: pair for name, pair in pairs.items() if name not in case.contact.pairs}

    # what the case names stays where it is: its formulas cannot be sent
    pairs = case.contact.complete_pairs | (find() if comm is None else shared(comm, find))
    if not pairs and case.coupling is None:  # in a flow there are walls
        raise case.error(("contact", "bodies"), "no named surfaces of these bodies can meet: name the pairs")
    return case.model_copy(update={"contact": case.contact.model_copy(update={"pairs": pairs, "bodies": None})})


def find_pairs(case: Case, meshes: Mapping[str, Mesh]) -> dict[str, PairSection]:
    """Pairs by name: those that the case names, then those of the bodies with these meshes, and of rigid ones."""
    assert case.contact is not None
    found = case.contact.complete_pairs
    named = [{_owner(side) for _, side in pair.sides} for pair in found.values()]
    tied = [pair.sides[0][1] for pair in found.values() if pair.tied]
    for first, second in combinations(candidates(case, meshes), 2):
        if first.rigid or not first.faces or not second.faces or {first.name, second.name} in named:
            continue
        for others in images(first.faces, second.faces, periods(case)):
            for pair in meeting(first.faces, others, case.contact.reach, anywhere=second.free):
                name, settings = _pair(case, (first, second), pair, tied)
                if settings.slave not in tied:
                    found[name] = settings
    return found


def candidates(case: Case, meshes: Mapping[str, Mesh]) -> list[Candidate]:
    """Bodies with these meshes, obstacles and rigid bodies, in this order."""
    found = [_body(case, name, mesh) for name, mesh in meshes.items()]
    found += [_obstacle(case, name) for name in ({} if case.contact is None else case.contact.obstacles)]
    return found + [_rigid_body(case, name) for name, one in case.rigid_surfaces.items() if one.keys[0] != "contact"]


def _pair(
    case: Case, bodies: tuple[Candidate, Candidate], pair: tuple[Face, Face], tied: Sequence[Side]
) -> tuple[str, PairSection]:
    """tied: slaves of ties; their multipliers cannot be those of contact, so that the other surface is the slave."""
    assert case.contact is not None
    sides = list(zip(bodies, pair, strict=True))
    if not _is_slave(sides[0], sides[1]):
        sides.reverse()
    found = [_side(*side) for side in sides]
    if found[0] in tied and found[1] not in tied and not sides[1][0].rigid:
        sides.reverse()
        found.reverse()
    words = []
    for body, surface in sides:
        words += [*body.side.values(), *([] if body.rigid else [surface.name])]
    return _name(words), PairSection(slave=found[0], master=found[1], friction=case.contact.friction or Friction())


def _name(words: Sequence[str]) -> str:
    return "_".join("".join(c if c.isalnum() or c in "_-" else "_" for c in word) for word in words)


def _side(body: Candidate, surface: Face) -> Side:
    return Side(**body.side, on=None if body.rigid else (surface.name,))


def _is_slave(first: tuple[Candidate, Face], second: tuple[Candidate, Face]) -> bool:
    """The first one against the second: softer, then finer."""
    stiffness = first[0].stiffness, second[0].stiffness
    if second[0].rigid or not np.isclose(*stiffness, rtol=EQUAL_SIZES, atol=0.0):
        return stiffness[0] < stiffness[1]
    return first[1].size <= second[1].size * (1.0 + EQUAL_SIZES)


def _owner(side: Side) -> str:
    return side.body or side.obstacle or ""


def _body(case: Case, name: str, mesh: Mesh) -> Candidate:
    settings = case.elastic_bodies[name]
    held = [support for support in settings.supports if support.on is not None]
    free = [face for face in faces(mesh) if not any(holds(support, face) for support in held)]
    return Candidate({"body": name}, free, mean_stiffness(case, name, mesh))


def _obstacle(case: Case, name: str) -> Candidate:
    assert case.contact is not None
    mesh = read_obstacle(case, name)
    on = case.contact.obstacles[name].on
    found = [face(mesh, None)] if on is None else [face(mesh, [surface]) for surface in on]
    return Candidate({"obstacle": name}, found, np.inf)


def _rigid_body(case: Case, name: str) -> Candidate:
    found = [face(read_rigid_body(case, name)[0], case.rigid_surfaces[name].on)]
    return Candidate({"obstacle": name}, found, np.inf, free=name in (case.rigid or {}))


def holds(support: SupportSection, face: Face) -> bool:
    """Whether a support prescribes the displacement normal to a surface."""
    if face.name not in (support.on or ()):
        return False
    if support.symmetry or support.normal:
        return True
    if support.direction is not None:
        direction = np.array(support.direction, dtype=float)
        share = (face.normals @ direction) ** 2 / (direction @ direction)
    else:
        components = support.displacement if isinstance(support.displacement, tuple) else ()
        prescribed = [component is not None for component in components]
        share = face.normals**2 @ np.array(prescribed, dtype=float)
    return bool(share.min() > 0.5)


def mean_stiffness(case: Case, body: str, mesh: Mesh) -> float:
    """The mean of Young's modulus [Pa] in the middles of all cells of a body, for small strains. Raises CaseError."""
    return float(np.mean(young(*lame_at_cells(case, body, mesh))))
