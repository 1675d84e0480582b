"""The sentinel of closed pockets: an incompressible fluid keeps its volume, whatever moves its boundary.

A pocket is a cavity of a body, whose volume its surface gives, or a closed region of the fluid. Its volume may change
only by what prescribed velocities bring in. From step to step a pocket is where its cells are: it goes on in all
regions that have some of them. Pockets that join go on as one. A pocket ends where a region of it opens.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from solvers.algebra.connected import connected_parts
from solvers.api import Finding, Indices, State
from solvers.fluid.flow.conservation.cavities import TESTED, Cavity, enclosed, evenly, find_cavities, points_inside
from solvers.fluid.flow.conservation.regions import Regions, RegionsOfCut, overlaps
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.geometry.pieces import place_of

#: Relative change of the volume of a pocket above which there is a warning.
CHANGE = 0.005


@dataclass
class WatchedPocket:
    """A pocket with the volume that it should have."""

    name: str
    since: float  #: time [s] when it closed
    volume: float  #: at present [m^3]
    cells: Indices  #: numbers in the box of its cells full of fluid, sorted; a small cavity has none
    due: list[float] = field(default_factory=list)  #: volumes that it should have had, newest first [m^3]
    surface: Indices | None = None  #: facets that bound it, of a cavity


class Pockets:
    """Implements `Sentinel`, and has the columns of the pockets that are closed at the start."""

    def __init__(self, fluid: Fluid, regions: RegionsOfCut):
        self._fluid, self._regions, self._rate = fluid, regions, flow_rate(fluid)
        self._given = [patch.name for patch in fluid.parts.boundary.patches if patch.record.value == "velocity"]
        self._wet = fluid.moving.surfaces.wet
        self._pockets: list[WatchedPocket] = []
        self._columns = 0  #: pockets at the start
        self._count = 0  #: pockets so far

    def start(self, t: float) -> None:
        """Find the pockets at the start, cavities first (collective).

        Cavities without a cell full of fluid count where no body is in them: they may be gaps, or closed, else.
        """
        fluid, box = self._fluid, self._fluid.grid.grid.edges
        corners = [np.array([edge[side] for edge in box]) for side in (0, -1)]
        cut, found = fluid.cut, self._regions.now()
        for cavity in find_cavities(cut.facets, cut.motion.x, self._wet, corners) if len(cut.facets) else []:
            cells = self._cells_in(cavity, found)
            if len(cells) or len(cavity.facets) == len(cavity.wall):
                self._add(t, -enclosed(cut.motion.x, cut.facets[cavity.facets]), cells, cavity.facets)
        self._follow(t, found)
        self._columns = self._count

    def look(self, t: float, dt: float) -> Sequence[Finding]:
        """The pockets whose volume is not what it should be (collective)."""
        found = self._regions.now()
        self._flow_in(found)
        self._follow(t, found)
        return [finding for pocket in self._pockets if (finding := self._finding(pocket)) is not None]

    def numbers(self) -> dict[str, float]:
        """Volume [m^3] of each pocket that was closed at the start, nan once it is open."""
        volumes = {pocket.name: pocket.volume for pocket in self._pockets}
        return {f"fluid.{name}": volumes.get(name, np.nan) for name in map(_name, range(1, self._columns + 1))}

    # ------------------------------------------------------------------------------------------------- volumes

    def _add(self, t: float, volume: float, cells: Indices, surface: Indices | None = None) -> None:
        self._count += 1
        due = [volume] * max(1, self._fluid.settings.time.times)
        self._pockets.append(WatchedPocket(_name(self._count), t, volume, cells, due, surface))

    def _cells_in(self, cavity: Cavity, found: Regions) -> Indices:
        """Numbers in the box of cells full of fluid in a cavity (collective).

        All cells of regions that lie in it; of a region that the grid does not separate from the outside, the tested
        ones that do.
        """
        fluid, cut = self._fluid, self._fluid.cut
        uncut = cut.uncut[cut.uncut < fluid.grid.owned]
        numbers, region = fluid.grid.numbers[uncut], found.of_cell[uncut]
        parts = []
        for which in range(len(found.closed)):
            mine = np.sort(np.concatenate(fluid.comm.allgather(numbers[region == which])))
            tested = evenly(mine, TESTED)
            low, size = place_of(fluid.grid.grid, tested)
            inside = points_inside(low + 0.5 * size, cut.motion.x, cut.facets[cavity.wall])
            parts.append(mine if len(mine) and inside.all() else tested[inside])
        return np.sort(np.concatenate(parts))

    def _flow_in(self, found: Regions) -> None:
        """Add what flows in through patches with a given velocity, by the difference formula of the flow."""
        rule = self._fluid.current.difference
        rates = self._rates(found)
        for pocket, rate in zip(self._pockets, rates, strict=True):
            past = sum(beta * before for beta, before in zip(rule.beta, pocket.due, strict=False))
            pocket.due = [(past + rate) / rule.alpha, *pocket.due[:-1]]

    def _rates(self, found: Regions) -> list[float]:
        """Flow rate [m^3/s] into each pocket through patches with a given velocity."""
        if not self._given:
            return [0.0] * len(self._pockets)
        own = overlaps(self._fluid, found, [pocket.cells for pocket in self._pockets])
        return [-self._rate(self._given, np.append(row, False)[found.of_cell]) for row in own]

    def _finding(self, pocket: WatchedPocket) -> Finding | None:
        change = pocket.volume / pocket.due[0] - 1.0 if pocket.due[0] > 0.0 else 0.0
        if abs(change) <= CHANGE:
            return None
        where = self._middle(pocket)
        place = ", ".join(f"{x:.3g}" for x in where)
        number = pocket.name.rpartition("_")[2]
        message = (
            f"closed pocket {number} of the fluid, around ({place}), has {pocket.volume:.5g} [volume] instead of "
            f"{pocket.due[0]:.5g} since it closed at t = {pocket.since:.4g} ({change:+.2%}): fluid was lost or made. "
            "If rigid bodies squeeze it, give it an open patch; else take a smaller 'step' or finer cells at its walls"
        )
        return Finding("pocket", pocket.name, change, message, where=where)

    def _middle(self, pocket: WatchedPocket) -> tuple[float, ...]:
        if not len(pocket.cells):
            cut = self._fluid.cut
            return tuple(cut.motion.x[np.unique(cut.facets[pocket.surface])].mean(axis=0).tolist())
        low, size = place_of(self._fluid.grid.grid, pocket.cells)
        return tuple((low + 0.5 * size).mean(axis=0).tolist())

    # ------------------------------------------------------------------------------------- from step to step

    def _follow(self, t: float, found: Regions) -> None:
        """Set volumes and cells of all pockets, end those that have opened, and add new ones."""
        pockets, count = self._pockets, len(self._pockets)
        shared = overlaps(self._fluid, found, [pocket.cells for pocket in pockets])
        of_pocket, region = np.nonzero(shared)
        group = connected_parts(of_pocket, count + region, count + len(found.closed))
        self._pockets, fresh = [], np.flatnonzero(found.closed & ~shared.any(axis=0)).tolist()
        for number in np.unique(group[:count]):
            members = [pocket for pocket, g in zip(pockets, group, strict=False) if g == number]
            those = np.flatnonzero(group[count:] == number)
            cavities = [pocket for pocket in members if pocket.surface is not None]
            plain = [pocket for pocket in members if pocket.surface is None]
            self._pockets += cavities
            if cavities:
                if len(members) == 1 and found.closed[those].all() and len(those):
                    cavities[0].cells = _cells(found, those)
            elif found.closed[those].all() and len(those):
                kept = plain[0]
                kept.due = [sum(due) for due in zip(*(pocket.due for pocket in plain), strict=True)]
                kept.volume, kept.cells = float(found.volume[those].sum()), _cells(found, those)
                self._pockets.append(kept)
            else:
                fresh += those[found.closed[those]].tolist()
        cut = self._fluid.cut
        for pocket in self._pockets:
            if pocket.surface is not None:
                pocket.volume = -enclosed(cut.motion.x, cut.facets[pocket.surface])
        for number in sorted(fresh):
            self._add(t, float(found.volume[number]), found.whole[number])

    # ---------------------------------------------------------------------------------------- save and restore

    def save(self) -> State:
        pockets = self._pockets
        return {
            "columns": self._columns,
            "count": self._count,
            "names": [pocket.name for pocket in pockets],
            "since": [pocket.since for pocket in pockets],
            "volume": [pocket.volume for pocket in pockets],
            "due": [list(pocket.due) for pocket in pockets],
            "cells": _packed([pocket.cells for pocket in pockets]),
            "is_cavity": [pocket.surface is not None for pocket in pockets],
            "surfaces": _packed([pocket.surface for pocket in pockets if pocket.surface is not None]),
        }

    def restore(self, state: State) -> None:
        self._columns, self._count = state["columns"], state["count"]
        surfaces = iter(_unpacked(state["surfaces"]))
        numbers = zip(*(state[name] for name in ("names", "since", "volume", "due", "is_cavity")), strict=True)
        self._pockets = [
            WatchedPocket(name, since, volume, cells, list(due), next(surfaces) if is_cavity else None)
            for (name, since, volume, due, is_cavity), cells in zip(numbers, _unpacked(state["cells"]), strict=True)
        ]


def _packed(arrays: Sequence[Indices]) -> State:
    """Arrays as one, and their lengths."""
    none = np.empty(0, dtype=np.int64)
    return {"values": np.concatenate([none, *arrays]), "counts": np.array([len(a) for a in arrays], dtype=np.int64)}


def _unpacked(state: State) -> list[Indices]:
    ends = np.cumsum(state["counts"])
    return [state["values"][end - count : end] for end, count in zip(ends, state["counts"], strict=True)]


def _name(number: int) -> str:
    return f"pocket_{number}"


def _cells(found: Regions, those: Indices) -> Indices:
    return np.sort(np.concatenate([found.whole[region] for region in those]))
