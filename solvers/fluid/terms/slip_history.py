"""The slip s = (u - g) . n at surfaces in earlier steps, so that its penalty has an inertia and no friction.

The penalty of the mass has the rate alpha s - sum_k beta_k s_{n-k} (docs/theory_fluid.md, Weak form). The slip belongs
to points of the surface, and moves with them. It is kept as a linear function on each facet.
"""

from __future__ import annotations

import numpy as np

from solvers.api import Array, State
from solvers.fluid.settings.time_scheme import Difference
from solvers.fluid.terms.interface import InterfaceTerms

#: Weight of the slope of the slip on a facet, so that it is found where only an end of the facet is wet. With
#: 1e-4 and 1e-2 the velocity of that cylinder is the same to 2e-4.
SMOOTH = 1e-3


class SlipHistory:
    """Slips at the corners of all facets at earlier times [m/s], (facets, dim), newest first."""

    def __init__(self, times: int):
        """times: count of earlier slips in the difference formula."""
        self._times = times
        self.past: tuple[Array, ...] = ()  #: none: no slip

    def rate(self, difference: Difference) -> Array | None:
        """sum_k beta_k s_{n-k} [m/s^2] at the corners of facets, (facets, dim); None: zero."""
        pairs = zip(difference.beta, self.past, strict=False)
        return sum((beta * past for beta, past in pairs), start=np.zeros_like(self.past[0])) if self.past else None

    def end_step(self, slip: Array) -> None:
        """Keep the slip at the end of a step."""
        self.past = (slip, *self.past)[: self._times]

    def start(self, slip: Array) -> None:
        """Take a slip for that of all earlier times."""
        self.past = (slip,) * self._times

    def save(self) -> State:
        return {"count": len(self.past), "past": np.array(self.past)}

    def restore(self, state: State) -> None:
        self.past = tuple(np.asarray(state["past"]).copy()) if state["count"] else ()


def slip_of_facets(at: InterfaceTerms, flow: Array, g: Array, facets: int) -> Array:
    """The slip (u - g) . n at the corners of all facets [m/s], (facets, dim), zero on dry ones (collective).

    The linear function s_c N_c of each facet with <s - (u - g) . n, N_b> = 0, and a small weight on its slope. flow:
    velocity and pressure at local dofs; g: velocities at the corners of pieces [m/s], (pieces, dim, dim).
    """
    dim, u = at.dim, flow[at.u]
    normal_u, normal_g = np.einsum("pai,pi->pa", u, at.n), np.einsum("pvi,pi->pv", g, at.n)
    moments, mass = np.zeros((facets, dim)), np.zeros((facets, dim, dim))
    of_u = np.einsum("pav,pa->pv", at.fields[..., 0], normal_u)
    np.add.at(moments, at.facet, of_u - (at.mass_of_pieces @ normal_g[..., None])[..., 0])
    np.add.at(mass, at.facet, at.mass_of_pieces)
    moments, mass = at.comm.allreduce(moments), at.comm.allreduce(mass)
    slope = np.eye(dim) - 1.0 / dim
    area = mass.sum(axis=(1, 2))
    wet = area > 0.0
    slip = np.zeros_like(moments)
    slip[wet] = np.linalg.solve(mass[wet] + SMOOTH * area[wet, None, None] * slope, moments[wet, :, None])[..., 0]
    return slip
