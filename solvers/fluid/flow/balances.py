"""Balances of volume, momentum and power of the whole fluid, computed without the interface terms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import ufl
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.fluid.solve.system import FlowSystem
from solvers.fluid.terms import forms


@dataclass(frozen=True)
class Crossing:
    """Flow rates [m^3/s] at the pieces of surface in the cells of this process."""

    cell: NDArray[np.int32]
    swept: Array  #: int g . n, n out of the fluid
    leak: float  #: sum over facets in cells of |int (u - g) . n|


def crossing(system: FlowSystem) -> Crossing:
    """What passes through the surfaces of bodies, and what they displace.

    With Nitsche's method the velocity differs from that of the surface by the discretisation error. Where both sides of
    a thin body share unknowns, this is the flow through the body. Pieces of one facet in one cell are added up before
    absolute values are taken: where bodies touch, rounding decides how many there are.
    """
    assert system.cut is not None
    at = system.assemble_interface()
    u, g = system.flow.x.array[at.u], at.at_corners(system.cut.motion.v, system.sweep_velocity)
    swept = np.einsum("pvw,pw->p", at.mass_of_pieces, np.einsum("pwi,pi->pw", g, at.n))
    net = np.einsum("pav,pa->p", at.fields[..., 0], np.einsum("pai,pi->pa", u, at.n)) - swept
    _, of_piece = np.unique(np.stack([at.cell, at.facet]), axis=1, return_inverse=True)
    return Crossing(at.cell, swept, float(np.abs(np.bincount(of_piece.ravel(), net)).sum()))


def seepage(system: FlowSystem) -> float:
    """Flow rate [m^3/s] through closed contact (collective)."""
    terms = system.assemble_seepage()
    return 0.0 if terms is None else terms.leak(system.flow.x.array)


class Balances:
    """The momentum equations tested with a constant velocity (force) and with that of the fluid (power).

    Stabilisation and cut penalty vanish in the force. Their contribution to the power is the loss of the method.
    """

    def __init__(self, system: FlowSystem):
        self.system = system
        u = system.unknowns.parts(system.flow)[0]
        v = system.unknowns.parts(ufl.TestFunction(system.unknowns.space))[0]
        everywhere, in_cut, in_film = (
            ufl.dot(forms.inertia(flow, u), v) + ufl.inner(forms.viscous_stress(flow, u), forms.eps(v))
            for flow in (system.terms, system.on_cut, forms.creeping(system.on_cut))
        )
        self._inner = self._over_fluid(everywhere, in_cut, in_film)

    def __call__(self, held: NDArray[np.bool_]) -> tuple[Array, float, float]:
        """(force [N] on all bodies together, (dim,); power [W] lost by the method, and that of walls and patches).

        Collective.

        held: owned dofs whose rows are not solved for.
        Force: that on walls and patches, minus int rho (u_t + u . grad u) - f, plus the force in closed contact, which
        does not appear in the momentum of the fluid.
        Power of stabilisation, cut penalty and slip at the bodies: the power of walls and patches, minus that of the
        force on the bodies, minus int (rho (u_t + u . grad u) - f) . u + 2 mu eps(u) : eps(u).
        """
        system, dofs = self.system, self.system.unknowns.velocity.dofs
        assert system.cut is not None
        outer = self._outer_rows(held)
        rows = outer - self._inner_rows()
        force, closed = system.grid.comm.allreduce(rows[dofs].sum(axis=0)), system.zone_force()
        given = system.grid.comm.allreduce(float((rows * system.flow.x.array)[dofs].sum()))
        of_flow = system.surface_force() - closed
        on_bodies = float((of_flow * system.cut.motion.v).sum()) + system.sweep_power()
        outside = system.grid.comm.allreduce(float((outer * system.flow.x.array)[dofs].sum()))
        return force + closed.sum(axis=0), given - on_bodies, outside

    def _outer_rows(self, held: NDArray[np.bool_]) -> Array:
        """Forces [N] on the fluid from walls and patches at local dofs; contributions to ghosts are not added up."""
        owned = np.where(held, self.system.residual(), 0.0)
        rows = -self.system.outer_rows()
        rows[: len(owned)] += owned
        return rows

    def _over_fluid(self, integrand, in_cut, in_film) -> list[fem.Integral]:
        """Integrals over uncut cells, over the fluid in cut cells, and in films."""
        system, domain, weights = self.system, self.system.grid.domain, self.system.weights
        parts = [fem.Integral(domain, integrand * fem.measure(domain, "dx", 2 * system.unknowns.degree + 1))]
        if system.with_bodies:
            dx_cut = fem.measure(domain, "dx", weights.degree)
            parts += [fem.Integral(domain, weights.fluid * some * dx_cut) for some in (in_cut, in_film)]
        return parts

    def _inner_rows(self) -> Array:
        """int (rho (u_t + u . grad u) - f) . v + 2 mu eps(u) : eps(v) at local dofs, in films without convection.

        Contributions to ghosts are not added up.
        """
        system = self.system
        rows = np.zeros(system.unknowns.local)
        for part, cells in zip(self._inner, system.cells, strict=False):
            fem.assemble_vector(part.on(cell=cells), rows)
        return rows
