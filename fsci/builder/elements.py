"""The element of each elastic body: mixed where the volume hardly changes, and what its cells cannot follow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fsci.case import Case
from fsci.case.material import OwnLawSection
from fsci.case.solid_order import is_meshed_here
from fsci.meshes.slender import bending_error
from solvers.api import Array
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.structure.elastic_constants import lambda_of_bulk, poisson
from solvers.values import evaluate

if TYPE_CHECKING:
    from solvers.structure.elements import Formulation

#: Poisson's ratio from which on the error of first-order displacement elements in bending is over twice that at 0.3.
LOCKING = 0.45

#: Relative rounding error of a Poisson's ratio by way of other constants; without it the unit of E decides at 0.45.
ROUNDING_OF_RATIO = 1e-12

#: Error in bending from which on the cells of a body deserve a warning.
TOO_STIFF = 0.05


@dataclass(frozen=True)
class ChosenElement:
    """The element of a body, and what to say of it."""

    element: Formulation
    notes: tuple[str, ...] = ()  #: that the program has chosen the mixed one
    warnings: tuple[str, ...] = ()  #: that its cells lock


def choose_element(case: Case, name: str, mesh: Mesh) -> ChosenElement:
    """The element of a body with this mesh: what its case says, else by Poisson's ratio. Raises CaseError."""
    settings, kind = case.elastic_bodies[name], CELL_TYPES[mesh.cell_type]
    notes, warnings = [], []
    nu = None if settings.element == "mixed" else nearly_incompressible(case, name, mesh)
    mixed = settings.element == "mixed" or (nu is not None and settings.element == "auto" and not kind.shape.simplex)
    if nu is not None and mixed:
        notes.append(f"mixed element for nearly incompressible material (nu = {nu:.4g})")
    if nu is not None and not mixed and kind.degree == 1:
        remedy = "take 'order: 2'" if kind.shape.simplex else "take 'element: auto'"
        locks = f"first-order cells lock for nearly incompressible material (nu = {nu:.4g}); {remedy}"
        warnings.append(locks)
    elif stiff := _too_stiff(case, name, mesh):
        # who gives the order has chosen it; who gives a file may not know
        (notes if "order" in settings.mesh.model_fields_set else warnings).append(stiff)
    return ChosenElement("mixed" if mixed else "displacement", tuple(notes), tuple(warnings))


def _too_stiff(case: Case, name: str, mesh: Mesh) -> str:
    """That first-order cells bend too little; nothing below TOO_STIFF."""
    nu = float(np.clip(poisson(*lame_at_cells(case, name, mesh)), 0.0, LOCKING).mean())
    error = bending_error(mesh, nu)
    if error < TOO_STIFF:
        return ""
    by = f"about {100 * error:.2g} %" if error < 1.0 else f"{1.0 + error:.2g} times"
    remedy = "'order: 2'" if is_meshed_here(case.elastic_bodies[name].mesh) else "cells of second order"
    return f"first-order cells make it {by} too stiff in bending; take {remedy}"


def nearly_incompressible(case: Case, name: str, mesh: Mesh) -> float | None:
    """The largest Poisson's ratio of a body if cells may lock at it, else None. Raises CaseError."""
    assert case.structure is not None
    if mesh.points.shape[1] == 2 and case.structure.plane == "stress":
        return None
    nu = float(np.max(poisson(*lame_at_cells(case, name, mesh))))
    return nu if nu >= LOCKING * (1.0 - ROUNDING_OF_RATIO) else None


def lame_at_cells(case: Case, name: str, mesh: Mesh) -> tuple[Array, Array]:
    """(mu, lambda) [Pa] of a body at small strains in the middles of its cells, shape (cells,); of the mean parameters
    of a law in a file of the user. Raises CaseError."""
    law = case.elastic_bodies[name].material
    middles = mesh.points[mesh.cells].mean(axis=1).T
    if isinstance(law, OwnLawSection):
        from fsci.builder.own_law import own_law_at_rest

        rest = own_law_at_rest(case, name, middles)
        return np.array([rest.mu]), np.array([lambda_of_bulk(rest.mu, rest.bulk)])
    mu, lmbda = law.lame
    return evaluate(mu, middles, 0.0), evaluate(lmbda, middles, 0.0)
