"""One elastic body: its mesh, material, loads and supports, and the forms assembled from them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from mpi4py import MPI
from petsc4py import PETSc

from solvers import fem
from solvers.algebra.petsc_blocks import BlockRows, quick_to_multiply
from solvers.api import Array
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.structure import forms
from solvers.structure.active import Active, ActiveStress
from solvers.structure.block_assembly import BlockAssembly
from solvers.structure.element import Element
from solvers.structure.elements import Displacement, Formulation, Mixed
from solvers.structure.loads import DeadLoads, FollowerPressure, LineForce, PointForce, Pressure, Traction
from solvers.structure.materials import Material, Ogden, parameters
from solvers.structure.pre_stretch import PreStretch, PreStretched, pre_stretch_tensor
from solvers.structure.principal import ByPrincipalStretches, PrincipalStretches
from solvers.structure.relaxation import Branch, Relaxing
from solvers.structure.springs import Spring, Springs
from solvers.structure.supports import Roller, Support, Symmetry
from solvers.values import Value, evaluate_components


class Body:
    """Mass, internal forces, loads and tangent of one body at the displacement `u`.

    mesh: that of the whole body on process 0; other processes may pass None. Vectors have one entry per dimension,
    which is a number or a function of position and time.
    """

    def __init__(
        self,
        name: str,
        mesh: Mesh | None,
        material: Material,
        *,
        element: Formulation = "displacement",
        relaxing: Sequence[Branch] = (),
        pre_stretch: Sequence[PreStretch] = (),
        supports: Sequence[Support | Symmetry | Roller] = (),
        springs: Sequence[Spring] = (),
        gravity: Sequence[Value] | None = None,  # [m/s^2]
        body_force: Sequence[Value] | None = None,  # [N/m^3]
        tractions: Sequence[Traction] = (),
        pressures: Sequence[Pressure] = (),
        active: Sequence[Active] = (),
        point_forces: Sequence[PointForce] = (),
        line_forces: Sequence[LineForce] = (),
        initial_displacement: Sequence[Value] | None = None,  # [m]
        initial_velocity: Sequence[Value] | None = None,  # [m/s]
        comm: MPI.Comm = MPI.COMM_WORLD,
    ):
        self.name, self.material, self.formulation = name, material, element
        self.supports, self.springs = tuple(supports), tuple(springs)
        self.initial_displacement, self.initial_velocity = initial_displacement, initial_velocity
        self.domain = domain = fem.distribute(comm, mesh if comm.rank == 0 else None)
        self.space = fem.vector_space(domain)
        self.u = fem.function(self.space)
        self.nodes = fem.node_of_block(domain, self.space)
        self.points = fem.block_points(self.space)
        self.owned = self.space.dofmap.index_map.size_local
        self.stiffness_degree, self.mass_degree = CELL_TYPES[domain.cell_type].quadrature
        self.density = self._parameter(material.density)
        self.parameters = {k: self._parameter(p) for k, p in parameters(material).items()}
        self.element = self._element(fem.volume_measure(domain, self.stiffness_degree), relaxing, pre_stretch)
        self._energy, self._internal, self._tangent, self._mass = self._compiled()
        self._tangent_assembly = BlockAssembly(self._tangent)
        self._force = fem.function(self.space)
        gradient = forms.deformation_gradient(self.u)
        self._jacobian = fem.compile_expression(ufl.det(gradient), fem.reference_nodes(domain))
        self._dead = DeadLoads(domain, self.space, self.nodes[: self.owned])
        if body_force:
            self._dead.add_volume(body_force)
        if gravity:
            self._dead.add_volume(gravity, material.density)
        for traction in tractions:
            self._dead.add_surface(traction)
        for line in line_forces:
            self._dead.add_lines(line)
        for point in point_forces:
            self._dead.add_points(point)
        self.dead_load = np.zeros(self.size)
        self._loads_at: float | None = None  #: time [s] of the loads
        self.active = [ActiveStress(domain, self.space, one, self.stiffness_degree) for one in active]
        #: loads that depend on the displacement
        self.pressures: list[FollowerPressure | ActiveStress] = [
            *(FollowerPressure(domain, self.space, pressure) for pressure in pressures),
            *self.active,
        ]
        self._spring_matrix = Springs(self) if springs else None
        self._averages: tuple[Any, Any] | None = None  #: space of nodal averages and expression of the stress

    @cached_property
    def heights(self) -> Array:
        """Height [m] of the flattest cell at each owned node, shape (owned,)."""
        return fem.node_heights(self.domain, self.space)[: self.owned]

    @property
    def linear(self) -> bool:
        """Whether displacements are small: strain and loads refer to the reference configuration."""
        return self.material.linear

    @property
    def dim(self) -> int:
        return self.domain.dim

    @property
    def size(self) -> int:
        """Owned dofs."""
        return self.owned * self.dim

    def _parameter(self, value: Value):
        """A UFL coefficient: a number, or a number per cell, evaluated at the midpoint."""
        if not callable(value):
            return fem.constant(self.domain, float(value))
        cellwise = fem.function(fem.cellwise_space(self.domain))
        cellwise.x.array[:] = value(fem.cell_midpoints(self.domain), 0.0)
        return cellwise

    def _element(self, dx: ufl.Measure, relaxing: Sequence[Branch], pre_stretch: Sequence[PreStretch]) -> Element:
        law: Any = self.material
        F, stretches = forms.deformation_gradient(self.u), None
        G = pre_stretch_tensor(self.domain, pre_stretch) if pre_stretch else None
        if isinstance(law, Ogden):
            stretches = PrincipalStretches(self.domain, law, F if G is None else F * G, self.stiffness_degree)
            law = stretches.law
        law = law if G is None else PreStretched(law, G)
        element: Element = Displacement(law, self.parameters)
        if self.formulation == "mixed":
            element = Mixed(self.domain, self.u, law, self.parameters, dx)
        if relaxing:
            element = Relaxing(element, self.domain, self.u, self.parameters, self.stiffness_degree, relaxing)
        return element if stretches is None else ByPrincipalStretches(element, stretches)

    def _compiled(self) -> Sequence[Any]:
        """Energy, internal force, its tangent and the mass."""
        v, du = ufl.TestFunction(self.space), ufl.TrialFunction(self.space)
        dx = fem.volume_measure(self.domain, self.stiffness_degree)
        wanted = [
            forms.stored_energy(self.u, self.element, dx),
            forms.internal_force(self.u, self.element, v, dx),
            forms.tangent(self.u, self.element, v, du, dx),
            forms.inertia(du, v, self.density, fem.volume_measure(self.domain, self.mass_degree)),
        ]
        return fem.compile_forms(wanted, f"body '{self.name}'")

    def nodal(self, value: Sequence[Value], t: float) -> Array:
        """Values of a vector field at all local nodes, shape (blocks, dim)."""
        return evaluate_components(value, self.points, t).T

    def set_displacement(self, owned: Array) -> None:
        """Set the displacement from owned dofs [m], shape (size,)."""
        self.u.x.array[: self.size] = owned
        self.u.x.scatter_forward()
        self.element.update()

    def _evaluate_loads(self, t: float) -> None:
        if t == self._loads_at:
            return
        changed = self._dead.update(t) or self._loads_at is None
        if self.domain.comm.allreduce(changed, op=MPI.LOR):
            self._force.x.array[:] = self._dead.force
            self.dead_load = self._summed()
        for pressure in self.pressures:
            pressure.set_time(t)
        self._loads_at = t

    # ---------------------------------------------------------------------------------------------- assembly

    def _assemble(self, compiled: Sequence) -> Array:
        self._force.x.array[:] = 0.0
        for form in compiled:
            fem.assemble_vector(form, self._force.x.array)
        return self._summed()

    def _summed(self) -> Array:
        """The sum of `_force` over all processes, at owned dofs."""
        fem.accumulate(self._force)
        return self._force.x.array[: self.size].copy()

    def internal_force(self) -> Array:
        """int P : grad v dX plus the force on springs [N], shape (size,) (collective)."""
        return self._assemble([self._internal]) + self.spring_force()

    def spring_force(self) -> Array | float:
        """Force of the body on its springs [N], shape (size,); 0 without springs (collective)."""
        return 0.0 if self._spring_matrix is None else self._spring_matrix.force(self.u.x.array[: self.size])

    @property
    def spring_stiffness(self) -> Springs | None:
        """The springs of the body, None without any."""
        return self._spring_matrix

    def external_force(self, t: float) -> Array:
        """Loads [N] at the time t [s] and the present displacement, shape (size,) (collective)."""
        self._evaluate_loads(t)
        if not self.pressures:
            return self.dead_load.copy()
        self._force.x.array[:] = 0.0
        for pressure in self.pressures:
            pressure.add_force(self._shape, self._force.x.array)
        return self.dead_load + self._summed()

    @property
    def _shape(self) -> Array:
        """Displacement of the surface that pressures act on; zero for small displacements."""
        return np.zeros_like(self.u.x.array) if self.linear else self.u.x.array

    def mass(self) -> PETSc.Mat:
        """Consistent mass matrix [kg]."""
        matrix = quick_to_multiply(fem.create_matrix(self._mass))
        fem.assemble_matrix(matrix, self._mass)
        matrix.assemble()
        return matrix

    def create_tangent(self) -> PETSc.Mat:
        """An empty matrix for `assemble_tangent`."""
        return quick_to_multiply(fem.create_matrix(self._tangent))

    def assemble_tangent(self, matrix: PETSc.Mat, t: float) -> None:
        """d(internal - external force)/du [N/m] at the time t [s] (collective)."""
        self._evaluate_loads(t)
        self.element.linearise()
        self._tangent_assembly.assemble(matrix)
        for pressure in () if self.linear else self.pressures:
            pressure.add_tangent(self._shape, matrix)
        matrix.assemble()
        if self._spring_matrix is not None:
            matrix.axpy(1.0, self._spring_matrix.matrix, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        self.element.complete_tangent(matrix)

    def tangent_blocks(self, t: float) -> BlockRows | None:
        """The blocks of the tangent, until it is assembled again; None if it has terms besides the material's."""
        others = self._spring_matrix is not None or (self.pressures and not self.linear)
        if others or self.formulation != "displacement":
            return None
        self._evaluate_loads(t)
        self.element.linearise()
        return self._tangent_assembly.assemble_blocks()

    def smallest_jacobian(self) -> tuple[float, str, tuple[float, ...]]:
        """(smallest det F at the cells' nodes, body name, reference position [m]) over all processes.

        Infinite for small displacements, whose energy does not depend on det F.
        """
        if self.linear:
            return np.inf, self.name, ()
        values = fem.evaluate_cells(self.domain, self._jacobian)
        cell = int(np.argmin(values.min(axis=1))) if values.size else 0
        low = float(values[cell].min()) if values.size else np.inf
        low, rank = self.domain.comm.allreduce((low, self.domain.comm.rank), op=MPI.MINLOC)
        place = None
        if rank == self.domain.comm.rank and not low > 0.0:
            place = tuple(fem.cell_midpoints(self.domain)[: self.dim, cell].tolist())
        return low, self.name, self.domain.comm.bcast(place, root=rank) if not low > 0.0 else ()

    def stress(self) -> Array:
        """Nodal averages of the Cauchy stress [Pa] at owned nodes, 3x3 by rows, shape (owned, 9) (collective)."""
        if self._averages is None:  # compiled for the first picture or file: a step of a small body takes less time
            at = fem.reference_nodes(self.domain)
            expression = fem.compile_expression(forms.cauchy_stress(self.u, self.element, self.active), at)
            self._averages = fem.scalar_space(self.domain), expression
        self.element.prepare_output()
        return fem.average_at_nodes(self.domain, *self._averages, components=9)[: self.owned]

    def internal_energy(self) -> float:
        """int W dX plus the energy of springs [J] (collective)."""
        energy = fem.assemble_scalar(self._energy, self.domain.comm)
        if self._spring_matrix is not None:
            energy += self._spring_matrix.energy(self.u.x.array[: self.size], self.domain.comm)
        return energy
