"""The columns and sentinels of what a flow conserves."""

from __future__ import annotations

from fsci.builder.columns import Numbers
from solvers.api import Sentinel
from solvers.fluid.flow.conservation.pockets import Pockets
from solvers.fluid.flow.conservation.regions import RegionsOfCut
from solvers.fluid.flow.conservation.volume_balance import VolumeBalance
from solvers.fluid.flow.conservation.volumes import Volumes
from solvers.fluid.flow.field import Fluid


class WatchedFlow:
    """Volumes and pockets of a flow: `sentinels` by name, and the columns of the history."""

    def __init__(self, fluid: Fluid):
        regions = RegionsOfCut(fluid)
        self._balance = VolumeBalance(fluid, regions)
        self.sentinels: dict[str, Sentinel] = {"volumes": Volumes(fluid, regions, self._balance)}
        moves = not all(body.rests for body in fluid.bodies)
        self._pockets = Pockets(fluid, regions) if moves and not fluid.steady else None
        if self._pockets is not None:
            self.sentinels["pockets"] = self._pockets

    def numbers(self) -> Numbers:
        """fluid.mass, fluid.leak, fluid.seepage, and the volume of each pocket that was closed at the start."""
        return self._balance.numbers() | ({} if self._pockets is None else self._pockets.numbers())
