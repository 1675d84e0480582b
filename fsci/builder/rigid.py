"""From free bodies in the section `fluid` of a case to rigid bodies in motion, their scheme and probes."""

from __future__ import annotations

from collections.abc import Callable

from mpi4py import MPI

from fsci.builder.columns import Numbers, columns
from fsci.builder.fluid import read_surface
from fsci.builder.solver import build_tolerance
from fsci.case import Case
from fsci.case.free_body import HELD
from fsci.meshes.of_case import require_inside_period
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.rigid import probes
from solvers.rigid.body import PointSpring, RigidBody
from solvers.rigid.field import RigidBodies
from solvers.rigid.inertia import inertia_of_surface
from solvers.timing import Timer


def build_free_bodies(case: Case, comm: MPI.Comm, timer: Timer) -> RigidBodies:
    """The bodies that the flow moves. Raises CaseError (collective)."""
    assert case.fluid is not None
    bodies = [_body(case, name, comm) for name in case.fluid.free_bodies]
    scheme = GeneralisedAlpha.from_rho_inf(case.fluid.dynamics.rho_inf)
    return RigidBodies(bodies, scheme, build_tolerance(case), timer=timer, comm=comm)


def _body(case: Case, name: str, comm: MPI.Comm) -> RigidBody:
    assert case.fluid is not None
    settings = case.fluid.free_bodies[name]
    points, facets = read_surface(case, name, comm)
    require_inside_period(case, ("fluid", "bodies", name), points)
    spin = settings.initial_spin or ()
    return RigidBody(
        name,
        points,
        facets,
        inertia_of_surface(points, facets, settings.density),
        gravity=settings.gravity,
        springs=[PointSpring(spring.at, spring.stiffness, spring.damping) for spring in settings.springs],
        held={way: _not_at_all for word in settings.held for way in HELD[word]},
        initial_velocity=settings.initial_velocity or (),
        initial_spin=(0.0, 0.0, *spin) if len(spin) == 1 else spin,
    )


def _not_at_all(t: float) -> float:
    return 0.0


def build_probes(case: Case, bodies: RigidBodies) -> Callable[[], Numbers]:
    """The probes of rigid bodies."""
    numbers = {body.name: index for index, body in enumerate(bodies.bodies)}
    found: dict[str, probes.Probe] = {}
    for name, settings in case.probes.items():
        if settings.field != "rigid":
            continue
        index = numbers[settings.body or ""]
        if settings.at is not None:
            found[name] = probes.at_point(bodies, index, settings.quantity, settings.at)
        else:
            found[name] = probes.of_body(bodies, index, settings.quantity)
    return columns(found)
