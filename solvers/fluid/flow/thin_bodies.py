"""Moving thin bodies: detection of changes of the sheets, and transfer of the flow to the nodes of new sheets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from solvers.api import Array, FailureKind, NoResidual, State
from solvers.cut_cells import CrossingSurfaces
from solvers.fluid.flow.carrier import Carrier
from solvers.fluid.flow.history import Past
from solvers.fluid.flow.sheet_transfer import Sides, along_surface, sides_of, transfer
from solvers.fluid.geometry.pieces import off_boundary
from solvers.fluid.geometry.thin.sheet_cycles import joined_in, recurring, united
from solvers.fluid.geometry.thin.sheet_nodes import Joined, same_nodes
from solvers.fluid.geometry.thin.sheets import Sheets, find_sheets
from solvers.fluid.geometry.thin.thickness import THIN, THIN_IF_MOVING
from solvers.fluid.geometry.thin.thinness import cell_sizes_at, may_be_thin, solid_of
from solvers.fluid.geometry.thin.walls import facets_of_walls
from solvers.fluid.grid.box import Grid
from solvers.fluid.grid.nested import Nested
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.time_scheme import FlowStep
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import Motion, tied, wetness

NO_INSIDE = "an iterate has a surface that crosses itself or another one, so that it has no inside"

#: Thickness in cells up to which moving bodies have separate cells with contact, by dimension: in 2D that of bodies at
#: rest. Where thicker ones touch, Newton's method may not converge: fluid between them appears and disappears in its
#: course. In 3D elastic bodies of 0.3 cells were computed; from one cell on it is as without separate cells, because
#: no elastic body between one and two cells has been tried. They leak little (docs/theory_fsci.md).
THICK_IN_CONTACT = {2: float(THIN), 3: 1.0}


def thickest(dim: int) -> float:
    """Thickness in cells up to which moving bodies have separate cells for each side.

    Thicker ones have a strip of cells behind each side instead, and fluid would pass where both strips share nodes:
    where cut cells are THIN_IF_MOVING apart or less in all directions. A body is so thick if it is parallel to a
    diagonal plane.
    """
    return math.sqrt(dim) * (THIN_IF_MOVING + 1)


class ThinBodies:
    """Finds the sheets of the fluid for each position of the bodies, after one of these has been thin."""

    def __init__(self, grid: Grid, bodies: Sequence[ImmersedBody], repeated: tuple[int, ...], sheets: Sheets | None):
        """repeated: periodic axes of the box; sheets: around bodies at rest."""
        self._grid, self._repeated, self.follows, self._sheets = grid, repeated, False, sheets
        surfaces = [body.surface for body in bodies]
        self._wet, self._tied = wetness(surfaces), tied(surfaces)
        moving = bool(bodies) and not all(body.rests for body in bodies)
        touch = any(body.surface.in_contact is not None and body.surface.in_contact.any() for body in bodies)
        self._touch = touch
        # what moves with the iterates would touch and part in the course of a step
        self._thin, self._may_close = True, all(body.motion is not None for body in bodies)
        self._possible: bool | None = None if moving else False
        self._x: Array | None = None
        self._searched = False  #: in this step, without a result: a search takes as long as a tenth of an iterate
        self._closed: NDArray[np.int64] | None = None  #: `Sheets.closed` of this step; None: it has no sheets yet
        self._alone: Sheets | None = None  #: sheets of the latest position, with no part joined
        self._tried: list[Sheets] = []  #: sheets of the positions of this step, in their order
        self._joined: Joined = {}  #: parts that a cycle of this step joins
        self._released = False  #: the cycles of this step have been let go once

    @property
    def may_follow(self) -> bool:
        """Whether the cells may change during the run."""
        return self._possible is not False

    def sheets(self, facets: NDArray[np.int64], motion: Motion) -> Sheets | None:
        """Sheets of the fluid around surfaces at their present positions.

        None if no body has been thin yet, which the first position in a step decides.
        """
        if self._possible is None:
            self._thin = self._may_be_thin(facets, motion.x)
            self._possible = self._thin or self._may_close
        if not self._possible or (self._searched and not self.follows):
            return self._sheets
        if self._x is None or not np.array_equal(self._x, motion.x):
            found = self._at(facets, motion.x)
            self._sheets, self._x, self.follows, self._searched = found, motion.x, found is not None, True
        if self._sheets is not None:
            if self._closed is None:
                self._closed = self._sheets.touching
            if not np.array_equal(self._sheets.closed, self._closed):
                self._sheets = replace(self._sheets, closed=self._closed)
        return self._sheets

    def _may_be_thin(self, facets: NDArray[np.int64], x: Array) -> bool:
        grid, most = self._grid, thickest(self._grid.dim)
        body = solid_of(facets, x, self._tied)

        def thin(some: NDArray[np.bool_], thick: float) -> bool:
            return may_be_thin(grid, facets[some], x, thick, body[some])

        if not self._touch:
            return thin(self._wet, most)
        return thin(self._wet, THICK_IN_CONTACT[grid.dim]) or thin(self._wet & facets_of_walls(grid, facets, x), most)

    def _at(self, facets: NDArray[np.int64], x: Array) -> Sheets | None:
        """Sheets at a position, where the parts are joined that a cycle of this step has joined.

        These depend on the way; see `release`. Parts that touching bodies divide in a step are not joined as such: the
        pressures on both sides of bodies that glide along each other differ.
        """
        alone = self._find(facets, x, {})
        if alone is None:
            return None
        found, self._alone = self._with(alone, facets, x), alone
        if cycle := recurring(self._tried, found):
            self._joined = united(self._joined, joined_in(cycle))
            found = self._with(alone, facets, x)
        if not (self._tried and self._tried[-1].same_unknowns(found)):
            self._tried.append(found)
        return found

    def _with(self, alone: Sheets, facets: NDArray[np.int64], x: Array) -> Sheets:
        if not same_nodes(alone.parts, self._joined):
            return alone
        found = self._find(facets, x, self._joined)
        assert found is not None
        return found

    def _find(self, facets: NDArray[np.int64], x: Array, joined: Joined) -> Sheets | None:
        off = off_boundary(self._grid, x[facets])
        thin, always = THIN_IF_MOVING, self.follows
        ties = None if self._tied is None else (self._tied, self._wet)
        try:
            return find_sheets(
                self._grid,
                facets,
                x,
                off,
                thin=thin if self._thin else 0,
                always=always,
                closing=self._may_close,
                joined=joined,
                tied=ties,
                repeated=self._repeated,
                before=self._sheets,
            )
        except CrossingSurfaces as error:  # on all processes, which have the same surfaces and the whole grid
            raise NoResidual("fluid", FailureKind.DIVERGED, f"{NO_INSIDE}: {error}") from None

    def release(self, facets: NDArray[np.int64], motion: Motion) -> bool:
        """Let parts go that a cycle joins, at a solution; returns whether it has other unknowns without them.

        A solution without them is then looked for from there. If the cycle comes back there is none nearby, and parts
        that it joins belong to the solution. So no solution depends on the way to it.
        """
        if not self._joined or self._released:
            return False
        before, self._released = self._sheets, True
        self._joined, self._tried, self._x = {}, [], None
        now = self.sheets(facets, motion)
        assert before is not None
        return now is None or not now.same_unknowns(before)

    def begin_step(self) -> None:
        """Start from the accepted position, and search once for thin bodies if there has been none."""
        self._tried, self._searched, self._closed, self._released = [], False, None, False
        if self._joined:
            self._joined, self._sheets = {}, self._alone

    def save(self) -> State:
        """The state: whether a body has been thin, and (cell, facet) of joined parts."""
        pairs = [(cell, facet) for cell, some in sorted(self._joined.items()) for facet in sorted(some)]
        return {"follows": self.follows, "joined": np.array(pairs, dtype=np.int64).reshape(-1, 2)}

    def restore(self, state: State) -> None:
        """Restore a saved state."""
        self.begin_step()
        self.follows, self._searched = bool(state["follows"]), True
        for cell, facet in np.asarray(state["joined"]).tolist():
            self._joined = united(self._joined, {cell: frozenset({facet})})
        if self._possible is not False:
            self._x = self._sheets = self._alone = None


@dataclass(frozen=True)
class Began:
    """The state at the beginning of a step: unknowns, sheets, earlier velocities, and positions of the bodies [m]."""

    unknowns: Unknowns
    sheets: Sheets | None
    step: FlowStep  #: that the system has the terms of
    past: tuple[Past, ...]
    motions: tuple[Motion, ...]
    layers: int  #: of cells behind surfaces with velocities

    def way(self, x: Array) -> float:
        """The farthest way [m] along an axis of a vertex to the positions x of all vertices."""
        before = [motion.x for motion in self.motions]
        return float(np.abs(x - np.concatenate(before)).max(initial=0.0)) if before else 0.0


class Carrying:
    """Transfers to the unknowns of new sheets, around facets with this motion now.

    What the new sheets need for it is found once, for any number of transfers and, with `q1q1`, for velocity and
    pressure, whose nodes are the same.
    """

    def __init__(self, new: Unknowns, facets: NDArray[np.int64], motion: Motion):
        after, x = new.grid.sheets, motion.x
        assert after is not None
        self._new, self._after = new, after
        cell = max(float(cell_sizes_at(edge, x[:, axis]).max()) for axis, edge in enumerate(after.grid.edges))
        self._along = cache(lambda: along_surface(facets, x, cell))
        self._sides = cache(lambda degree: sides_of(after, degree, self._along()))
        self._walls = cache(lambda: _seen(self._sides(new.degree), motion.v[facets].mean(axis=1)))

    def __call__(self, old: Unknowns, before: Sheets | None) -> Carrier:
        """The transfer from old unknowns; before: their sheets, None: nodes of the box."""
        degree, walls = self._new.degree, self._walls()
        matrices = {one: self._matrix(before, one) for one in {degree, 1}}
        if (nested := self._new.grid.nested) is not None:
            for one, matrix in matrices.items():
                matrices[one] = matrix[_in_mesh(nested, self._after, one)][:, _in_mesh(nested, before, one)]
            walls = walls[_in_mesh(nested, self._after, degree)]
        return Carrier(old, self._new, matrices[degree], matrices[1], walls)

    def _matrix(self, before: Sheets | None, degree: int) -> sparse.csr_matrix:
        if before is not None:
            return transfer(sides_of(before, degree, self._along()), self._sides(degree))
        count = self._after.node_count(degree)
        entries = (np.ones(count), (np.arange(count), self._after.on_lattice(np.arange(count), degree)))
        return sparse.csr_matrix(entries, shape=(count, self._after.lattice_size(degree)))


def _in_mesh(nested: Nested, sheets: Sheets | None, degree: int) -> NDArray[np.int64]:
    """Numbers of the nodes that the mesh of nested cells has, in the order of `FlowNodes.consecutive`."""
    nodes = nested.all_nodes(degree)
    if sheets is None:
        return nodes
    return np.concatenate([nodes, np.arange(sheets.lattice_size(degree), sheets.node_count(degree))])


def _seen(sides: Sides, of_facets: Array) -> Array:
    """Weighted mean of values of the facets that each node sees, nan where it sees none."""
    with np.errstate(invalid="ignore"):
        return np.asarray(sides.of_nodes @ of_facets) / np.asarray(sides.of_nodes.sum(axis=1))
