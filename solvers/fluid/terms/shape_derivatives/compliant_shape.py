"""What slip along surfaces and layers on them add to the derivatives of `cut_shape`.

With D, R = I - D P and t = 2 mu eps(u) n - P (u - g) of `nitsche`, the terms of a compliant surface are

    -<R t - p n, v> - <w, 2 mu eps(v) n> - <q, (u - g) . n> + <kappa / mu grad_t p, grad_t q>,    w = u - g + D t,

those of a surface without slip and layer with R t in the place of t and w in the place of u - g, and the flow in the
layer. So their derivatives follow from those of `cut_shape`: P becomes P R, which `interface` has as the penalty, and
what is left is here. D and R depend on the normal, and on the cell's length along it by P.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.api import Array
from solvers.fluid.terms.interface import InterfaceTerms


@dataclass(frozen=True)
class PenaltyChanges:
    """Derivatives by the motion of vertices c in directions j, by pieces."""

    turn: Array  #: of the normal, (pieces, k, c, j)
    s: Array  #: of the penalty s, (pieces, c, j)
    normal: Array  #: of its additional part along the normal s_n, (pieces, c, j)
    length: Array  #: relative, of the length of the cell along the normal, (pieces, c, j)


@dataclass(frozen=True)
class CompliantTerms:
    """What the terms of `cut_shape` lose to the compliance."""

    load: Array  #: D P 2 mu eps(u) n, (pieces, k)
    gradient: Array  #: D P, (pieces, k, l), the part of the slip's gradient
    by_motion: Array  #: d((R t - t) ds) / ds with the sign of the loss, (pieces, k, c, j)


def compliant_terms(
    at: InterfaceTerms, stress: Array, slip: Array, slope: Array, changes: PenaltyChanges
) -> CompliantTerms | None:
    """The terms at the mean viscous stress and slip u - g of pieces; None without slip and layers.

    slope: of `normal_derivative`.
    """
    if not at.cell_blocks:
        return None
    n, dim, turn = at.n, at.dim, changes.turn
    DP = at.released @ at.full_penalty
    traction = (stress @ n[:, :, None])[..., 0]
    # t - R t = D P (2 mu eps(u) n) - (P - P R) (u - g); `cut_shape` has P R for P, but the changes of s and s_n
    by_motion = (DP @ (stress @ slope.reshape(len(n), dim, -1))).reshape(slope.shape)
    lost, of_D = (_parts(part, n) for part in (DP, at.released))
    along = (lost[0] - lost[1])[:, None, None, None]
    t_n, t_turn = (traction * n).sum(axis=1)[:, None, None, None], np.einsum("pl,plcj->pcj", traction, turn)[:, None]
    by_motion += along * (turn * t_n + n[:, :, None, None] * t_turn)
    on_normal = n[:, :, None] * n[:, None, :]
    for projector, part, D, change in (
        (on_normal, lost[0], of_D[0], changes.s + changes.normal),
        (np.eye(dim) - on_normal, lost[1], of_D[1], changes.s),
    ):
        # R = 1 / (1 + c P), D = c R: d(D P) = D R dP, d(P R) = R^2 dP
        kept = (1.0 - part)[:, None]
        weight = (D[:, None] * kept * traction - (1.0 - kept**2) * slip)[:, None]
        by_motion += (weight @ projector)[:, 0, :, None, None] * change[:, None]
    return CompliantTerms((DP @ traction[..., None])[..., 0], DP, by_motion)


def layer_by_motion(at: InterfaceTerms, dp: Array, slope: Array) -> Array:
    """d<kappa / mu grad_t p, grad_t q> by the turning and stretching of facets, (pieces, functions, c, j).

    dp: mean gradient of the pressure of pieces; slope: of `normal_derivative`.
    """
    assert at.mobility is not None
    n, dq = at.n, at.pressure_slope
    stretch = np.einsum("pk,pkcj->pcj", n, slope)
    turn = slope - n[:, :, None, None] * stretch[:, None]
    along = dp - (dp * n).sum(axis=1)[:, None] * n
    found = np.einsum("pak,pk->pa", dq, along)[..., None, None] * stretch[:, None]
    found -= (dq @ n[..., None])[..., None] * np.einsum("pk,pkcj->pcj", dp, turn)[:, None]
    found -= (dp * n).sum(axis=1)[:, None, None, None] * np.einsum("pak,pkcj->pacj", dq, turn)
    return at.mobility[:, None, None, None] * found


def _parts(values: Array, n: Array) -> tuple[Array, Array]:
    """Factors along the normal and along the surface of matrices a n n^T + b (I - n n^T), (pieces, k, l)."""
    normal = np.einsum("pk,pkl,pl->p", n, values, n)
    return normal, (np.einsum("pkk->p", values) - normal) / (n.shape[1] - 1)
