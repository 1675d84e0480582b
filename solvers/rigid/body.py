"""A rigid body: surface, inertia, and its own loads by gravity and springs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.rigid.inertia import Inertia
from solvers.rigid.rotation import skew
from solvers.values import Value, evaluate

#: Components of motion: displacements of the centre of mass, and rotations about axes through it.
COMPONENTS = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")


@dataclass(frozen=True)
class PointSpring:
    """A spring from a point of the body to its position at the start, with the force -k (d + damping d') by axis."""

    at: Sequence[float]  #: the point at the start [m], shape (dim,)
    stiffness: float | Sequence[float]  #: k [N/m], for all directions or by axis; in 2D per depth
    damping: float = 0.0  #: damping over stiffness [s]


@dataclass(frozen=True)
class RigidBody:
    """A rigid body with 6 unknowns, 3 in 2D. `held` components follow functions of time [m, rad]."""

    name: str
    points: Array  #: vertices of its surface [m], shape (n, dim)
    facets: NDArray[np.int64]  #: segments or triangles, right-hand normals out of the solid, shape (m, dim)
    inertia: Inertia
    gravity: Sequence[Value] | None = None  #: [m/s^2], by components
    springs: Sequence[PointSpring] = ()
    held: Mapping[str, Callable[[float], float]] = field(default_factory=dict)  #: by names of `COMPONENTS`
    initial_velocity: Sequence[float] = ()  #: of the centre [m/s], shape (dim,)
    initial_spin: Sequence[float] = ()  #: angular velocity [rad/s], shape (3,)

    @property
    def dim(self) -> int:
        return self.points.shape[1]

    @property
    def extent(self) -> float:
        """Largest distance [m] of a vertex from the centre of mass."""
        return float(np.linalg.norm(self.points - self.inertia.centre, axis=1).max())

    @property
    def held_components(self) -> NDArray[np.int64]:
        """Indices of the held components into `COMPONENTS`."""
        return np.array([i for i, name in enumerate(COMPONENTS) if name in self.held], dtype=np.int64)

    def held_at(self, t: float) -> Array:
        """Values of the held components at the time t [s]."""
        return np.array([self.held[COMPONENTS[i]](t) for i in self.held_components])

    def arms(self, R: Array, points: Array) -> Array:
        """Vectors [m] from the centre to points, rotated by R, shape (n, 3); points: at the start [m], (n, dim)."""
        return in_space(points - self.inertia.centre) @ R.T

    def own_load(self, t: float, shift: Array, R: Array, velocity: Array, spin: Array) -> Array:
        """Force [N] and moment [N m] about the centre by gravity and springs, shape (6,).

        shift: displacement of the centre [m]; R: rotation; velocity: of the centre [m/s]; spin: angular velocity in
        space [rad/s].
        """
        load = np.zeros(6)
        if self.gravity is not None:
            at = self.inertia.centre[:, None] + shift[: self.dim, None]
            load[: self.dim] += self.inertia.mass * np.array([evaluate(g, at, t)[0] for g in self.gravity])
        for spring in self.springs:
            arm, force, _ = self._spring_force(spring, shift, R, velocity, spin)
            load += np.concatenate([force, np.cross(arm, force)])
        return load

    def own_load_tangent(self, shift: Array, R: Array, velocity: Array, spin: Array, rate: Array) -> Array:
        """Derivative of `own_load` by the displacement of the centre and a further rotation in space, shape (6, 6).

        rate: derivative of (velocity, spin) by both, shape (6, 6).
        """
        tangent = np.zeros((6, 6))
        for spring in self.springs:
            arm, force, k = self._spring_force(spring, shift, R, velocity, spin)
            B = np.hstack([np.eye(3), -skew(arm)])
            speed = B @ rate
            speed[:, 3:] -= skew(spin) @ skew(arm)
            tangent -= B.T @ (k[:, None] * (B + spring.damping * speed))
            tangent[3:, 3:] += skew(force) @ skew(arm)
        return tangent

    def _spring_force(
        self, spring: PointSpring, shift: Array, R: Array, velocity: Array, spin: Array
    ) -> tuple[Array, Array, Array]:
        """(arm [m], force [N], stiffness by axis [N/m]) of a spring, each of shape (3,)."""
        at = np.array([spring.at], dtype=float)
        k = in_space(np.broadcast_to(np.asarray(spring.stiffness, dtype=float), (1, self.dim)))[0]
        arm, rest = self.arms(R, at)[0], self.arms(np.eye(3), at)[0]
        speed = velocity + np.cross(spin, arm)
        return arm, -k * (shift + arm - rest + spring.damping * speed), k


def in_space(vectors: Array) -> Array:
    """Vectors in 3D, with zeros as the missing components, shape (n, 3)."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))
