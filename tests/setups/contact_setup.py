"""Bodies that touch, for several tests: meshes, structures with contact, and homogeneous states known exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from scipy.optimize import brentq
from structure_setup import block, corner_count, corner_shape_functions

from coupling.contact_surfaces import contact_surface
from solvers.contact.contact import Contact
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.law.law import Law
from solvers.contact.pair import Pair
from solvers.contact.surface import Surface
from solvers.mesh.mesh import Mesh
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Body, Support
from solvers.structure.field import Structure
from solvers.structure.materials import NeoHooke
from solvers.structure.time_scheme import Statics

SETTINGS = SolverSettings(Tolerance(residual=1e-11, residual_absolute=1e-11, max_iterations=15), linear="direct")
MATERIAL = NeoHooke(mu=400.0, lmbda=600.0, density=1.0)


def make_body(name: str, mesh: Mesh, material=MATERIAL, **loads) -> Body:
    return Body(name, mesh, material, **loads, comm=MPI.COMM_SELF)


def make_contact(
    bodies: Sequence[Body],
    pairs: Sequence[tuple],
    *,
    time=None,
    settings: SolverSettings = SETTINGS,
    c_n: float = 1.0,
    law: Law = Frictionless(),
    exchanges_mass: bool = False,
) -> tuple[Structure, Contact]:
    """Each pair is slave and master, (body, surface) or a rigid surface, and its own law if it is not `law`."""
    found: dict[tuple[str, str], Surface] = {}

    def side(of: tuple[str, str] | Surface) -> Surface:
        if isinstance(of, Surface):
            return of
        if of not in found:
            found[of] = contact_surface(bodies, *of)
        return found[of]

    parts = [Pair(side(slave), side(master), law=own[0] if own else law) for slave, master, *own in pairs]
    contact = Contact(parts, c_n=c_n, comm=MPI.COMM_SELF)
    time = time or Statics()
    return Structure(bodies, time, settings, contact=contact, exchanges_mass=exchanges_mass), contact


def solve_step(structure: Structure, t: float = 0.0, dt: float = 1.0, *, first: bool = True):
    """One step to the tolerance."""
    if first:
        structure.initialise(t, dt)
    structure.begin_step(t, dt)
    info = structure.solve()
    structure.end_step()
    return info


def brick(cell_type: str, cells: int, size: Sequence[float], origin: Sequence[float], irregular: float = 0.1) -> Mesh:
    """A box whose corners are moved at random, on its faces within the face, by up to this share of a cell."""
    mesh = block(cell_type, cells)
    rng = np.random.default_rng(cells)
    corners = np.unique(mesh.cells[:, : corner_count(mesh)])
    points = mesh.points.copy()
    inside = (points[corners] > 1e-9) & (points[corners] < 1 - 1e-9)
    points[corners] += inside * rng.uniform(-irregular / cells, irregular / cells, inside.shape)
    weights = corner_shape_functions(mesh)
    points[mesh.cells] = np.einsum("nc,kcd->knd", weights, points[mesh.cells[:, : weights.shape[1]]])
    return replace(mesh, points=points * np.asarray(size) + np.asarray(origin))


def turned(mesh: Mesh, rotation: np.ndarray) -> Mesh:
    return replace(mesh, points=mesh.points @ rotation.T)


def pressed(dim: int, stretch: float, material=MATERIAL, *, sides_free: bool = True) -> tuple[np.ndarray, float, float]:
    """Homogeneous neo-Hookean state of this stretch along the last axis (plane strain in 2D).

    (diagonal of F, contact pressure per present area, load per reference area)
    """

    def kirchhoff(lateral: float) -> np.ndarray:
        squares = np.array([lateral**2] * (dim - 1) + [stretch**2])
        return material.mu * (squares - 1.0) + material.lmbda * 0.5 * np.log(np.prod(squares))

    lateral = brentq(lambda a: kirchhoff(a)[0], 0.8, 1.25, xtol=1e-15, rtol=1e-14) if sides_free else 1.0
    pressure = -kirchhoff(lateral)[-1] / (lateral ** (dim - 1) * stretch)
    return np.array([lateral] * (dim - 1) + [stretch]), pressure, pressure * lateral ** (dim - 1)


def pressures(contact: Contact) -> np.ndarray:
    """Contact pressures [Pa] of the active nodes."""
    active = contact.active_set.active
    return np.einsum("nd,nd->n", contact.z[active], contact.terms.normals[active])


def press_blocks(
    lower: Mesh, upper: Mesh, exact, *, far: str, slave: str, masters_edge: float = 1.0, load: float = 0.0, sides=()
):
    """Bodies `lower` and `upper` pressed together by the displacement `exact` of their far sides.

    far: all components of `exact` are held there, or only the `normal` one. sides: held normal to themselves.
    The top of `lower` carries the dead `load` where it is not covered, beyond `masters_edge` in every direction.
    Returns (structure, contact, info).
    """
    dim = lower.points.shape[1]

    def component(i: int):
        return tuple(exact[i] if k == i else None for k in range(dim))

    held = [Support(side, component(i)) for side, i in sides]
    bodies = [
        make_body(name, mesh, supports=[*held, Support(surface, exact if far == "all" else component(dim - 1))])
        for name, mesh, surface in (("lower", lower, "bottom"), ("upper", upper, "top"))
    ]
    near = [("upper", "bottom"), ("lower", "top")]
    structure, contact = make_contact(bodies, [tuple(near if slave == "upper" else near[::-1])])
    structure.initialise(0.0, 1.0)
    if load:
        bodies[0].dead_load += uncovered_load(bodies[0], load, masters_edge)
    return structure, contact, solve_step(structure, first=False)


def uncovered_load(body: Body, load: float, edge: float) -> np.ndarray:
    """Nodal forces of a load on the part of the top beyond `edge`, exactly integrated; facets are a lattice on [0, 1].

    Integrals over the square minus those over the covered one; both are products of integrals over lines.
    """
    dim = body.dim
    top = np.flatnonzero(np.abs(body.points[dim - 1, : body.owned] - body.points[dim - 1].max()) < 1e-12)
    order = 2 if body.domain.cell_type in ("triangle6", "quad9", "hexahedron27") else 1
    whole, covered = np.ones(len(top)), np.ones(len(top))
    for axis in range(dim - 1):
        s = body.points[axis, top]
        lines = np.unique(s.round(12))
        index = np.searchsorted(lines, s - 1e-9)
        whole *= line_integrals(lines, order, 1.0)[index]
        covered *= line_integrals(lines, order, edge)[index]
    force = np.zeros((body.owned, dim))
    force[top, dim - 1] = -load * (whole - covered)
    return force.ravel()


def line_integrals(nodes: np.ndarray, order: int, end: float) -> np.ndarray:
    """Integral from 0 to `end` of every nodal shape function on a line."""
    found = np.zeros(len(nodes))
    for first in range(0, len(nodes) - 1, order):
        cell = nodes[first : first + order + 1]
        stop = min(max(end, cell[0]), cell[-1])
        for i, node in enumerate(cell):
            others = np.delete(cell, i)
            antiderivative = np.poly1d(np.poly(others) / np.prod(node - others)).integ()
            found[first + i] += antiderivative(stop) - antiderivative(cell[0])
    return found


def displacement_error(structure: Structure, exact, t: float = 1.0) -> float:
    """Largest error of the displacement relative to the largest exact one."""
    errors, sizes = [], []
    for body, u in zip(structure.bodies, structure.split(structure.now.u), strict=True):
        wanted = np.stack([component(body.points, t) for component in exact], axis=1)
        errors.append(np.abs(u.reshape(-1, structure.dim) - wanted).max())
        sizes.append(np.abs(wanted).max())
    return max(errors) / max(sizes)
