"""Compiled forms, measures and assembly."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import cpp, fem, jit
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array
from solvers.fem.domain import Domain
from solvers.fem.quiet import quiet

#: A process that waits for another one to compile the same form is patient.
COMPILE_OPTIONS = {"cffi_extra_compile_args": ["-O3", "-march=native"], "timeout": 300}


def compile_form(form: ufl.Form) -> fem.FormMetaClass:
    """Compile a UFL form for this machine (cached on disk)."""
    with quiet():
        return fem.form(form, jit_params=COMPILE_OPTIONS)


class Integral:
    """A compiled form whose integration domain may change without looking at the form again.

    `on` takes the local cells or facets of every integral type that the form has: cell, exterior_facet, interior_facet.
    """

    def __init__(self, domain: Domain, form: ufl.Form):
        self.domain = domain
        with quiet():
            self._compiled, self._module, _ = jit.ffcx_jit(domain.comm, form, jit_params=COMPILE_OPTIONS)
        coefficients = form.coefficients()
        order = [self._compiled.original_coefficient_position[i] for i in range(self._compiled.num_coefficients)]
        self._coefficients = [coefficients[i]._cpp_object for i in order]
        self._constants = [constant._cpp_object for constant in form.constants()]
        self._spaces = [argument.ufl_function_space()._cpp_object for argument in form.arguments()]

    def on(self, **entities: NDArray[np.int32]) -> cpp.fem.Form_float64:
        """The form over sorted local entities; measures must carry the subdomain number 1."""
        mesh = self.domain.mesh
        types = {"cell": self.domain.dim, "exterior_facet": self.domain.dim - 1, "interior_facet": self.domain.dim - 1}
        tags = {
            getattr(cpp.fem.IntegralType, name): cpp.mesh.MeshTags_int32(
                mesh._mesh, types[name], np.asarray(local, dtype=np.int32), np.ones(len(local), dtype=np.int32)
            )
            for name, local in entities.items()
        }
        pointer = self._module.ffi.cast("uintptr_t", self._module.ffi.addressof(self._compiled))
        return cpp.fem.create_form_float64(
            int(pointer), self._spaces, self._coefficients, self._constants, tags, mesh._mesh
        )


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


def assemble_scalar(form: fem.FormMetaClass, comm: MPI.Comm) -> float:
    """Sum of a functional over all processes."""
    return comm.allreduce(fem.assemble_scalar(form), op=MPI.SUM)


def mean_cell_size(domain: Domain) -> float:
    """(volume / number of cells)^(1/dim) [m] (collective)."""
    volume = assemble_scalar(compile_form(constant(domain, 1.0) * volume_measure(domain, 1)), domain.comm)
    return float((volume / domain.mesh.topology.index_map(domain.dim).size_global) ** (1.0 / domain.dim))


def assemble_vector(form: fem.FormMetaClass, out: Array) -> None:
    """Add a linear form to a local array (owned and ghost dofs); ghost contributions stay where they are."""
    cpp.fem.assemble_vector(out, form, cpp.fem.pack_constants(form), cpp.fem.pack_coefficients(form))


def create_matrix(form: fem.FormMetaClass) -> PETSc.Mat:
    """An empty matrix with the sparsity of a bilinear form."""
    return fem.petsc.create_matrix(form)


def assemble_matrix(matrix: PETSc.Mat, form: fem.FormMetaClass) -> None:
    """Add a bilinear form to a matrix, without finishing it (`matrix.assemble()`)."""
    cpp.fem.petsc.assemble_matrix(
        matrix, form, cpp.fem.pack_constants(form), cpp.fem.pack_coefficients(form), [], False
    )


def compile_expression(expression: ufl.core.expr.Expr, points: Array) -> fem.Expression:
    """Compile a UFL expression for evaluation at reference points of cells."""
    with quiet():
        return fem.Expression(expression, points, jit_params=COMPILE_OPTIONS)
