"""Warnings about bodies in the wrong place or of the wrong size, by their meshes.

Fixed and driven rigid bodies may overlap anything and reach beyond the box: the fluid is outside of their union.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fsci.builder.closed_faces import closed_faces
from fsci.builder.periods import periods
from fsci.case import Case
from fsci.case.contact import PairSection
from solvers.mesh.mesh import Mesh
from solvers.mesh.tessellation import tessellate
from solvers.sentinels.bodies import MovingBody
from solvers.sentinels.overlaps import Overlaps

Array = NDArray[np.float64]
Keys = tuple[str | int, ...]
Said = tuple[Keys, str]

#: Ratio of sizes from which on a mesh is probably in another unit, of which 1000 is the most frequent.
OTHER_UNIT = 300.0


@dataclass(frozen=True)
class Placed:
    """A body at the start."""

    name: str
    keys: Keys
    moves: bool  #: freely: it is elastic, or a free rigid body
    elastic: bool
    mesh: Mesh

    @property
    def box(self) -> tuple[Array, Array]:
        return self.mesh.points.min(axis=0), self.mesh.points.max(axis=0)

    @property
    def extent(self) -> float:
        return float(np.ptp(self.mesh.points, axis=0).max())


def overlaps(case: Case, bodies: list[Placed], pairs: dict[str, PairSection]) -> Iterator[tuple[bool, Keys, str]]:
    """(only a note, path, text) of bodies that overlap at the start."""
    by_name = {body.name: body for body in bodies if body.moves or _rests(case, body.name)}
    if not any(body.moves for body in by_name.values()):
        return
    found = Overlaps([_at_rest(body) for body in by_name.values()], {}, case.joined, periods(case))
    found.start(case.time.start)
    for one, other, depth in found.overlapping():
        first, second = by_name[one], by_name[other]
        if {first.moves, second.moves} != {True} and (first.elastic or second.elastic):
            continue  # an elastic body that is held in a given one
        pair = pair_between(pairs, first.name, second.name)
        how = f"{depth:.3g} {case.units.length} deep"
        if pair is not None:
            names = f"bodies '{first.name}' and '{second.name}' of pair '{pair}'"
            yield True, second.keys, f"{names} overlap, {how}, which contact has to push apart at once"
        else:
            remedy = "move one of them"
            if first.elastic or second.elastic:
                remedy += ", or make their surfaces a pair of contact"
            else:
                remedy += ": they have no contact"
            yield False, second.keys, f"bodies '{first.name}' and '{second.name}' overlap, {how}: {remedy}"


def _at_rest(body: Placed) -> MovingBody:
    facets, nodes = tessellate(body.mesh)
    return MovingBody(body.name, facets, lambda t: body.mesh.points[nodes], free=body.moves)


def _rests(case: Case, name: str) -> bool:
    body = None if case.fluid is None else case.fluid.bodies.get(name)
    return body is not None and body.motion is None and body.free is None


def pair_between(pairs: dict[str, PairSection], first: str, second: str) -> str | None:
    """Name of the pair of contact that two bodies are the sides of."""
    for name, pair in pairs.items():
        if {first, second} == {side.body or side.obstacle for _, side in pair.sides}:
            return name
    return None


def around_box(case: Case, bodies: list[Placed]) -> Iterator[Said]:
    """Bodies that move freely beyond the box or a plane of symmetry, and bodies of another unit than the box."""
    if case.fluid is None:
        return
    low, high, repeat = np.array(case.fluid.grid.start), np.array(case.fluid.grid.to), periods(case)
    beside = np.isinf(repeat) if repeat is not None else np.ones(len(low), dtype=bool)  # axes along which it ends
    symmetric = [face for patch in case.fluid.patches.values() if patch.symmetry for face in patch.on]
    dry = () if case.coupling is None else case.coupling.dry_side
    for body in bodies:
        ratio = body.extent / float((high - low).max())
        if ratio >= OTHER_UNIT or 1.0 / ratio >= OTHER_UNIT:
            yield body.keys, _sizes("the body is", ratio, "the box")
            continue
        x_low, x_high = body.box
        outside = bool((((x_high <= low) | (x_low >= high)) & beside).any())
        if outside and not _driven(case, body.name):
            yield body.keys, "the body is outside of the fluid's box"
        if not body.moves or outside or body.name in dry:
            continue
        yield from _behind_walls(case, body, symmetric)
        for face in symmetric:
            axis = "xyz".index(face[0])
            beyond = low[axis] - x_low[axis] if face[1] == "-" else x_high[axis] - high[axis]
            if beyond <= 1e-6 * body.extent:
                continue
            counts = "it counts with all of its mass, but only with the part of the fluid's force inside of the box"
            remedy = "cut the mesh there" if not body.elastic else "cut the mesh there and give it 'symmetry: true'"
            length = f"{beyond:.3g} {case.units.length}"
            yield body.keys, f"the body reaches {length} beyond the plane of symmetry '{face}': {counts}; {remedy}"


def _behind_walls(case: Case, body: Placed, symmetric: Sequence[str]) -> Iterator[Said]:
    """Free rigid bodies that are behind walls at the start; a pivot there is a hinge."""
    free = (case.rigid or {}).get(body.name)
    if body.elastic or free is None or free.pivot is not None:
        return
    for wall in closed_faces(case):
        depth = float(wall.depth(body.mesh.points).max())
        if depth > 1e-6 * body.extent and wall.face not in symmetric:
            length = f"{depth:.3g} {case.units.length}"
            yield (
                body.keys,
                f"the free body reaches {length} behind the wall '{wall.face}', which does not hold it there",
            )


def _driven(case: Case, name: str) -> bool:
    """Whether a rigid body has a prescribed motion, which may bring it into the box."""
    body = None if case.fluid is None else case.fluid.bodies.get(name)
    return body is not None and body.motion is not None


def pair_sizes(bodies: list[Placed], pairs: dict[str, PairSection]) -> Iterator[Said]:
    """Elastic bodies of a pair with sizes that differ as units do."""
    by_name = {body.name: body for body in bodies if body.elastic}
    done: set[frozenset[str]] = set()
    for pair in pairs.values():
        names = [side.body for _, side in pair.sides]
        if None in names or len(set(names)) < 2 or frozenset(map(str, names)) in done:
            continue
        done.add(frozenset(map(str, names)))
        if not all(name in by_name for name in names):
            continue
        first, second = (by_name[str(name)] for name in names)
        ratio = first.extent / second.extent
        if ratio >= OTHER_UNIT or 1.0 / ratio >= OTHER_UNIT:
            yield first.keys, _sizes("the body is", ratio, f"body '{second.name}', which it may touch")


def _sizes(subject: str, ratio: float, other: str) -> str:
    factor, word = (ratio, "larger") if ratio > 1.0 else (1.0 / ratio, "smaller")
    return f"{subject} {factor:,.4g} times {word} than {other}: is its mesh in another unit, such as mm instead of m?"
