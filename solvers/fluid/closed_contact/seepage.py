"""Seepage along rough or porous surfaces: flow in a layer at the surface that is too thin for the grid.

The flux in the layer is -kappa / mu grad_t p with the transmissivity kappa [m^3]. For a roughness R, kappa is that of a
gap of this height, R^3 / 12. The layer conserves volume: its divergence is the normal velocity at the surface,

    (u - g) . n = -div_t (kappa / mu grad_t p):    <kappa / mu grad_t p, grad_t q> beside <q, div u> - <q, (u - g) . n>.

A film of height g in front of the surface has the flux (g^3 / 12 + kappa) / mu times the pressure gradient. Hence the
force of the film on bodies that approach each other is finite down to contact.

The continuity equation limits this normal velocity. Nitsche's penalty must not suppress it: along the normal the
surface has the compliance (`nitsche`) c = theta kappa / (mu h^2), zero without a layer. Then n . 2 mu eps(u) n =
-(u - g) . n / c on the surface, a viscous stress that should vanish. In a film of length l, u_n = kappa p / (mu l^2),
and this stress is (h / l)^2 / theta of the pressure.
Source of the layer: Frei, Gerosa, Burman, Fernandez, Comput. Methods Appl. Mech. Engrg. 392 (2022) 114637.
"""

from __future__ import annotations

import numpy as np

from solvers.api import Array

#: theta. The force of a film in contact is the same to 1 % from 10 to 1000.
RELEASE = 100.0


def release(mobility: Array, sizes: Array) -> Array:
    """c = theta kappa / (mu h^2) [m/Pa s] by pieces, shape (pieces,).

    mobility: kappa / mu [m^3/Pa s], (pieces,); sizes: edge lengths of the cells [m], (pieces, dim).
    """
    return RELEASE * mobility / sizes.min(axis=1) ** 2


def seepage_terms(tangents: Array, area: Array, gradient: Array, mobility: Array, sizes: Array) -> Array:
    """<kappa / mu grad_t psi_b, grad_t psi_a> by pieces, shape (pieces, functions, functions).

    tangents: I - n n^T, (pieces, dim, dim); area: int L_q, (pieces, points); gradient: of the pressure's shape
    functions in the reference cell at these points (points, functions, dim); the others as in `release`.
    """
    T = tangents * mobility[:, None, None] / (sizes[:, :, None] * sizes[:, None, :])
    pairs = np.einsum("qai,qbj->qaibj", gradient, gradient)
    block: Array = np.einsum("paibj,pij->pab", np.tensordot(area, pairs, (1, 0)), T)
    return block
