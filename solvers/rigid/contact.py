"""Frictionless contact of rigid bodies with rigid obstacles, vertex against facet.

For the gaps g_j of vertices, their derivatives G by the unknowns, and contact forces z_j [N] averaged over the step,

    g_j >= 0,   z_j >= 0,   z_j g_j = 0,        balance - G^T z = 0.

Each Newton iteration finds the active set by a small quadratic program: the increment nearest to that without contact,
in the metric of the tangent, for which no gap is negative. Where several z give the same force, few are not zero. After
an impact, the velocity away from the obstacle is the restitution times that towards it before.
Sources: Lawson, Hanson, Solving Least Squares Problems (1974), chapter 23 (least distance); Moreau in Moreau,
Panagiotopoulos, Nonsmooth Mechanics and Applications (1988) (impact).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.rows import RowTransformation
from solvers.sparse import nothing, sparse_from_array


@dataclass(frozen=True)
class Obstacle:
    """A rigid obstacle of segments or triangles, whose right-hand normals point towards the bodies."""

    name: str
    points: Array  #: vertices [m], shape (n, dim)
    facets: NDArray[np.int64]  #: shape (m, dim)
    motion: Callable[[float], Array] | None = None  #: time [s] -> positions of the vertices [m]; None: it rests

    def at(self, t: float) -> Array:
        """Positions [m] of the vertices at the time t [s]."""
        return self.points if self.motion is None else self.motion(t)


@dataclass(frozen=True)
class Gaps:
    """Gaps of vertices to an obstacle."""

    gap: Array  #: [m], negative behind the obstacle, shape (n,)
    normal: Array  #: unit normals of the obstacle, shape (n, dim)


def gaps(x: Array, corners: Array) -> Gaps:
    """Gaps of points (n, dim) to the nearest of flat facets with corners (m, dim, dim), positions in [m]."""
    closest, gap, normal = np.full(len(x), np.inf), np.full(len(x), np.inf), np.zeros_like(x)
    for facet in corners:
        n = _normal(facet)
        foot = _nearest(x, facet)
        away = x - foot
        distance = np.linalg.norm(away, axis=1)
        height = away @ n
        nearer = distance < closest
        closest[nearer], gap[nearer], normal[nearer] = distance[nearer], height[nearer], n
    return Gaps(gap, normal)


def _normal(facet: Array) -> Array:
    edges = facet[1:] - facet[0]
    n = np.array([edges[0, 1], -edges[0, 0]]) if len(facet) == 2 else np.cross(edges[0], edges[1])
    return n / np.linalg.norm(n)


def _nearest(x: Array, facet: Array) -> Array:
    """The point of a segment or triangle nearest to each point, shape (n, dim)."""
    edges = [(facet[a], facet[b]) for b in range(len(facet)) for a in range(b)]
    feet = []
    for a, b in edges:
        share = np.clip((x - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        feet.append(a + share[:, None] * (b - a))
    best = np.argmin([np.linalg.norm(x - foot, axis=1) for foot in feet], axis=0)
    foot = np.stack(feet)[best, np.arange(len(x))]
    if len(facet) == 3:
        n = _normal(facet)
        flat = x - ((x - facet[0]) @ n)[:, None] * n
        turns = [np.cross(facet[(i + 1) % 3] - facet[i], flat - facet[i]) @ n for i in range(3)]
        inside = np.min(turns, axis=0) >= 0.0
        foot[inside] = flat[inside]
    return foot


@dataclass(frozen=True)
class RigidPair:
    """A body that may touch an obstacle."""

    body: int  #: index of the body
    vertices: int  #: count of vertices of its surface
    obstacle: Obstacle


class RigidContact:
    """All pairs. Arrays have the shape (m,): the vertices of all bodies, pair by pair."""

    def __init__(self, pairs: Sequence[RigidPair], unknowns: int, *, restitution: float = 0.0):
        self.pairs, self.restitution = list(pairs), restitution
        count = sum(pair.vertices for pair in pairs)
        self.z = np.zeros(count)  #: contact forces [N]
        self.gap = np.full(count, np.inf)  #: [m]
        self.G = np.zeros((count, unknowns))  #: derivatives of the gaps by the unknowns

    @property
    def force(self) -> Array:
        """Generalised contact force: force [N] and moment [N m] by unknown."""
        return self.G.T @ self.z

    @property
    def active(self) -> NDArray[np.bool_]:
        """Mask of the vertices in contact, shape (m,)."""
        return self.z > 0.0

    def measure(
        self, positions: Sequence[Array], arms: Sequence[Array], components: NDArray[np.int64], t: float
    ) -> None:
        """Set gaps and their derivatives at the time t [s].

        positions, arms: of the vertices [m] and from the centres to them [m], by body, (n, dim) and (n, 3);
        components: the unknowns of a body among `COMPONENTS`.
        """
        self.G[:] = 0.0
        start = 0
        for pair in self.pairs:
            rows = slice(start, start + pair.vertices)
            found = gaps(positions[pair.body], pair.obstacle.at(t)[pair.obstacle.facets])
            n = np.pad(found.normal, ((0, 0), (0, 3 - found.normal.shape[1])))
            by_component = np.hstack([n, np.cross(arms[pair.body], n)])[:, components]
            self.gap[rows] = found.gap
            self.G[rows, pair.body * len(components) : (pair.body + 1) * len(components)] = by_component
            start = rows.stop

    def press(self, tangent: Array, right: Array) -> None:
        """Set the contact forces for a Newton iteration; right: minus the balance without contact.

        When the balance with these forces vanishes, gaps and forces fulfil the complementarity conditions.
        """
        without = np.linalg.solve(tangent, right)
        too_far = 0.0 - self.gap - self.G @ without
        self.z = pressures(0.5 * (tangent + tangent.T), self.G, too_far)

    def transformation(self, tangent: Array) -> RowTransformation | None:
        """Transformation that eliminates z from J du = b + G^T z with G du = -g; None without contact.

        With S = G K^-1 G^T: rows L = 1 - G^T S^-1 G K^-1, added A = G^T S^-1 G, right c = -G^T S^-1 g.
        """
        G, g, n = self.G[self.active], self.gap[self.active], len(tangent)
        if not len(G):
            return None
        inverse = np.linalg.inv(tangent)
        back = np.linalg.solve(G @ inverse @ G.T, G).T
        return RowTransformation(
            dofs=np.arange(n),
            rows=sparse_from_array(np.eye(n) - back @ G @ inverse),
            stiffness=nothing((n, n)),
            added=sparse_from_array(back @ G),
            right=-back @ g,
            replaced=np.ones(n, dtype=bool),
        )

    def after_impact(self, mass: Array, before: Array, without: Array, force: Array) -> tuple[Array, Array]:
        """(velocities, rates of momentum) by unknown at the end of a step with contact.

        mass: mass matrix; before: velocities at the start of the step, to which restitution applies; without: those at
        its end without contact; force: that at its end. Vertices that stay in contact do not accelerate towards the
        obstacle.
        """
        G: Array = self.G[self.active]
        rebound = -self.restitution * np.minimum(G @ before, 0.0)
        missing: Array = rebound - G @ without
        velocity = without + np.linalg.solve(mass, G.T @ pressures(mass, G, missing))
        staying: Array = G[rebound == 0.0]
        inwards: Array = -(staying @ np.linalg.solve(mass, force))
        return velocity, force + staying.T @ pressures(mass, staying, inwards)

    def numbers(self) -> dict[str, float]:
        """Columns of the history."""
        return {"contact.active": float(self.active.sum())}


def pressures(K: Array, G: Array, f: Array) -> Array:
    """z >= 0 of the smallest d = K^-1 G^T z, in the metric of K, with G d >= f; K (n, n), G (m, n), f (m,)."""
    if not (f > 0.0).any():
        return np.zeros(len(f))
    half = np.linalg.cholesky(K)
    E = np.linalg.solve(half, G.T).T
    sizes = np.abs(E).max(), f.max()
    z = least_distance(E / sizes[0], f / sizes[1])
    return z * sizes[1] / sizes[0] ** 2


def least_distance(E: Array, f: Array) -> Array:
    """z >= 0 of the shortest y = E^T z with E y >= f, E (m, n), f (m,); few components of z are not zero."""
    from scipy.optimize import nnls  # the import takes a fifth of a second: only runs with contact need it

    system = np.vstack([E.T, f])
    target = np.zeros(len(system))
    target[-1] = 1.0
    found, _ = nnls(system, target)
    rest = system @ found - target
    return -found / rest[-1]
