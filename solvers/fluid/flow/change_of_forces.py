"""The change of the forces on a fluid in a step, with which Newton's method compares its residual."""

from __future__ import annotations

from collections.abc import Callable

from solvers.api import Array
from solvers.fluid.flow.flow_iterate import FlowIterate
from solvers.fluid.settings.flow_settings import FlowSettings


class ChangeOfForces:
    """Norm of the first residual of a solution, of those that are not zero.

    Those of later iterates, which may blow up, say nothing of the forces. With a viscosity by the shear rate the first
    one is that of fluid at rest, which a power law makes as large as one likes. The second iterate knows the rates:
    then the first flow is measured again, with the viscosity of the second one in cut cells and in the norm.
    """

    def __init__(self, settings: FlowSettings):
        self._varies = settings.shear is not None
        self.size = 0.0  #: [N]
        self._first: tuple[FlowIterate, Array] | None = None  #: with its flow at local dofs, until the second one

    def begin(self) -> None:
        """No residual of this solution is known."""
        self.size, self._first = 0.0, None

    def record(self, size: float, iterate: FlowIterate, norm: Callable[[Array], float]) -> None:
        """Note the norm [N] of the present residual; norm: of rows (collective)."""
        if not self.size:
            self.size = size
            self._first = (iterate, iterate.local_values()) if self._varies else None
        elif self._first is not None:
            first, flow = self._first
            if first is iterate:  # else there are other cells
                self.size = min(self.size, norm(iterate.residual_of(flow)))
            self._first = None
