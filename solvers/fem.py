"""The only module with DOLFINx calls that differ between versions: meshes, spaces, compiled forms, surface tags.

A node is a point of the mesh file, numbered as there on every process; a dof block is DOLFINx's local number of a node.
Elements are isoparametric, so that the nodes of the mesh and of the displacement are the same points.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import basix
import numpy as np
import ufl
from dolfinx import cpp, fem, jit, la
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array
from solvers.mesh import Mesh

#: Meshio cell type -> (UFL cell, degree)
CELLS = {
    "triangle": ("triangle", 1),
    "triangle6": ("triangle", 2),
    "quad": ("quadrilateral", 1),
    "quad9": ("quadrilateral", 2),
    "tetra": ("tetrahedron", 1),
    "tetra10": ("tetrahedron", 2),
    "hexahedron": ("hexahedron", 1),
    "hexahedron27": ("hexahedron", 2),
}

_SQUARE: list[tuple[float, ...]] = [(0, 0), (1, 0), (1, 1), (0, 1)]
_QUAD9: list[tuple[float, ...]] = [*_SQUARE, (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5), (0.5, 0.5)]
_TRIANGLE6: list[tuple[float, ...]] = [(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)]
_CUBE: list[tuple[float, ...]] = [(x, y, z) for z in (0, 1) for x, y in _SQUARE]

#: Reference coordinates of VTK's nodes: matching them with basix' points gives the node permutation of any version.
_VTK_POINTS: dict[str, list[tuple[float, ...]]] = {
    "triangle": _TRIANGLE6[:3],
    "triangle6": _TRIANGLE6,
    "quad": list(_SQUARE),
    "quad9": _QUAD9,
    "tetra": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "tetra10": [
        *[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
        *[(0.5, 0, 0), (0.5, 0.5, 0), (0, 0.5, 0), (0, 0, 0.5), (0.5, 0, 0.5), (0, 0.5, 0.5)],
    ],
    "hexahedron": list(_CUBE),
    "hexahedron27": [
        *_CUBE,
        *[(x, y, 0) for x, y in _QUAD9[4:8]],
        *[(x, y, 1) for x, y in _QUAD9[4:8]],
        *[(x, y, 0.5) for x, y in _SQUARE],
        *[(0, 0.5, 0.5), (1, 0.5, 0.5), (0.5, 0, 0.5), (0.5, 1, 0.5), (0.5, 0.5, 0), (0.5, 0.5, 1)],
        (0.5, 0.5, 0.5),
    ],
}

#: A process that waits for another one to compile the same form is patient.
COMPILE_OPTIONS = {"cffi_extra_compile_args": ["-O3", "-march=native"], "timeout": 300}


def vtk_from_basix(cell_type: str) -> NDArray[np.int64]:
    """Permutation p with nodes_vtk = nodes_basix[p]."""
    name, degree = CELLS[cell_type]
    element = basix.create_element(
        basix.ElementFamily.P, getattr(basix.CellType, name), degree, basix.LagrangeVariant.equispaced
    )
    vtk = np.array(_VTK_POINTS[cell_type], dtype=float)
    distance = np.linalg.norm(vtk[:, None, :] - element.points[None, :, :], axis=2)
    return np.argmin(distance, axis=1)


@dataclass(frozen=True)
class Domain:
    """A distributed mesh and what is needed to find its nodes again."""

    mesh: dolfinx_mesh.Mesh
    cell_type: str
    degree: int
    nodes: int  #: nodes of the whole mesh
    surfaces: dict[str, NDArray[np.int32]] = field(default_factory=dict)  #: name -> local exterior facets, sorted
    source: Mesh | None = None  #: rank 0 only: the whole mesh

    @property
    def comm(self) -> MPI.Comm:
        return self.mesh.comm

    @property
    def dim(self) -> int:
        return self.mesh.geometry.dim


def distribute(comm: MPI.Comm, mesh: Mesh | None) -> Domain:
    """Distribute a mesh that rank 0 holds (other ranks pass None)."""
    header = comm.bcast(None if mesh is None else (mesh.cell_type, mesh.points.shape, mesh.surfaces), root=0)
    cell_type, (nodes, dim), named = header
    name, degree = CELLS[cell_type]
    vtk = vtk_from_basix(cell_type)
    if mesh is not None:
        cells, points = np.ascontiguousarray(mesh.cells[:, np.argsort(vtk)], dtype=np.int64), mesh.points
    else:
        cells, points = np.empty((0, len(vtk)), dtype=np.int64), np.empty((0, dim))
    element = ufl.VectorElement("Lagrange", ufl.Cell(name, geometric_dimension=dim), degree)
    distributed = dolfinx_mesh.create_mesh(comm, cells, points, ufl.Mesh(element))
    domain = Domain(distributed, cell_type, degree, nodes, source=mesh)
    return Domain(**{**vars(domain), "surfaces": _find_surfaces(domain, named)})


def _find_surfaces(domain: Domain, named: dict[str, NDArray[np.int64]]) -> dict[str, NDArray[np.int32]]:
    """Local facets of each named surface, found by their corner nodes (whatever the facet's node order)."""
    mesh = domain.mesh
    dim = mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    exterior = np.sort(exterior_facets(domain))
    geometry = cpp.mesh.entities_to_geometry(mesh._mesh, dim - 1, exterior, False)
    corners = np.sort(input_nodes(domain)[geometry], axis=1).reshape(len(exterior), -1)
    facet_of = {tuple(corner): facet for corner, facet in zip(corners.tolist(), exterior, strict=True)}
    found = {}
    for name, facets in named.items():
        local = (facet_of.get(tuple(facet)) for facet in np.sort(facets, axis=1).tolist())
        found[name] = np.sort(np.array([f for f in local if f is not None], dtype=np.int32))
    return found


def exterior_facets(domain: Domain) -> NDArray[np.int32]:
    """Local numbers of the facets on the boundary of the body that this process integrates over."""
    mesh = domain.mesh
    mesh.topology.create_entities(mesh.topology.dim - 1)
    mesh.topology.create_connectivity(mesh.topology.dim - 1, mesh.topology.dim)
    return np.asarray(cpp.mesh.exterior_facet_indices(mesh.topology), dtype=np.int32)


def input_nodes(domain: Domain) -> NDArray[np.int64]:
    """Number in the mesh file of each local geometry node."""
    return np.asarray(domain.mesh.geometry.input_global_indices, dtype=np.int64)


def input_cells(domain: Domain) -> NDArray[np.int64]:
    """Number in the mesh file of each local cell (ghosts last)."""
    return np.asarray(domain.mesh.topology.original_cell_index, dtype=np.int64)


def owned_cells(domain: Domain) -> int:
    """How many of the local cells this process owns; they come first."""
    return int(domain.mesh.topology.index_map(domain.dim).size_local)


def _facet_cells(domain: Domain) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(offsets, cells) of the cells at each local facet."""
    topology = domain.mesh.topology
    topology.create_entities(domain.dim - 1)
    topology.create_connectivity(domain.dim - 1, domain.dim)
    links = topology.connectivity(domain.dim - 1, domain.dim)
    return np.asarray(links.offsets, dtype=np.int32), np.asarray(links.array, dtype=np.int32)


def interior_facets(domain: Domain) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(local facets with two local cells, those cells of shape (facets, 2))."""
    offsets, cells = _facet_cells(domain)
    facets = np.flatnonzero(np.diff(offsets) == 2).astype(np.int32)
    return facets, np.stack([cells[offsets[facets]], cells[offsets[facets] + 1]], axis=1)


def boundary_facets(domain: Domain) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(local facets on the boundary of the mesh that this process integrates over, the cell of each)."""
    facets = np.sort(exterior_facets(domain))
    offsets, cells = _facet_cells(domain)
    return facets, cells[offsets[facets]]


def facet_midpoints(domain: Domain, facets: NDArray[np.int32]) -> Array:
    """Midpoints [m] of facets, shape (facets, dim)."""
    if len(facets) == 0:
        return np.empty((0, domain.dim))
    return dolfinx_mesh.compute_midpoints(domain.mesh, domain.dim - 1, facets)[:, : domain.dim]


# ---------------------------------------------------------------------------------------------------------- spaces


def vector_space(domain: Domain) -> fem.FunctionSpace:
    """Isoparametric vector Lagrange space: one dof block per node."""
    with _quiet():
        return fem.VectorFunctionSpace(domain.mesh, ("Lagrange", domain.degree))


def scalar_space(domain: Domain) -> fem.FunctionSpace:
    """Isoparametric scalar Lagrange space: one dof per node."""
    with _quiet():
        return fem.FunctionSpace(domain.mesh, ("Lagrange", domain.degree))


def cellwise_space(domain: Domain) -> fem.FunctionSpace:
    """One number per cell."""
    with _quiet():
        return fem.FunctionSpace(domain.mesh, ("Discontinuous Lagrange", 0))


def flow_space(domain: Domain, velocity_degree: int) -> fem.FunctionSpace:
    """Velocity and pressure as one function with dim + 1 components, pressure last and of first degree.

    Equal order: one block of dim + 1 unknowns per node, side by side in the matrix; otherwise a mixed element.
    """
    cell = domain.mesh.ufl_cell()
    if velocity_degree == 1:
        element = ufl.VectorElement("Lagrange", cell, 1, dim=domain.dim + 1)
    else:
        velocity = ufl.VectorElement("Lagrange", cell, velocity_degree)
        element = ufl.MixedElement([velocity, ufl.FiniteElement("Lagrange", cell, 1)])
    with _quiet():
        return fem.FunctionSpace(domain.mesh, element)


def component_dofs(space: fem.FunctionSpace, component: int) -> tuple[NDArray[np.int32], Array]:
    """(local unrolled dofs, their points of shape (dofs, 3)) of one component of a `flow_space` (collective)."""
    if space.dofmap.index_map_bs > 1:
        blocks = np.arange(len(space.tabulate_dof_coordinates()), dtype=np.int32)
        return blocks * space.dofmap.index_map_bs + component, space.tabulate_dof_coordinates()
    with _quiet():
        part = space.sub(0).sub(component) if component < space.mesh.geometry.dim else space.sub(1)
        collapsed, dofs = part.collapse()
    return np.asarray(dofs, dtype=np.int32), collapsed.tabulate_dof_coordinates()


def component_cell_dofs(space: fem.FunctionSpace, component: int) -> NDArray[np.int32]:
    """Local dofs of one component of a `flow_space` in each local cell, in the order of the scalar element."""
    if space.dofmap.index_map_bs > 1:
        part = space.sub(component)
    else:
        part = space.sub(0).sub(component) if component < space.mesh.geometry.dim else space.sub(1)
    cells = space.mesh.topology.index_map(space.mesh.topology.dim)
    return np.asarray(part.dofmap.list.array).reshape(cells.size_local + cells.num_ghosts, -1)


def tabulate_lagrange(domain: Domain, degree: int, points: Array) -> tuple[Array, Array]:
    """Scalar shape functions (points, functions) and their reference gradients (points, functions, dim)."""
    element = basix.create_element(
        basix.ElementFamily.P,
        getattr(basix.CellType, CELLS[domain.cell_type][0]),
        degree,
        basix.LagrangeVariant.gll_warped,
    )
    table = element.tabulate(1, points)[..., 0]
    return table[0], np.moveaxis(table[1:], 0, -1)


def facet_dofs(space: fem.FunctionSpace, component: int, facets: NDArray[np.int32]) -> NDArray[np.int32]:
    """Local dofs of one component of a `flow_space` on facets, on every process that knows them (collective)."""
    dim = space.mesh.topology.dim
    if space.dofmap.index_map_bs > 1:
        blocks = fem.locate_dofs_topological(space, dim - 1, facets)
        return np.asarray(blocks, dtype=np.int32) * space.dofmap.index_map_bs + component
    part = space.sub(0).sub(component) if component < dim else space.sub(1)
    return np.asarray(fem.locate_dofs_topological(part, dim - 1, facets), dtype=np.int32)


def quadrature_space(domain: Domain, degree: int, shape: tuple[int, ...] = ()) -> fem.FunctionSpace:
    """Values at the points of the quadrature rule of a degree; shape () for scalars, (n,) vectors, (n, m) tensors."""
    cell = domain.mesh.ufl_cell()
    if not shape:
        element = ufl.FiniteElement("Quadrature", cell, degree, quad_scheme="default")
    elif len(shape) == 1:
        element = ufl.VectorElement("Quadrature", cell, degree, dim=shape[0], quad_scheme="default")
    else:
        element = ufl.TensorElement("Quadrature", cell, degree, shape=shape, quad_scheme="default")
    with _quiet():
        return fem.FunctionSpace(domain.mesh, element)


def quadrature_points(domain: Domain, degree: int) -> tuple[Array, Array]:
    """(points of shape (n, dim), weights) on the reference cell that a measure of this degree uses."""
    return basix.make_quadrature(getattr(basix.CellType, CELLS[domain.cell_type][0]), degree)


def function(space: fem.FunctionSpace) -> fem.Function:
    """A finite element function, zero at first."""
    return fem.Function(space)


def node_of_block(domain: Domain, space: fem.FunctionSpace) -> NDArray[np.int64]:
    """Mesh-file number of the node behind each local dof block (owned blocks first, then ghosts)."""
    cells = domain.mesh.topology.index_map(domain.mesh.topology.dim)
    local_cells = cells.size_local + cells.num_ghosts
    blocks = space.dofmap.list.array.reshape(local_cells, -1)
    geometry = domain.mesh.geometry.dofmap.array.reshape(local_cells, -1)
    nodes = np.full(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, -1, dtype=np.int64)
    nodes[blocks] = input_nodes(domain)[geometry]
    return nodes


def surface_blocks(domain: Domain, space: fem.FunctionSpace, name: str) -> NDArray[np.int32]:
    """Local dof blocks on a named surface, on every process that knows the node (a collective call)."""
    return fem.locate_dofs_topological(space, domain.mesh.topology.dim - 1, domain.surfaces[name])


def block_points(space: fem.FunctionSpace) -> Array:
    """Reference position of each local dof block, shape (3, blocks)."""
    return np.ascontiguousarray(space.tabulate_dof_coordinates().T)


# ----------------------------------------------------------------------------------------------------------- forms


def compile_form(form: ufl.Form) -> fem.FormMetaClass:
    """Compile a UFL form for this machine (cached on disk)."""
    with _quiet():
        return fem.form(form, jit_params=COMPILE_OPTIONS)


@contextmanager
def _quiet() -> Iterator[None]:
    """setuptools reports every compiler call at INFO on the root logger, and sets its level itself."""
    before = logging.root.manager.disable
    logging.disable(logging.INFO)
    try:
        yield
    finally:
        logging.disable(before)


class Integral:
    """A compiled form whose integration domain may change without looking at the form again.

    `on` takes the local cells or facets of every integral type that the form has: cell, exterior_facet, interior_facet.
    """

    def __init__(self, domain: Domain, form: ufl.Form):
        self.domain = domain
        with _quiet():
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


# ------------------------------------------------------------------------------------------------- points and rows


def locate_point(domain: Domain, point: Array) -> tuple[int, Array] | None:
    """(local cell, reference coordinates) of a material point on the one process that answers for it, else None.

    Collective. Points up to 1e-8 of the body's size outside still count as inside.
    """
    from dolfinx import geometry

    mesh, x = domain.mesh, np.zeros(3)
    x[: len(point)] = point
    size = domain.comm.allreduce(float(np.ptp(mesh.geometry.x, axis=0).max(initial=0.0)), op=MPI.MAX)
    tree = geometry.BoundingBoxTree(mesh, mesh.topology.dim, padding=1e-8 * size)
    candidates = geometry.compute_collisions(tree, x[None, :])
    cells = np.asarray(candidates.links(0))
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    best: tuple[float, int] = (np.inf, -1)
    for cell in cells[cells < owned]:
        nodes = mesh.geometry.dofmap.links(cell)
        distance = float(np.linalg.norm(geometry.compute_distance_gjk(x[None, :], mesh.geometry.x[nodes])))
        best = min(best, (distance, int(cell)))
    distance, rank = domain.comm.allreduce((best[0], domain.comm.rank), op=MPI.MINLOC)
    if not distance <= 1e-6 * size or rank != domain.comm.rank:
        return None
    nodes = mesh.geometry.dofmap.links(best[1])
    reference = mesh.geometry.cmap.pull_back(x[None, : domain.dim], mesh.geometry.x[nodes][:, : domain.dim])
    return best[1], reference[0]


def tabulate(domain: Domain, reference: Array) -> Array:
    """Shape functions of the displacement at a reference point, in the order of the cell's dof blocks."""
    name, degree = CELLS[domain.cell_type]
    element = basix.create_element(
        basix.ElementFamily.P, getattr(basix.CellType, name), degree, basix.LagrangeVariant.gll_warped
    )
    return element.tabulate(0, reference[None, :])[0, 0, :, 0]


def sum_ghosts(space: fem.FunctionSpace, values: Array) -> Array:
    """Values per local block with those of all processes added up, the same wherever a block is known (collective)."""
    total: Any = la.vector(space.dofmap.index_map, 1)
    total.array[:] = values
    total.scatter_reverse(cpp.la.ScatterMode.add)
    total.scatter_forward()
    return total.array.copy()


def add_ghosts(space: fem.FunctionSpace, local: Array) -> None:
    """Add what processes hold at ghost dofs to the owners' entries of a local array (collective)."""
    vector: Any = la.vector(space.dofmap.index_map, space.dofmap.index_map_bs)
    vector.array[:] = local
    vector.scatter_reverse(cpp.la.ScatterMode.add)
    local[:] = vector.array


def share_owned(space: fem.FunctionSpace, local: Array) -> Array:
    """A local array with the owners' values at ghost dofs (collective)."""
    vector: Any = la.vector(space.dofmap.index_map, space.dofmap.index_map_bs)
    vector.array[:] = local
    vector.scatter_forward()
    return vector.array.copy()


def accumulate(function: fem.Function) -> None:
    """Send what processes added to ghost dofs to the owners."""
    function.x.scatter_reverse(cpp.la.ScatterMode.add)


def compile_expression(expression: ufl.core.expr.Expr, points: Array) -> fem.Expression:
    """Compile a UFL expression for evaluation at reference points of cells."""
    with _quiet():
        return fem.Expression(expression, points, jit_params=COMPILE_OPTIONS)


def evaluate_cells(domain: Domain, expression: fem.Expression) -> Array:
    """Values at the expression's points in all owned cells, shape (cells, points * components)."""
    cells = np.arange(domain.mesh.topology.index_map(domain.dim).size_local, dtype=np.int32)
    return expression.eval(cells)


def average_at_nodes(domain: Domain, expression: fem.Expression, *, components: int) -> Array:
    """Mean over the adjacent cells of an expression compiled at `reference_nodes`, shape (local nodes, components)."""
    space = scalar_space(domain)
    values = evaluate_cells(domain, expression)
    values = values.reshape(len(values), -1, components)
    blocks = space.dofmap.list.array.reshape(-1, values.shape[1])[: len(values)]
    total = function(space)
    mean = np.empty((len(total.x.array), components))
    for component in range(-1, components):
        total.x.array[:] = 0.0
        np.add.at(total.x.array, blocks, 1.0 if component < 0 else values[:, :, component])
        accumulate(total)
        total.x.scatter_forward()
        if component < 0:
            count = total.x.array.copy()
        else:
            mean[:, component] = total.x.array / count
    return mean


def reference_nodes(domain: Domain) -> Array:
    """Reference coordinates of a cell's nodes, in the order of its dof blocks."""
    name, degree = CELLS[domain.cell_type]
    return basix.create_element(
        basix.ElementFamily.P, getattr(basix.CellType, name), degree, basix.LagrangeVariant.equispaced
    ).points


def cell_midpoints(domain: Domain) -> Array:
    """Reference position of the middle of each local cell, shape (3, cells)."""
    index_map = domain.mesh.topology.index_map(domain.dim)
    cells = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    return dolfinx_mesh.compute_midpoints(domain.mesh, domain.dim, cells).T
