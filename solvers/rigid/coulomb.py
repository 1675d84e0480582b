"""Coulomb friction of rigid bodies: the cone problem of motions u and contact forces z that Newton's method linearises.

    K u = f + B^T z,    w = w_0 + B u,    0 <= w_n,  0 <= z_n,  w_n z_n = 0,
    |z_t| <= mu z_n,  and where w_t is not zero, z_t = -mu z_n w_t / |w_t|.

The forces on two rigid bodies are redundant: many z belong to one motion. Each proximal step (augmented Lagrangian)

    z <- P(z - r w(u), mu),    K u = f + B^T P(z - r w(u), mu),

has one solution u whatever the rank of B; P projects the normal part on z_n >= 0 and then the tangential part on
|z_t| <= mu z_n. From z = 0, z comes near to the shortest one. The equation for u is solved by Newton's method, with one
sparse factorisation of the size of the bodies' unknowns each.
Sources: Rockafellar, SIAM J. Control Optim. 14 (1976) 877-898 (proximal steps); Alart, Curnier, Comput. Methods Appl.
Mech. Engng 92 (1991) 353-375 (Newton's method for them).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, sparse_from_entries
from solvers.api import Array, FailureKind, Indices32, StepFailed

NO_MOTION = "bodies in contact have no room: no motion of them opens all overlaps"
NO_FORCES = "the friction of rigid bodies has no contact forces"

#: Stiffness r of a proximal step over that of the bodies at a contact, 1 / diag(B K^-1 B^T). The error falls by about
#: this factor in each; from 1e2 to 1e5 results are the same.
PROXIMAL = 1e3

#: Change of the contact forces in a proximal step, relative to the largest, at which they are found; or, where forces
#: vanish, relative to r times the motions, whose rounding errors they are then.
FOUND = 1e-13

#: The same, from which on rounding errors may keep them from changing less.
FORCE_ROUNDING = 1e-9

#: Difference of the changes in two proximal steps, relative to them, below which they go on like that.
STEADY_CHANGE = 1e-2

#: Change of the contact forces in a Newton iteration, relative to the largest, after which the next one is rounding.
SAME_FORCES = 1e-9

#: Gaps that such steps miss, relative to the way by the contact forces: bodies that brace each other miss their room by
#: rounding errors of positions, and by what the iterate before left of overlaps (2e-9 in a pile of 50 discs).
NEGLIGIBLE_GAP = 1e-7

#: Proximal steps: with tree-like contacts 5 suffice, with a bracing of bodies some tens.
PROXIMAL_STEPS = 200

#: Newton iterations of a proximal step with whole increments, which mostly converge.
WHOLE_INCREMENTS = 8

#: Newton iterations with increments that may be halved, if those do not converge; then r is too large.
HALVED_INCREMENTS = 12

#: Halvings of such an increment, to 2e-4 of it.
INCREMENT_HALVINGS = 12

#: The share of r in the first step, of forces of which nothing is known: a small one finds which contacts close.
FIRST_SHARE = 1e-2

#: A proximal step that Newton's method does not solve is taken with a tenth of r; the next ones with more of it again.
SHARE_GROWTH = 3.0

#: Reduction of the change by a proximal step, above which the next one has a larger r: vertices that nearly coincide
#: have nearly the same motion. Its rounding errors are larger, too.
SLOW_CHANGE = 0.3

#: The largest share of r then: rounding errors of w times r are below 1e-5 of the forces.
LARGEST_SHARE = 1e4


@dataclass(frozen=True)
class Touch:
    """Contacts of two bodies at most: relative motions w = B u in a frame with the normal first, and forces F^T z."""

    B: Array  #: derivative of the relative motion by the unknowns of both bodies, shape (m, 2, dim, unknowns of a body)
    body: NDArray[np.int64]  #: their indices, shape (m, 2), -1: none, where B is zero
    friction: Array  #: coefficients, shape (m,)
    F: Array | None = None  #: as B; None: B

    def __getitem__(self, which: NDArray) -> Touch:
        F = None if self.F is None else self.F[which]
        return Touch(self.B[which], self.body[which], self.friction[which], F)

    @property
    def pushed(self) -> Array:
        """F."""
        return self.B if self.F is None else self.F

    def sliding(self, slope: Array) -> Touch:
        """The contacts with forces z_n slope along the tangents beside z; slope: shape (m, dim - 1)."""
        F = self.pushed.copy()
        F[:, :, 0] += np.einsum("md,msdk->msk", slope, self.B[:, :, 1:])
        return Touch(self.B, self.body, self.friction, F)

    def motion(self, u: Array) -> Array:
        """B u, shape (m, dim); u: all unknowns."""
        by_body = u.reshape(-1, self.B.shape[3])[self.body]
        return np.einsum("msdk,msk->md", self.B, by_body)

    def force(self, z: Array, unknowns: int) -> Array:
        """F^T z by unknown; z: shape (m, dim)."""
        found = np.zeros((unknowns // self.B.shape[3], self.B.shape[3]))
        np.add.at(found, self.body, np.einsum("msdk,md->msk", self.pushed, z))
        return found.ravel()

    def dofs(self) -> NDArray[np.int64]:
        """Unknowns of both bodies, shape (m, 2, k); of no body those of the first one, where B is zero."""
        k = self.B.shape[3]
        return np.maximum(self.body, 0)[:, :, None] * k + np.arange(k)

    def rows(self, unknowns: int) -> Sparse:
        """B as a matrix, rows (contact, direction)."""
        return self._matrix(self.B, unknowns)

    def rows_of_force(self, unknowns: int) -> Sparse:
        """F as a matrix, rows (contact, direction)."""
        return self._matrix(self.pushed, unknowns)

    def _matrix(self, blocks: Array, unknowns: int) -> Sparse:
        m, _, dim, _ = blocks.shape
        values = blocks.transpose(0, 2, 1, 3)
        rows = np.broadcast_to(np.arange(m * dim).reshape(m, dim, 1, 1), values.shape)
        columns = np.broadcast_to(self.dofs()[:, None], values.shape)
        return sparse_from_entries(rows.ravel(), columns.ravel(), values.ravel(), (m * dim, unknowns))


def project(p: Array, friction: Array) -> tuple[Array, Array]:
    """(P(p, mu), its derivative) of the shapes (m, dim) and (m, dim, dim)."""
    z, D = np.zeros_like(p), np.zeros((*p.shape, p.shape[1]))
    normal = np.maximum(p[:, 0], 0.0)
    closed = p[:, 0] > 0.0
    z[:, 0], D[closed, 0, 0] = normal, 1.0
    tangent = p[:, 1:]
    size, bound = np.linalg.norm(tangent, axis=1), friction * normal
    stuck = closed & (size <= bound) & (friction > 0.0)
    z[stuck, 1:] = tangent[stuck]
    D[stuck, 1:, 1:] = np.eye(tangent.shape[1])
    slid = closed & ~stuck & (friction > 0.0)
    way = tangent[slid] / size[slid, None]
    z[slid, 1:] = bound[slid, None] * way
    D[slid, 1:, 0] = friction[slid, None] * way
    across = np.eye(tangent.shape[1]) - way[:, :, None] * way[:, None, :]
    D[slid, 1:, 1:] = (bound[slid] / size[slid])[:, None, None] * across
    return z, D


def solver(K: Sparse) -> Callable[[Array], Array]:
    """K^-1 of a right side, by a sparse factorisation."""
    turned = K.T  # compressed rows of K^T are compressed columns of K
    return _factors(turned.data, turned.indices, turned.indptr)


def _factors(data: Array, rows: Indices32, starts: Indices32) -> Callable[[Array], Array]:
    """Factors of a matrix by its columns."""
    from scipy.sparse import csc_matrix  # the import takes a fifth of a second: only runs with contact need it
    from scipy.sparse.linalg import splu

    n = len(starts) - 1
    return splu(csc_matrix((data, rows, starts), shape=(n, n))).solve


def positive_definite(K: Sparse) -> bool:
    """Whether the symmetric part of K is, by the signs of its pivots; then one motion belongs to the forces f."""
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    half = csc_matrix((K.data, K.indices, K.indptr), shape=K.shape)
    lower = {"SymmetricMode": True}
    try:
        factors = splu(half + half.T, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=lower)
    except RuntimeError:  # singular
        return False
    return bool((factors.perm_r == factors.perm_c).all() and (factors.U.diagonal() > 0.0).all())


class _System:
    """The equations of proximal steps: K u = f + F^T z with w = w_0 + B u.

    The entries of K and of F^T D B have their places once for all D.
    """

    def __init__(self, K: Sparse, f: Array, touch: Touch, w0: Array):
        self.K, self.f, self.w0, self.friction = K, f, w0, touch.friction
        m, sides, dim, k = touch.B.shape
        self._dofs = touch.dofs().reshape(m, -1)
        self._B = touch.B.transpose(0, 2, 1, 3).reshape(m, dim, sides * k)
        self._F = touch.pushed.transpose(0, 1, 3, 2).reshape(m, sides * k, dim)
        own = np.repeat(touch.body >= 0, k, axis=1)
        self._kept = own[:, :, None] & own[:, None, :]
        n = K.shape[0]
        places = (self._dofs[:, None, :] * n + self._dofs[:, :, None])[self._kept]  # by columns
        keys, place = np.unique(
            np.concatenate([K.indices.astype(np.int64) * n + K.row_numbers(), places]), return_inverse=True
        )
        self._rows, self._columns = (keys % n).astype(np.int32), keys // n
        self._place, self._count = place[len(K.data) :], len(keys)
        self._own = np.zeros(self._count)
        self._own[place[: len(K.data)]] = K.data

    def motion(self, u: Array) -> Array:
        """w, shape (m, dim)."""
        return self.w0 + (self._B @ u[self._dofs][:, :, None])[:, :, 0]

    def force(self, z: Array) -> Array:
        """F^T z by unknown; z: shape (m, dim)."""
        return np.bincount(self._dofs.ravel(), (self._F @ z[:, :, None]).ravel(), len(self.f)).astype(float)

    def solver(self, D: Array) -> Callable[[Array], Array]:
        """(K + F^T D B)^-1 of a right side; D: shape (m, dim, dim)."""
        blocks = np.zeros(self._kept.shape)
        closed = D.any(axis=(1, 2))
        blocks[closed] = self._F[closed] @ (D[closed] @ self._B[closed])
        data = self._own + np.bincount(self._place, blocks[self._kept], self._count)
        some = data != 0.0
        starts = np.searchsorted(self._columns[some], np.arange(len(self.f) + 1)).astype(np.int32)
        return _factors(data[some], self._rows[some], starts)


def braced(K: Sparse, touch: Touch, z: Array) -> bool:
    """Whether the symmetric part of K is positive definite in the motions that contacts with these forces leave."""
    closed = z[:, 0] > 0.0
    stuck = closed & (np.linalg.norm(z[:, 1:], axis=1) < (1.0 - FORCE_ROUNDING) * touch.friction * z[:, 0])
    dim = z.shape[1]
    kept = np.concatenate([closed[:, None], np.repeat(stuck[:, None], dim - 1, axis=1)], axis=1)
    B = touch.rows(K.shape[0]).scaled_rows(np.where(kept, np.sqrt(_stiffness(K, touch))[:, None], 0.0).ravel())
    return positive_definite(K + B.T @ B)


def contact_forces(
    K: Sparse, f: Array, touch: Touch, w0: Array, start: Array | None = None
) -> tuple[Array, Array, Array]:
    """(u, z, missed) of shapes (n,), (m, dim) and (m, dim). start: z of a problem nearby.

    missed: ways that contacts miss, times their stiffness r [N].

    Raises StepFailed if there is no motion with w_n >= 0: bodies that are held, or between others, have no room.
    """
    free = solver(K)(f)
    m = len(w0)
    near = (w0 + touch.motion(free))[:, 0] < 0.0 if start is None else np.ones(m, dtype=bool)
    if not near.any():
        return free, np.zeros_like(w0), np.zeros_like(w0)
    r = _stiffness(K, touch)
    if (w0[~(r > 0.0), 0] < 0.0).any():
        raise StepFailed("rigid bodies", FailureKind.NO_ROOM, NO_MOTION)
    z = np.zeros_like(w0) if start is None else start * (r > 0.0)[:, None]
    system = _System(K, f, touch, w0)
    ways = np.abs(w0) + Touch(np.abs(touch.B), touch.body, touch.friction).motion(np.abs(free))
    sizes = r[:, None] * ways.max(axis=1, keepdims=True)
    u, share, change = free, FIRST_SHARE if start is None else 10.0 * FIRST_SHARE, np.full_like(w0, np.inf)
    for _ in range(PROXIMAL_STEPS):
        solved = _proximal_step(system, share * r, z, u)
        if solved is None:
            share *= 0.1
            continue
        last, before, u = change, z, solved
        z = project(before - share * r[:, None] * system.motion(u), touch.friction)[0]
        change = (z - before) / share
        way = float((r * np.linalg.norm(system.motion(u) - system.motion(free), axis=1)).max())
        vanish = float(np.abs(z).max()) <= FORCE_ROUNDING * float(sizes.max())
        if (vanish and (np.abs(change) <= FOUND * sizes).all()) or _found(z, change, last, share, way):
            return u, z, change
        slow = float(np.abs(change).max()) > SLOW_CHANGE * float(np.abs(last).max())
        share = min(LARGEST_SHARE if slow else max(1.0, share), SHARE_GROWTH * share)
    if (change[:, 0] > FORCE_ROUNDING * np.abs(z).max()).any():
        raise StepFailed("rigid bodies", FailureKind.NO_ROOM, NO_MOTION)
    raise StepFailed("rigid bodies", FailureKind.JAMMED, NO_FORCES)


def _found(z: Array, change: Array, last: Array, share: float, way: float) -> bool:
    """Whether proximal steps have found z; change, last: its change in the last one and in that before.

    way: the largest by the forces times r, as `change` is what is missed times r.

    Vertices of one body that stick need not agree on its motion: in a step a second one lands beside the first one, and
    its way before belongs to the step. Their friction then grows by the same in each step, at the same motion, without
    any change of the normal forces. With the largest share of r one of them mostly slides soon; where it does not, the
    growth need not be followed to the end. With a smaller one, what it leaves in the balance is too much for bodies on
    which small forces act beside large ones.
    """
    scale, missed = float(np.abs(z).max()), float(np.abs(change).max())
    if missed <= FOUND * scale:
        return True
    if not np.isfinite(last).all():
        return False
    if missed <= FORCE_ROUNDING * scale and missed >= 0.5 * float(np.abs(last).max()):
        return True
    steady = share == LARGEST_SHARE and float(np.abs(change - last).max()) <= STEADY_CHANGE * missed
    return steady and float(np.abs(change[:, 0]).max()) <= NEGLIGIBLE_GAP * way


def _stiffness(K: Sparse, touch: Touch) -> Array:
    """r, shape (m,), zero of contacts that no unknown moves."""
    k = touch.B.shape[3]
    blocks = np.zeros((K.shape[0] // k, k, k))
    rows, columns = K.row_numbers(), K.indices
    own = rows // k == columns // k
    blocks[rows[own] // k, rows[own] % k, columns[own] % k] = K.data[own]
    solved = np.linalg.solve(blocks[np.maximum(touch.body, 0)], touch.B.transpose(0, 1, 3, 2))
    soft = np.abs(np.einsum("msdk,mskd->m", touch.B, solved)) / touch.B.shape[2]
    return np.divide(PROXIMAL, soft, out=np.zeros_like(soft), where=soft > 0.0)


def _proximal_step(system: _System, r: Array, z: Array, u: Array) -> Array | None:
    """u with K u = f + F^T P(z - r w(u)); None if Newton's method does not find it."""

    def state(u: Array) -> tuple[Array, Array, Array]:
        forces, D = project(z - r[:, None] * system.motion(u), system.friction)
        return system.f + system.force(forces) - system.K @ u, forces, D

    for iterations, halvings in ((WHOLE_INCREMENTS, 1), (HALVED_INCREMENTS, INCREMENT_HALVINGS)):
        at = u
        missed, forces, D = state(at)
        for _ in range(iterations):
            step, size = system.solver(r[:, None, None] * D)(missed), float(np.linalg.norm(missed))
            before, slopes = forces, D
            for halving in range(halvings):
                new = at + 0.5**halving * step
                missed, forces, D = state(new)
                if halvings == 1 or float(np.linalg.norm(missed)) < size:
                    break
            else:
                scale = float(system.force(np.abs(forces)).max(initial=0.0)) + float(np.abs(system.f).max())
                if size <= FORCE_ROUNDING * scale:
                    return at
                break
            at = new
            same = np.array_equal(D, slopes) or np.abs(forces - before).max() <= SAME_FORCES * np.abs(forces).max()
            if halving == 0 and same:  # the equations are linear between both iterates, or nearly
                return at
    return None
