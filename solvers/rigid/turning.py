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
    f, arms = np.pad(forces, ((0, 0), (0, 3 - forces.shape[1]))), near.arms(moment)
    changes = np.zeros((3, m, 3, 12))
    for some, change in ((near.edge < 0, _on_facets), (near.edge >= 0, _on_edges)):
        if some.any():
            changes[:, some] = change(near[some], _skew(f[some]), _skew(arms[some, 0]), _skew(arms[some, 1]))
    d_force, d_arm_of, d_arm_on = changes
    f, of, on = _skew(f), _skew(arms[:, 0]), _skew(arms[:, 1])
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


def _on_facets(near: Near, f: Array, of: Array, on: Array) -> tuple[Array, Array, Array]:
    """Derivatives of force and arms by the motions of both bodies, each of shape (m, 3, 12); others as [a] of a."""
    n = np.pad(near.frame[:, 0], ((0, 0), (0, 3 - near.x.shape[1])))
    d_x, d_foot = _carried(near, of, on)
    d_gap = np.einsum("mi,mij->mj", n, d_x - d_foot)
    d_force, d_arm_of = np.zeros_like(d_x), np.zeros_like(d_x)
    d_force[:, :, 9:] = -_there(near, 1) * f
    d_arm_of[:, :, 3:6] = -of
    d_arm_on = d_x - n[:, :, None] * d_gap[:, None]
    d_arm_on[:, :, 6:9] -= np.eye(3)
    d_arm_on[:, :, 9:] += near.gap[:, None, None] * _skew(n)
    return d_force, d_arm_of, d_arm_on


def _on_edges(near: Near, f: Array, of: Array, on: Array) -> tuple[Array, Array, Array]:
    """The same where edges cross, in space."""
    n, one, other = near.frame[:, 0], near.along[:, 0], near.along[:, 1]
    sine = np.einsum("md,md->m", n, np.cross(one, other))[:, None]
    dual, dual_other = np.cross(other, n) / sine, np.cross(n, one) / sine
    d_x, d_foot = _carried(near, of, on)
    d_n = np.zeros_like(d_x)
    d_n[:, :, 3:6] = -_there(near, 0) * dual[:, :, None] * np.cross(one, n)[:, None]
    d_n[:, :, 9:] = -_there(near, 1) * dual_other[:, :, None] * np.cross(other, n)[:, None]
    turned = _skew(n) @ d_n
    turned[:, :, 9:] += _there(near, 1) * n[:, :, None] * n[:, None]
    missed = d_x - d_foot - near.gap[:, None, None] * d_n
    d_arm_of = -one[:, :, None] * np.einsum("md,mde->me", dual, missed)[:, None]
    d_arm_of[:, :, 3:6] -= of
    d_arm_on = other[:, :, None] * np.einsum("md,mde->me", dual_other, missed)[:, None]
    d_arm_on[:, :, 9:] -= on
    return -f @ turned, d_arm_of, d_arm_on


def _carried(near: Near, of: Array, on: Array) -> tuple[Array, Array]:
    """Derivatives of the point of the first body and of the one below it, that are carried along; (m, 3, 12) each."""
    d_x, d_foot = np.zeros((len(of), 3, 12)), np.zeros((len(of), 3, 12))
    for d, first, side, arm in ((d_x, 0, 0, of), (d_foot, 6, 1, on)):
        d[:, :, first : first + 3] = _there(near, side) * np.eye(3)
        d[:, :, first + 3 : first + 6] = -_there(near, side) * arm
    return d_x, d_foot


def _there(near: Near, side: int) -> Array:
    """One where there is a body, else zero, shape (m, 1, 1)."""
    return (near.body[:, side] >= 0).astype(float)[:, None, None]


def _skew(a: Array) -> Array:
    """[a] with [a] b = a x b, shape (m, 3, 3)."""
    zero = np.zeros(len(a))
    x, y, z = a.T
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
