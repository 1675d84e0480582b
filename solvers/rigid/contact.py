"""Contact of rigid bodies with each other, with obstacles and walls: vertex against facet, with Coulomb's friction.

For the gaps g_j of vertices, their ways s_j along the other surface in the step, and contact forces (z_j, t_j) [N]
averaged over the step, B being the derivative of (g, s) by the unknowns,

    g_j >= 0,   z_j >= 0,   z_j g_j = 0,   |t_j| <= mu z_j, against the way that the vertex slides,
    balance - B^T (z, t) = 0.

The vertices of both surfaces have gaps to the other one. So there are more forces than the bodies have freedoms. Each
Newton iteration solves the cone problem of its linear system (`solvers.rigid.coulomb`). After an impact, the velocity
away from the other side is the restitution times that towards it before; the impulse has friction, too.
Source: Moreau in Moreau, Panagiotopoulos, Nonsmooth Mechanics and Applications (1988).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.rows import RowTransformation
from solvers.algebra.sparse import Sparse, nothing, sparse_from_entries
from solvers.api import Array, StepFailed
from solvers.rigid.body import RigidBody
from solvers.rigid.coulomb import FORCE_ROUNDING, Touch, braced, contact_forces, positive_definite
from solvers.rigid.impact import AT_BOUND, Closed
from solvers.rigid.near import Moment, Near, Obstacle, RigidPair, same_rows, search, vertices
from solvers.rigid.turning import turning

__all__ = ["Obstacle", "RigidContact", "RigidPair"]

#: Singular value relative to the largest, below which forces of contact are redundant.
REDUNDANT = 1e-10

#: Iterates of a step from which on vertices keep their facets. Where corners meet, they go from facet to facet, whose
#: normals differ, without end. Most steps end before.
KEPT = 4


class RigidContact:
    """All pairs. Arrays have the shape (m, ...): the vertices that are near the other side at the latest `measure`."""

    def __init__(
        self,
        bodies: Sequence[RigidBody],
        pairs: Sequence[RigidPair],
        *,
        restitution: float = 0.0,
        standoff: float = 0.0,
        periods: Array | None = None,
    ):
        """standoff: gap [m] that contact leaves open, so that a flow between the bodies stays connected.

        periods: lengths [m] after which space repeats, infinite where it does not, shape (dim,); None: nowhere.
        """
        self.bodies, self.pairs, self.restitution, self.standoff = list(bodies), list(pairs), restitution, standoff
        self._periods = periods
        self._starts = np.cumsum([0] + [vertices(bodies, pair) for pair in pairs]).tolist()
        self._unknowns = len(bodies) * (3 if bodies[0].dim == 2 else 6)
        self._moment: Moment | None = None
        self._components = np.empty(0, dtype=np.int64)
        self.near = Near.joined([], bodies[0].dim)
        self.touch = Touch(np.empty((0, 2, bodies[0].dim, 1)), self.near.body, self.near.friction)
        self.z = np.zeros_like(self.near.x)  #: forces [N] in the frames, the pressing one first
        self.stiffness = nothing((self._unknowns, self._unknowns))  #: minus the derivative of `force`, forces turning
        self._missed = self.z  #: what contacts miss at the last press [N]
        self.tangent = self.stiffness  #: of the bodies, that the forces of the last `press` belong to
        self._start: Array | None = None  # forces in the frames at the last press of this step
        self._measured = 0  # in this step
        self._pressing = self.near.names(), self.near.x  # names and forces [N] in space at the last press

    def begin_step(self) -> None:
        """Nothing is known of the contact forces."""
        self._pressing, self._measured = (self.near.names()[:0], self.near.x[:0]), 0

    def end_prediction(self) -> None:
        """Facets may change again; the contact forces are a guess."""
        self._measured = 0

    def forget(self) -> None:
        """No contact forces, until `press`."""
        self.z = self._missed = np.zeros_like(self.z)

    @property
    def force(self) -> Array:
        """Generalised contact force: force [N] and moment [N m] by unknown."""
        return self.touch.force(self.z, self._unknowns) if len(self.z) else np.zeros(self._unknowns)

    def rounding(self) -> Array:
        """Errors of `force`, by unknown: vertices that lie side by side need not agree on the motion of their body.

        No more than `FORCE_ROUNDING` of the forces: a body that misses more is not in balance.
        """
        if len(self.z) == 0:
            return np.zeros(self._unknowns)
        sizes = Touch(np.abs(self.touch.pushed), self.touch.body, self.touch.friction)
        return sizes.force(np.minimum(np.abs(self._missed), FORCE_ROUNDING * np.abs(self.z).max()), self._unknowns)

    @property
    def whole_force(self) -> Array:
        """The same with that on held unknowns, which the bodies do not feel."""
        return self._of_all(self.near).force(self.z, self._unknowns) if len(self.z) else np.zeros(self._unknowns)

    @property
    def active(self) -> NDArray[np.bool_]:
        """Mask of the near vertices in contact, shape (m,)."""
        return self.z[:, 0] > 0.0

    def touching(self) -> NDArray[np.bool_]:
        """Mask of the vertices in contact, of all pairs: those of the body, then those of the other side."""
        found = np.zeros(self._starts[-1], dtype=bool)
        found[self.near.vertex[self.active] % len(found)] = True
        return found

    def measure(self, moment: Moment, components: NDArray[np.int64], free: NDArray[np.bool_]) -> None:
        """Set gaps and their derivatives at the end of a step.

        components: the unknowns of a body among `COMPONENTS`; free: mask of the unknowns that are not held.
        """
        self._moment, self._components = moment, components
        kept = self.near if self._measured >= KEPT else None
        self.near = search(self.pairs, self._starts, moment, kept, self._periods)
        self._measured += 1
        self.touch = self.near.touch(moment, components, free)
        self.z = self._missed = np.zeros_like(self.near.x)
        known, forces = self._pressing
        at, of = same_rows(self.near.names(), known)
        if len(at):
            self.stiffness = -turning(self.near[at], forces[of], moment, components, free)
            self._start = np.zeros_like(self.z)
            self._start[at] = np.einsum("mde,me->md", self.near.frame[at], forces[of])
        else:
            self._start = None
            self.stiffness = nothing((self._unknowns, self._unknowns))

    def _ways(self) -> Array:
        """Gaps beyond the standoff, and ways along the surface in the step [m], shape (m, dim)."""
        ways = self.near.in_frame(self.near.carried)
        moves = (self.touch.B[:, :, 0] != 0.0).any(axis=(1, 2))  # else nothing can open it
        ways[:, 0] = self.near.gap - np.where(moves, self.standoff, 0.0)
        return ways

    def press(self, tangent: Sparse, upright: Callable[[], Sparse], right: Array) -> None:
        """Set the contact forces for a Newton iteration; right: minus the balance without contact.

        When the balance with these forces vanishes, gaps and forces fulfil the conditions of contact. Where forces that
        turn are larger than what the inertia of the bodies and the contacts of the last iterate hold upright, the
        tangent is `upright`: that in which forces of contact and of a flow do not turn.
        """
        self.tangent = tangent
        if len(self.z) == 0:
            return
        turning = positive_definite(tangent) or (self._start is not None and braced(tangent, self.touch, self._start))
        try:
            self._press(tangent if turning else upright(), right)
        except StepFailed:
            if not turning:
                raise
            self._press(upright(), right)
        active = self.active
        in_space = np.einsum("mde,md->me", self.near.frame[active], self.z[active])
        self._pressing = self.near.names()[active], in_space

    def _press(self, tangent: Sparse, right: Array) -> None:
        self.tangent = tangent
        _, self.z, self._missed = contact_forces(tangent, right, self.touch, self._ways(), self._start)

    def transformation(self) -> RowTransformation | None:
        """Transformation that eliminates the forces from J du = b + F z with C du = -c; None without contact.

        C has the normals, and the tangents of contacts that stick; F has the forces, with friction of those that slide.
        With S = C K^-1 F: rows L = 1 - F S^-1 C K^-1, added A = F S^-1 C, right -F S^-1 c. Any regular K will do.
        """
        active = self.active
        if not active.any():
            return None
        touch, z = self.touch[active], self.z[active]
        unknowns, dim = self._unknowns, z.shape[1]
        stuck = np.linalg.norm(z[:, 1:], axis=1) < AT_BOUND * touch.friction * z[:, 0]
        slide = np.where(stuck[:, None], 0.0, z[:, 1:] / z[:, :1])
        kept = np.flatnonzero(np.concatenate([np.ones((len(z), 1), bool), np.tile(stuck[:, None], dim - 1)], 1).ravel())
        C = touch.rows(unknowns)[kept].toarray()
        F = touch.sliding(slide).rows_of_force(unknowns)[kept].toarray().T
        c = self._ways()[active].ravel()[kept]
        dofs = np.unique(touch.dofs()[touch.body >= 0])
        C, F = C[:, dofs], F[dofs]
        number = np.full(unknowns, -1)
        number[dofs] = np.arange(len(dofs))
        K = self.tangent[dofs].columns(dofs).toarray()
        through = np.linalg.solve(K.T, C.T).T
        back = F @ np.linalg.pinv(through @ F, rcond=REDUNDANT)
        n = len(dofs)
        return RowTransformation(
            dofs=dofs,
            rows=_entries(np.eye(n) - back @ through),
            stiffness=nothing((n, n)),
            added=_entries(back @ C),
            right=-back @ c,
            replaced=np.ones(n, dtype=bool),
        )

    def closed(self, mass: Sparse, without: Array, force: Array, gyroscopic: Array) -> Closed:
        """The contacts that are closed; all by unknown, see `Closed`; without: velocities, also of held unknowns."""
        near, touch = self.near[self.active], self.touch[self.active]
        assert self._moment is not None
        given = near.in_frame(near.given) / self._moment.dt + self._of_all(near).motion(without) - touch.motion(without)
        return Closed(near, touch, self.z[self.active], self._moment, mass, given, force, gyroscopic)

    @property
    def given(self) -> list[str]:
        """Names of the obstacles and walls."""
        return list(dict.fromkeys(pair.other.name for pair in self.pairs if not isinstance(pair.other, int)))

    def on_given(self, name: str, body: int | None = None) -> Array:
        """Force [N] on an obstacle or wall, averaged over the step, shape (dim,); body: index, None: of all bodies."""
        near, z = self.near[self.active], self.z[self.active]
        number = np.searchsorted(self._starts, near.vertex % self._starts[-1], side="right") - 1
        counts = [
            not isinstance(pair.other, int) and pair.other.name == name and body in (None, pair.body)
            for pair in self.pairs
        ]
        forces = np.einsum("mde,md->me", near.frame, z)  # on what has the vertex
        return np.asarray((forces * np.where(near.body[:, :1] < 0, 1.0, -1.0))[np.array(counts)[number]].sum(axis=0))

    def _of_all(self, near: Near) -> Touch:
        """Relative motions by all unknowns, those that are held, too."""
        assert self._moment is not None
        return near.touch(self._moment, self._components, np.ones(self._unknowns, dtype=bool))

    def numbers(self, forces: Array) -> dict[str, float]:
        """Columns of the history; forces: on each body [N], shape (bodies, dim)."""
        found = {"contact.active": float(self.active.sum())}
        for body, force in zip(self.bodies, forces, strict=True):
            found |= {f"contact.on_{body.name}.{axis}": float(f) for axis, f in zip("xyz", force, strict=False)}
        return found


def _entries(values: Array) -> Sparse:
    rows, columns = np.nonzero(values)
    return sparse_from_entries(rows, columns, values[rows, columns], (len(values), values.shape[1]))
