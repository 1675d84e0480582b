"""Rigid bodies against rigid obstacles, without friction: no vertex passes an obstacle, and nothing pulls.

For the gaps g_j of vertices, their derivatives G by the unknowns, and pressures z_j [N],

    g_j >= 0,   z_j >= 0,   z_j g_j = 0,        balance - G^T z = 0        z: means over the step

Each Newton step finds who is in contact from a small quadratic problem: the increment nearest to that without contact,
in the metric of the tangent, that leaves no gap negative. Of several pressures for one force it takes few.
An impact takes the velocity towards the obstacle, but for a share of it, the restitution.
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
    """Segments or triangles whose right-hand normals point to where bodies may be."""

    name: str
    points: Array  #: vertices [m], shape (n, dim)
    facets: NDArray[np.int64]  #: shape (m, dim)
    motion: Callable[[float], Array] | None = None  #: positions [m] of the vertices at a time; None: it rests

    def at(self, t: float) -> Array:
        """Positions [m] of the vertices."""
        return self.points if self.motion is None else self.motion(t)


@dataclass(frozen=True)
class Gaps:
    """Of vertices from an obstacle."""

    gap: Array  #: [m], negative behind it, shape (n,)
    normal: Array  #: unit vectors away from it, shape (n, dim)


def gaps(x: Array, corners: Array) -> Gaps:
    """Of points (n, dim) from the nearest of flat facets with corners (m, dim, dim)."""
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
    """Nearest point of a segment or triangle to each point."""
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
    """Vertices of one body, by its number, and an obstacle."""

    body: int
    vertices: int  #: of the body's surface
    obstacle: Obstacle


class RigidContact:
    """All pairs; arrays over all vertices of one pair after those of the other, shape (m,)."""

    def __init__(self, pairs: Sequence[RigidPair], unknowns: int, *, restitution: float = 0.0):
        self.pairs, self.restitution = list(pairs), restitution
        count = sum(pair.vertices for pair in pairs)
        self.z = np.zeros(count)  #: pressures [N]
        self.gap = np.full(count, np.inf)  #: [m]
        self.G = np.zeros((count, unknowns))  #: derivatives of the gaps by the unknowns

    @property
    def force(self) -> Array:
        """Force and moment of the pressures, of all unknowns."""
        return self.G.T @ self.z

    @property
    def active(self) -> NDArray[np.bool_]:
        """Which vertices are in contact."""
        return self.z > 0.0

    def measure(self, positions: Sequence[Array], arms: Sequence[Array], ways: NDArray[np.int64], t: float) -> None:
        """Gaps and their derivatives for vertices (n, dim) and their arms (n, 3) of each body at the time t."""
        self.G[:] = 0.0
        start = 0
        for pair in self.pairs:
            rows = slice(start, start + pair.vertices)
            found = gaps(positions[pair.body], pair.obstacle.at(t)[pair.obstacle.facets])
            n = np.pad(found.normal, ((0, 0), (0, 3 - found.normal.shape[1])))
            by_way = np.hstack([n, np.cross(arms[pair.body], n)])[:, ways]
            self.gap[rows] = found.gap
            self.G[rows, pair.body * len(ways) : (pair.body + 1) * len(ways)] = by_way
            start = rows.stop

    def press(self, tangent: Array, right: Array) -> None:
        """The pressures of a Newton step from here; right: minus the balance without contact.

        Once they leave nothing of the balance, the gaps and pressures are as they must be.
        """
        without = np.linalg.solve(tangent, right)
        too_far = 0.0 - self.gap - self.G @ without
        self.z = pressures(0.5 * (tangent + tangent.T), self.G, too_far)

    def transformation(self, tangent: Array) -> RowTransformation | None:
        """Rows of J du = b + G^T z without z, which ask for G du = -g where there is contact.

        With S = G K^-1 G^T: L = 1 - G^T S^-1 G K^-1, A = G^T S^-1 G, c = -G^T S^-1 g. None without contact.
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
        """(velocities, rates of momentum) at the end of a step with contact, of all unknowns.

        mass: matrix; before: velocities at the start of the step, of which the restitution gives back its share;
        without: those at its end if there were no contact; force: that at its end. What stays in contact does not
        accelerate towards the obstacle.
        """
        G: Array = self.G[self.active]
        wanted = -self.restitution * np.minimum(G @ before, 0.0)
        missing: Array = wanted - G @ without
        velocity = without + np.linalg.solve(mass, G.T @ pressures(mass, G, missing))
        staying: Array = G[wanted == 0.0]
        inwards: Array = -(staying @ np.linalg.solve(mass, force))
        return velocity, force + staying.T @ pressures(mass, staying, inwards)

    def numbers(self) -> dict[str, float]:
        """Columns of the history."""
        return {"contact.active": float(self.active.sum())}


def pressures(K: Array, G: Array, f: Array) -> Array:
    """z >= 0 of the smallest d = K^-1 G^T z, in the metric of K, with G d >= f; shapes (n, n), (m, n), (m,)."""
    if not (f > 0.0).any():
        return np.zeros(len(f))
    half = np.linalg.cholesky(K)
    E = np.linalg.solve(half, G.T).T
    sizes = np.abs(E).max(), f.max()
    z = least_distance(E / sizes[0], f / sizes[1])
    return z * sizes[1] / sizes[0] ** 2


def least_distance(E: Array, f: Array) -> Array:
    """z >= 0 of the shortest y = E^T z with E y >= f, shapes (m, n), (m,); few of them are not zero."""
    from scipy.optimize import nnls  # a fifth of a second, which runs without contact do not need

    system = np.vstack([E.T, f])
    target = np.zeros(len(system))
    target[-1] = 1.0
    found, _ = nnls(system, target)
    rest = system @ found - target
    return -found / rest[-1]
