"""Bodies along which the flow slips: the shear stress is mu / b times the velocity along the surface (Navier).

With T = I - n n^T and the stress along the surface that Nitsche's method finds, tau = T (2 mu eps(u) n - s (u - g)),
the terms of `forms.interface` and `InterfaceTerms`, which make the flow stick, get one more,

    -<kappa tau(u, g), tau(v, 0)>,   kappa = 1 / (mu / b + s),

and the force on the body <kappa s tau(u, g), N_b>. Then tau = -mu / b T (u - g) holds for every b from 0 (no slip) to
infinity (no shear stress), exactly for flows that the elements have, and the blocks stay symmetric.
Source: Juntunen, Stenberg, Math. Comp. 78 (2009) 1353-1374.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.api import Array

#: Pieces that are worked on at once: what is at their quadrature points is large in 3D.
AT_ONCE = 256


@dataclass(frozen=True)
class SlipTerms:
    """What slip adds, by pieces of surface; zero where the flow sticks."""

    flow: Array  #: d(rows)/du, (pieces, functions, dim, functions, dim)
    coupling: Array  #: d(rows)/dg, (pieces, functions, dim, vertices, dim)
    mass: Array  #: -d(force)/dg, (pieces, vertices, dim, vertices, dim)

    def __add__(self, other: SlipTerms) -> SlipTerms:
        return SlipTerms(self.flow + other.flow, self.coupling + other.coupling, self.mass + other.mass)


@dataclass(frozen=True)
class PieceIntegrals:
    """Integrals over pieces of surface, with normal n, shape functions phi_a of velocity and N_v of vertices."""

    n: Array  #: (pieces, dim)
    area: Array  #: int L_q, (pieces, points)
    phi: Array  #: int phi_a N_v, (pieces, functions, vertices)
    grad: Array  #: int grad phi_a N_v, (pieces, functions, vertices, dim)
    mass: Array  #: int N_v N_w, (pieces, vertices, vertices)
    sizes: Array  #: edge lengths of the cell [m], (pieces, dim)


def slip_terms(at: PieceIntegrals, table: tuple[Array, Array], mu: float, penalty: Array, length: Array) -> SlipTerms:
    """For slip lengths [m] of pieces, inf: no shear stress.

    table: values (points, functions) and reference gradients (points, functions, dim) at the points of L_q; mu [Pa s];
    penalty: P = s I + s_n n n^T [Pa s/m], shape (pieces, dim, dim).
    """
    n, dim = at.n, at.n.shape[1]
    T = np.eye(dim) - n[:, :, None] * n[:, None, :]
    s = np.einsum("pij,pij->p", penalty, T) / (dim - 1)
    with np.errstate(divide="ignore"):
        kappa = 1.0 / (mu / length + s)
    slope = mu * np.einsum("pavj,pj->pav", at.grad, n) - s[:, None, None] * at.phi
    along = mu * np.einsum("pij,pavj->pavi", T, at.grad)
    coupling = np.einsum("pav,pki->pakvi", slope, T) + np.einsum("pavi,pk->pakvi", along, n)
    mass = np.einsum("pij,pvw->pviwj", T, at.mass)
    factor = (kappa * s)[:, None, None, None, None]
    functions = table[0].shape[1]
    flow = np.zeros((len(n), functions, dim, functions, dim))
    slips = np.flatnonzero(kappa > 0.0)
    for some in (slips[first : first + AT_ONCE] for first in range(0, len(slips), AT_ONCE)):
        flow[some] = _squares(n[some], at.area[some] * -kappa[some, None], at.sizes[some], table, mu, s[some])
    return SlipTerms(flow, -factor * coupling, -factor * s[:, None, None, None, None] * mass)


def _squares(n: Array, weight: Array, sizes: Array, table: tuple[Array, Array], mu: float, s: Array) -> Array:
    """int weight tau(phi_b e_l) . tau(phi_a e_k), shape (pieces, a, k, b, l).

    tau(phi_a e_k) = T e_k S_a + mu n_k T grad phi_a with S_a = mu d_n phi_a - s phi_a.
    """
    phi, reference = table
    grad = reference / sizes[:, None, None, :]
    normal = np.einsum("pqai,pi->pqa", grad, n)
    S = mu * normal - s[:, None, None] * phi
    along = mu * (grad - normal[..., None] * n[:, None, None, :])
    pieces, points, functions, dim = along.shape
    weighted = np.swapaxes(weight[:, :, None] * S, 1, 2)
    mixed = (weighted @ along.reshape(pieces, points, -1)).reshape(pieces, functions, functions, dim)
    both = sum(np.swapaxes(weight[:, :, None] * along[..., i], 1, 2) @ along[..., i] for i in range(dim))
    T = np.eye(dim) - n[:, :, None] * n[:, None, :]
    block = np.einsum("pab,pkl->pakbl", weighted @ S, T) + np.einsum("pab,pk,pl->pakbl", both, n, n)
    block += np.einsum("pabk,pl->pakbl", mixed, n)
    block += np.einsum("pbal,pk->pakbl", mixed, n)
    return block
