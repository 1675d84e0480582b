"""The sentinel of volumes: the fluid loses none, and none passes through walls.

Volumes that have passed since the start are compared, not rates. A flow that starts, rests or turns has rates near
zero, and errors that change their sign pass nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from solvers.api import Array, Finding, State
from solvers.fluid.flow.conservation.regions import Regions, RegionsOfCut
from solvers.fluid.flow.conservation.volume_balance import FlowRates, VolumeBalance
from solvers.fluid.flow.field import Fluid
from solvers.fluid.geometry.pieces import place_of

#: Share of the volume that flows through the box, or that bodies displace, above which a loss is found.
LOST = 0.005

CLOSED_POCKET = (
    "This part of the fluid has no open patch, so that what flows in or is squeezed there cannot leave: give it an "
    "'outflow', 'traction' or 'pressure' patch"
)
OPENED_POCKET = (
    "It vanishes in surfaces that are not wetted, or comes out of them: name all surfaces that the fluid may reach in "
    "'coupling.wetted', or make the step smaller"
)


class Volumes:
    """Implements `Sentinel`."""

    def __init__(self, fluid: Fluid, regions: RegionsOfCut, balance: VolumeBalance):
        self._fluid, self._regions, self._balance = fluid, regions, balance
        surfaces = [body.surface for body in fluid.bodies]
        self._names = [surface.name for surface in surfaces]
        self._body = np.repeat(np.arange(len(surfaces)), [len(surface.facets) for surface in surfaces])
        self._flowed = 0.0  #: volume that has flowed through the box, or that bodies have displaced [m^3]
        self._unsolved = 0.0  #: volume that the residuals of the continuity equations explain [m^3]
        self._made = 0.0  #: volume that has left without having been there [m^3]; negative: that was lost
        self._exchanged = 0.0  #: volume that has passed from one region to another [m^3]

    def start(self, t: float) -> None:
        """Nothing has flowed."""

    def look(self, t: float, dt: float) -> Sequence[Finding]:
        """Losses of the whole fluid, and what has passed through walls (collective)."""
        rates = self._balance.rates()
        total = abs(rates.mass)
        self._flowed += dt * max(rates.through_box, rates.displaced)
        self._unsolved += dt * rates.unsolved
        self._made += dt * rates.mass
        self._exchanged += dt * 0.5 * (float(np.abs(rates.lost).sum()) - total)
        return list(self._findings(rates))

    def _findings(self, rates: FlowRates) -> Iterator[Finding]:
        least = max(LOST * self._flowed, self._unsolved)
        if abs(self._made) <= least and self._exchanged <= least:
            return
        regions = self._regions.now() if self._fluid.bodies else None
        worst = int(np.argmax(np.abs(rates.lost)))
        where, place = None, ""
        if regions is not None:
            where = self._middle(regions, worst)
            place = f" around ({', '.join(f'{x:.3g}' for x in where)})"
        if abs(self._made) > least:
            what = "made of nothing" if self._made > 0.0 else "lost"
            cause = OPENED_POCKET if regions is not None and regions.opened[worst] else CLOSED_POCKET
            message = f"{abs(self._made):.3g} [volume] of fluid were {what}{place} ({self._share(self._made)}). {cause}"
            yield Finding("mass", "fluid", self._made, message, where=where)
        elif regions is not None:
            names = self._bodies_at(regions, worst)
            message = (
                f"{self._exchanged:.3g} [volume] of fluid have passed through {names}{place}, which is tight "
                f"({self._share(self._exchanged)}): the cells do not separate its two sides. Make it four cells thick"
            )
            yield Finding("leak", names, self._exchanged, message, where=where)

    def _share(self, volume: float) -> str:
        share = abs(volume) / self._flowed if self._flowed > 0.0 else np.inf
        return f"{share:.2%} of what has flowed through the box or was displaced"

    def _middle(self, regions: Regions, number: int) -> tuple[float, ...]:
        """The middle [m] of a region (collective)."""
        grid = self._fluid.grid
        low, size = place_of(grid.grid, grid.numbers[regions.of_cell == number])
        sums: Array = self._fluid.comm.allreduce(np.append((low + 0.5 * size).sum(axis=0), len(low)))
        return tuple((sums[:-1] / sums[-1]).tolist())

    def _bodies_at(self, regions: Regions, number: int) -> str:
        """The names of the bodies that bound a region (collective)."""
        cut = self._fluid.cut
        facets = cut.pieces.facet[regions.of_cell[cut.cut[cut.pieces.cell]] == number]
        count = np.bincount(self._body[facets], minlength=len(self._names))
        found = np.flatnonzero(self._fluid.comm.allreduce(count))
        return ", ".join(f"'{self._names[index]}'" for index in found)

    def save(self) -> State:
        return {"volumes": [self._flowed, self._unsolved, self._made, self._exchanged]}

    def restore(self, state: State) -> None:
        self._flowed, self._unsolved, self._made, self._exchanged = state["volumes"]
