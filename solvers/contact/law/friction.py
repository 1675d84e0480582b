"""Friction laws: the tangential traction is the projection of a trial traction onto a disc.

    z_t = P_s(q),   q = z_t + c_t u_t,   P_s(q) = q min(1, s / |q|)

with the slip u_t of the step and the radius s, for stick and slip alike (docs/theory_contact.md, Friction). The
equation is C = max(s, |q|) z_t - s q = 0 divided by max(s, |q|). All derivatives are exact (semi-smooth Newton).
Source: Alart & Curnier, Comput. Methods Appl. Mech. Engng 92 (1991); Gitterle, Popp, Gee & Wall, Int. J. Numer. Meth.
Engng 84 (2010).
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, sparse, stack
from solvers.api import Array
from solvers.contact.blocks import components
from solvers.contact.law.law import OPEN, SLIP, STICK, Point, Rows, Slopes, Statuses, along

#: Distance of a trial traction from the edge of the disc, relative to its radius, below which a node slips. A node that
#: slips has its trial traction there at the beginning of the next step, up to the tolerance of Newton's method.
EDGE_OF_DISC = 1e-6


@runtime_checkable
class FrictionBound(Protocol):
    """The bound of the tangential traction, in which friction laws differ. The functions below are their methods."""

    def radius(self, at: Point) -> Array:
        """s, the largest tangential traction [Pa], shape (m,)."""
        ...

    def radius_slopes(self, at: Point) -> tuple[Array, Array, Array]:
        """Derivatives of s by z and by n, shapes (m, dim), and by the weighted gap, shape (m,)."""
        ...


def trial_traction(at: Point) -> Array:
    """q [Pa], shape (m, dim)."""
    y = at.z + at.c_t[:, None] * at.slip
    return y - np.einsum("nd,nd->n", y, at.normals)[:, None] * at.normals


def opposed(at: Point) -> NDArray[np.bool_]:
    """Mask of the trial tractions that point against the present ones, shape (m,)."""
    return np.einsum("nd,nd->n", trial_traction(at), at.z) < 0.0


def reversing(law: FrictionBound, at: Point, status: Statuses) -> NDArray[np.bool_]:
    """Mask of the multipliers that slip against their present traction, shape (m,)."""
    return (status == SLIP) & opposed(at) & (law.radius(at) > 0.0)


def friction_status(law: FrictionBound, at: Point) -> Statuses:
    """Status: contact where the trial pressure is positive, stick inside the disc.

    A node whose trial traction is opposed to the present one sticks first, once in a solve or, where slips alternate,
    each time (`ActiveSet.begin_increment`): its slip could reverse in every Newton iteration, and in the solution both
    have the same direction. Only the linearisation depends on this.
    """
    q, radius = trial_traction(at), law.radius(at)
    turned = ~at.stuck & opposed(at)
    inside = at.slip_defined & (turned | _within(q, radius)) & (radius > 0.0)
    return np.where(at.covered & (at.trial_pressure > 0.0), np.where(inside, STICK, SLIP), OPEN).astype(np.int8)


def friction_residual(law: FrictionBound, at: Point, status: Statuses, weight: float) -> Array:
    """Residual [N]: gap times stiffness along the normal, z_t - P_s(q) along the surface, shape (m, dim)."""
    q, radius = trial_traction(at), law.radius(at)
    return _missed(at, _on_disc(q, np.where(_within(q, radius), STICK, SLIP), radius)[0], weight)


def _within(q: Array, radius: Array) -> NDArray[np.bool_]:
    """Mask of the trial traction inside the disc, shape (m,)."""
    return np.linalg.norm(q, axis=1) < (1.0 - EDGE_OF_DISC) * radius


def _missed(at: Point, projected: Array, weight: float) -> Array:
    missed = at.z - at.pressure[:, None] * at.normals - projected
    return (at.stiffness * at.gap)[:, None] * at.normals + (weight * at.D)[:, None] * missed


def friction_rows(law: FrictionBound, at: Point, slopes: Slopes, status: Statuses, weight: float) -> Rows:
    """The residual and its derivatives."""
    by_z, by_normal, by_gap = law.radius_slopes(at)
    dim = at.z.shape[1]
    tangent = along(at.normals)
    factor = (weight * at.D)[:, None, None]
    q = trial_traction(at)
    projected, by_q, by_radius = _on_disc(q, status, law.radius(at), derivatives=True)
    by_q = by_q + _slope_of_free(law, at)[:, None, None] * np.eye(dim)
    y_n = np.einsum("nd,nd->n", at.z + at.c_t[:, None] * at.slip, at.normals)[:, None, None]

    # dz_t = T dz - z_n dn and dq = T (dz + c_t du) - y_n dn, both along the surface; dP = by_q dq + by_radius ds
    in_z = tangent - by_q @ tangent - by_radius[:, :, None] * by_z[:, None, :]
    turning = y_n * by_q - at.pressure[:, None, None] * np.eye(dim) - by_radius[:, :, None] * by_normal[:, None, :]
    closing = at.stiffness[:, None] * at.normals - factor[:, 0] * by_gap[:, None] * by_radius
    sliding = -at.c_t[:, None, None] * (by_q @ tangent)
    in_u = _in_displacements(closing, factor * turning, factor * sliding, slopes)
    return Rows(_missed(at, projected, weight), factor * in_z, in_u)


def _slope_of_free(law: FrictionBound, at: Point) -> Array:
    """Slope of the traction over q where a body slips that nothing holds, zero elsewhere, shape (m,).

    The linearisation alone has it. Its stiffness k = s / h [Pa/m], with the size h of a node's area, lets friction s
    at all nodes of a body move it by h in an iterate. As q is z_t + c_t u_t, the slope is k / (k + c_t).
    """
    size = np.where(at.D > 0.0, at.D, 1.0) ** (1.0 / (at.normals.shape[1] - 1))
    stiffness = np.where(at.free, law.radius(at), 0.0) / size
    return np.divide(stiffness, stiffness + at.c_t, out=np.zeros_like(stiffness), where=stiffness > 0.0)


def _in_displacements(by_gap: Array, by_normal: Array, by_slip: Array, slopes: Slopes) -> Sparse:
    """by_gap dg + by_normal dn + by_slip du_t; shapes (m, dim), (m, dim, dim), (m, dim, dim): one sparse product."""
    m, dim = by_gap.shape
    entries = np.concatenate([by_gap[:, :, None], by_normal, by_slip], axis=2)
    vectors = m + components(np.arange(m), dim).reshape(m, dim)
    columns = np.concatenate([np.arange(m)[:, None], vectors, dim * m + vectors], axis=1)
    indices, indptr = columns.repeat(dim, axis=0).ravel(), (1 + 2 * dim) * np.arange(dim * m + 1)
    combination = sparse((entries.ravel(), indices, indptr), (dim * m, (1 + 2 * dim) * m))
    return combination @ stack([slopes.gap, slopes.normals, slopes.slip])


def _on_disc(q: Array, status: Statuses, radius: Array, *, derivatives: bool = False):
    """(P_s(q), dP/dq, dP/ds), inside or on the edge of the disc according to the status."""
    size = np.linalg.norm(q, axis=1)
    stick = status == STICK
    unit = q / np.where(size > 0.0, size, 1.0)[:, None]
    projected = np.where(stick[:, None], q, radius[:, None] * unit)
    if not derivatives:
        return projected, None, None
    ratio = np.divide(radius, size, out=np.zeros_like(size), where=size > 0.0)
    rim = ratio[:, None, None] * (np.eye(q.shape[1]) - unit[:, :, None] * unit[:, None, :])
    by_q = np.where(stick[:, None, None], np.eye(q.shape[1]), rim)
    return projected, by_q, np.where(stick[:, None], 0.0, unit)
