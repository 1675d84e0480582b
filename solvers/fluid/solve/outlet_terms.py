"""Outlets whose pressure is a line of their flow rate, P = R q + p: a part of rank one of the equations each.

With b = int n . v over the wet part of an outlet and q = b . u the momentum equations have b P, their tangent R b b^T.
It couples all unknowns of the outlet: Krylov methods multiply by it, with a preconditioner of the rest, and need one
more iteration for each outlet (`added_product`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from solvers import fem
from solvers.api import EPS, Array, Mask
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.terms.boundary.windkessel import Line


class OutletTerms:
    """The terms of all outlets on the present cut. Rows and values are arrays at owned dofs; calls are collective."""

    def __init__(self, unknowns: Unknowns, lines: Sequence[Line]):
        self._unknowns, self._comm = unknowns, unknowns.grid.comm
        self.lines = lines  #: of the present step
        self._fluxes = np.zeros((len(lines), unknowns.owned))  #: b

    def set(self, fluxes: Sequence[Array]) -> None:
        """Take b of a new cut, at local dofs without the contributions of other processes."""
        hanging, owned = self._unknowns.hanging, self._unknowns.owned
        for row, flux in zip(self._fluxes, fluxes, strict=True):
            fem.add_ghosts(self._unknowns.space, flux)
            row[:] = flux[:owned] if hanging is None else hanging.rows(flux[:owned])

    def rates(self, flow: Array) -> Array:
        """q [m^3/s] of each outlet for values at owned dofs."""
        own: Array = self._fluxes @ flow
        return own if self._comm.size == 1 or not self.lines else self._comm.allreduce(own)

    def pressures(self, flow: Array) -> Array:
        """P [Pa] of each outlet."""
        return np.array(
            [line.resistance * q + line.pressure for line, q in zip(self.lines, self.rates(flow), strict=True)]
        )

    def rows(self, flow: Array) -> Array:
        """b P, the force of the outlets on the fluid with the opposite sign [N]."""
        return self.pressures(flow) @ self._fluxes

    def product(self, held: Mask) -> Callable[[Array], Array] | None:
        """x -> R b b^T x with zero rows at held dofs; None without outlets."""
        if not self.lines:
            return None
        resistances = np.array([line.resistance for line in self.lines])
        into = np.where(held, 0.0, self._fluxes)
        return lambda x: (resistances * self.rates(x)) @ into

    def rounding(self, flow: Array) -> Array:
        """Rounding errors of `rows`, as in `algebra.rounding`: those of each term of q, with random signs."""
        if not self.lines:
            return np.zeros(self._unknowns.owned)
        squares = self._fluxes**2 @ flow**2
        sizes = np.array([line.resistance for line in self.lines]) * np.sqrt(self._comm.allreduce(squares))
        return EPS * sizes @ np.abs(self._fluxes)
