"""Shape derivatives of the interface terms: by the displacement of the surface, for monolithic Newton iterations.

Assume u - g = 0 and the momentum equation at the interface. For displacements dd of the surface,

    dr(v, q) = -<(grad u) dd, 2 mu eps(v) n + q n> + <P (grad u) dd, v>
    df_b i   =  <n_i grad p . dd + (P (grad u) dd)_i, N_b> + <(p I - 2 mu eps(u)) d(n ds), N_b e_i>

with fields of the present iterate, averaged over each piece of surface (docs/theory_coupling.md, Shape derivatives).
"""

from __future__ import annotations

import numpy as np

from solvers.api import Array
from solvers.fluid.terms.interface import InterfaceTerms, MotionOperator


def shape_derivatives(interface: InterfaceTerms, flow: Array) -> tuple[MotionOperator, Array]:
    """(dr/dd, df/dd) by pieces, of the form of `InterfaceTerms.coupling` and `mass_blocks`; flow at local dofs."""
    at, n, mu = interface, interface.n, interface.mu
    u, p = flow[at.u], flow[at.p]
    area_of_vertices = at.psi.sum(axis=1)
    area = area_of_vertices.sum(axis=1)
    share = np.where(area > 0.0, 1.0 / np.where(area > 0.0, area, 1.0), 0.0)
    pieces, functions, vertices, fields = at.fields.shape
    of_u = np.swapaxes(u, 1, 2) @ at.fields.reshape(pieces, functions, vertices * fields)
    grad_u = share[:, None, None] * of_u.reshape(pieces, at.dim, vertices, fields).sum(axis=2)[..., 1:]
    pressure = np.einsum("pa,pa,p->p", p, at.psi.sum(axis=2), share)
    grad_p = np.einsum("pa,paj,p->pj", p, at.pressure_slope, share)

    field = n[:, :, None] * grad_p[:, None, :] + at.penalty @ grad_u
    stress = pressure[:, None, None] * np.eye(at.dim) - mu * (grad_u + np.swapaxes(grad_u, 1, 2))
    slope = normal_derivative(at.x, n)
    turned = (stress @ slope.reshape(pieces, at.dim, vertices * at.dim)).reshape(slope.shape)
    load = at.mass_of_pieces[:, :, :, None, None] * field[:, None, None]
    load += np.einsum("pb,pivj->pbvij", area_of_vertices, turned)
    return at.coupling.of(-grad_u), load


def normal_derivative(x: Array, n: Array) -> Array:
    """d(n ds)_l / dx_vj / ds of each facet, shape (facets, dim, vertices, dim).

    x: corners [m], (facets, vertices, dim); n: unit normals into the solid, (facets, dim).
    """
    dim = x.shape[2]
    if dim == 2:
        length = np.linalg.norm(x[:, 1] - x[:, 0], axis=1)
        turn = np.array([[0.0, 1.0], [-1.0, 0.0]]) / length[:, None, None]
        return np.stack([turn, -turn], axis=2)
    first, second = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    size = np.linalg.norm(np.cross(first, second), axis=1)[:, None, None]
    axes = np.eye(3)
    by_first = np.swapaxes(np.cross(axes, second[:, None, :]), 1, 2) / size
    by_second = np.swapaxes(np.cross(first[:, None, :], axes), 1, 2) / size
    return -np.stack([-by_first - by_second, by_first, by_second], axis=2)
