"""How the interface terms change when the surface moves: what makes a monolithic Newton iteration fast.

For displacements dd of the surface, with u - g = 0 and the momentum equation fulfilled at the interface, what remains
of the derivative of the discrete equations with respect to the shape of the fluid's domain is

    dr(v, q) = -<(grad u) dd, 2 mu eps(v) n + q n> + <P (grad u) dd, v>           the surface sees another velocity
    df_b i   =  <n_i grad p . dd + (P (grad u) dd)_i, N_b> + <(p I - 2 mu eps(u)) d(n ds), N_b e_i>

Gradients are those of the present iterate; in df they are averaged over each piece. The residual does not know them,
so that they cost accuracy of the Newton step at most.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from solvers.api import Array
from solvers.fluid.interface import Interface


def shape_derivatives(interface: Interface, flow: Array) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """(dr/dd at local dofs, shape (local, vertices dim); df/dd, shape (vertices dim, vertices dim))."""
    at = interface
    phi, gradient = at.rule.velocity_table
    psi, psi_gradient = at.rule.pressure_table
    sizes, m, n, mu, P = at.sizes, at.moments, at.n, at.mu, at.penalty
    slope = gradient[None] / sizes[:, None, None, :]
    U = np.einsum("pai,pqaj->pqij", flow[at.u], slope, optimize=True)
    mU = np.einsum("pqv,pqij->pqvij", m, U)
    seen = np.einsum("qa,pqvij->pavij", phi, mU, optimize=True)
    normal_slope = np.einsum("pqaj,pj->pqa", slope, n)
    rows_u = np.einsum("pkl,pavlj->pakvj", P, seen, optimize=True)
    rows_u -= mu * np.einsum("pqa,pqvkj->pakvj", normal_slope, mU, optimize=True)
    rows_u -= mu * np.einsum("pk,pqai,pqvij->pakvj", n, slope, mU, optimize=True)
    rows_p = -np.einsum("qa,pi,pqvij->pavj", psi, n, mU, optimize=True)
    into_fluid = at.scatter(rows_u, rows_p)

    area = m.sum(axis=(1, 2))
    mean = m.sum(axis=2) / np.where(area > 0.0, area, 1.0)[:, None]
    grad_p = np.einsum("pq,qaj,pa->pj", mean, psi_gradient, flow[at.p], optimize=True) / sizes
    grad_u = np.einsum("pq,pqij->pij", mean, U)
    field = n[:, :, None] * grad_p[:, None, :] + P @ grad_u
    pressure = np.einsum("qa,pa->pq", psi, flow[at.p])
    stress = pressure[..., None, None] * np.eye(at.dim) - mu * (U + np.swapaxes(U, 2, 3))
    turning = np.einsum("pqb,pqil,plvj->pbivj", m, stress, _normal_derivative(at.x, n), optimize=True)
    load = np.einsum("pbv,pij->pbivj", at.mass_of_pieces, field) + turning
    return into_fluid, at.scatter_surface(load)


def _normal_derivative(x: Array, n: Array) -> Array:
    """d(n ds)_l / dx_vj / ds of each piece's facet with corners x (pieces, vertices, dim); n points into the solid."""
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
