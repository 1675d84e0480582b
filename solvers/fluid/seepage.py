"""Rough or porous surfaces: fluid passes along them in a layer too thin for the grid.

Its flux along the surface is -kappa / mu grad_t p with the transmissivity kappa [m^3]; for a roughness R it is that of
a gap of this height, R^3 / 12. What the layer takes from the fluid at one place it gives back at another,

    (u - g) . n = -div_t (kappa / mu grad_t p):    <kappa / mu grad_t p, grad_t q> beside <q, div u> - <q, (u - g) . n>.

A film of height g in front lets (g^3 / 12 + kappa) / mu times the pressure gradient through: its force on bodies that
approach each other stays finite down to contact.

The pressure sees to it that no more than this passes. Nitsche's penalty must not hold it back: along the normal the
surface gives way (`nitsche`) by c = theta kappa / (mu h^2). So n . 2 mu eps(u) n = -(u - g) . n / c on it, where a wall
that nothing passes has 0. A film of the width l passes u_n = kappa p / (mu l^2): the stress that remains is
(h / l)^2 / theta of the pressure. Without layer c = 0.
Source of the layer: Frei, Gerosa, Burman, Fernandez, Comput. Methods Appl. Mech. Engrg. 392 (2022) 114637.
"""

from __future__ import annotations

import numpy as np

from solvers.api import Array

#: theta; the force of a film in contact is the same to 1 % from 10 to 1000.
RELEASE = 100.0


def release(mobility: Array, sizes: Array) -> Array:
    """C = theta kappa / (mu h^2) [m/Pa s] by pieces, from kappa / mu [m^3/Pa s] and edge lengths [m] (pieces, dim)."""
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
