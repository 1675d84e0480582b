"""Compiled forms, measures and assembly."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array
from solvers.fem.axis_aligned import axis_aligned
from solvers.fem.calls import calls
from solvers.fem.compiling import compiling
from solvers.fem.domain import Domain

#: Sums may be reordered: newer form compilers write a product per term, and a tangent of the flow takes 24 instead of
#: 59 us per cell once common factors are taken out. Infinities and NaN keep their meaning. Without what only debuggers
#: read (-g0) the compiler takes four fifths of the time. The last name, which the compiler ignores, tells the
#: cache these libraries from Python modules of the same form.
COMPILE_OPTIONS = {
    "cffi_extra_compile_args": [
        "-O3", "-march=native", "-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math", "-g0",
        "-DPLAIN_LIBRARY",
    ]
}  # fmt: skip

#: They differ by a name that the compiler ignores, and the cache does not.
AXIS_ALIGNED_OPTIONS = {key: [*given, "-DAXIS_ALIGNED"] for key, given in COMPILE_OPTIONS.items()}


def compile_form(form: ufl.Form, what: str = "a form") -> Any:
    """Compile a UFL form for this machine (cached on disk); `what` it is, for messages."""
    with compiling(what):
        return calls.compile_form(form, COMPILE_OPTIONS)


def compile_forms(forms: Sequence[ufl.Form], owner: str) -> list[Any]:
    """Compile the forms of an owner, counted in messages."""
    return [compile_form(form, _counted(number, len(forms), owner)) for number, form in enumerate(forms, 1)]


def _counted(number: int, count: int, owner: str) -> str:
    return f"form {number} of {count} of {owner}"


class Integral:
    """A compiled form whose integration domain may change without looking at the form again.

    `on` takes the local cells or facets of every integral type that the form has: cell, exterior_facet, interior_facet.
    It is compiled by `compile_integrals`, or when it is used first.
    """

    def __init__(self, domain: Domain, form: ufl.Form):
        self._domain, self._form = domain, form
        self.compiled: Any = None

    def compile(self, what: str = "a form") -> None:
        """Compile it if it is not yet (collective); `what` it is, for messages."""
        if self.compiled is None:
            with compiling(what):
                if self._domain.axis_aligned:
                    with axis_aligned():
                        self.compiled = calls.Compiled(self._domain.mesh, self._form, AXIS_ALIGNED_OPTIONS)
                else:
                    self.compiled = calls.Compiled(self._domain.mesh, self._form, COMPILE_OPTIONS)

    def on(self, **entities: NDArray[np.int32]) -> Any:
        """The form over sorted local entities; measures must carry the subdomain number 1."""
        self.compile()
        return self.compiled.on(entities)


def compile_integrals(integrals: Sequence[Integral], owner: str) -> None:
    """Compile all integrals of an owner (collective), counted in messages."""
    for number, integral in enumerate(integrals, 1):
        integral.compile(_counted(number, len(integrals), owner))


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


def constant(domain: Domain, value: float | Array) -> fem.Constant:
    """A number or vector that can change without recompiling the form."""
    return fem.Constant(domain.mesh, PETSc.ScalarType(value))


def assemble_scalar(form: Any, comm: MPI.Comm) -> float:
    """Sum of a functional over all processes."""
    return comm.allreduce(fem.assemble_scalar(form), op=MPI.SUM)


def direction(domain: Domain) -> fem.Constant:
    """The unit vector that `assemble_components` sets."""
    return constant(domain, np.zeros(domain.dim))


def assemble_components(form: Any, along: fem.Constant, comm: MPI.Comm) -> list[float]:
    """Sums of a functional that is linear in a direction, for each axis: one form for all."""
    found = []
    for axis in np.eye(len(along.value)):
        along.value = axis
        found.append(assemble_scalar(form, comm))
    return found


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
    with compiling("an expression"):
        return calls.compile_expression(expression, points, COMPILE_OPTIONS)
