"""Velocities and accelerations of rigid bodies in contact at the end of a step, with Coulomb's friction.

Impulses act where there is contact. Away from the other side, velocities are then at least the restitution times those
towards it before; along it, the impulse opposes the sliding after it (Moreau's impact law). Accelerations are those of
the forces at the end of the step: contacts that stay closed do not accelerate towards each other, and friction opposes
the velocity or, where that is zero, the acceleration.
Rigid bodies with friction may have no finite acceleration: the friction of a sliding contact may press it down harder
than the normal force lifts it (Painleve's paradox).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse
from solvers.api import Array, FailureKind, StepFailed
from solvers.rigid.coulomb import Touch, contact_forces
from solvers.rigid.near import Moment, Near

#: Share of the bound of friction above which a contact slides.
AT_BOUND = 1.0 - 1e-9


@dataclass(frozen=True)
class Closed:
    """Contacts at the end of a step, and the bodies there."""

    near: Near
    touch: Touch
    z: Array  #: forces of the step [N] in the frames, shape (m, dim), near those that are sought
    moment: Moment
    mass: Sparse  #: of all unknowns, with rows and columns of the identity for held ones
    given: Array  #: relative velocities by motions that are prescribed [m/s], in the frames, shape (m, dim)
    force: Array  #: without contact, at the end of the step [N, N m], by unknown
    gyroscopic: Array  #: moments w x J w [N m], by unknown

    def relative(self, v: Array) -> Array:
        """Relative velocities [m/s] in the frames, shape (m, dim)."""
        return self.touch.motion(v) + self.given

    def after(self, before: Array, without: Array, restitution: float) -> tuple[Array, Array]:
        """(velocities, rates of momentum) by unknown; before: velocities at the start; without: without impulses."""
        rebound = -restitution * np.minimum(self.relative(before)[:, 0], 0.0)
        offset = self.given.copy()
        offset[:, 0] -= rebound
        velocity, impulse, _ = contact_forces(
            self.mass, self.mass @ without, self.touch, offset, self.moment.dt * self.z
        )
        self._require_forces(before, self.moment.dt)
        staying = (rebound == 0.0) & (impulse[:, 0] > 0.0)
        ways = np.where(self._slide(impulse)[:, None], impulse[:, 1:] / np.maximum(impulse[:, :1], 1e-300), 0.0)
        return velocity, self._rate(velocity, ways, staying)

    def _slide(self, impulse: Array) -> NDArray[np.bool_]:
        bound = self.touch.friction * impulse[:, 0]
        return np.linalg.norm(impulse[:, 1:], axis=1) >= AT_BOUND * bound

    def _rate(self, velocity: Array, slope: Array, staying: NDArray[np.bool_]) -> Array:
        """Rates of momentum [N, N m] by unknown; slope: friction over normal force of contacts that slide."""
        if not staying.any():
            return self.force
        offset = self._curvature(velocity)[staying]
        slides = slope.any(axis=1)
        free = Touch(self.touch.B, self.touch.body, np.where(slides, 0.0, self.touch.friction))
        touch = free.sliding(slope)[staying]
        for tried in (offset, np.zeros_like(offset)):  # bodies that are wedged may have none that fit their rotation
            try:
                z = contact_forces(self.mass, self.force - self.gyroscopic, touch, tried, self.z[staying])[1]
            except StepFailed as error:
                failed = error
                continue
            return self.force + touch.force(z, len(self.force))
        if not (staying & slides).any():
            raise failed
        raise StepFailed("rigid bodies", FailureKind.JAMMED, self._paradox(staying & slides))

    def _paradox(self, sliding: NDArray[np.bool_]) -> str:
        names = [self.moment.bodies[index].name for index in np.unique(self.near.body[sliding]) if index >= 0]
        return (
            f"no contact force holds {' and '.join(repr(name) for name in names)}: rigid bodies that slide with so much"
            " friction jam (Painleve's paradox)"
        )

    def _require_forces(self, before: Array, dt: float) -> None:
        """Raise StepFailed where contacts that slide at the start of the step have no finite forces."""
        speed = self.relative(before)
        along = np.linalg.norm(speed[:, 1:], axis=1)
        reached = dt * np.abs(self.touch.motion(self._accelerations(self.force - self.gyroscopic))[:, 0])
        staying = -speed[:, 0] <= reached  # else it is an impact, which has an impulse
        slides = staying & (along > reached) & (self.touch.friction > 0.0)
        if not slides.any():
            return
        slope = np.where(
            slides[:, None], -self.touch.friction[:, None] * speed[:, 1:] / np.maximum(along, 1e-300)[:, None], 0.0
        )
        touch = self.touch.sliding(slope)[slides]
        if (self._response(touch) < 0.0).any():
            self._rate(before, slope, staying)

    def _response(self, touch: Touch) -> Array:
        """Acceleration [m/s^2] away from the other side by a unit of force, shape (m,)."""
        k, n = touch.B.shape[3], len(self.force)
        inverse = np.linalg.inv(self._blocks(n // k, k))
        body = np.maximum(touch.body, 0)
        return np.einsum("msk,mskl,msl->m", touch.B[:, :, 0], inverse[body], touch.pushed[:, :, 0])

    def _accelerations(self, force: Array) -> Array:
        k, n = self.touch.B.shape[3], len(force)
        return np.linalg.solve(self._blocks(n // k, k), force.reshape(-1, k, 1)).ravel()

    def _blocks(self, count: int, k: int) -> Array:
        found = np.zeros((count, k, k))
        rows, columns = self.mass.row_numbers(), self.mass.indices
        found[rows // k, rows % k, columns % k] = self.mass.data
        return found

    def _curvature(self, velocity: Array) -> Array:
        """Relative accelerations [m/s^2] by the velocities alone, in the frames."""
        dim = self.near.x.shape[1]
        arms = self.near.arms(self.moment)
        spins = self._spins(velocity)[np.maximum(self.near.body, 0)] * (self.near.body >= 0)[:, :, None]
        swept = np.cross(spins, np.cross(spins, arms))
        found = self.near.in_frame((swept[:, 0] - swept[:, 1])[:, :dim])
        sliding = np.einsum("mde,md->me", self.near.frame, self.relative(velocity))
        along = np.cross(spins[:, 1], np.pad(sliding, ((0, 0), (0, 3 - dim))))[:, :dim]
        found[:, 0] -= 2.0 * np.einsum("md,md->m", self.near.frame[:, 0], along)
        return found

    def _spins(self, velocity: Array) -> Array:
        """Angular velocities in space [rad/s], shape (bodies, 3)."""
        by_body = velocity.reshape(len(self.moment.bodies), -1)
        return by_body[:, 3:] if by_body.shape[1] == 6 else np.pad(by_body[:, 2:], ((0, 0), (2, 0)))
