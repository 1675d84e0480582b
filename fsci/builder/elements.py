"""The element of each elastic body: mixed where the volume hardly changes, if its cells have that element."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fsci.case import Case
from fsci.case.material import OwnLawSection
from solvers.api import Array
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.structure.elastic_constants import lambda_of_bulk, poisson
from solvers.values import evaluate

if TYPE_CHECKING:
    from solvers.structure.elements import Formulation

#: Poisson's ratio from which on the error of first-order displacement elements in bending is over twice that at 0.3.
LOCKING = 0.45


@dataclass(frozen=True)
class ChosenElement:
    """The element of a body, and what to say of it."""

    element: Formulation
    note: str = ""  #: that the program has chosen the mixed one
    warning: str = ""  #: that its cells lock


def choose_element(case: Case, name: str, mesh: Mesh) -> ChosenElement:
    """The element of a body with this mesh: what its case says, else by Poisson's ratio. Raises CaseError."""
    given = case.elastic_bodies[name].element
    if given == "mixed":
        return ChosenElement("mixed")
    if (nu := nearly_incompressible(case, name, mesh)) is None:
        return ChosenElement("displacement")
    kind = CELL_TYPES[mesh.cell_type]
    if given == "auto" and not kind.shape.simplex:
        return ChosenElement("mixed", note=f"mixed element for nearly incompressible material (nu = {nu:.4g})")
    if kind.degree > 1:
        return ChosenElement("displacement")
    remedy = "take 'order: 2'" if kind.shape.simplex else "take 'element: auto'"
    locks = f"first-order cells lock for nearly incompressible material (nu = {nu:.4g}); {remedy}"
    return ChosenElement("displacement", warning=locks)


def nearly_incompressible(case: Case, name: str, mesh: Mesh) -> float | None:
    """The largest Poisson's ratio of a body if cells may lock at it, else None. Raises CaseError."""
    assert case.structure is not None
    if mesh.points.shape[1] == 2 and case.structure.plane == "stress":
        return None
    nu = float(np.max(poisson(*lame_at_cells(case, name, mesh))))
    return nu if nu >= LOCKING else None


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
