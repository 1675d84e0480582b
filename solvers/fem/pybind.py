"""The calls of DOLFINx up to the generation with UFL's own elements and pybind11. See `solvers.fem.calls`."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx import cpp, fem, jit
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array, Indices32

# UFL sorts the constants of a form by their numbers as text, 10 before 9: where a digit is added the same form would be
# another one, and would be compiled once more. From here on all numbers have seven digits.
ufl.Constant(ufl.triangle, count=999_999)

# ------------------------------------------------------------------------------------------------------------ elements


def lagrange_element(cell: str, degree: int, shape: tuple[int, ...] = ()) -> Any:
    """Continuous Lagrange element of a UFL cell, of scalars or vectors."""
    if not shape:
        return ufl.FiniteElement("Lagrange", cell, degree)
    return ufl.VectorElement("Lagrange", cell, degree, dim=shape[0])


def discontinuous_element(cell: str, degree: int) -> Any:
    """Polynomials of a complete degree in each cell alone."""
    simplex = cell in ("triangle", "tetrahedron")
    family = "Discontinuous Lagrange" if simplex or degree == 0 else "DPC"
    return ufl.FiniteElement(family, cell, degree)


def broken_element(cell: str, degree: int) -> Any:
    """The Lagrange element of scalars with nodes of its own in each cell."""
    return ufl.FiniteElement("DG" if cell in ("triangle", "tetrahedron") else "DQ", cell, degree)


def mixed_element(elements: list[Any]) -> Any:
    """Several elements side by side."""
    return ufl.MixedElement(elements)


def quadrature_element(cell: str, degree: int, shape: tuple[int, ...] = ()) -> Any:
    """Values at the points of the default rule of a degree: scalars, vectors or tensors."""
    if not shape:
        return ufl.FiniteElement("Quadrature", cell, degree, quad_scheme="default")
    if len(shape) == 1:
        return ufl.VectorElement("Quadrature", cell, degree, dim=shape[0], quad_scheme="default")
    return ufl.TensorElement("Quadrature", cell, degree, shape=shape, quad_scheme="default")


# -------------------------------------------------------------------------------------------------------------- meshes


def create_mesh(
    comm: MPI.Comm,
    cells: NDArray[np.int64],
    points: Array,
    cell: str,
    degree: int,
    destinations: tuple[Indices32, Indices32] | None = None,
) -> dolfinx_mesh.Mesh:
    """A distributed mesh; processes know the cells behind the facets between them.

    destinations: processes of each cell of this process, its owner first, and offsets; None: by the graph of cells.
    """
    # FFCx writes the variant into this element when it compiles the first form. The signatures of later ones, by which
    # the cache finds them, would depend on whether the first was in the cache.
    kind = ufl.Cell(cell, geometric_dimension=points.shape[1])
    element = ufl.VectorElement("Lagrange", kind, degree, variant="equispaced")
    links = cpp.graph.AdjacencyList_int64(cells)  # arrays are printed first, into a message that nobody sees
    if destinations is None:
        return dolfinx_mesh.create_mesh(comm, links, points, ufl.Mesh(element))
    return dolfinx_mesh.create_mesh(
        comm, links, points, ufl.Mesh(element), partitioner=lambda *_: cpp.graph.AdjacencyList_int32(*destinations)
    )


def geometry_nodes(mesh: dolfinx_mesh.Mesh) -> Indices32:
    """Local geometry nodes of all local cells, one cell after the other."""
    return np.asarray(mesh.geometry.dofmap.array)


def facet_nodes(mesh: dolfinx_mesh.Mesh, facets: Indices32) -> Indices32:
    """Local geometry nodes at the corners of facets, shape (facets, corners)."""
    return np.asarray(cpp.mesh.entities_to_geometry(mesh._mesh, mesh.topology.dim - 1, facets, False))


def exterior_facets(mesh: dolfinx_mesh.Mesh) -> Indices32:
    """Facets of this process on the boundary of the mesh."""
    return np.asarray(cpp.mesh.exterior_facet_indices(mesh.topology), dtype=np.int32)


# -------------------------------------------------------------------------------------------------------------- spaces


def function_space(mesh: dolfinx_mesh.Mesh, element: Any, options: dict[str, Any]) -> Any:
    """The space of an element on a mesh."""
    return fem.FunctionSpace(mesh, element, jit_params=options)


def cell_blocks(space: Any) -> Indices32:
    """Local dof blocks of all local cells, shape (cells, blocks per cell)."""
    return np.asarray(space.dofmap.list.array).reshape(-1, space.dofmap.dof_layout.num_dofs)


def replace_dofs(space: Any, cells: Indices32, own: int, ghosts: NDArray[np.int64], owners: Indices32) -> Any:
    """The space with other dof blocks in its cells: `own` of this process, and ghosts with their owners."""
    dofmap = space.dofmap
    index_map = cpp.common.IndexMap(space.mesh.comm, own, ghosts, owners)
    links = cpp.graph.AdjacencyList_int32(cells)
    replaced = cpp.fem.DofMap(dofmap.dof_layout, index_map, dofmap.index_map_bs, links, dofmap.bs)
    found = cpp.fem.FunctionSpace(space.mesh._mesh, space.element, replaced)
    return fem.FunctionSpace(space.mesh, space.ufl_element(), found)


def add_from_ghosts(vector: Any) -> None:
    """Send what a distributed vector holds at ghosts to their owners, who add it."""
    vector.scatter_reverse(cpp.la.ScatterMode.add)


# --------------------------------------------------------------------------------------------------------------- forms


def compile_form(form: ufl.Form, options: dict[str, Any]) -> Any:
    """A form over the entities of its measures."""
    return fem.form(form, jit_params=options)


class Compiled:
    """A form of which entities, with the subdomain number 1, are chosen later."""

    def __init__(self, mesh: dolfinx_mesh.Mesh, form: ufl.Form, options: dict[str, Any]):
        self._mesh = mesh
        self._compiled, self._module, _ = jit.ffcx_jit(mesh.comm, form, jit_params=options)
        coefficients = form.coefficients()
        order = [self._compiled.original_coefficient_position[i] for i in range(self._compiled.num_coefficients)]
        self._of = [coefficients[i] for i in order], form.constants()
        self._arguments = [argument.ufl_function_space() for argument in form.arguments()]
        self._coefficients, self._constants = ([one._cpp_object for one in some] for some in self._of)
        self._spaces = [space._cpp_object for space in self._arguments]

    def on(self, entities: dict[str, Indices32]) -> Any:
        """The form over local cells or facets, by the name of the integral type."""
        mesh = self._mesh
        types = {name: mesh.topology.dim - ("facet" in name) for name in entities}
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

    def of_facets(self) -> tuple[Any, list[Any], list[Any], list[Any]]:
        """The function for interior facets, coefficients and constants that it reads, and spaces of its arguments."""
        integral = self._compiled.integrals(self._module.lib.interior_facet)[0]
        return integral.tabulate_tensor_float64, *self._of, self._arguments


def assemble_vector(form: Any, out: Array) -> None:
    """Add a linear form to an array over local dofs."""
    cpp.fem.assemble_vector(out, form, cpp.fem.pack_constants(form), cpp.fem.pack_coefficients(form))


def create_matrix(form: Any) -> PETSc.Mat:
    """An empty matrix with the sparsity of a bilinear form."""
    return fem.petsc.create_matrix(form)


def assemble_matrix(matrix: PETSc.Mat, form: Any) -> None:
    """Add a bilinear form to a matrix, without finishing it."""
    cpp.fem.petsc.assemble_matrix(
        matrix, form, cpp.fem.pack_constants(form), cpp.fem.pack_coefficients(form), [], False
    )


def compile_expression(expression: Any, points: Array, options: dict[str, Any]) -> Any:
    """An expression at reference points of cells."""
    return fem.Expression(expression, points, jit_params=options)


def tabulator(comm: MPI.Comm, expression: Any, points: Array, options: dict[str, Any]) -> Any:
    """What the form compiler makes of an expression at reference points of cells."""
    return jit.ffcx_jit(comm, (expression, points), jit_params=options)[0]


def evaluate(expression: Any, mesh: dolfinx_mesh.Mesh, cells: Indices32) -> Array:
    """Values in cells, shape (cells, points * components)."""
    return expression.eval(cells)
