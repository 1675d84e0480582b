"""From the `structure` section of a case to bodies, the field and its probes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mpi4py import MPI

from fsci.builder.columns import Numbers, columns
from fsci.builder.loads import build_loads
from fsci.builder.named import named
from fsci.builder.solver import build_tolerance
from fsci.case import Case
from fsci.case.probes import Probe
from fsci.case.structure import BodySection
from fsci.case.values import value_of
from fsci.meshes.locations import Locations, find_locations
from fsci.meshes.of_case import VECTORS, read_body
from solvers.constraint import Constraint
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.mesh import Mesh
from solvers.solver_settings import SolverSettings
from solvers.structure import materials, probes
from solvers.structure.body import Body
from solvers.structure.dynamics import Dynamics
from solvers.structure.elastic_constants import plane_stress_lambda
from solvers.structure.field import Structure
from solvers.structure.materials import (
    LinearElastic,
    Material,
    PlaneStressLinearElastic,
    PlaneStressStVenantKirchhoff,
)
from solvers.structure.rayleigh import Damping
from solvers.structure.supports import SupportError
from solvers.structure.time_scheme import Statics, TimeScheme
from solvers.timing import Timer
from solvers.values import combine


def build_bodies(case: Case, comm: MPI.Comm) -> list[Body]:
    """The elastic bodies of a case. Raises CaseError (collective)."""
    meshes, locations = _meshes(case, comm)
    return [_body(case, name, comm, meshes.get(name), locations[name]) for name in case.elastic_bodies]


def build_structure(
    case: Case, comm: MPI.Comm, bodies: list[Body], contact: Constraint | None, timer: Timer
) -> Structure:
    """The field of all bodies. Raises CaseError (collective)."""
    linear = case.solver.linear
    settings = SolverSettings(build_tolerance(case), linear.method, linear.tolerance)
    try:
        alone = case.coupling is None
        time = _time_scheme(case)
        return Structure(bodies, time, settings, contact=contact, exchanges_mass=alone, timer=timer)
    except SupportError as error:
        supports = case.elastic_bodies[error.body].supports
        index = next(i for i, support in enumerate(supports) if error.where in (support.on or ()))
        keys = ("structure", "bodies", error.body, "supports", index)
        raise case.error(keys, error.message) from None


def _time_scheme(case: Case) -> TimeScheme:
    assert case.structure is not None
    dynamics = case.structure.dynamics
    if dynamics is None:
        return Statics()
    if dynamics.rho_inf is not None:
        scheme = GeneralisedAlpha.from_rho_inf(dynamics.rho_inf)
    else:
        alphas: list[Any] = [dynamics.alpha_m, dynamics.alpha_f, dynamics.beta, dynamics.gamma]
        scheme = GeneralisedAlpha(*alphas)
    damping = Damping(dynamics.damping.mass, dynamics.damping.stiffness)
    return Dynamics(scheme, damping=damping, predictor=dynamics.predictor)


def _body(case: Case, name: str, comm: MPI.Comm, mesh: Mesh | None, locations: Locations) -> Body:
    assert case.structure is not None
    settings = case.elastic_bodies[name]
    vectors = {key: getattr(settings, key) for key in VECTORS}
    material = _material(settings, case.structure.plane)
    loads = build_loads(settings, locations)
    return Body(name, mesh, material, element=settings.element, **loads, **vectors, comm=comm)


def _meshes(case: Case, comm: MPI.Comm) -> tuple[dict[str, Mesh], dict[str, Locations]]:
    """The meshes of the bodies on rank 0, with all surfaces that the case names; on all processes the loaded parts."""
    error, meshes, locations = None, {}, {}
    if comm.rank == 0:
        try:
            meshes = {name: read_body(case, name) for name in case.elastic_bodies}
            locations = {name: find_locations(case, name, mesh) for name, mesh in meshes.items()}
            if case.contact is not None:
                from fsci.builder.adjust import adjusted
                from fsci.builder.tied import join_tied

                meshes = join_tied(case, adjusted(case, meshes))
        except Exception as raised:  # raised on every process below
            error = raised
    error, locations = comm.bcast((error, locations), root=0)
    if error is not None:
        raise error
    return meshes, locations


def _material(body: BodySection, plane: str) -> Material:
    settings = body.material
    density = 0.0 if settings.density is None else value_of(settings.density)
    mu, lmbda = settings.lame
    if plane == "stress":
        law = PlaneStressLinearElastic if body.kinematics == "linear" else PlaneStressStVenantKirchhoff
        return law(mu, combine(plane_stress_lambda, mu, lmbda), density)
    if body.kinematics == "linear":
        return LinearElastic(mu, lmbda, density)
    return named(materials, settings.law)(*settings.parameters, density)


# ---------------------------------------------------------------------------------------------------------- probes


def build_probes(case: Case, structure: Structure) -> Callable[[], Numbers]:
    """The probes of the structure. Raises CaseError (collective)."""
    by_name = {body.name: body for body in structure.bodies}
    found: dict[str, probes.Probe] = {}
    for name, settings in _probes(case):
        if settings.pair is not None:
            found[name] = _of_pair(case, structure, settings)
        elif settings.at is not None:
            try:
                found[name] = probes.at_point(structure, by_name[settings.body or ""], settings.quantity, settings.at)
            except probes.PointOutside as error:
                raise case.error(("probes", name, "at"), str(error)) from None
        elif settings.on is not None:
            found[name] = probes.on_surface(structure, by_name[settings.body or ""], settings.quantity, settings.on)
        else:
            chosen = structure.bodies if settings.body is None else [by_name[settings.body]]
            found[name] = probes.of_bodies(structure, chosen, settings.quantity)
    return columns(found)


def _of_pair(case: Case, structure: Structure, settings: Probe) -> probes.Probe:
    from solvers.contact.contact import Contact
    from solvers.contact.probes import at_slave, first_contact, overlap

    contact, pairs = structure.constraint, [] if case.contact is None else list(case.contact.pairs)
    assert isinstance(contact, Contact)
    if settings.pair not in pairs:
        name = next(key for key, probe in case.probes.items() if probe is settings)
        raise case.error(("probes", name, "pair"), f"unknown pair '{settings.pair}' (available: {', '.join(pairs)})")
    index = pairs.index(settings.pair)
    if settings.quantity == "first_contact":
        return first_contact(contact, index)
    if settings.quantity == "overlap":
        return overlap(contact, index)
    extreme = settings.extreme or ("largest" if settings.quantity == "pressure" else "least")
    return at_slave(contact, index, settings.quantity, settings.at or extreme)


def _probes(case: Case) -> list[tuple[str, Probe]]:
    return [(name, probe) for name, probe in case.probes.items() if probe.field == "structure"]
