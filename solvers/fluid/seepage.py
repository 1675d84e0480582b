"""Rough or porous surfaces: fluid passes along them in a layer too thin for the grid.

Its flux along the surface is -kappa / mu grad_t p with the transmissivity kappa [m^3]; for a roughness R it is that of
a gap of this height, R^3 / 12. What the layer takes from the fluid at one place it gives back at another,

    (u - g) . n = -div_t (kappa / mu grad_t p):    <kappa / mu grad_t p, grad_t q> beside <q, div u> - <q, (u - g) . n>.

A film of height g in front lets (g^3 / 12 + kappa) / mu times the pressure gradient through: its force on bodies that
approach each other stays finite down to contact.

The pressure sees to it that no more than this passes. Nitsche's penalty must not hold it back; as in `slip`, with the
stress sigma_n(v) = n . (2 mu eps(v) n - P v), it is released by -<kappa_n sigma_n(u - g), sigma_n(v)>,

    kappa_n = 1 / (1 / c + n . P n),    c = theta kappa / (mu h^2),

so that on the surface n . 2 mu eps(u) n = -(u - g) . n / c, where a wall that nothing passes has 0. A film of the width
l passes u_n = kappa p / (mu l^2): the stress that remains is (h / l)^2 / theta of the pressure. Without layer c = 0.
Source of the layer: Frei, Gerosa, Burman, Fernandez, Comput. Methods Appl. Mech. Engrg. 392 (2022) 114637.
"""

from __future__ import annotations

import numpy as np

from solvers.api import Array
from solvers.fluid.slip import PieceIntegrals, SlipTerms

#: theta; the force of a film in contact is the same to 1 % from 10 to 1000.
RELEASE = 100.0


def seepage_terms(at: PieceIntegrals, gradient: Array, mobility: Array) -> Array:
    """<kappa / mu grad_t psi_b, grad_t psi_a> by pieces, shape (pieces, functions, functions).

    gradient: of the pressure's shape functions in the reference cell (points, functions, dim); mobility: kappa / mu of
    each piece [m^3/Pa s].
    """
    T = np.eye(at.n.shape[1]) - at.n[:, :, None] * at.n[:, None, :]
    T *= mobility[:, None, None] / (at.sizes[:, :, None] * at.sizes[:, None, :])
    pairs = np.einsum("qai,qbj->qaibj", gradient, gradient)
    block: Array = np.einsum("paibj,pij->pab", np.tensordot(at.area, pairs, (1, 0)), T)
    return block


def release_terms(
    at: PieceIntegrals, table: tuple[Array, Array], mu: float, penalty: Array, mobility: Array
) -> SlipTerms:
    """-<kappa_n sigma_n(u - g), sigma_n(v)>; arguments as those of `slip_terms` and `seepage_terms`."""
    n, (phi, reference) = at.n, table
    s = np.einsum("pi,pij,pj->p", n, penalty, n)
    with np.errstate(divide="ignore"):
        kappa = 1.0 / (at.sizes.min(axis=1) ** 2 / (RELEASE * mobility) + s)
    along = n[:, :, None] * n[:, None, :]
    slope = 2.0 * mu * np.einsum("pavj,pj->pav", at.grad, n) - s[:, None, None] * at.phi
    factor = (-kappa * s)[:, None, None]
    coupling = np.einsum("pav,pki->pakvi", factor * slope, along)
    mass = np.einsum("pij,pvw->pviwj", along, factor * s[:, None, None] * at.mass)
    stress = 2.0 * mu * np.einsum("qai,pi->pqa", reference, n / at.sizes) - s[:, None, None] * phi
    square = np.swapaxes((-kappa[:, None] * at.area)[:, :, None] * stress, 1, 2) @ stress
    return SlipTerms(np.einsum("pab,pkl->pakbl", square, along), coupling, mass)
