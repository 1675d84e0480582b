"""Compiled forms, measures and assembly."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array
from solvers.fem.calls import calls
from solvers.fem.domain import Domain
from solvers.fem.quiet import quiet

#: A process that waits for another one to compile the same form is patient.
COMPILE_OPTIONS = {"cffi_extra_compile_args": ["-O3", "-march=native"], "timeout": 300}


def compile_form(form: ufl.Form) -> Any:
    """Compile a UFL form for this machine (cached on disk)."""
    with quiet():
        return calls.compile_form(form, COMPILE_OPTIONS)


class Integral:
    """A compiled form whose integration domain may change without looking at the form again.

    `on` takes the local cells or facets of every integral type that the form has: cell, exterior_facet, interior_facet.
    """

    def __init__(self, domain: Domain, form: ufl.Form):
        with quiet():
            self._compiled = calls.Compiled(domain.mesh, form, COMPILE_OPTIONS)

    def on(self, **entities: NDArray[np.int32]) -> Any:
        """The form over sorted local entities; measures must carry the subdomain number 1."""
        return self._compiled.on(entities)


def measure(domain: Domain, kind: str, degree: int) -> ufl.Measure:
    """dx, ds or dS over entities that `Integral.on` chooses."""
    return ufl.Measure(kind, domain=domain.mesh, subdomain_id=1, metadata={"quadrature_degree": degree})


def surface_measure(domain: Domain, name: str, degree: int) -> ufl.Measure:
    """ds on a named surface; the subdomain number is always 1, so that compiled forms are shared by all cases."""
    facets = domain.surfaces[name]
    tags = dolfinx_mesh.meshtags(domain.mesh, domain.dim - 1, facets, np.ones(len(facets), dtype=np.int32))
    return ufl.Measure(
        "ds", domain=domain.mesh, subdomain_data=tags, subdomain_id=1, metadata={"quadrature_degree": degree}
    )


def volume_measure(domain: Domain, degree: int) -> ufl.Measure:
    """dx with the given quadrature degree."""
    return ufl.Measure("dx", domain=domain.mesh, metadata={"quadrature_degree": degree})


def constant(domain: Domain, value: float) -> fem.Constant:
    """A number that can change without recompiling the form."""
    return fem.Constant(domain.mesh, PETSc.ScalarType(value))


def assemble_scalar(form: Any, comm: MPI.Comm) -> float:
    """Sum of a functional over all processes."""
    return comm.allreduce(fem.assemble_scalar(form), op=MPI.SUM)


def mean_cell_size(domain: Domain) -> float:
    """(volume / number of cells)^(1/dim) [m] (collective)."""
    volume = assemble_scalar(compile_form(constant(domain, 1.0) * volume_measure(domain, 1)), domain.comm)
    return float((volume / domain.mesh.topology.index_map(domain.dim).size_global) ** (1.0 / domain.dim))


def assemble_vector(form: Any, out: Array) -> None:
    """Add a linear form to a local array (owned and ghost dofs); ghost contributions stay where they are."""
    calls.assemble_vector(form, out)


def create_matrix(form: Any) -> PETSc.Mat:
    """An empty matrix with the sparsity of a bilinear form."""
    return calls.create_matrix(form)


def assemble_matrix(matrix: PETSc.Mat, form: Any) -> None:
    """Add a bilinear form to a matrix, without finishing it (`matrix.assemble()`)."""
    calls.assemble_matrix(matrix, form)


def compile_expression(expression: ufl.core.expr.Expr, points: Array) -> fem.Expression:
    """Compile a UFL expression for evaluation at reference points of cells."""
    with quiet():
        return calls.compile_expression(expression, points, COMPILE_OPTIONS)
