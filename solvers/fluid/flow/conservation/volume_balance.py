"""Flow rates of one step: through patches, through the surfaces of bodies, and what each region of the fluid loses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.api import Array
from solvers.fluid.flow.balances import Crossing, crossing, seepage
from solvers.fluid.flow.conservation.regions import Regions, RegionsOfCut
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.settings.time_scheme import FlowStep


@dataclass(frozen=True)
class FlowRates:
    """Flow rates [m^3/s] at the end of a step.

    The rate that a region loses is the flow rate out of it through patches, plus the volume that bodies leave in it per
    time. It is the discrete continuity equation tested with 1 there, and zero up to the tolerance of the solver if the
    unknowns of regions are separate. It has no error of the velocity at surfaces, as `leak` has.
    """

    patches: dict[str, float]  #: out of the box through each patch
    periodic: float  #: through the box along periods
    lost: Array  #: by each region
    leak: float  #: through the surfaces of all bodies, sum over facets in cells of absolute values
    displaced: float  #: volume per time that bodies take on one side and leave on the other
    unsolved: float  #: residual of the continuity equations, sum of absolute values

    @property
    def mass(self) -> float:
        """What the whole fluid loses."""
        return float(self.lost.sum())

    @property
    def through_box(self) -> float:
        """What flows into the box, or out of it if this is more."""
        rates = np.array([0.0, *self.patches.values()])
        return float(max(rates[rates > 0.0].sum(), -rates[rates < 0.0].sum())) + self.periodic


class VolumeBalance:
    """Measures the flow rates once per step (collective)."""

    def __init__(self, fluid: Fluid, regions: RegionsOfCut):
        self._fluid, self._regions, self._rate = fluid, regions, flow_rate(fluid)
        patches = fluid.parts.boundary.patches
        self._patches, self._periods = (
            [patch.name for patch in patches if patch.record.periodic == periodic] for periodic in (False, True)
        )
        self._step: FlowStep | None = None
        self._rates: FlowRates | None = None

    def rates(self) -> FlowRates:
        """Those of the present step."""
        fluid = self._fluid
        if self._rates is None or self._step is not fluid.current:
            self._step, self._rates = fluid.current, self._measure()
        return self._rates

    def numbers(self) -> dict[str, float]:
        """Columns of the history.

        fluid.mass [m^3/s]: what the fluid loses. fluid.leak, with bodies: the flow rate through their surfaces, a
        discretisation error. fluid.seepage: that through closed contact.
        """
        fluid, rates = self._fluid, self.rates()
        passing = {"fluid.leak": rates.leak} if fluid.bodies else {}
        if fluid.system.seeping is not None:
            passing["fluid.seepage"] = seepage(fluid.system)
        return {"fluid.mass": rates.mass, **passing}

    def _measure(self) -> FlowRates:
        fluid = self._fluid
        patches = {name: self._rate([name]) for name in self._patches}
        periodic = sum(abs(self._rate([name])) for name in self._periods)
        _, unsolved = fluid.unsolved()
        if not fluid.bodies:
            return FlowRates(patches, periodic, np.array([sum(patches.values())]), 0.0, 0.0, unsolved)
        found, regions = crossing(fluid.system), self._regions.now()
        leak, displaced = fluid.comm.allreduce(np.array([found.leak, 0.5 * np.abs(found.swept).sum()]))
        return FlowRates(patches, periodic, self._lost(found, regions, patches), leak, displaced, unsolved)

    def _lost(self, found: Crossing, regions: Regions, patches: dict[str, float]) -> Array:
        count = len(regions.volume)
        if count < 2:
            return np.array([sum(patches.values()) + self._fluid.comm.allreduce(float(found.swept.sum()))])
        region = regions.of_cell[found.cell]
        swept = self._fluid.comm.allreduce(np.bincount(region + 1, found.swept, count + 1))
        rates = [self._rate(self._patches, regions.of_cell == number) for number in range(count)]
        lost = swept[1:] + np.array(rates)
        lost[np.argmax(regions.volume)] += (
            sum(patches.values()) - sum(rates) + swept[0]
        )  # in no region: rounding errors
        return lost
