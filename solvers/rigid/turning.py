"""How contact forces turn with the bodies: the derivative of their resultants where the forces on a facet turn with it.

A force f on a vertex of the body a, at the arm r_a, acts on the body b of the facet with -f, at the arm r_b of the foot
x - g n. The facet's frame turns with b:

    df = w_b x f,    dr_a = w_a x r_a,    dr_b = dx - dc_b - g (w_b x n) - n dg,    dx = dc_a + w_a x r_a.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, sparse_from_entries
from solvers.api import Array
from solvers.rigid.near import Moment, Near


def turning(
    near: Near, forces: Array, moment: Moment, components: NDArray[np.int64], free: NDArray[np.bool_]
) -> Sparse:
    """Derivative of all resultants by all unknowns; forces: on the vertices [N], shape (m, dim)."""
    k, m = len(components), len(forces)
    f = _skew(np.pad(forces, ((0, 0), (0, 3 - forces.shape[1]))))
    n = np.pad(near.frame[:, 0], ((0, 0), (0, 3 - forces.shape[1])))
    arms = near.arms(moment)
    of, on = _skew(arms[:, 0]), _skew(arms[:, 1])
    there = (near.body >= 0).astype(float)[:, :, None, None]
    eye = np.eye(3)
    d_x = np.concatenate([there[:, 0] * eye, -there[:, 0] * of, np.zeros((m, 3, 6))], axis=2)
    d_foot = np.concatenate([np.zeros((m, 3, 6)), there[:, 1] * eye, -there[:, 1] * on], axis=2)
    d_gap = np.einsum("mi,mij->mj", n, d_x - d_foot)
    d_force = np.zeros((m, 3, 12))
    d_force[:, :, 9:] = -there[:, 1] * f
    d_arm_of = np.zeros((m, 3, 12))
    d_arm_of[:, :, 3:6] = -of
    d_arm_on = d_x - n[:, :, None] * d_gap[:, None]
    d_arm_on[:, :, 6:9] -= eye
    d_arm_on[:, :, 9:] += near.gap[:, None, None] * _skew(n)
    rows = np.concatenate(
        [d_force, of @ d_force - f @ d_arm_of, -d_force, f @ d_arm_on - on @ d_force],
        axis=1,
    )
    blocks = rows.reshape(m, 2, 6, 2, 6)[:, :, components][..., components]
    open_ways = free.reshape(-1, k)[np.maximum(near.body, 0)] & (near.body >= 0)[:, :, None]
    blocks = blocks * open_ways[:, :, :, None, None] * open_ways[:, None, None]
    dofs = np.maximum(near.body, 0)[:, :, None] * k + np.arange(k)
    at = np.broadcast_to(dofs[:, :, :, None, None], blocks.shape)
    by = np.broadcast_to(dofs[:, None, None], blocks.shape)
    return sparse_from_entries(at.ravel(), by.ravel(), blocks.ravel(), (len(free), len(free)))


def _skew(a: Array) -> Array:
    """[a] with [a] b = a x b, shape (m, 3, 3)."""
    zero = np.zeros(len(a))
    x, y, z = a.T
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
