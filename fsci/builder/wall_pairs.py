"""Pairs of elastic bodies in a flow with faces of its box that no fluid passes: without a section of the case.

Slave is the surface of a body, whole but for facets that are behind the face at the start, that a support holds across,
that touch such a support on the face, that a plane of symmetry cuts, that are paired with an obstacle there or tied, or
that the fluid does not wet. The master is the face, or the parts of it that closed patches have.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fsci.builder.automatic_pairs import holds
from fsci.builder.closed_parts import ClosedPart, closed_parts
from fsci.builder.facing import face
from fsci.case import Case
from fsci.case.contact import Friction
from fsci.meshes.of_case import read_obstacle, read_rigid_body
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import boundary_facets, cut_out, surface_facets

Array = NDArray[np.float64]
Facets = NDArray[np.int64]

#: Distance from a face relative to the box or the body up to which something lies on it: rounding of meshes.
ON_FACE = 1e-6


@dataclass(frozen=True)
class FoundWall:
    """A pair of a body with a closed part of a face."""

    name: str
    body: str
    wall: ClosedPart
    facets: Facets  #: slave facets with all their nodes, numbers in the mesh
    friction: Friction
    embedded: bool  #: some of the body is behind the face at the start


def wall_pairs(case: Case, meshes: Mapping[str, Mesh]) -> list[FoundWall]:
    """The pairs of elastic bodies with these meshes; case: with all its pairs named (`with_pairs`)."""
    if case.contact_off or case.fluid is None or case.coupling is None:
        return []
    walls = list(closed_parts(case))
    found = [pair for name, mesh in meshes.items() for pair in _of_body(case, name, mesh, walls)] if walls else []
    taken = set() if case.contact is None else set(case.contact.pairs)
    for k, pair in enumerate(found):
        name = pair.name
        while name in taken:
            name += "_"
        taken.add(name)
        found[k] = replace(pair, name=name)
    return found


def _of_body(case: Case, body: str, mesh: Mesh, walls: list[ClosedPart]) -> Iterator[FoundWall]:
    facets, x = boundary_facets(mesh), _at_start(case, body, mesh)
    held = _held(case, body, mesh)
    free = ~_among(facets, held) & ~_among(facets, _tied(case, body, mesh))
    wetted = case.coupling.wetted.get(body) if case.coupling is not None else None
    if wetted is not None:
        free &= _among(facets, [surface_facets(mesh, name) for name in wetted])
    held_nodes = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *(own.ravel() for own in held)]))
    tolerance = ON_FACE * float(np.ptp(x, axis=0).max())
    friction = (None if case.contact is None else case.contact.friction) or Friction()
    for wall in walls:
        gap = wall.gap(x)
        kept = np.zeros(len(x), dtype=bool)
        kept[held_nodes] = gap[held_nodes] <= tolerance
        chosen = free & ~(gap < -tolerance)[facets].any(axis=1) & ~kept[facets].any(axis=1)
        if wall.symmetry:
            chosen &= ~(np.abs(gap) <= tolerance)[facets].all(axis=1)
        chosen &= ~_among(facets, _paired(case, body, mesh, wall))
        if chosen.any():
            yield FoundWall(f"{body}_{wall.name}", body, wall, facets[chosen], friction, bool((gap < -tolerance).any()))


def _at_start(case: Case, body: str, mesh: Mesh) -> Array:
    """Positions [m] of the nodes at the start."""
    displacement = case.elastic_bodies[body].initial_displacement
    if displacement is None:
        return mesh.points
    x = mesh.points.T
    moved = [np.broadcast_to(component(x, case.time.start), x.shape[1]) for component in displacement]
    return mesh.points + np.stack(moved, axis=1)


def _among(facets: Facets, others: list[Facets]) -> NDArray[np.bool_]:
    """Mask of the facets that are among others."""
    if not others:
        return np.zeros(len(facets), dtype=bool)
    keys = {tuple(facet) for some in others for facet in np.sort(some, axis=1).tolist()}
    return np.array([tuple(facet) in keys for facet in np.sort(facets, axis=1).tolist()], dtype=bool)


def _held(case: Case, body: str, mesh: Mesh) -> list[Facets]:
    """Facets of the named surfaces that a support holds across."""
    named = {name: support for support in case.elastic_bodies[body].supports for name in support.on or ()}
    supports = case.elastic_bodies[body].supports
    return [
        surface_facets(mesh, name)
        for name in named
        if any(holds(support, face(mesh, [name])) for support in supports if support.on is not None)
    ]


def _tied(case: Case, body: str, mesh: Mesh) -> list[Facets]:
    pairs = [] if case.contact is None else [pair for pair in case.contact.pairs.values() if pair.tied]
    sides = [pair.sides[0][1] for pair in pairs]
    return [surface_facets(mesh, name) for side in sides if side.body == body for name in side.on or ()]


def _paired(case: Case, body: str, mesh: Mesh, wall: ClosedPart) -> list[Facets]:
    """Facets of the surfaces that are paired with an obstacle on the face or behind it."""
    found = []
    for pair in [] if case.contact is None else case.contact.pairs.values():
        (_, slave), (_, master) = pair.sides
        if slave.body == body and master.obstacle is not None and _lies_there(case, master.obstacle, wall):
            found += [surface_facets(mesh, name) for name in slave.on or ()]
    return found


def _lies_there(case: Case, obstacle: str, wall: ClosedPart) -> bool:
    assert case.contact is not None
    assert case.fluid is not None
    if obstacle in case.contact.obstacles:
        points = cut_out(read_obstacle(case, obstacle), case.contact.obstacles[obstacle].on)[0]
    else:
        points = cut_out(read_rigid_body(case, obstacle)[0], case.fluid.bodies[obstacle].on)[0]
    grid = case.fluid.grid
    size = max(high - low for low, high in zip(grid.start, grid.to, strict=True))
    return bool((wall.gap(points) <= ON_FACE * size).all())
