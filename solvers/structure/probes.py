"""Probes of the structure: at points, on surfaces, of whole bodies.

A probe is a function without arguments that every process calls. It returns values by component.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
import ufl
from mpi4py import MPI

from solvers import fem
from solvers.algebra.blocks import times
from solvers.api import Array
from solvers.structure import forms
from solvers.structure.body import Body
from solvers.structure.field import Structure

Probe = Callable[[], dict[str, float]]


class PointOutside(ValueError):
    """A probe's point is not in the body."""


def at_point(structure: Structure, body: Body, quantity: str, point: Sequence[float]) -> Probe:
    """Probe of the displacement [m], velocity [m/s] or acceleration [m/s^2] of a material point (collective).

    point: reference position [m]. Raises PointOutside.
    """
    comm = structure.comm
    found = fem.locate_point(body.domain, np.asarray(point, dtype=float))
    owner = comm.allreduce(comm.rank if found is not None else -1, op=MPI.MAX)
    if owner < 0:
        raise PointOutside(f"the point {tuple(point)} is not in body '{body.name}'")
    index = structure.bodies.index(body)
    function = fem.function(body.space)
    name = {"displacement": "u", "velocity": "v", "acceleration": "a"}[quantity]
    if found is not None:
        cell, reference = found
        blocks, weights = body.space.dofmap.cell_dofs(cell), fem.tabulate(body.domain, reference)

    def probe() -> dict[str, float]:
        function.x.array[: body.size] = structure.split(getattr(structure.now, name))[index]
        function.x.scatter_forward()
        value = None if found is None else weights @ function.x.array.reshape(-1, body.dim)[blocks]
        return _components(comm.bcast(value, root=owner))

    return probe


def on_surface(structure: Structure, body: Body, quantity: str, surface: str) -> Probe:
    """Probe of a resultant or mean over a named surface, in the reference configuration (collective).

    reaction: force [N] of supports and springs; traction: int P N dA [N]; displacement: mean [m]; area [m^2].
    """
    if quantity == "reaction":
        return _reaction(structure, body, surface)
    ds, along = fem.surface_measure(body.domain, surface, body.mass_degree), fem.direction(body.domain)
    if quantity == "traction":
        P = forms.first_piola_kirchhoff(body.u, body.element, body.active)
        resultant = fem.compile_form(ufl.dot(P * ufl.FacetNormal(body.domain.mesh), along) * ds)

        def force() -> dict[str, float]:
            body.element.prepare_output()
            return _components(fem.assemble_components(resultant, along, structure.comm))

        return force
    area = fem.compile_form(fem.constant(body.domain, 1.0) * ds)
    if quantity == "area":
        return lambda: {"": fem.assemble_scalar(area, structure.comm)}
    total = fem.compile_form(ufl.dot(body.u, along) * ds)

    def displacement() -> dict[str, float]:
        size = fem.assemble_scalar(area, structure.comm)
        return _components([one / size for one in fem.assemble_components(total, along, structure.comm)])

    return displacement


def _reaction(structure: Structure, body: Body, surface: str) -> Probe:
    index = structure.bodies.index(body)
    blocks = fem.surface_blocks(body.domain, body.space, surface)
    blocks = np.unique(blocks[blocks < body.owned])

    def probe() -> dict[str, float]:
        force = structure.split(structure.time.reaction(structure))[index] - body.spring_force()
        return _components(structure.comm.allreduce(force.reshape(-1, body.dim)[blocks].sum(axis=0)))

    return probe


def of_bodies(structure: Structure, bodies: Sequence[Body], quantity: str) -> Probe:
    """Probe of an integral over bodies (collective).

    energy [J] of the whole structure: kinetic, internal, work (of loads and supports), total; mass [kg]; volume [m^3]
    of the deformed bodies; centre of mass [m]; momentum [kg m/s]; angular_momentum [kg m^2/s] about the origin.
    """
    if quantity == "volume":
        return _volume(structure, bodies)
    return partial(OF_BODIES[quantity], structure, bodies)


def _energy(structure: Structure, bodies: Sequence[Body]) -> dict[str, float]:
    energy = structure.energy
    return {
        "kinetic": energy.kinetic,
        "internal": energy.internal,
        "work": energy.work,
        "total": energy.kinetic + energy.internal,
    }


def _sums(structure: Structure, bodies: Sequence[Body], array: Array) -> Array:
    """Sums of nodal values by component. Those of M f are int rho f dX: shape functions add up to one."""
    parts = zip(structure.bodies, structure.split(array), strict=True)
    total = sum(part.reshape(-1, structure.dim).sum(axis=0) for body, part in parts if body in bodies)
    return structure.comm.allreduce(total)


def _mass(structure: Structure, bodies: Sequence[Body]) -> float:
    return float(_sums(structure, bodies, times(structure.inertia.assemble_mass(), np.ones_like(structure.now.u)))[0])


def _momenta(structure: Structure) -> Array:
    """Momentum [kg m/s] of the nodes, with that of massless ones on the others."""
    return structure.inertia.times(structure.now.v)


def _positions(structure: Structure) -> Array:
    reference = [body.points[: body.dim, : body.owned].T.ravel() for body in structure.bodies]
    return np.concatenate(reference) + structure.now.u


def _centre(structure: Structure, bodies: Sequence[Body]) -> dict[str, float]:
    inertia = structure.inertia
    moments, rigid, frame = times(inertia.assemble_mass(), _positions(structure)), inertia.find_rigid(), inertia.frame
    if rigid is not None and frame is not None:
        moments = moments + rigid.on_nodes(frame, frame.first, np.zeros_like(frame.first))
    return _components(_sums(structure, bodies, moments) / _mass(structure, bodies))


def _angular_momentum(structure: Structure, bodies: Sequence[Body]) -> dict[str, float]:
    momenta = structure.split(_momenta(structure))
    total = np.zeros(3)
    for body, x, p in zip(structure.bodies, structure.split(_positions(structure)), momenta, strict=True):
        if body in bodies:
            arms, moments = (np.pad(a.reshape(-1, body.dim), ((0, 0), (0, 3 - body.dim))) for a in (x, p))
            total += np.cross(arms, moments).sum(axis=0)
    total = structure.comm.allreduce(total)
    return _components(total) if structure.dim == 3 else {"": float(total[2])}


def _volume(structure: Structure, bodies: Sequence[Body]) -> Probe:
    volumes = [
        fem.compile_form(
            ufl.det(forms.deformation_gradient(body.u)) * fem.volume_measure(body.domain, body.mass_degree)
        )
        for body in bodies
    ]
    return lambda: {"": sum(fem.assemble_scalar(form, structure.comm) for form in volumes)}


def _components(values: Sequence[float] | Array) -> dict[str, float]:
    return {axis: float(value) for axis, value in zip("xyz", values, strict=False)}


#: Quantity of bodies -> its values by component at the end of a step (collective).
OF_BODIES: Mapping[str, Callable[[Structure, Sequence[Body]], dict[str, float]]] = {
    "energy": _energy,
    "mass": lambda structure, bodies: {"": _mass(structure, bodies)},
    "centre": _centre,
    "momentum": lambda structure, bodies: _components(_sums(structure, bodies, _momenta(structure))),
    "angular_momentum": _angular_momentum,
}
