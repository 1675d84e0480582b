"""Construction of the objects of a run from a case. Only the modules of this folder import all classes.

A part that the case does not mention is not imported.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from mpi4py import MPI

from fsci.builder.columns import Numbers, build_probes, joined
from fsci.builder.known_pairs import require_known_pairs
from fsci.case import Case
from solvers.api import Scheme, Sentinel, Snapshot
from solvers.timing import Timer

if TYPE_CHECKING:
    from solvers.contact.contact import Contact
    from solvers.contact.results import PartFields
    from solvers.fluid.flow.resolution.cells import BodyCells
    from solvers.rigid.field import RigidBodies
    from solvers.structure.body import Body
    from solvers.structure.field import Structure


@dataclass(frozen=True)
class Simulation:
    """The objects that the run loop uses; every function is collective."""

    scheme: Scheme
    initialise: Callable[[float, float], None]  #: state at the first time, for a given step size
    snapshots: Callable[[], list[Snapshot]]  #: on rank 0, empty elsewhere
    probes: Callable[[], Numbers]  #: column -> value
    balances: Callable[[], Numbers]  #: column -> value
    dofs: dict[str, int]
    notes: list[str] = field(default_factory=list)  #: notes to the user on changes of meshes, on rank 0
    sentinels: dict[str, Sentinel] = field(default_factory=dict)  #: by a name in the saved state
    take_materials: Callable[[], None] = lambda: None  #: go on from a restored state with other materials
    imbalance: Callable[[], Numbers] = dict  #: of contact work, with facets dealt out evenly and as it was
    resolution: Callable[[], list[BodyCells]] = list  #: cells across the bodies in the flow, their layers and gaps


def build(case: Case, comm: MPI.Comm, timer: Timer) -> Simulation:
    """All objects of a case (collective). Raises CaseError for mistakes that only the meshes show."""
    if case.contact is not None:
        from fsci.builder.automatic_pairs import with_pairs

        case = with_pairs(case, comm)
    require_known_pairs(case)
    if case.fluid is not None:
        from fsci.builder.on_first import on_first
        from fsci.meshes.enclosed import require_outlet

        on_first(comm, partial(require_outlet, case))
    if case.coupling is not None:
        return _coupled(case, comm, timer) if case.structure is not None else _coupled_rigid(case, comm, timer)
    if case.fluid is not None:
        return _fluid_alone(case, comm, timer)
    if case.rigid and case.structure is not None:
        return _structure_and_rigid(case, comm, timer)
    return _rigid_alone(case, comm, timer) if case.rigid else _structure_alone(case, comm, timer)


def _structure_alone(case: Case, comm: MPI.Comm, timer: Timer) -> Simulation:
    from fsci.builder.structure import STRUCTURE_PROBES, build_bodies, build_structure
    from solvers.structure.snapshot import snapshots

    bodies = build_bodies(case, comm)
    contact = _contact(case, comm, bodies)
    structure = build_structure(case, comm, bodies, contact, timer)
    _know_loads(contact, structure)
    return Simulation(
        scheme=structure,
        initialise=structure.initialise,
        snapshots=lambda: snapshots(structure, _contact_fields(structure)),
        probes=build_probes(case, "structure", STRUCTURE_PROBES, structure),
        balances=lambda: {"structure.energy": structure.energy.error},
        dofs={"structure": structure.dofs()},
        notes=_notes(case, bodies),
        sentinels={
            **_of_bodies(case, comm, structure, contact),
            "energy": structure.energy_sentinel,
        },
        take_materials=structure.take_materials,
        imbalance=partial(_imbalance, structure),
    )


def _rigid_alone(case: Case, comm: MPI.Comm, timer: Timer) -> Simulation:
    from fsci.builder.rigid import RIGID_PROBES, build_free_bodies
    from fsci.builder.sentinels import build_sentinels
    from solvers.rigid.snapshot import snapshots

    bodies = build_free_bodies(case, comm, timer)
    return Simulation(
        scheme=bodies,
        initialise=bodies.initialise,
        snapshots=lambda: snapshots(bodies),
        probes=build_probes(case, "rigid", RIGID_PROBES, bodies),
        balances=dict,
        dofs={"rigid": bodies.unknowns},
        sentinels=build_sentinels(case, comm, rigid=bodies),
    )


def _structure_and_rigid(case: Case, comm: MPI.Comm, timer: Timer) -> Simulation:
    from coupling.composite import Composite
    from coupling.elastic import Elastic
    from fsci.builder.rigid import RIGID_PROBES, build_free_bodies
    from fsci.builder.sentinels import build_sentinels
    from fsci.builder.structure import STRUCTURE_PROBES, build_bodies, build_structure
    from solvers.rigid.snapshot import snapshots as of_rigid
    from solvers.structure.snapshot import snapshots as of_structure

    rigid, bodies = build_free_bodies(case, comm, timer), build_bodies(case, comm)
    contact = _contact(case, comm, bodies, rigid)
    structure = build_structure(case, comm, bodies, contact, timer, rigid)
    _know_loads(contact, structure, rigid)
    scheme = Composite(Elastic(structure, ()), rigid)
    probes = [
        build_probes(case, "structure", STRUCTURE_PROBES, structure),
        build_probes(case, "rigid", RIGID_PROBES, rigid),
    ]
    return Simulation(
        scheme=scheme,
        initialise=scheme.initialise,
        snapshots=lambda: of_structure(structure, _contact_fields(structure)) + of_rigid(rigid),
        probes=joined(probes),
        balances=lambda: {"structure.energy": structure.energy.error},
        dofs={"structure": structure.dofs(), "rigid": rigid.unknowns},
        notes=_notes(case, bodies),
        sentinels={
            **build_sentinels(case, comm, structure=structure, contact=contact, rigid=rigid),
            "energy": structure.energy_sentinel,
        },
        take_materials=structure.take_materials,
        imbalance=lambda: {} if contact is None else contact.imbalance,
    )


def _of_bodies(case: Case, comm: MPI.Comm, structure: Structure, contact: Contact | None) -> dict[str, Sentinel]:
    """Sentinels of a structure; one body alone has nothing to meet."""
    if contact is None and len(structure.bodies) == 1:
        return {}
    from fsci.builder.sentinels import build_sentinels

    return build_sentinels(case, comm, structure=structure, contact=contact)


def _contact(case: Case, comm: MPI.Comm, bodies: list[Body], rigid: RigidBodies | None = None) -> Contact | None:
    if case.contact is None or not case.contact.pairs:  # rigid bodies alone may touch
        return None
    from fsci.builder.contact import build_contact

    return build_contact(case, comm, bodies, rigid)


def _know_loads(contact: Contact | None, structure: Structure, rigid: RigidBodies | None = None) -> None:
    if contact is not None and contact.unheld.bodies:
        from fsci.builder.contact import know_loads

        know_loads(contact, structure, rigid)


def _contact_fields(structure: Structure) -> PartFields | None:
    if structure.constraint is None:
        return None
    from solvers.contact.contact import Contact
    from solvers.contact.results import surface_fields

    assert isinstance(structure.constraint, Contact)
    return surface_fields(structure.constraint)


def _imbalance(structure: Structure) -> Numbers:
    if structure.constraint is None:
        return {}
    from solvers.contact.contact import Contact

    assert isinstance(structure.constraint, Contact)
    return structure.constraint.imbalance


def _coupled(case: Case, comm: MPI.Comm, timer: Timer) -> Simulation:
    from fsci.builder import fluid as build_fluid
    from fsci.builder import structure as build_structure
    from fsci.builder.coupling import build_coupled, start
    from fsci.builder.dry_side import outlines
    from fsci.builder.flow_loads import loads_of_flow
    from fsci.builder.jumps import at_jumps
    from fsci.builder.sentinels import build_sentinels
    from fsci.builder.watch_flow import WatchedFlow
    from solvers.fluid.flow.probes import Forces
    from solvers.fluid.flow.resolution.measure import measure
    from solvers.fluid.flow.snapshot import snapshots as of_fluid
    from solvers.fluid.flow.snapshot import surface_forces
    from solvers.structure.snapshot import snapshots as of_structure

    rigid = _free_bodies(case, comm, timer)

    bodies = build_structure.build_bodies(case, comm)
    contact = _contact(case, comm, bodies, rigid)
    structure = build_structure.build_structure(case, comm, bodies, contact, timer, rigid)
    _know_loads(contact, structure, rigid)
    scheme, fluid = build_coupled(case, comm, bodies, structure, timer, rigid)
    coupled = scheme.coupled
    watched = WatchedFlow(fluid)
    probes = [
        build_probes(case, "structure", build_structure.STRUCTURE_PROBES, structure),
        build_probes(case, "fluid", build_fluid.FLUID_PROBES, Forces(fluid)),
    ]
    if rigid is not None:
        from fsci.builder.rigid import RIGID_PROBES

        probes.append(build_probes(case, "rigid", RIGID_PROBES, rigid))

    def snapshots() -> list[Snapshot]:
        dry = outlines(fluid, coupled.interface.dry_sides)
        forces = surface_forces(fluid)
        loads = loads_of_flow(coupled.solid, fluid, forces)
        return of_structure(structure, _contact_fields(structure), loads) + of_fluid(fluid, forces) + dry

    return Simulation(
        scheme=at_jumps(case, scheme),
        initialise=partial(start, case, scheme, fluid),
        snapshots=snapshots,
        probes=joined(probes),
        balances=lambda: {"structure.energy": structure.energy.error, **watched.numbers(), **coupled.balance.numbers()},
        dofs={"fluid": fluid.dofs(), "structure": structure.dofs()}
        | ({} if rigid is None else {"rigid": rigid.unknowns}),
        notes=_notes(case, bodies),
        sentinels={
            **build_sentinels(case, comm, structure=structure, contact=contact, rigid=rigid, given=fluid.bodies),
            **watched.sentinels,
            "energy": structure.energy_sentinel,
            "interface": coupled.sentinel,
        },
        take_materials=structure.take_materials,
        imbalance=partial(_imbalance, structure),
        resolution=partial(measure, fluid),
    )


def _free_bodies(case: Case, comm: MPI.Comm, timer: Timer) -> RigidBodies | None:
    if not case.rigid:
        return None
    from fsci.builder.rigid import build_free_bodies

    return build_free_bodies(case, comm, timer)


def _coupled_rigid(case: Case, comm: MPI.Comm, timer: Timer) -> Simulation:
    from fsci.builder import fluid as build_fluid
    from fsci.builder import rigid as build_rigid
    from fsci.builder.coupling import build_coupled_rigid, start
    from fsci.builder.jumps import at_jumps
    from fsci.builder.sentinels import build_sentinels
    from fsci.builder.watch_flow import WatchedFlow
    from solvers.fluid.flow.probes import Forces
    from solvers.fluid.flow.resolution.measure import measure
    from solvers.fluid.flow.snapshot import snapshots

    bodies = build_rigid.build_free_bodies(case, comm, timer)
    scheme, fluid = build_coupled_rigid(case, comm, bodies, timer)
    watched = WatchedFlow(fluid)
    probes = [
        build_probes(case, "rigid", build_rigid.RIGID_PROBES, bodies),
        build_probes(case, "fluid", build_fluid.FLUID_PROBES, Forces(fluid)),
    ]
    return Simulation(
        scheme=at_jumps(case, scheme),
        initialise=partial(start, case, scheme, fluid),
        snapshots=lambda: snapshots(fluid),
        probes=joined(probes),
        balances=lambda: {**watched.numbers(), **scheme.coupled.balance.numbers()},
        dofs={"fluid": fluid.dofs(), "rigid": bodies.unknowns},
        notes=_notes(case, []),
        sentinels={
            **build_sentinels(case, comm, rigid=bodies, given=fluid.bodies),
            **watched.sentinels,
            "interface": scheme.coupled.sentinel,
        },
        resolution=partial(measure, fluid),
    )


def _fluid_alone(case: Case, comm: MPI.Comm, timer: Timer) -> Simulation:
    from fsci.builder.fluid import FLUID_PROBES, build_fluid, build_rigid_bodies
    from fsci.builder.jumps import at_jumps
    from fsci.builder.watch_flow import WatchedFlow
    from solvers.fluid.flow.probes import Forces
    from solvers.fluid.flow.resolution.measure import measure
    from solvers.fluid.flow.snapshot import snapshots

    fluid = build_fluid(case, comm, timer, build_rigid_bodies(case, comm))
    watched = WatchedFlow(fluid)
    return Simulation(
        scheme=at_jumps(case, fluid),
        initialise=fluid.initialise,
        snapshots=lambda: snapshots(fluid),
        probes=build_probes(case, "fluid", FLUID_PROBES, Forces(fluid)),
        balances=watched.numbers,
        sentinels=watched.sentinels,
        dofs={"fluid": fluid.dofs()},
        notes=_notes(case, []),
        resolution=partial(measure, fluid),
    )


def _notes(case: Case, bodies: list[Body]) -> list[str]:
    from fsci.builder.elements import choose_element
    from fsci.case.flow_element import flow_element

    meshes = {body.name: body.domain.source for body in bodies if body.domain.source is not None}
    notes = [f"mesh of body '{name}': {mesh.note}" for name, mesh in meshes.items() if mesh.note]
    chosen = {name: choose_element(case, name, mesh) for name, mesh in meshes.items()}
    notes += [f"body '{name}': {words}" for name, one in chosen.items() for words in one.notes]
    if case.fluid is not None and (flow := flow_element(case)).why:
        notes.append(f"flow: element {flow}")
    return notes + [f"warning: body '{name}': {words}" for name, one in chosen.items() for words in one.warnings]
