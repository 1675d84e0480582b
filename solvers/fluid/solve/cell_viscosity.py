"""The viscosity of cut cells, one number for each cell: that of the middle of the cell at the present iterate.

All terms of a surface have it (`nitsche`), so that they stay consistent and action is reaction. Uncut cells have the
viscosity of each point. The tangent has no derivative of the viscosity of cut cells.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from ufl import avg

from solvers import fem
from solvers.api import Array, Indices32
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.terms.forms import Coefficients


class CellViscosity:
    """Without a law of shear, the constant viscosity."""

    def __init__(self, unknowns: Unknowns, settings: FlowSettings):
        self._unknowns, self._settings, domain = unknowns, settings, unknowns.grid.domain
        space = fem.cellwise_space(domain)
        self._function, self._of_scales = (None if settings.shear is None else fem.function(space) for _ in range(2))
        _, slopes = fem.tabulate_lagrange(domain, settings.degree, np.full((1, unknowns.dim), 0.5))
        self._slopes: Array = slopes[0]
        self._kept = False

    def on_cut(self, flow: Coefficients) -> Coefficients:
        """The coefficients in cut cells."""
        return flow if self._function is None else replace(flow, mu=self._function, shear=None)

    def on_faces(self, flow: Coefficients) -> Coefficients:
        """The coefficients on faces between cells: those of `set_scales`, which iterates do not change."""
        return flow if self._of_scales is None else replace(flow, mu=avg(self._of_scales), shear=None)

    def of(self, cells: Indices32) -> Array | float:
        """mu [Pa s] of local cells."""
        if self._function is None:
            return self._settings.viscosity
        found: Array = self._function.x.array[cells]
        return found

    def update(self, flow: Array) -> bool:
        """Take the viscosity of a flow at local dofs; whether it has changed on any process (collective)."""
        if self._function is None or self._kept:
            return False
        new, before = self._by_cell(flow)[0], self._function.x.array
        changed = not np.array_equal(new, before)
        before[:] = new
        return bool(self._unknowns.grid.comm.allreduce(changed, op=MPI.LOR))

    def set_scales(self, velocity: Array) -> None:
        """Set the viscosity that scales penalties on faces to that of a velocity [m/s] at local dofs."""
        if self._of_scales is not None:
            self._of_scales.x.array[:] = self._by_cell(velocity)[0]

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Within, cut cells keep their viscosity, whatever the flow."""
        self._kept = True
        try:
            yield
        finally:
            self._kept = False

    def where_it_shears(self, flow: Array) -> float:
        """Mean of mu [Pa s] with the weight eps(u):eps(u), of a flow at local dofs; at rest that of rest (collective).

        A mean over the volume would be that of dead water.
        """
        if self._function is None:
            return self._settings.viscosity
        grid = self._unknowns.grid
        mu, square = self._by_cell(flow)
        weight = (square * grid.sizes.prod(axis=1))[: grid.owned]
        sums = grid.comm.allreduce(np.array([weight @ mu[: grid.owned], weight.sum()]))
        return float(sums[0] / sums[1]) if sums[1] > 0.0 else self._settings.viscosity

    def _by_cell(self, flow: Array) -> tuple[Array, Array]:
        """mu [Pa s] and 2 eps(u):eps(u) [1/s^2] in the middle of each local cell."""
        mu, law, grid = self._settings.viscosity, self._settings.shear, self._unknowns.grid
        assert law is not None
        gradient = self._slopes / grid.sizes[:, None]
        slope = np.swapaxes(flow[self._unknowns.cell_velocity], 1, 2) @ gradient
        square = 0.5 * ((slope + np.swapaxes(slope, 1, 2)) ** 2).sum(axis=(1, 2))
        power = (1.0 + law.time**2 * square) ** (0.5 * (law.exponent - 1.0))
        return law.infinite + (mu - law.infinite) * power, square
