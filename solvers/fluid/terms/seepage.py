"""Seepage along rough or porous surfaces: flow in a layer at the surface that is too thin for the grid.

The layer has the flux -kappa / mu grad_t p and conserves volume (docs/theory_fsci.md, Rough surfaces):

    <q, div u> - <q, (u - g) . n> + <kappa / mu grad_t p, grad_t q> = 0.

Nitsche's penalty must not suppress this normal velocity: along the normal the surface has the compliance (`nitsche`)
c = theta kappa / (mu h^2). In a film of length l its viscous stress is (h / l)^2 / theta of the pressure.
Source of the layer: Frei, Gerosa, Burman, Fernandez, Comput. Methods Appl. Mech. Engrg. 392 (2022) 114637.
"""

from __future__ import annotations

from ufl import dot, grad

from solvers.api import Array
from solvers.fluid.terms.forms import Expr

#: theta. The force of a film in contact is the same to 1 % from 10 to 1000.
RELEASE = 100.0


def release(mobility: Array, sizes: Array) -> Array:
    """c = theta kappa / (mu h^2) [m/Pa s] by pieces, shape (pieces,).

    mobility: kappa / mu [m^3/Pa s], (pieces,); sizes: edge lengths of the cells [m], (pieces, dim).
    """
    return RELEASE * mobility / sizes.min(axis=1) ** 2


def layer(mobility: Expr, n: Expr, p: Expr, q: Expr) -> Expr:
    """Integrand kappa / mu grad_t p . grad_t q."""
    return mobility * (dot(grad(p), grad(q)) - dot(grad(p), n) * dot(grad(q), n))
