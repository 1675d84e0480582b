"""Active stress along fibres, as of muscles: S = T a a, with a unit direction a of the undeformed body.

It is the second Piola-Kirchhoff stress, so that the force per reference area along a fibre is T times its stretch. For
the balance it is a load, -int T (F a) . (grad v a) dX, since its energy comes from outside.
Source: Land et al., Proc. R. Soc. A 471 (2015) 20150641, section 2(c).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import ufl
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array
from solvers.structure.materials import Tensor
from solvers.values import Value, evaluate, evaluate_components


@dataclass(frozen=True)
class Active:
    """Tension along fibres."""

    direction: Sequence[Value]  #: of the fibres in the undeformed body, of any length
    stress: Value  #: T [Pa]


class ActiveStress:
    """Forces and tangent of an active stress; the interface is that of `FollowerPressure`."""

    def __init__(self, domain: fem.Domain, space, active: Active, degree: int):
        """degree: of the quadrature rule."""
        self._dim, self._active = domain.dim, active
        self._points = np.ascontiguousarray(fem.block_points(space)[: domain.dim].T)
        [self._of_cells] = fem.cell_quadrature(domain, space, degree)
        cells = self._of_cells
        to_reference = np.linalg.inv(cells.tangents(self._points))
        a = _unit(evaluate_components(active.direction, cells.positions, 0.0)).T
        along = np.einsum("epkd,epd->epk", to_reference, a.reshape(*cells.weights.shape, -1))
        #: derivative of each shape function along the fibre [1/m], shape (cells, points, nodes)
        self._along = np.einsum("pnk,epk->epn", cells.slopes, along)
        self._tension = np.zeros_like(cells.weights)
        self._nodal = fem.function(fem.scalar_space(domain))
        self._nodes = fem.block_points(self._nodal.function_space)
        self._directions = [fem.function(self._nodal.function_space) for _ in range(domain.dim)]
        for function, values in zip(
            self._directions, _unit(evaluate_components(active.direction, self._nodes, 0.0)), strict=True
        ):
            function.x.array[:] = values

    def set_time(self, t: float) -> None:
        """Evaluate the stress at the time t [s]."""
        self._tension = evaluate(self._active.stress, self._of_cells.positions, t).reshape(self._tension.shape)
        self._nodal.x.array[:] = evaluate(self._active.stress, self._nodes, t)

    def add_force(self, u: Array, out: Array) -> None:
        """Add -int T (F a) . (grad v a) dX [N] at the displacement u [m] to local dofs, shape (local dofs,)."""
        cells, x = self._of_cells, self._points + u.reshape(-1, self._dim)
        fibre = np.einsum("epn,end->epd", self._along, x[cells.blocks])
        forces = -np.einsum("ep,epn,epd->end", cells.weights * self._tension, self._along, fibre)
        np.add.at(out.reshape(-1, self._dim), cells.blocks, forces)

    def add_tangent(self, u: Array, matrix: PETSc.Mat) -> None:
        """Add the derivative of the negative force by u [N/m]; the matrix is not assembled."""
        cells, eye = self._of_cells, np.eye(self._dim)
        nodes = np.einsum("ep,epn,epm->enm", cells.weights * self._tension, self._along, self._along)
        dofs = self._dim * cells.blocks[:, :, None] + np.arange(self._dim, dtype=np.int32)
        rows = dofs.reshape(len(dofs), -1).astype(PETSc.IntType)
        block = np.einsum("enm,ij->enimj", nodes, eye).reshape(len(rows), rows.shape[1], rows.shape[1])
        matrix.setValuesLocalRCV(rows, rows, np.ascontiguousarray(block), addv=True)

    def potential(self, F: Tensor, *, linear: bool) -> Tensor:
        """A density [J/m^3] with this stress as its derivative, at any point; T and a are interpolated from nodes."""
        a = ufl.as_vector([*self._directions, 0][: F.ufl_shape[0]])
        fibre = F * a
        return self._nodal * (ufl.inner(a, fibre) if linear else ufl.inner(fibre, fibre) / 2)


def _unit(vectors: Array) -> Array:
    """Vectors of length 1, shape (components, n)."""
    return vectors / np.linalg.norm(vectors, axis=0)
