"""The state of a structure that a next step starts from: nodal values by body, energies, contact."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from solvers.api import Array, State
from solvers.mesh.distributed import Nodal
from solvers.structure.energy import EnergyBalance
from solvers.structure.instant import MovingStructure
from solvers.structure.solid_solver import SolidSolver


class SavedStructure(MovingStructure, Protocol):
    """A structure with all that its state consists of; `Structure` is one."""

    energy: EnergyBalance
    solver: SolidSolver

    def forget_mass(self) -> None:
        """Find the massless nodes anew, and all that follows from them."""
        ...


def saved_state(structure: SavedStructure) -> State:
    """The state, by body."""
    state: State = {name: per_body(structure, array) for name, array in vars(structure.now).items()}
    state["last_length"] = structure.last_length
    state["energy"] = structure.energy.save()
    state["linear_solver"] = structure.solver.position
    if relaxing := {body.name: kept for body in structure.bodies if (kept := body.element.save())}:
        state["relaxing"] = relaxing
    if structure.constraint is not None:
        state["contact"] = structure.constraint.save()
    return state


def restore_state(structure: SavedStructure, state: State) -> None:
    """Set what `saved_state` returned."""
    for name, array in vars(structure.now).items():
        array[:] = from_bodies(structure, state[name])
    for body, u in zip(structure.bodies, structure.layout.split(structure.now.u), strict=True):
        body.set_displacement(u)
        body.element.restore(state.get("relaxing", {}).get(body.name, {}))
    if structure.constraint is not None:
        structure.constraint.restore(state["contact"])
        structure.forget_mass()
    structure.inertia.find_frame(structure.now.u)
    structure.energy.restore(state["energy"])
    structure.solver.position, structure.last_length = state["linear_solver"], state["last_length"]


def per_body(structure: MovingStructure, array: Array) -> State:
    """Nodal values by body, from an array of owned dofs."""
    return {
        body.name: Nodal(part.reshape(-1, body.dim).copy(), body.nodes[: body.owned])
        for body, part in zip(structure.bodies, structure.layout.split(array), strict=True)
    }


def from_bodies(structure: MovingStructure, state: State) -> Array:
    """An array of owned dofs, from nodal values by body."""
    return np.concatenate([state[body.name].values.ravel() for body in structure.bodies])
