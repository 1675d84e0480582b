"""From the `structure` section of a case to bodies, the field and its probes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import nan
from typing import TYPE_CHECKING

from mpi4py import MPI

from fsci.builder.columns import Table
from fsci.builder.elements import choose_element
from fsci.builder.loads import build_loads
from fsci.builder.named import named
from fsci.builder.point_springs import point_springs
from fsci.builder.solver import build_tolerance
from fsci.case import Case
from fsci.case.checks import VECTORS
from fsci.case.material import OwnLawSection
from fsci.case.probes import Probe
from fsci.case.values import value_of
from fsci.meshes.locations import Locations, find_locations
from fsci.meshes.of_case import read_body
from solvers.constraint import Constraint
from solvers.mesh.mesh import Mesh
from solvers.solver_settings import SolverSettings
from solvers.structure import materials, probes
from solvers.structure.body import Body
from solvers.structure.elastic_constants import plane_stress_lambda
from solvers.structure.elements import Formulation
from solvers.structure.field import Structure
from solvers.structure.materials import (
    LinearElastic,
    Material,
    PlaneStressLinearElastic,
    PlaneStressStVenantKirchhoff,
)
from solvers.structure.point_springs import SpringOutside
from solvers.structure.relaxation import Branch
from solvers.structure.supports import SupportError
from solvers.structure.time_scheme import Statics, TimeScheme
from solvers.timing import Timer
from solvers.values import combine

if TYPE_CHECKING:
    from solvers.contact.contact import Contact
    from solvers.rigid.field import RigidBodies


def build_bodies(case: Case, comm: MPI.Comm) -> list[Body]:
    """The elastic bodies of a case. Raises CaseError (collective)."""
    meshes, locations, elements = _meshes(case, comm)
    return [_body(case, name, comm, meshes.get(name), locations[name], elements[name]) for name in case.elastic_bodies]


def build_structure(
    case: Case,
    comm: MPI.Comm,
    bodies: list[Body],
    contact: Constraint | None,
    timer: Timer,
    rigid: RigidBodies | None = None,
) -> Structure:
    """The field of all bodies; rigid: those that springs may lead to. Raises CaseError (collective)."""
    linear, placed = case.solver.linear, point_springs(case, rigid)
    settings = SolverSettings(build_tolerance(case), linear.method, linear.tolerance)
    try:
        alone = case.coupling is None
        time = _time_scheme(case)
        springs = [spring for _, spring in placed]
        return Structure(bodies, time, settings, contact=contact, exchanges_mass=alone, springs=springs, timer=timer)
    except SpringOutside as error:
        raise case.error(placed[error.spring][0][error.end], str(error)) from None
    except SupportError as error:
        supports = case.elastic_bodies[error.body].supports
        index = next(i for i, support in enumerate(supports) if error.where in (support.on or ()))
        keys = ("structure", "bodies", error.body, "supports", index)
        raise case.error(keys, error.message) from None


def _time_scheme(case: Case) -> TimeScheme:
    assert case.structure is not None
    dynamics = case.structure.dynamics
    return Statics() if dynamics is None else dynamics.time_scheme()


def _body(case: Case, name: str, comm: MPI.Comm, mesh: Mesh | None, locations: Locations, element: Formulation) -> Body:
    settings = case.elastic_bodies[name]
    vectors = {key: getattr(settings, key) for key in VECTORS}
    material = _material(case, name)
    loads = build_loads(settings, locations)
    relaxing = [Branch(part.share, part.time) for part in settings.material.viscous]
    return Body(name, mesh, material, element=element, relaxing=relaxing, **loads, **vectors, comm=comm)


def _meshes(case: Case, comm: MPI.Comm) -> tuple[dict[str, Mesh], dict[str, Locations], dict[str, Formulation]]:
    """The meshes of the bodies on rank 0, with all surfaces that the case names; on all processes the loaded parts and
    the elements."""
    error, meshes, locations, elements = None, {}, {}, {}
    if comm.rank == 0:
        try:
            meshes = {name: read_body(case, name) for name in case.elastic_bodies}
            locations = {name: find_locations(case, name, mesh) for name, mesh in meshes.items()}
            _require_own_laws(case, meshes)
            elements = {name: choose_element(case, name, mesh).element for name, mesh in meshes.items()}
            if case.contact is not None:
                from fsci.builder.adjust import adjusted
                from fsci.builder.tied import join_tied

                meshes = join_tied(case, adjusted(case, meshes))
        except Exception as raised:  # raised on every process below
            error = raised
    error, locations, elements = comm.bcast((error, locations, elements), root=0)
    if error is not None:
        raise error
    return meshes, locations, elements


def _require_own_laws(case: Case, meshes: Mapping[str, Mesh]) -> None:
    """Raises CaseError for a law of the user that is no energy, or unstable at rest."""
    own = [name for name, body in case.elastic_bodies.items() if isinstance(body.material, OwnLawSection)]
    if own:
        from fsci.builder.own_law import own_law_at_rest

        for name in own:
            own_law_at_rest(case, name, meshes[name].points[meshes[name].cells].mean(axis=1).T)


def _material(case: Case, name: str) -> Material:
    assert case.structure is not None
    body, plane = case.elastic_bodies[name], case.structure.plane
    settings = body.material
    if isinstance(settings, OwnLawSection):
        from fsci.builder.own_law import own_law

        return own_law(case, name)
    density = 0.0 if settings.density is None else value_of(settings.density)
    mu, lmbda = settings.lame
    if plane == "stress":
        law = PlaneStressLinearElastic if body.kinematics == "linear" else PlaneStressStVenantKirchhoff
        return law(mu, combine(plane_stress_lambda, mu, lmbda), density)
    if body.kinematics == "linear":
        return LinearElastic(mu, lmbda, density)
    return named(materials, settings.law)(*settings.parameters, density)


# ---------------------------------------------------------------------------------------------------------- probes


def _at(case: Case, structure: Structure, name: str) -> probes.Probe:
    """Raises CaseError."""
    settings = case.probes[name]
    assert settings.at is not None
    try:
        return probes.at_point(structure, _probed(structure, settings), settings.quantity, settings.at)
    except probes.PointOutside as error:
        raise case.error(("probes", name, "at"), str(error)) from None


def _on(case: Case, structure: Structure, name: str) -> probes.Probe:
    settings = case.probes[name]
    assert settings.on is not None
    return probes.on_surface(structure, _probed(structure, settings), settings.quantity, settings.on)


def _whole(case: Case, structure: Structure, name: str) -> probes.Probe:
    settings = case.probes[name]
    chosen = structure.bodies if settings.body is None else [_probed(structure, settings)]
    return probes.of_bodies(structure, chosen, settings.quantity)


def _probed(structure: Structure, settings: Probe) -> Body:
    return next(body for body in structure.bodies if body.name == settings.body)


def _of_pair(case: Case, structure: Structure, name: str) -> probes.Probe:
    from solvers.contact.probes import at_slave

    settings = case.probes[name]
    extreme = settings.extreme or ("largest" if settings.quantity == "pressure" else "least")
    quantity, where = settings.quantity, settings.at or extreme
    return _on_pair(case, structure, name, lambda contact, pair: at_slave(contact, pair, quantity, where))


def _first_contact(case: Case, structure: Structure, name: str) -> probes.Probe:
    from solvers.contact.probes import first_contact

    return _on_pair(case, structure, name, first_contact)


def _of_area(case: Case, structure: Structure, name: str) -> probes.Probe:
    from solvers.contact.probes import of_area

    quantity = case.probes[name].quantity
    return _on_pair(case, structure, name, lambda contact, pair: of_area(contact, pair, quantity))  # type: ignore[arg-type]


def _overlap(case: Case, structure: Structure, name: str) -> probes.Probe:
    from solvers.contact.probes import overlap

    return _on_pair(case, structure, name, overlap)


def _on_pair(
    case: Case, structure: Structure, name: str, of_contact: Callable[[Contact, int], probes.Probe]
) -> probes.Probe:
    """The probe of a pair of the present contact, which has pairs with walls once they are near.

    Until then its gap is not a number, and all else is zero.
    """
    from solvers.contact.contact import Contact

    settings = case.probes[name]
    wanted = settings.pair
    away = nan if settings.quantity in ("gap", "mean_gap", "first_contact") else 0.0

    def probe() -> dict[str, float]:
        contact = structure.constraint
        if not isinstance(contact, Contact) or wanted not in contact.names:
            return {"": away}
        return of_contact(contact, contact.names.index(wanted))()

    return probe


#: How the probes of a structure are made.
STRUCTURE_PROBES: Table[Structure] = {
    ("displacement", "at"): _at,
    ("velocity", "at"): _at,
    ("acceleration", "at"): _at,
    ("displacement", "on"): _on,
    ("reaction", "on"): _on,
    ("traction", "on"): _on,
    ("area", "on"): _on,
    ("gap", "pair"): _of_pair,
    ("mean_gap", "pair"): _of_pair,
    ("pressure", "pair"): _of_pair,
    **{(quantity, "pair"): _of_area for quantity in ("contact_area", "stick_area", "mean_pressure")},
    ("overlap", "pair"): _overlap,
    ("first_contact", "pair"): _first_contact,
    **{(quantity, ""): _whole for quantity in probes.OF_BODIES},
    ("volume", ""): _whole,
}
