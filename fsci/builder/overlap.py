"""Pairs of contact whose bodies overlap at the start: the facets that lie deep in the other body."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fsci.builder.obstacle_motion import motion_of_obstacle
from fsci.builder.on_first import shared
from fsci.case import Case
from fsci.case.contact import PairSection, Side
from fsci.meshes.of_case import read_rigid_side
from solvers.api import Array
from solvers.contact.overlap_at_start import SolidSide, overlapping_facets
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.tessellation import tessellate
from solvers.mesh.topology import cut_out


def facets_in_each_other(
    case: Case, comm: MPI.Comm, pair: PairSection, meshes: Mapping[str, Mesh | None]
) -> NDArray[np.int32]:
    """Pairs (slave facet, master facet) in numbers of both surfaces, shape (p, 2) (collective).

    meshes: of elastic bodies by name, on the first process.
    """
    return shared(comm, partial(_find, case, pair, meshes))


def _find(case: Case, pair: PairSection, meshes: Mapping[str, Mesh | None]) -> NDArray[np.int32]:
    none = np.empty((0, 2), dtype=np.int32)
    if pair.itself is not None or pair.tied:
        return none
    (_, slave), (_, master) = pair.sides
    if slave.body == master.body:
        return none
    sides = [PlacedSide(case, side, meshes) for side in (slave, master)]
    low, high = zip(*(side.box for side in sides), strict=True)
    if (np.maximum(*low) >= np.minimum(*high)).any():
        return none
    return overlapping_facets(sides[0].cut_out()[0], sides[1].cut_out()[0])


class PlacedSide:
    """The mesh of one side of a pair, where it is at the start."""

    def __init__(self, case: Case, side: Side, meshes: Mapping[str, Mesh | None]):
        name = side.body or side.obstacle or ""
        if side.body is not None:
            found = meshes[name]
            assert found is not None, "the first process has the meshes"
            mesh, on = found, side.on
        else:
            mesh, on = read_rigid_side(case, name)
        self.mesh, self._on = mesh, on
        self.x = mesh.points + _displacement(case, side, mesh.points)  #: positions of its nodes [m], shape (n, dim)

    @property
    def box(self) -> tuple[Array, Array]:
        return self.x.min(axis=0), self.x.max(axis=0)

    def cut_out(self) -> tuple[SolidSide, NDArray[np.int64]]:
        """(the side, numbers of its nodes in the mesh)."""
        _, facets, nodes = cut_out(self.mesh, self._on)
        whole, at = tessellate(self.mesh)
        return SolidSide(self.x[nodes], facets, CELL_TYPES[self.mesh.cell_type].facet, self.x[at][whole]), nodes


def _displacement(case: Case, side: Side, points: Array) -> Array:
    """Displacement [m] at the start."""
    start = case.time.start
    if side.obstacle is not None:
        motion = motion_of_obstacle(case, side.obstacle, points)
        return np.zeros_like(points) if motion is None else motion(start) - points
    initial = case.elastic_bodies[side.body or ""].initial_displacement
    if initial is None:
        return np.zeros_like(points)
    return np.stack([component(points.T, start) for component in initial], axis=1)
