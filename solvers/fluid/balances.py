"""Momentum and power of the whole fluid: what its bodies get by them, found without the interface terms."""

from __future__ import annotations

import numpy as np
import ufl

from solvers import fem
from solvers.api import Array
from solvers.fluid import forms
from solvers.fluid.field import Fluid


def leak(fluid: Fluid) -> float:
    """Volume [m^3/s] that passes through the surfaces of bodies: sum over pieces of |int (u - g) . n ds| (collective).

    Nitsche's method lets the velocity differ from that of the surface by the error of the grid. Where both sides of a
    thin body share unknowns, the sum is as large as the flow through it.
    """
    at, cut = fluid.system.interface, fluid.cut
    u, g = fluid.flow[at.u], cut.motion.v[at.corners]
    through = np.einsum("pav,pa->p", at.phi, np.einsum("pai,pi->pa", u, at.n))
    through -= np.einsum("pvw,pw->p", at.mass_of_pieces, np.einsum("pwi,pi->pw", g, at.n))
    return fluid.comm.allreduce(float(np.abs(through).sum()))


class Balances:
    """Sums of all momentum equations, tested with a constant velocity and with that of the fluid.

    Stabilisation and ghost penalty vanish in the first sum; what they take from the second is lost by the method.
    """

    def __init__(self, fluid: Fluid):
        self.fluid = fluid
        system = fluid.system
        u = fluid.unknowns.parts(system.flow)[0]
        v = fluid.unknowns.parts(ufl.TestFunction(fluid.unknowns.space))[0]
        inertia, strain = forms.inertia(system.terms, u), forms.eps(u)
        self._inner = self._over_fluid(ufl.dot(inertia, v) + 2.0 * system.terms.mu * ufl.inner(strain, forms.eps(v)))

    def __call__(self) -> tuple[Array, float]:
        """(force [N] of the fluid on all bodies together, shape (dim,); power [W] that the method takes) (collective).

        Force: that on walls and patches less int rho (u_t + u . grad u) - f. Power, by stabilisation, ghost penalty and
        slip at the bodies: that of walls and patches less what bodies get and
        int (rho (u_t + u . grad u) - f) . u + 2 mu eps(u) : eps(u).
        """
        fluid, dofs = self.fluid, self.fluid.unknowns.velocity.dofs
        rows = self._outer_rows() - self._inner_rows()
        force = fluid.comm.allreduce(rows[dofs].sum(axis=0))
        given = fluid.comm.allreduce(float((rows * fluid.flow)[dofs].sum()))
        return force, given - float((fluid.system.surface_force() * fluid.cut.motion.v).sum())

    def _outer_rows(self) -> Array:
        """Forces [N] on the fluid from walls and patches at local dofs, the ghosts' share still there."""
        fluid = self.fluid
        owned = np.where(fluid.held, fluid.system.residual(), 0.0)
        rows = -fluid.system.outer_rows()
        rows[: len(owned)] += owned
        return rows

    def _over_fluid(self, integrand) -> list[fem.Integral]:
        """Its integral over uncut cells, and over the fluid's part of cut cells."""
        fluid, domain, weights = self.fluid, self.fluid.grid.domain, self.fluid.system.weights
        parts = [fem.Integral(domain, integrand * fem.measure(domain, "dx", 2 * fluid.unknowns.degree + 1))]
        if fluid.bodies:
            dx_cut = fem.measure(domain, "dx", weights.degree)
            parts.append(fem.Integral(domain, weights.fluid * integrand * dx_cut))
        return parts

    def _inner_rows(self) -> Array:
        """int (rho (u_t + u . grad u) - f) . v + 2 mu eps(u) : eps(v) at local dofs, the ghosts' share still there."""
        fluid = self.fluid
        rows = np.zeros(fluid.unknowns.local)
        for part, cells in zip(self._inner, (fluid.cut.uncut, fluid.cut.cut), strict=False):
            fem.assemble_vector(part.on(cell=cells[cells < fluid.grid.owned]), rows)
        return rows
