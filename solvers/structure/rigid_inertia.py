"""Inertia of rigid motion of bodies whose mass is not where their material is.

Each connected piece gets what the matrix M' of the moved mass lacks, as that of a rigid body without mass that it
carries along (docs/theory_contact.md, Massless contact surfaces). With the centre c' of M', r = x - c', and the inertia
I' = int (|r|^2 1 - r r^T) dm', the piece has the velocity V = sum M' v / m, omega = I'^-1 sum M' r x v. The difference
has the first moment m d, where c' + d is the true centre, and the inertia K about c':

    momenta  H = omega x m d,    h = K omega          energy  V . H + omega . K omega / 2
    force    A = dH/dt,          couple about c'  B = dh/dt + m d x dV/dt
    forces on nodes  f = M' (A / m + (I'^-1 B) x r)

The energy of M' and the difference together is never negative, with the inertia K_d of a mass m at d:

    v.M'v / 2 >= m |V|^2 / 2 + omega . I' omega / 2,    m |V + omega x d|^2 / 2 + omega . (I' + K - K_d) omega / 2
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.blocks import times
from solvers.algebra.sparse import Sparse, sparse_from_entries
from solvers.api import Array

#: Moments below this share of those of the whole piece are rounding errors.
NO_DIFFERENCE = 1e-12


@dataclass(frozen=True)
class Frames:
    """The frames of the pieces at one displacement. Vectors have three components, in 2D, too."""

    arms: Array  #: r [m] of owned nodes, shape (n, 3)
    modes: Sparse  #: M' e_k [kg] and M' e_k x r [kg m] at owned dofs, shape (n dim, 6 pieces)
    projection: Sparse  #: its transpose
    inertia: Array  #: I' [kg m^2], shape (pieces, 3, 3)
    compliance: Array  #: I'^-1 [1/(kg m^2)], shape (pieces, 3, 3); in 2D of rotations in the plane
    first: Array  #: m d [kg m], shape (pieces, 3)
    second: Array  #: K [kg m^2], shape (pieces, 3, 3)


@dataclass(frozen=True)
class Split:
    """A motion as rigid ones of the pieces with their true mass, and the rest."""

    velocity: Array  #: of the centre [m/s], shape (pieces, 3)
    spin: Array  #: angular momentum about the centre [kg m^2/s], shape (pieces, 3)
    velocities: Array  #: [m/s] at owned dofs besides the rigid motion
    energy_of_rest: Array  #: kinetic energy [J] of these, shape (pieces,)
    energy: Array  #: kinetic energy [J] of the whole, shape (pieces,)


@dataclass(frozen=True)
class Momenta:
    """H and h of the pieces, and their rates; shape (pieces, 3)."""

    frame: Frames
    linear: Array  #: H [kg m/s]
    angular: Array  #: h [kg m^2/s]
    force: Array  #: dH/dt [N]
    couple: Array  #: dh/dt [N m]


class RigidInertia:
    """What the inertia of the true mass has more than that of the moved mass, for rigid motion of each piece."""

    def __init__(
        self,
        comm: MPI.Comm,
        true: PETSc.Mat,
        moved: PETSc.Mat,
        points: Array,
        pieces: tuple[NDArray[np.int64], int],
        turns: NDArray[np.bool_],
    ):
        """true, moved: mass matrices [kg] of all bodies. Of owned nodes: points, their reference positions [m], shape
        (n, dim); pieces, the number of each, shape (n,), and their count; turns, whether they have large displacements,
        shape (n,) (collective).
        """
        self._comm, self._moved = comm, moved
        self._piece, self._count = piece, count = pieces
        n, self._dim = points.shape
        self._turns, self._points = turns, self._in_space(points.ravel())
        self._gather = sparse_from_entries(piece, np.arange(n), np.ones(n), (count, n))
        self._large = self._sums(turns[:, None].astype(float)) > 0.0
        ones = np.ones_like(self._points)
        self._weights, true_weights = (self._scalar(matrix, ones)[:, :1] for matrix in (moved, true))
        self.mass = self._sums(self._weights)  #: [kg], shape (pieces, 1)
        self._reference = r = self._points - (self._sums(self._weights * self._points) / self.mass)[piece]
        total, own = (self._sums(_outer(r, self._scalar(matrix, r))) for matrix in (true, moved))
        first, size = self._sums(true_weights * r), np.trace(total, axis1=1, axis2=2)[:, None]
        self._first = np.where(np.abs(first) > NO_DIFFERENCE * np.sqrt(self.mass * size), first, 0.0)
        changed = np.abs(total - own) > NO_DIFFERENCE * size[:, None]
        self._second = np.where(changed, total - own, 0.0)  # int r r^T of the difference
        self._pattern = indices, indptr = _pattern_of_modes(piece, self._dim)
        self._shape = len(indptr) - 1, 6 * count
        numbered = Sparse(np.arange(indices.size, dtype=float), *self._pattern, self._shape).T
        self._transposed, self._order = (numbered.indices, numbered.indptr), numbered.data.astype(np.int64)

    # ------------------------------------------------------------------------------------------------ geometry

    def frame(self, u: Array) -> Frames:
        """The frames at the displacement u [m] of owned dofs (collective)."""
        x = self._points + self._turns[:, None] * self._in_space(u)
        moments = self._scalar(self._moved, x)
        centre = (self._sums(moments) / self.mass)[self._piece]
        arms, moments = x - centre, moments - self._weights * centre
        products = self._sums(np.stack([_outer(arms, moments), _outer(moments, self._reference)], axis=1))
        spread, turned = products[:, 0], products[:, 1]
        R = np.tile(np.eye(3), (self._count, 1, 1))
        R[:, : self._dim, : self._dim] = _rotation(turned[:, : self._dim, : self._dim])
        inertia, second = _inertia(spread), _inertia(R @ self._second @ R.transpose(0, 2, 1))
        if self._dim == 2:  # of rotations in the plane alone
            second[:, :2], second[:, 2, :2] = 0.0, 0.0
            compliance = np.zeros_like(inertia)
            compliance[:, 2, 2] = 1.0 / inertia[:, 2, 2]
        else:
            compliance = np.linalg.inv(inertia)
        return Frames(arms, *self._modes(moments), inertia, compliance, _apply(R, self._first), second)

    def _modes(self, moments: Array) -> tuple[Sparse, Sparse]:
        """The modes and their transpose."""
        w, (x, y, z) = self._weights[:, 0], moments.T
        parts = [w, -y, w, x] if self._dim == 2 else [w, z, -y, w, -z, x, w, y, -x]
        data = np.stack(parts, axis=1).ravel()
        modes = Sparse(data, *self._pattern, self._shape)
        return modes, Sparse(data[self._order], *self._transposed, self._shape[::-1])

    # --------------------------------------------------------------------------------------------------- motion

    def velocities(self, frame: Frames, v: Array) -> tuple[Array, Array]:
        """(V [m/s], omega [1/s]) of the velocity v of owned dofs, shape (pieces, 3) (collective)."""
        sums = self._summed(frame.projection @ v).reshape(-1, 6)
        return sums[:, :3] / self.mass, _apply(frame.compliance, sums[:, 3:])

    def energy(self, frame: Frames, v: Array) -> float:
        """V . H + omega . K omega / 2 [J] (collective)."""
        V, omega = self.velocities(frame, v)
        linear, angular = _momenta(frame, omega)
        return float(np.sum(V * linear) + 0.5 * np.sum(omega * angular))

    def split(self, frame: Frames, v: Array) -> Split:
        """The rigid motion of each piece and the rest, of the velocity v of owned dofs (collective)."""
        V, omega = self.velocities(frame, v)
        rigid = V[self._piece] + _cross(omega[self._piece], frame.arms)
        rest = self._in_space(v) - rigid
        energy = 0.5 * self._sums((rest * self._scalar(self._moved, rest)).sum(axis=1)[:, None])[:, 0]
        velocity, spin = V + _cross(omega, frame.first / self.mass), _apply(self._about_centre(frame), omega)
        whole = energy + 0.5 * (self.mass[:, 0] * (velocity**2).sum(axis=1) + (omega * spin).sum(axis=1))
        return Split(velocity, spin, rest[:, : self._dim].ravel(), energy, whole)

    def joined(self, frame: Frames, motion: Split, rest: Array) -> Array:
        """Velocities [m/s] of owned dofs with the rigid motion of `motion` and other velocities `rest`."""
        inertia, spin = self._about_centre(frame), motion.spin.copy()
        if self._dim == 2:
            inertia[:, :2], inertia[:, 2, :2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 0.0
            spin[:, :2] = 0.0
        omega = np.linalg.solve(inertia, spin[:, :, None])[:, :, 0]
        V = motion.velocity - _cross(omega, frame.first / self.mass)
        rigid = V[self._piece] + _cross(omega[self._piece], frame.arms)
        return rest + rigid[:, : self._dim].ravel()

    def _about_centre(self, frame: Frames) -> Array:
        """Inertia [kg m^2] about the true centre, I' + K - K_d, shape (pieces, 3, 3)."""
        d = frame.first / self.mass
        return frame.inertia + frame.second - _inertia(self.mass[:, :, None] * _outer(d, d))

    # --------------------------------------------------------------------------------------------------- forces

    def on_nodes(self, frame: Frames, force: Array, couple: Array) -> Array:
        """Forces [N] on owned dofs with these resultants about c', shape (pieces, 3)."""
        return frame.modes @ np.hstack([force / self.mass, _apply(frame.compliance, couple)]).ravel()

    def product(self, frame: Frames) -> Callable[[Array], Array]:
        """Function that multiplies fields at owned dofs with the difference of the mass matrices (collective).

        That is f of accelerations a of bodies at rest: M' E N^-1 D N^-1 E^T M' a, E the rigid modes, N = E^T M' E,
        and D the difference of the true mass from N.
        """
        difference, inverse = np.zeros((2, self._count, 6, 6))
        lever = _cross(frame.first.repeat(3, axis=0), np.tile(np.eye(3), (self._count, 1))).reshape(-1, 3, 3)
        difference[:, :3, 3:], difference[:, 3:, :3] = lever, lever.transpose(0, 2, 1)
        difference[:, 3:, 3:] = frame.second
        inverse[:, :3, :3], inverse[:, 3:, 3:] = np.eye(3) / self.mass[:, :, None], frame.compliance
        by_sums = inverse @ difference @ inverse

        def times(a: Array) -> Array:
            sums = self._summed(frame.projection @ a).reshape(-1, 6, 1)
            return frame.modes @ (by_sums @ sums).ravel()

        return times

    def times(self, frame: Frames, a: Array) -> Array:
        """The difference of the mass matrices times a field at owned dofs (collective)."""
        return self.product(frame)(a)

    def force_by_acceleration(self, frame: Frames, v: Array, a: Array) -> Array:
        """f [N] of given velocities and accelerations of owned dofs (collective)."""
        (_, omega), (acceleration, spin) = self.velocities(frame, v), self.velocities(frame, a)
        spread = self._sums(_outer(self._in_space(times(self._moved, v)), frame.arms))
        change = _apply(_inertia(spread + spread.transpose(0, 2, 1)), omega)  # dI'/dt omega
        spin = spin - np.where(self._large, _apply(frame.compliance, change), 0.0)
        turning = np.where(self._large, omega, 0.0)
        force, couple = _momenta(frame, spin)
        linear, angular = _momenta(frame, omega)
        force, couple = force + _cross(turning, linear), couple + _cross(turning, angular)
        return self.on_nodes(frame, force, couple + _cross(frame.first, acceleration))

    def momenta(self, frame: Frames, v: Array, a: Array, force: Array) -> Momenta:
        """Momenta and their rates from the state of owned dofs; force: f [N] (collective)."""
        linear, angular = _momenta(frame, self.velocities(frame, v)[1])
        f = self._in_space(force)
        resultant, couple = np.split(self._sums(np.hstack([f, _cross(frame.arms, f)])), 2, axis=1)
        return Momenta(frame, linear, angular, resultant, couple - _cross(frame.first, self.velocities(frame, a)[0]))

    def force(self, frame: Frames, v: Array, a: Array, before: Momenta, dt: float, gamma: float) -> Array:
        """f [N] at the end of a step of length dt [s] from the motion of owned dofs there (collective)."""
        linear, angular = _momenta(frame, self.velocities(frame, v)[1])
        force = ((linear - before.linear) / dt - (1.0 - gamma) * before.force) / gamma
        couple = ((angular - before.angular) / dt - (1.0 - gamma) * before.couple) / gamma
        return self.on_nodes(frame, force, couple + _cross(frame.first, self.velocities(frame, a)[0]))

    # ---------------------------------------------------------------------------------------------------- arrays

    def _in_space(self, owned: Array) -> Array:
        """Vectors of three components from an array of owned dofs, shape (n, 3)."""
        found = np.zeros((len(self._piece), 3))
        found[:, : self._dim] = owned.reshape(-1, self._dim)
        return found

    def _scalar(self, matrix: PETSc.Mat, vectors: Array) -> Array:
        return self._in_space(times(matrix, vectors[:, : self._dim].ravel()))

    def _sums(self, values: Array) -> Array:
        """Sums over the nodes of each piece, shape (pieces, ...) (collective)."""
        sums = self._gather @ values.reshape(len(values), -1)
        return self._summed(sums).reshape(self._count, *values.shape[1:])

    def _summed(self, local: Array) -> Array:
        return local if self._comm.size == 1 else self._comm.allreduce(local)


def _pattern_of_modes(piece: NDArray[np.int64], dim: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(indices, indptr) of the modes: at component k of a node e_k, and those e_j x r that have this component."""
    turning = [(1, 2), (0, 2), (0, 1)] if dim == 3 else [(2,), (2,)]
    columns = np.array([[k, *(3 + j for j in axes)] for k, axes in enumerate(turning)])
    indices = (6 * piece[:, None, None] + columns).astype(np.int32)
    rows, width = indices.shape[0] * indices.shape[1], indices.shape[2]
    return indices.ravel(), np.arange(rows + 1, dtype=np.int32) * np.int32(width)


def _momenta(frame: Frames, omega: Array) -> tuple[Array, Array]:
    """H and h of the pieces."""
    return _cross(omega, frame.first), _apply(frame.second, omega)


def _cross(a: Array, b: Array) -> Array:
    """np.cross of vectors of three components, several times as fast."""
    (a1, a2, a3), (b1, b2, b3) = a.T, b.T
    return np.stack([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1], axis=1)


def _outer(a: Array, b: Array) -> Array:
    return a[:, :, None] * b[:, None, :]


def _apply(tensors: Array, vectors: Array) -> Array:
    return (tensors @ vectors[:, :, None])[:, :, 0]


def _inertia(second: Array) -> Array:
    """tr(S) 1 - S of second moments S."""
    return np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second


def _rotation(spread: Array) -> Array:
    """The rotations R that maximise tr(R^T A), shape (pieces, dim, dim).

    Source: W. Kabsch, Acta Cryst. A 32 (1976) 922-923.
    """
    left, _, right = np.linalg.svd(spread)
    left[:, :, -1] *= np.sign(np.linalg.det(left @ right))[:, None]
    return left @ right
