"""The calls of DOLFINx since the generation with basix' elements and nanobind. See `solvers.fem.calls`."""

# Its DOLFINx is not the one that mypy sees on Debian 12.
# mypy: ignore-errors

from __future__ import annotations

import inspect
from itertools import count
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import cpp, fem, jit, la
from dolfinx import mesh as dolfinx_mesh
from dolfinx.fem import petsc as fem_petsc
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array, Indices32

# UFL sorts the constants of a form by their numbers as text, 10 before 9: where a digit is added the same form would be
# another one, and would be compiled once more. From here on all numbers have seven digits.
ufl.Constant._counter = count(1_000_000)

# ------------------------------------------------------------------------------------------------------------ elements


def lagrange_element(cell: str, degree: int, shape: tuple[int, ...] = ()) -> Any:
    """Continuous Lagrange element of a UFL cell, of scalars or vectors."""
    return basix.ufl.element("Lagrange", cell, degree, shape=shape)


def discontinuous_element(cell: str, degree: int) -> Any:
    """Polynomials of a complete degree in each cell alone."""
    simplex = cell in ("triangle", "tetrahedron")
    family = "Discontinuous Lagrange" if simplex or degree == 0 else "DPC"
    return basix.ufl.element(family, cell, degree)


def broken_element(cell: str, degree: int) -> Any:
    """The Lagrange element of scalars with nodes of its own in each cell."""
    return basix.ufl.element("Lagrange", cell, degree, discontinuous=True)


def mixed_element(elements: list[Any]) -> Any:
    """Several elements side by side."""
    return basix.ufl.mixed_element(elements)


def quadrature_element(cell: str, degree: int, shape: tuple[int, ...] = ()) -> Any:
    """Values at the points of the default rule of a degree: scalars, vectors or tensors."""
    return basix.ufl.quadrature_element(cell, value_shape=shape, scheme="default", degree=degree)


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
    element = lagrange_element(cell, degree, (points.shape[1],))
    most = {"max_facet_to_cell_links": 2}
    known = inspect.signature(dolfinx_mesh.create_mesh).parameters
    partitioner = _by_graph() if destinations is None else _given(destinations)
    more = {name: value for name, value in most.items() if name in known}
    return dolfinx_mesh.create_mesh(comm, cells=cells, x=points, e=ufl.Mesh(element), partitioner=partitioner, **more)


def _by_graph() -> Any:
    try:
        return cpp.mesh.create_cell_partitioner(dolfinx_mesh.GhostMode.shared_facet, 2)
    except TypeError:
        return cpp.mesh.create_cell_partitioner(dolfinx_mesh.GhostMode.shared_facet)


def _given(destinations: tuple[Indices32, Indices32]) -> Any:
    """A partitioner that returns these; its arguments differ between versions."""
    return lambda *arguments: cpp.graph.AdjacencyList_int32(*destinations)


def geometry_nodes(mesh: dolfinx_mesh.Mesh) -> Indices32:
    """Local geometry nodes of all local cells, one cell after the other."""
    geometry = mesh.geometry
    several = getattr(geometry, "dofmaps", None)  # since meshes may have cells of several types
    return np.asarray(several[0] if isinstance(several, list) else geometry.dofmap).ravel()


def facet_nodes(mesh: dolfinx_mesh.Mesh, facets: Indices32) -> Indices32:
    """Local geometry nodes at the corners of facets, shape (facets, corners)."""
    dim = mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    mesh.topology.create_connectivity(dim, dim - 1)
    corners = len(basix.topology(getattr(basix.CellType, mesh.topology.cell_type.name))[dim - 1][0])
    if not len(facets):  # 0.9 divides by the number of cells of the process
        return np.empty((0, corners), dtype=np.int32)
    return np.asarray(dolfinx_mesh.entities_to_geometry(mesh, dim - 1, facets))[:, :corners]


def exterior_facets(mesh: dolfinx_mesh.Mesh) -> Indices32:
    """Facets of this process on the boundary of the mesh."""
    return np.asarray(dolfinx_mesh.exterior_facet_indices(mesh.topology), dtype=np.int32)


# -------------------------------------------------------------------------------------------------------------- spaces


def function_space(mesh: dolfinx_mesh.Mesh, element: Any, options: dict[str, Any]) -> Any:
    """The space of an element on a mesh; elements are not compiled here."""
    return fem.functionspace(mesh, element)


def cell_blocks(space: Any) -> Indices32:
    """Local dof blocks of all local cells, shape (cells, blocks per cell)."""
    return np.asarray(space.dofmap.list)


def replace_dofs(space: Any, cells: Indices32, own: int, ghosts: NDArray[np.int64], owners: Indices32) -> Any:
    """The space with other dof blocks in its cells: `own` of this process, and ghosts with their owners."""
    dofmap = space.dofmap
    try:
        index_map = cpp.common.IndexMap(space.mesh.comm, own, ghosts, owners)
    except TypeError:  # later with a tag for messages
        index_map = cpp.common.IndexMap(space.mesh.comm, own, ghosts, owners, 0)
    links = cpp.graph.AdjacencyList_int32(np.ascontiguousarray(cells))
    replaced = cpp.fem.DofMap(dofmap.dof_layout, index_map, dofmap.index_map_bs, links, dofmap.bs)
    whole = space._cpp_object
    shape = [whole.value_shape] if hasattr(whole, "value_shape") else []  # later the element has it
    found = type(whole)(space.mesh._cpp_object, whole.element, replaced, *shape)
    return fem.FunctionSpace(space.mesh, space.ufl_element(), found)


def add_from_ghosts(vector: Any) -> None:
    """Send what a distributed vector holds at ghosts to their owners, who add it."""
    vector.scatter_reverse(la.InsertMode.add)


# --------------------------------------------------------------------------------------------------------------- forms


def compile_form(form: ufl.Form, options: dict[str, Any]) -> Any:
    """A form over the entities of its measures."""
    return fem.form(form, jit_options=options)


class Compiled:
    """A form of which entities, with the subdomain number 1, are chosen later."""

    def __init__(self, mesh: dolfinx_mesh.Mesh, form: ufl.Form, options: dict[str, Any]):
        self._mesh = mesh
        self._compiled = fem.compile_form(mesh.comm, form, jit_options=options)
        compiled = self._compiled.ufcx_form
        self._every = form.coefficients()
        #: those that are left after derivatives are taken
        self._left = [self._every[compiled.original_coefficient_positions[i]] for i in range(compiled.num_coefficients)]
        self._coefficients = {c: c for c in self._left}
        self._constants = {c: c for c in form.constants()}
        self._spaces = [argument.ufl_function_space() for argument in form.arguments()]
        topology = mesh.topology
        topology.create_connectivity(topology.dim - 1, topology.dim)
        topology.create_connectivity(topology.dim, topology.dim - 1)

    def on(self, entities: dict[str, Indices32]) -> Any:
        """The form over local cells or facets, by the name of the integral type."""
        domains = {}
        for name, local in entities.items():
            kind = getattr(fem.IntegralType, name)
            domains[kind] = [(1, _integration_entities(self._mesh, kind, np.asarray(local, dtype=np.int32)))]
        arguments = self._compiled, self._spaces, self._mesh, domains
        try:
            return fem.create_form(*arguments, self._coefficients, self._constants)
        except RuntimeError:
            # DOLFINx 0.9 looks for coefficient i of those left under the name of coefficient i of all; unless all are
            # left, one is missing. There it gets what it looks for under that name.
            self._coefficients = dict(zip(self._every, self._left, strict=False))
            return fem.create_form(*arguments, self._coefficients, self._constants)

    def of_facets(self) -> tuple[Any, list[Any], list[Any], list[Any]]:
        """The function for interior facets, coefficients and constants that it reads, and spaces of its arguments."""
        form = self._compiled.ufcx_form
        integral = form.form_integrals[form.form_integral_offsets[self._compiled.module.lib.interior_facet]]
        return integral.tabulate_tensor_float64, self._left, list(self._constants), self._spaces


def _integration_entities(mesh: dolfinx_mesh.Mesh, kind: Any, local: Indices32) -> Indices32:
    """Cells as they are, facets as (cell, number of the facet in it) of each of their cells."""
    topology = mesh.topology._cpp_object if hasattr(mesh.topology, "_cpp_object") else mesh.topology
    try:
        found = cpp.fem.compute_integration_domains(kind, topology, local)
    except TypeError:
        dim = mesh.topology.dim - (kind is not fem.IntegralType.cell)
        found = cpp.fem.compute_integration_domains(kind, topology, local, dim)
    return np.asarray(found, dtype=np.int32)


def assemble_vector(form: Any, out: Array) -> None:
    """Add a linear form to an array over local dofs."""
    fem.assemble_vector(out, form)


def create_matrix(form: Any) -> PETSc.Mat:
    """An empty matrix with the sparsity of a bilinear form."""
    return fem_petsc.create_matrix(form)


def assemble_matrix(matrix: PETSc.Mat, form: Any) -> None:
    """Add a bilinear form to a matrix, without finishing it."""
    constants, coefficients = cpp.fem.pack_constants(form._cpp_object), cpp.fem.pack_coefficients(form._cpp_object)
    cpp.fem.petsc.assemble_matrix(matrix, form._cpp_object, constants, coefficients, [])


def compile_expression(expression: Any, points: Array, options: dict[str, Any]) -> Any:
    """An expression at reference points of cells."""
    return fem.Expression(expression, points, jit_options=options)


def tabulator(comm: MPI.Comm, expression: Any, points: Array, options: dict[str, Any]) -> Any:
    """What the form compiler makes of an expression at reference points of cells."""
    return jit.ffcx_jit(comm, (expression, points), jit_options=options)[0]


def evaluate(expression: Any, mesh: dolfinx_mesh.Mesh, cells: Indices32) -> Array:
    """Values in cells, shape (cells, points * components)."""
    if not len(cells):  # what 0.9 returns has no shape then
        return np.empty((0, len(expression.X()) * expression.value_size))
    return np.asarray(expression.eval(mesh, cells)).reshape(len(cells), -1)
