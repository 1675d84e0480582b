"""The reference of cases/cook_membrane, by Taylor-Hood triangles of fourth order and nothing of this program.

The rise of the corner converges slowly on equal cells, because the shear on the right edge ends there at once; these
cells get smaller towards all corners.
"""

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import LinearProblem
from mpi4py import MPI

from fsci.bench.family import CASES
from fsci.case import load_case

E, SHEAR, ORDER, GRADING = 70.0, 6.25, 4, 5


def towards_both_ends(x):
    return np.where(x < 0.5, 0.5 * (2 * x) ** GRADING, 1 - 0.5 * (2 * (1 - x)) ** GRADING)


def corner(poisson, cells):
    """Displacement of the corner (48, 60); of its formulation u, p with p = lambda div u."""
    square = mesh.create_unit_square(MPI.COMM_SELF, cells, cells)
    s, t = (towards_both_ends(x) for x in square.geometry.x[:, :2].T)
    square.geometry.x[:, 0] = 48 * s
    square.geometry.x[:, 1] = 44 * s * (1 - t) + (44 + 16 * s) * t
    cell = square.ufl_cell()
    element = ufl.MixedElement([ufl.VectorElement("P", cell, ORDER), ufl.FiniteElement("P", cell, ORDER - 1)])
    space = fem.FunctionSpace(square, element)
    (u, p), (v, q) = ufl.TrialFunctions(space), ufl.TestFunctions(space)
    shear, bulk = E / (2 * (1 + poisson)), E * poisson / ((1 + poisson) * (1 - 2 * poisson))
    stress = 2 * shear * ufl.sym(ufl.grad(u)) + p * ufl.Identity(2)
    a = (ufl.inner(stress, ufl.grad(v)) + q * ufl.div(u) - p * q / bulk) * ufl.dx
    right = mesh.locate_entities_boundary(square, 1, lambda x: np.isclose(x[0], 48))
    loaded = mesh.meshtags(square, 1, np.sort(right), np.ones(len(right), dtype=np.int32))
    load = SHEAR * v[1] * ufl.ds(subdomain_data=loaded, subdomain_id=1)
    displacements, _ = space.sub(0).collapse()
    left = mesh.locate_entities_boundary(square, 1, lambda x: np.isclose(x[0], 0))
    held = fem.locate_dofs_topological((space.sub(0), displacements), 1, left)
    support = fem.dirichletbc(fem.Function(displacements), held, space.sub(0))
    options = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}
    found = LinearProblem(a, load, [support], petsc_options=options).solve().sub(0).collapse()
    points = displacements.tabulate_dof_coordinates()[:, :2]
    node = int(np.argmin(np.linalg.norm(points - [48, 60], axis=1)))
    return found.x.array[2 * node : 2 * node + 2]


def test_reference_of_the_case():
    """16 x 16, 24 x 24 and 32 x 32 cells have 27.7540, 27.7552 and 27.7548."""
    (check,) = load_case(CASES / "cook_membrane").verify
    assert corner(0.4999, 16)[1] == pytest.approx(check.reference, rel=5e-5)


def test_a_compressible_panel():
    """Codes of others have 32.20 to 32.28 (CoFEA, benchmark 002)."""
    assert corner(1 / 3, 16)[1] == pytest.approx(32.30, abs=0.01)
