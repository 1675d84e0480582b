"""A rigid body: surface, inertia, and its own loads: gravity, springs, given forces and moments."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.rigid.edges import Edges
from solvers.rigid.inertia import Inertia, about
from solvers.rigid.rotation import skew
from solvers.values import Value, evaluate

#: Components of motion: displacements of the centre of mass, or of the pivot, and rotations about axes through it.
COMPONENTS = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")


@dataclass(frozen=True)
class PointSpring:
    """A spring from a point of the body to its position at the start: by axis, -k (d + damping d') - c d' [N]."""

    at: Sequence[float]  #: the point at the start [m], shape (dim,)
    stiffness: float | Sequence[float]  #: k [N/m], for all directions or by axis; in 2D per depth
    damping: float = 0.0  #: damping over stiffness [s]
    dashpot: float = 0.0  #: c [N s/m], in all directions; in 2D per depth


@dataclass(frozen=True)
class PointLoad:
    """A force at a point of the body, and a moment. They do not turn with the body."""

    force: Callable[[float], Array]  #: time [s] -> force [N], shape (3,)
    moment: Callable[[float], Array]  #: time [s] -> moment [N m], shape (3,)
    at: Sequence[float] | None = None  #: the point at the start [m], shape (dim,); None: the centre of mass


@dataclass(frozen=True)
class RigidBody:
    """A rigid body with 6 unknowns, 3 in 2D. `held` components follow functions of time [m, rad]."""

    name: str
    points: Array  #: vertices of its surface [m], shape (n, dim)
    facets: NDArray[np.int64]  #: segments or triangles, right-hand normals out of the solid, shape (m, dim)
    inertia: Inertia
    gravity: Sequence[Value] | None = None  #: [m/s^2], by components
    springs: Sequence[PointSpring] = ()
    loads: Sequence[PointLoad] = ()
    held: Mapping[str, Callable[[float], float]] = field(default_factory=dict)  #: by names of `COMPONENTS`
    initial_velocity: Sequence[float] = ()  #: of the centre [m/s], shape (dim,)
    initial_spin: Sequence[float] = ()  #: angular velocity [rad/s], shape (3,)

    @property
    def dim(self) -> int:
        return self.points.shape[1]

    @cached_property
    def edges(self) -> Edges:
        """Its sharp edges, in 3D."""
        return Edges.of(self.points, self.facets)

    @property
    def extent(self) -> float:
        """Largest distance [m] of a vertex from the centre of mass, or from the pivot."""
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
        """Force [N] and moment [N m] about the centre by gravity, loads and springs, shape (6,).

        shift: displacement of the centre [m]; R: rotation; velocity: of the centre [m/s]; spin: angular velocity in
        space [rad/s].
        """
        load = np.zeros(6)
        for arm, force in self._dead_forces(t, shift, R):
            load += np.concatenate([force, np.cross(arm, force)])
        for given in self.loads:
            load[3:] += given.moment(t)
        for spring in self.springs:
            arm, force, _ = self._spring_force(spring, shift, R, velocity, spin)
            load += np.concatenate([force, np.cross(arm, force)])
        return load

    def own_load_tangent(self, t: float, shift: Array, R: Array, velocity: Array, spin: Array, rate: Array) -> Array:
        """Derivative of `own_load` by the displacement of the centre and a further rotation in space, shape (6, 6).

        rate: derivative of (velocity, spin) by both, shape (6, 6).
        """
        tangent = np.zeros((6, 6))
        for arm, force in self._dead_forces(t, shift, R):
            tangent[3:, 3:] += skew(force) @ skew(arm)
        for spring in self.springs:
            arm, force, k = self._spring_force(spring, shift, R, velocity, spin)
            B = np.hstack([np.eye(3), -skew(arm)])
            speed = B @ rate
            speed[:, 3:] -= skew(spin) @ skew(arm)
            tangent -= B.T @ (k[:, None] * (B + spring.damping * speed) + spring.dashpot * speed)
            tangent[3:, 3:] += skew(force) @ skew(arm)
        return tangent

    def _dead_forces(self, t: float, shift: Array, R: Array) -> Iterator[tuple[Array, Array]]:
        """(arm [m], force [N]) of forces that keep their direction, each of shape (3,): weight and loads."""
        to_mass = R @ self.inertia.offset
        if self.gravity is not None:
            at = self.inertia.centre + (shift + to_mass)[: self.dim]
            g = [evaluate(component, at[:, None], t)[0] for component in self.gravity]
            yield to_mass, self.inertia.gravitational_mass * in_space(np.array([g]))[0]
        for load in self.loads:
            yield to_mass if load.at is None else self.arms(R, np.array([load.at], dtype=float))[0], load.force(t)

    def _spring_force(
        self, spring: PointSpring, shift: Array, R: Array, velocity: Array, spin: Array
    ) -> tuple[Array, Array, Array]:
        """(arm [m], force [N], stiffness by axis [N/m]) of a spring, each of shape (3,)."""
        at = np.array([spring.at], dtype=float)
        k = in_space(np.broadcast_to(np.asarray(spring.stiffness, dtype=float), (1, self.dim)))[0]
        arm, rest = self.arms(R, at)[0], self.arms(np.eye(3), at)[0]
        speed = velocity + np.cross(spin, arm)
        return arm, -k * (shift + arm - rest + spring.damping * speed) - spring.dashpot * speed, k


def hinged(body: RigidBody, pivot: Sequence[float]) -> RigidBody:
    """The body with a pivot: a point of it [m] at rest, which its other points turn about. Raises ValueError."""
    if moving := [way for way in ("x", "y", "z") if way in body.held]:
        raise ValueError(f"a pivot does not move: no motion of '{moving[0]}' can be given")
    rest = dict.fromkeys(("x", "y", "z")[: body.dim], lambda t: 0.0)
    return replace(body, inertia=about(body.inertia, np.array(pivot, dtype=float)), held={**body.held, **rest})


def in_space(vectors: Array) -> Array:
    """Vectors in 3D, with zeros as the missing components, shape (n, 3)."""
    found = np.zeros((len(vectors), 3))
    found[:, : vectors.shape[1]] = vectors
    return found
