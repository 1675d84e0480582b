"""What makes a rigid body: its surface, its inertia, and what acts on it besides the flow."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.rigid.inertia import Inertia
from solvers.rigid.rotation import skew
from solvers.values import Value, evaluate

#: Components of motion: displacements of its centre and rotations about the axes through it.
COMPONENTS = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")


@dataclass(frozen=True)
class PointSpring:
    """From a point of the body to where that point is at the start: -k d along each axis."""

    at: Sequence[float]  #: [m], shape (dim,)
    stiffness: float | Sequence[float]  #: [N/m], of all directions or by axis; in 2D per depth
    damping: float = 0.0  #: in units of the stiffness [s]: -k damping d'


@dataclass(frozen=True)
class RigidBody:
    """A rigid body with 6 unknowns, in 2D with 3. `held` components follow functions of time [m, rad], 0 for none."""

    name: str
    points: Array  #: vertices of its surface [m], shape (n, dim)
    facets: NDArray[np.int64]  #: segments or triangles, the solid on their left or below, shape (m, dim)
    inertia: Inertia
    gravity: Sequence[Value] | None = None  #: [m/s^2], by components
    springs: Sequence[PointSpring] = ()
    held: Mapping[str, Callable[[float], float]] = field(default_factory=dict)  #: by `COMPONENTS`
    initial_velocity: Sequence[float] = ()  #: of the centre [m/s], shape (dim,)
    initial_spin: Sequence[float] = ()  #: [rad/s], shape (3,)

    @property
    def dim(self) -> int:
        return self.points.shape[1]

    @property
    def extent(self) -> float:
        """Largest distance [m] of a vertex from the centre."""
        return float(np.linalg.norm(self.points - self.inertia.centre, axis=1).max())

    @property
    def held_components(self) -> NDArray[np.int64]:
        """Numbers of the components that are held."""
        return np.array([i for i, name in enumerate(COMPONENTS) if name in self.held], dtype=np.int64)

    def held_at(self, t: float) -> Array:
        """Held components at the time t."""
        return np.array([self.held[COMPONENTS[i]](t) for i in self.held_components])

    def arms(self, R: Array, points: Array) -> Array:
        """From the centre to points of the reference configuration [m], shape (n, dim), turned by R, shape (n, 3)."""
        return in_space(points - self.inertia.centre) @ R.T

    def own_load(self, t: float, shift: Array, R: Array, velocity: Array, spin: Array) -> Array:
        """Force [N] and moment [N m] about the centre of gravity and springs, shape (6,).

        shift: displacement [m] of the centre; R: rotation; velocity [m/s] of the centre, spin [rad/s] in space.
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
        """Its derivative by the centre's displacement and a further rotation in space, shape (6, 6).

        rate: derivative of (velocity, spin) by both.
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
    """Vectors with zeros as the missing components, shape (n, 3)."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))
