"""The interface `TimeScheme` of structures, and statics, the scheme without inertia."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array, StepInfo
from solvers.structure.held import Held
from solvers.structure.instant import MovingStructure
from solvers.structure.rayleigh import RayleighDamping


class SettlingStructure(MovingStructure, Protocol):
    """A structure that can solve for its initial state."""

    def by(self, time: TimeScheme, held: Held, t: float, dt: float) -> AbstractContextManager[None]:
        """A step to the same time t by another scheme and with other supports."""
        ...

    def solve(self) -> StepInfo:
        """Solve the step. Raises StepFailed."""
        ...


class ExchangingStructure(SettlingStructure, Protocol):
    """A structure whose massless nodes may change between steps."""

    exchanges_mass: bool

    def at_constraint(self, owned: Array) -> Array:
        """Values at the nodes of the constraint, shape (N, dim) (collective)."""
        ...

    def forget_mass(self) -> None:
        """Find the massless nodes anew, and all that follows from them."""
        ...

    def assemble(self) -> None:
        """Compute forces at the present displacement."""
        ...


class TimeScheme(Protocol):
    """A scheme without state of its own: results depend on the structure at both ends of the step only."""

    @property
    def force_weight(self) -> float:
        """Weight w of the forces at the end of the step in the balance; those at its start have 1 - w."""
        ...

    def massless(self, structure: MovingStructure) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Owned dofs without mass, and those of pieces that touch with nodes that have mass."""
        ...

    def create_damping(self, structure: MovingStructure) -> RayleighDamping | None:
        """The damping of a structure; None without damping."""
        ...

    def damping_slope(self, structure: MovingStructure, dt: float) -> Array | None:
        """Derivative of the weighted velocity of damping by the displacement [1/s]; None: there is no damping."""
        ...

    def start(self, structure: SettlingStructure, t: float, dt: float) -> None:
        """Set velocity and acceleration at the start."""
        ...

    def prepare(self, structure: ExchangingStructure, t: float, dt: float) -> None:
        """Prepare a step from t to t + dt [s], before its start is stored. Raises StepFailed."""
        ...

    def extrapolation(self, structure: ExchangingStructure, t: float, dt: float) -> Array:
        """Factor of the change of velocity of massless dofs in a step from t to t + dt [s], at owned dofs."""
        ...

    def guess(self, structure: MovingStructure, dt: float) -> Array:
        """Predictor: increment [m] of the displacement in a step of length dt, at owned dofs."""
        ...

    def motion(self, structure: MovingStructure, dt: float) -> tuple[Array, Array]:
        """(velocity [m/s], acceleration [m/s^2]) for the present displacement in a step of length dt."""
        ...

    def rigid_force(self, structure: MovingStructure, dt: float) -> Array:
        """The inertia force [N] that the moved mass lacks, for the present motion in a step of length dt."""
        ...

    def rigid_factor(self, dt: float) -> float:
        """Derivative of this force in the balance by the mass that is lacking times the displacement [1/s^2]."""
        ...

    def balance(self, structure: MovingStructure) -> Array:
        """The residual [N] at the present iterate."""
        ...

    def averaged_load(self, structure: MovingStructure) -> Array:
        """The balance [N] without loads of another field, with all forces averaged over the step."""
        ...

    def dynamic_stiffness(self, structure: MovingStructure, dt: float) -> PETSc.Mat | None:
        """D in d(balance)/du = force_weight K + D, K the static stiffness; None if it is zero."""
        ...

    def reaction(self, structure: MovingStructure) -> Array:
        """The out-of-balance force [N] at the present time, which supports carry."""
        ...

    def averaged(self, before: Array, after: Array) -> Array:
        """The mean of loads [N] at both ends of the step that does work in it."""
        ...

    def damping_force(self, structure: MovingStructure) -> Array:
        """The force of damping [N] in the balance of the step."""
        ...

    def support_forces(self, structure: MovingStructure) -> tuple[Array, Array]:
        """Forces [N] of supports at both ends of the step, whose mean does work on its displacement."""
        ...

    def stopping_force(self, structure: MovingStructure) -> Array:
        """Force of inertia [N] in the balance if nothing moved in the step, at owned dofs; zero without inertia."""
        ...

    def kinetic_energy(self, structure: MovingStructure) -> float:
        """Kinetic energy [J]."""
        ...

    @property
    def dissipates(self) -> bool:
        """Whether it loses energy by the user's choice."""
        ...


class Statics:
    """f_int(u) = f_ext(t): every time step is a load step."""

    force_weight = 1.0
    dissipates = True  #: a state without equilibrium nearby jumps to another one

    def massless(self, structure: MovingStructure) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)

    def create_damping(self, structure: MovingStructure) -> RayleighDamping | None:
        return None

    def damping_slope(self, structure: MovingStructure, dt: float) -> Array | None:
        return None

    def start(self, structure: SettlingStructure, t: float, dt: float) -> None: ...

    def prepare(self, structure: ExchangingStructure, t: float, dt: float) -> None: ...

    def extrapolation(self, structure: ExchangingStructure, t: float, dt: float) -> Array:
        return np.zeros(structure.layout.size)

    def guess(self, structure: MovingStructure, dt: float) -> Array:
        return np.zeros(structure.layout.size)

    def motion(self, structure: MovingStructure, dt: float) -> tuple[Array, Array]:
        return structure.now.v, structure.now.a

    def rigid_force(self, structure: MovingStructure, dt: float) -> Array:
        return structure.now.rigid

    def rigid_factor(self, dt: float) -> float:
        return 0.0

    def balance(self, structure: MovingStructure) -> Array:
        return self.reaction(structure)

    def averaged_load(self, structure: MovingStructure) -> Array:
        return structure.now.internal - structure.now.loads - structure.now.constraint

    def dynamic_stiffness(self, structure: MovingStructure, dt: float) -> PETSc.Mat | None:
        return None

    def reaction(self, structure: MovingStructure) -> Array:
        return structure.now.internal - structure.now.external - structure.now.constraint

    def support_forces(self, structure: MovingStructure) -> tuple[Array, Array]:
        old = structure.old
        return old.internal - old.external - old.constraint, self.reaction(structure)

    def averaged(self, before: Array, after: Array) -> Array:
        return 0.5 * (before + after)

    def damping_force(self, structure: MovingStructure) -> Array:
        return np.zeros(structure.layout.size)

    def stopping_force(self, structure: MovingStructure) -> Array:
        return np.zeros(structure.layout.size)

    def kinetic_energy(self, structure: MovingStructure) -> float:
        return 0.0
