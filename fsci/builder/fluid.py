"""From the `fluid` section of a case to grid, patches, rigid bodies, the field and its probes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fsci.builder.columns import Table
from fsci.builder.on_first import shared
from fsci.builder.solver import build_tolerance
from fsci.case import Case
from fsci.case.contact import FilmSection
from fsci.case.flow_element import flow_element
from fsci.case.fluid import FluidSection
from fsci.case.probes import Reference
from fsci.case.rigid_motion import finite, rigid_motion
from fsci.case.velocity_jumps import velocity_jumps
from fsci.meshes.nested import following, read_grid
from fsci.meshes.of_case import read_rigid_body, require_shorter_than_period
from solvers.api import StepFailed
from solvers.fluid.flow import probes
from solvers.fluid.flow.box_extremes import box_extreme
from solvers.fluid.flow.box_probes import CrossesThinBody, box_probe
from solvers.fluid.flow.extreme_pressure import extreme_pressure
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.section import plane_probe
from solvers.fluid.grid.box import Grid
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.surfaces.immersed import ImmersedBody, rigid_body
from solvers.fluid.surfaces.inside import PointInBody
from solvers.fluid.terms.boundary.patches import Patch, UncoveredFaces
from solvers.solver_settings import SolverSettings
from solvers.timing import Timer
from solvers.values import Value

Array = NDArray[np.float64]


def build_rigid_bodies(case: Case, comm: MPI.Comm) -> list[ImmersedBody]:
    """The rigid bodies of a case that the flow does not move. Raises CaseError (collective)."""
    if case.fluid is None:
        return []
    return [_body(case, name, comm) for name in case.fluid.bodies if name not in case.fluid.free_bodies]


def build_fluid(case: Case, comm: MPI.Comm, timer: Timer, bodies: Sequence[ImmersedBody]) -> Fluid:
    """The flow around bodies. Raises CaseError (collective)."""
    assert case.fluid is not None
    settings, linear = case.fluid, case.solver.linear
    solver = SolverSettings(build_tolerance(case), linear.method, linear.tolerance)
    bodies = [_with_layer(case, body) for body in bodies]
    grid, flow, patches = _grid(case, comm), _flow(case), _patches(settings)
    follows = following(case) if settings.grid.refine else None
    try:
        return Fluid(grid, flow, patches, bodies, solver, following=follows, timer=timer, comm=comm)
    except UncoveredFaces as error:
        faces = ", ".join(error.faces)
        raise case.error(("fluid", "patches"), f"no patch is on part of the box's boundary: {faces}") from None
    except StepFailed as error:  # thin bodies at rest at periodic faces
        raise case.error(("fluid", "bodies"), error.reason) from None


def _grid(case: Case, comm: MPI.Comm) -> Grid:
    assert case.fluid is not None
    if not case.fluid.grid.refine:
        return Grid(case.fluid.grid.planes)
    return shared(comm, lambda: read_grid(case))


def _flow(case: Case) -> FlowSettings:
    assert case.fluid is not None
    settings = case.fluid
    viscosity, shear = settings.viscosity, None
    if settings.shear is not None:
        viscosity, shear = settings.shear.of(viscosity)
    return FlowSettings(
        density=settings.density,
        viscosity=viscosity,
        shear=shear,
        element=flow_element(case).element,
        convection=settings.flow == "navier_stokes",
        scheme=settings.scheme,
        body_force=_body_force(settings),
        initial_velocity=settings.initial_velocity,
        narrow_gaps=settings.narrow_gaps,
    )


def _body_force(settings: FluidSection) -> tuple[Value, ...] | None:
    """Body force and density times gravity together [N/m^3]."""
    force, gravity, density = settings.body_force, settings.gravity, settings.density
    if gravity is None:
        return force

    def component(axis: int) -> Value:
        return lambda x, t: density * gravity[axis](x, t) + (0.0 if force is None else force[axis](x, t))

    return tuple(component(axis) for axis in range(len(gravity)))


def _patches(settings: FluidSection) -> list[Patch]:
    return [
        Patch(name, patch.on, patch.kind, patch.value, patch.where, patch.outlet, patch.rate)
        for name, patch in settings.patches.items()
    ]


# ---------------------------------------------------------------------------------------------------------- bodies


def _with_layer(case: Case, body: ImmersedBody) -> ImmersedBody:
    """The body with slip length and transmissivity of its surface."""
    assert case.fluid is not None
    name, film = body.surface.name, FilmSection() if case.contact is None else case.contact.film
    settings = case.fluid.bodies.get(name) or case.elastic_bodies.get(name)
    if settings is None:
        return body
    surface = replace(body.surface, slip_length=settings.slip_length)
    if name in case.bodies_in_contact:
        surface = replace(surface, transmissivity=film.value, zone=film.closed)
    return replace(body, surface=surface)


def read_surface(case: Case, name: str, comm: MPI.Comm) -> tuple[Array, NDArray[np.int64]]:
    """Points [m] and facets of a rigid body, whole on every process. Raises CaseError (collective)."""
    return shared(comm, lambda: read_rigid_body(case, name)[1:])


def _body(case: Case, name: str, comm: MPI.Comm) -> ImmersedBody:
    assert case.fluid is not None
    points, facets = read_surface(case, name, comm)
    movement = case.fluid.bodies[name].motion
    if movement is None:
        require_shorter_than_period(case, ("fluid", "bodies", name), points)
        return rigid_body(name, points, facets)
    moved = finite(rigid_motion(points, movement, case.time.start, case.time.step, velocity_jumps(case)), name)
    require_shorter_than_period(case, ("fluid", "bodies", name), moved(case.time.start)[0])
    return rigid_body(name, points, facets, moved)


# ---------------------------------------------------------------------------------------------------------- probes


def _at(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    """Raises CaseError."""
    if case.probes[name].minus is None:
        return _at_point(case, forces.fluid, name, "at")
    return probes.difference(*(_at_point(case, forces.fluid, name, key) for key in ("at", "minus")))


def _at_point(case: Case, fluid: Fluid, name: str, key: str) -> probes.Probe:
    settings = case.probes[name]
    try:
        return probes.at_point(fluid, settings.quantity, getattr(settings, key), case.time.start)
    except PointInBody as error:
        raise case.error(("probes", name, key), str(error)) from None


def _on_patch(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    settings = case.probes[name]
    return probes.on_patch(forces.fluid, settings.quantity, settings.on or settings.through or "")


def _through_plane(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    settings = case.probes[name]
    assert settings.plane is not None
    return plane_probe(forces.fluid, settings.quantity, settings.plane.point, settings.plane.normal)


def _in_box(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    settings = case.probes[name]
    assert settings.box is not None
    if settings.has_place:
        return _place_of_extreme(case, forces, name)
    try:
        return box_probe(forces.fluid, settings.quantity, *settings.box)
    except CrossesThinBody as error:
        raise case.error(("probes", name, "box"), str(error)) from None


def _of_outlet(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    return probes.of_outlet(forces.fluid, case.probes[name].through or "")


def _driving_force(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    return probes.driving_force(forces.fluid, case.probes[name].through or "")


def _extreme(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    return extreme_pressure(forces.fluid, case.probes[name].extreme or "largest")


def _place_of_extreme(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    settings = case.probes[name]
    box = settings.box or (None, None)
    return box_extreme(forces.fluid, settings.quantity, settings.extreme or "largest", *box)


def _force(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    settings = case.probes[name]
    return forces.probe(settings.quantity, settings.body, settings.about)


def _force_on_patch(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    return probes.force_on_patch(forces.fluid, case.probes[name].on or "")


def _coefficient(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    settings = case.probes[name]
    assert settings.reference is not None
    return forces.coefficient(settings.body, _scale(case, settings.reference, settings.quantity))


def _whole(case: Case, forces: probes.Forces, name: str) -> probes.Probe:
    return probes.of_fluid(forces.fluid, case.probes[name].quantity)


#: How the probes of a fluid are made.
FLUID_PROBES: Table[probes.Forces] = {
    ("velocity", "at"): _at,
    ("pressure", "at"): _at,
    ("pressure", "on"): _on_patch,
    ("flow_rate", "through"): _on_patch,
    **{(quantity, "plane"): _through_plane for quantity in ("flow_rate", "area", "pressure")},
    **{(quantity, "box"): _in_box for quantity in ("velocity", "pressure", "volume", "kinetic_energy")},
    ("outlet_pressure", "through"): _of_outlet,
    ("driving_force", "through"): _driving_force,
    ("pressure", ""): _extreme,
    **{("speed", place): _place_of_extreme for place in ("box", "")},
    ("force", ""): _force,
    ("force", "on"): _force_on_patch,
    ("moment", ""): _force,
    ("power", ""): _force,
    ("drag_coefficient", ""): _coefficient,
    ("lift_coefficient", ""): _coefficient,
    ("volume", ""): _whole,
    ("kinetic_energy", ""): _whole,
    ("dissipation", ""): _whole,
}


def _scale(case: Case, reference: Reference, quantity: str) -> Array:
    """e / (1/2 rho U^2 L), with which the force gives a coefficient [1/N]."""
    assert case.fluid is not None
    dim = case.fluid.grid.dimension
    drag = np.array(reference.drag or np.eye(dim)[0], dtype=float)
    lift = reference.lift or ((-drag[1], drag[0]) if dim == 2 else np.eye(dim)[1])
    direction = drag if quantity == "drag_coefficient" else np.array(lift, dtype=float)
    density = reference.density or case.fluid.density
    size = reference.length if dim == 2 else reference.area
    assert size is not None
    return direction / np.linalg.norm(direction) / (0.5 * density * reference.velocity**2 * size)
