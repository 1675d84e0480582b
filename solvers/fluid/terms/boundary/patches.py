"""Conditions on the faces of the box, patch by patch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.fluid.grid.box import FACES
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.terms.boundary.meeting_patches import meeting_patches
from solvers.fluid.terms.boundary.patch_kinds import PATCH_KINDS, PatchKind
from solvers.fluid.terms.boundary.wet_faces import WetFaces
from solvers.fluid.terms.boundary.windkessel import Windkessel
from solvers.values import Value, evaluate


@dataclass(frozen=True)
class Patch:
    """Part of the box's boundary with one condition.

    velocity: all components are given; no_slip: they are zero; slip, symmetry: no normal velocity, no shear stress;
    traction [Pa]: sigma n is given; pressure [Pa]: n . sigma n = -p, no tangential velocity; outflow:
    mu du/dn - (p - p_h) n = 0, p_h: hydrostatic pressure of mean zero, modified where fluid enters; periodic: the flow
    is the same on the opposite face, which belongs to the patch too, and a force drives `rate`; resistance,
    windkessel: outflow at the pressure of `outlet`. `kind` may also be a record of the user.
    """

    name: str
    faces: tuple[str, ...]
    kind: str | PatchKind
    value: Sequence[Value] | None = None  #: velocity, traction or pressure
    where: Value | None = None  #: positive on the part of the faces that belongs to the patch; None: all
    outlet: Windkessel | None = None  #: its pressure by the flow rate; None: zero
    rate: Value | None = None  #: of a period, the mean along it of the fluid's flow rate [m^3/s]; None: free

    def __post_init__(self) -> None:
        assert set(self.faces) <= set(FACES)

    @property
    def record(self) -> PatchKind:
        """The record of its kind."""
        return PATCH_KINDS[self.kind] if isinstance(self.kind, str) else self.kind


class UncoveredFaces(ValueError):
    """Part of the boundary has no condition; faces: names of the faces of the box."""

    def __init__(self, faces: Sequence[str]):
        super().__init__("no patch is on part of the box's boundary: " + ", ".join(faces))
        self.faces = tuple(faces)


def periodic_axes(patches: Sequence[Patch]) -> tuple[int, ...]:
    """Directions (0, 1, 2) along which the flow repeats."""
    faces = {face for patch in patches if patch.record.periodic for face in patch.faces}
    assert all(face[0] + other in faces for face in faces for other in "-+"), "both ends of a period"
    return tuple(sorted({"xyz".index(face[0]) for face in faces}))


def driven_periods(patches: Sequence[Patch]) -> list[tuple[str, int, Value]]:
    """Names, directions and rates of the periods with a given rate."""
    return [(patch.name, "xyz".index(patch.faces[0][0]), patch.rate) for patch in patches if patch.rate is not None]


def outlet_laws(patches: Sequence[Patch]) -> dict[str, Windkessel]:
    """The laws of all patches that have one, by name."""
    return {patch.name: patch.outlet for patch in patches if patch.outlet is not None}


def wall_faces(patches: Sequence[Patch]) -> list[tuple[int, int]]:
    """Axis and side (0, 1) of the faces of the box that hold the normal velocity: they are walls."""
    walls = {face for patch in patches if patch.record.normal_given for face in patch.faces}
    return sorted(("xyz".index(face[0]), int(face[1] == "+")) for face in walls)


class Boundary:
    """All patches on one grid. Raises UncoveredFaces (collective).

    Where patches overlap, the last one applies. At nodes where they meet, normal velocities are means of what they
    give (`meeting_patches`), and tangential ones are those of the last patch.
    """

    def __init__(self, grid: DistributedGrid, unknowns: Unknowns, patches: Sequence[Patch]):
        self.patches = list(patches)
        self._unknowns = unknowns
        self.wet_faces = WetFaces()  #: of this box, while bodies rest
        facets, self._cells, midpoints = grid.find_outer_faces()
        patch_of = np.full(len(facets), -1)
        for number, patch in enumerate(patches):
            on = np.zeros(len(facets), dtype=bool)
            for face in patch.faces:
                on |= grid.on_face(midpoints, face)
            if patch.where is not None:
                on &= evaluate(patch.where, midpoints.T, 0.0) > 0.0
            patch_of[on] = number
        self._check(grid, midpoints[patch_of < 0])
        #: local faces and their cells, by patch
        self.facets = [facets[patch_of == number] for number in range(len(patches))]
        self.cells = [self._cells[patch_of == number] for number in range(len(patches))]
        last = np.any([grid.on_face(midpoints, f"{axis}+") for axis in "xyz"[: grid.dim]], axis=0)
        #: mask of the facets that count in flow rates, by patch: of a period only those at its end
        self.at_end = [last[patch_of == n] | (not patch.record.periodic) for n, patch in enumerate(patches)]
        #: number of the patch that prescribes each local dof, the last one where several do; -1: none
        self.imposed = np.full(unknowns.local, -1)
        for number, patch in enumerate(patches):
            for component in self._held(grid, patch, midpoints[patch_of == number]):
                on_patch, axes = component
                dofs = fem.facet_dofs(unknowns.space, axes, np.sort(self.facets[number][on_patch]))
                self.imposed[dofs] = number
        meeting = meeting_patches(grid, unknowns, list(self._across(grid, midpoints, patch_of)))
        normal, owner = meeting.last()
        self.imposed[normal] = owner
        if unknowns.hanging is not None:
            self.imposed[unknowns.hanging.dofs] = -1
        #: local dofs with a prescribed velocity
        self.dofs: NDArray[np.int64] = np.flatnonzero(self.imposed >= 0)
        #: normal velocities that several patches prescribe; whether any process has some
        self.shared = meeting.shared()
        self.any_shared = bool(grid.comm.allreduce(len(self.shared.dofs)))
        self._place = np.searchsorted(self.dofs, np.unique(self.shared.dofs))
        self._node_and_axis = np.full((unknowns.local, 2), -1)  #: of each local velocity dof
        for axis in range(unknowns.dim):
            dofs = unknowns.velocity.dofs[:, axis]
            self._node_and_axis[dofs] = np.stack([np.arange(len(dofs)), np.full(len(dofs), axis)], axis=1)

    def _check(self, grid: DistributedGrid, bare: Array) -> None:
        found = {face for face in FACES[: 2 * grid.dim] if grid.on_face(bare, face).any()}
        together = set().union(*grid.comm.allgather(found))
        if together:
            raise UncoveredFaces([face for face in FACES if face in together])

    def _held(self, grid: DistributedGrid, patch: Patch, midpoints: Array):
        """Pairs of (mask of facets of the patch, component of the velocity that they prescribe)."""
        prescribed = patch.record.prescribed
        if prescribed == "all":
            return [(np.ones(len(midpoints), dtype=bool), axis) for axis in range(grid.dim)]
        on = [(grid.on_face(midpoints, face), "xyz".index(face[0])) for face in patch.faces]
        if prescribed == "normal":
            return on
        if prescribed == "tangential":
            return [(face, axis) for face, normal in on for axis in range(grid.dim) if axis != normal]
        return []

    def _across(self, grid: DistributedGrid, midpoints: Array, patch_of: NDArray[np.int64]):
        """(patch, face of the box, local cells) of patches that prescribe the normal velocity."""
        for number, patch in enumerate(self.patches):
            if patch.record.normal_given:
                for face in patch.faces:
                    yield number, face, self._cells[(patch_of == number) & grid.on_face(midpoints, face)]

    def closed(self) -> bool:
        """Whether no patch is open, so that the pressure level is not determined."""
        return not any(patch.record.open for patch in self.patches)

    def open_cells(self) -> NDArray[np.int32]:
        """Local cells at open patches."""
        cells = [cells for cells, patch in zip(self.cells, self.patches, strict=True) if patch.record.open]
        return np.concatenate([np.empty(0, dtype=np.int32), *cells]).astype(np.int32)

    def velocity(self, t: float) -> Array:
        """Prescribed velocities [m/s] of `dofs` at the time t [s]."""
        values = self._given(self.dofs, self.imposed[self.dofs], t)
        if len(self._place):
            values[self._place] = self.shared.means(self.given_at_shared(t))[1]
        return values

    def given_at_shared(self, t: float) -> Array:
        """Velocities [m/s] that each patch of `shared` gives at its dofs at the time t [s]."""
        return self._given(self.shared.dofs, self.shared.patches, t)

    def _given(self, dofs: NDArray[np.int64], owner: NDArray[np.int64], t: float) -> Array:
        """Velocities [m/s] that patches (their numbers: owner) give at dofs."""
        values = np.zeros(len(dofs))
        node, axis = self._node_and_axis[dofs].T
        for number, patch in enumerate(self.patches):
            if patch.record.value != "velocity":
                continue
            assert patch.value is not None
            for component, value in enumerate(patch.value):
                on = (owner == number) & (axis == component)
                values[on] = evaluate(value, self._unknowns.velocity.points[node[on]].T, t)
        return values
