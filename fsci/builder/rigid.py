"""From the free bodies of a case to rigid bodies, their springs, their scheme and probes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import radians

import numpy as np
from mpi4py import MPI

from fsci.builder.columns import Table
from fsci.builder.fluid import build_rigid_bodies, read_surface
from fsci.builder.rigid_contact import build_rigid_contact
from fsci.builder.solver import build_tolerance
from fsci.case import Case
from fsci.case.errors import did_you_mean
from fsci.case.free_body import HELD, FreeMotion, PointSpringSection, RigidDynamics, RigidLoadSection
from fsci.case.values import value_of
from fsci.expression import Expression
from fsci.meshes.of_case import require_shorter_than_period
from solvers.api import Array
from solvers.generalised_alpha import BACKWARD_EULER, GeneralisedAlpha
from solvers.rigid import probes
from solvers.rigid.body import PointLoad, PointSpring, RigidBody, hinged
from solvers.rigid.field import RigidBodies
from solvers.rigid.inertia import inertia_of_surface, without_inertia
from solvers.rigid.line_springs import LineSpring
from solvers.timing import Timer


def build_free_bodies(case: Case, comm: MPI.Comm, timer: Timer) -> RigidBodies:
    """The free bodies. Raises CaseError (collective)."""
    settings = case.rigid or {}
    bodies = [_body(case, name, free, comm) for name, free in settings.items()]
    contact = build_rigid_contact(case, bodies, build_rigid_bodies(case, comm), comm)
    springs = list(_line_springs(case, settings))
    return RigidBodies(
        bodies, _scheme(case), build_tolerance(case), springs=springs, contact=contact, timer=timer, comm=comm
    )


def _scheme(case: Case) -> GeneralisedAlpha:
    """That of elastic bodies unless another one is given, so that momentum is kept where they touch.

    In a flow alone that with rho_inf 0: drag stops light bodies within a step, and anything else would let them swing.
    """
    section = case.fluid or case.rigid_section
    own = None if section is None else section.dynamics
    if _static(case):
        return BACKWARD_EULER
    if own is None and case.structure is not None and case.structure.dynamics is not None:
        return case.structure.dynamics.generalised_alpha()
    if own is None and case.fluid is not None:
        return GeneralisedAlpha.from_rho_inf(0.0)
    return GeneralisedAlpha.from_rho_inf((own or RigidDynamics()).rho_inf)


def _static(case: Case) -> bool:
    return case.structure is not None and case.structure.dynamics is None


def _body(case: Case, name: str, settings: FreeMotion, comm: MPI.Comm) -> RigidBody:
    points, facets = read_surface(case, name, comm)
    if case.fluid is not None:
        require_shorter_than_period(case, ("fluid", "bodies", name), points)
    spin = [radians(rate) for rate in settings.initial_angular_velocity or ()]
    inertia = inertia_of_surface(points, facets, settings.density)
    body = RigidBody(
        name,
        points,
        facets,
        inertia,
        gravity=None if settings.gravity is None else [value_of(one) for one in settings.gravity],
        springs=[_point_spring(spring) for spring in settings.springs if spring.to is None],
        loads=[_load(load) for load in settings.loads],
        held={way: _not_at_all for word in settings.held for way in HELD[word]},
        initial_velocity=settings.initial_velocity or (),
        initial_spin=(0.0, 0.0, *spin) if len(spin) == 1 else spin,
    )
    body = body if settings.pivot is None else hinged(body, settings.pivot)
    return replace(body, inertia=without_inertia(body.inertia)) if _static(case) else body


def _not_at_all(t: float) -> float:
    return 0.0


def _point_spring(spring: PointSpringSection) -> PointSpring:
    stiffness = spring.stiffness if len(spring.stiffness) > 1 else spring.stiffness[0]
    return PointSpring(spring.at, stiffness, spring.damping, spring.dashpot)


def _line_springs(case: Case, settings: Mapping[str, FreeMotion]) -> Iterator[LineSpring]:
    """Springs to points of other rigid bodies and at rest, each once."""
    numbers = {name: index for index, name in enumerate(settings)}
    for name, free in settings.items():
        for spring in free.springs:
            if (end := spring.to) is None or end.body in case.elastic_bodies:
                continue
            other = None if end.body is None else numbers[end.body]
            yield LineSpring(numbers[name], spring.at, other, end.at, spring.law())


def _load(load: RigidLoadSection) -> PointLoad:
    moment = load.moment or ()
    return PointLoad(_vector(load.force or ()), _vector((None, None, *moment) if len(moment) == 1 else moment), load.at)


def _vector(components: Sequence[Expression | None]) -> Callable[[float], Array]:
    """A function: time [s] -> the components, shape (3,); those that are not given are zero."""

    def at(t: float) -> Array:
        found = np.zeros(3)
        for axis, component in enumerate(components):
            found[axis] = 0.0 if component is None else float(component.at_times(t))
        return found

    return at


def _at(case: Case, bodies: RigidBodies, name: str) -> probes.Probe:
    settings = case.probes[name]
    assert settings.at is not None
    return probes.at_point(bodies, _index(bodies, settings.body), settings.quantity, settings.at)


def _whole(case: Case, bodies: RigidBodies, name: str) -> probes.Probe:
    settings = case.probes[name]
    return probes.of_body(bodies, _index(bodies, settings.body), settings.quantity)


def _on_given(case: Case, bodies: RigidBodies, name: str) -> probes.Probe:
    """Raises CaseError."""
    on, contact, body = case.probes[name].on or "", bodies.contact, case.probes[name].body
    names = [] if contact is None else contact.given
    if contact is None or on not in names:
        raise case.error(("probes", name, "on"), f"free bodies do not touch '{on}'{did_you_mean(on, names)}")
    return probes.on_given(contact, on, None if body is None else _index(bodies, body))


def _index(bodies: RigidBodies, name: str | None) -> int:
    return [body.name for body in bodies.bodies].index(name or "")


#: How the probes of rigid bodies are made.
RIGID_PROBES: Table[RigidBodies] = {
    ("displacement", "at"): _at,
    ("velocity", "at"): _at,
    ("mass", ""): _whole,
    ("centre", ""): _whole,
    ("momentum", ""): _whole,
    ("angular_momentum", ""): _whole,
    ("contact_force", "on"): _on_given,
}
