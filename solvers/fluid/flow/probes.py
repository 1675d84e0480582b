"""Probes of the fluid: at points, on patches of the box, on bodies, of the whole fluid.

A probe is a function without arguments that every process calls. It returns values by name of the component. In 2D
all extensive quantities are per depth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Protocol, TypeVar

import numpy as np
import ufl
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array, Step
from solvers.fluid.flow.field import Fluid
from solvers.fluid.grid.nested import Nested
from solvers.fluid.mesh.space import FlowNodes
from solvers.fluid.surfaces.inside import INSIDE, require_outside, winding
from solvers.fluid.terms import forms
from solvers.fluid.terms.boundary.covered_faces import CoveredFaces, covered_faces
from solvers.fluid.terms.boundary.patches import outlet_laws
from solvers.mesh.lagrange import lagrange

Probe = Callable[[], dict[str, float]]
T = TypeVar("T")


def renewed(fluid: Fluid, make: Callable[[], T]) -> Callable[[], T]:
    """What is made of the flow, again where thin bodies have gone to other cells."""
    found, made_of = make(), fluid.grid

    def latest() -> T:
        nonlocal found, made_of
        if fluid.grid is not made_of:
            found, made_of = make(), fluid.grid
        return found

    return latest


# ---------------------------------------------------------------------------------------------------------- points


def at_point(fluid: Fluid, quantity: str, point: Sequence[float], t: float) -> Probe:
    """Probe of the velocity [m/s] or pressure [Pa] at a point of the box; nan while a body covers it (collective).

    Raises PointInBody if a body with a prescribed motion covers the point at the time t [s].
    """
    x = np.asarray(point, dtype=float)
    given = [body for body in fluid.bodies if body.motion is not None]
    motions = [body.motion(t) for body in given if body.motion is not None]
    surfaces, periods = [body.surface for body in given], fluid.parts.cutter.periods
    images = [periods.images(s.facets, m.x, 0) for s, m in zip(surfaces, motions, strict=True)]
    surfaces = [replace(s, facets=i.facets, vertices=len(i.x)) for s, i in zip(surfaces, images, strict=True)]
    require_outside(x, surfaces, [i.motion(m) for i, m in zip(images, motions, strict=True)])
    may_be_covered = not all(body.rests for body in fluid.bodies)

    def shape_functions() -> tuple[np.ndarray, Array]:
        unknowns = fluid.unknowns
        nodes, degree = (unknowns.velocity, unknowns.degree) if quantity == "velocity" else (unknowns.pressure, 1)
        return interpolation(fluid, nodes, degree, x)

    found = renewed(fluid, shape_functions)

    def probe() -> dict[str, float]:
        dofs, weights = shape_functions() if may_be_covered and fluid.grid.sheets is not None else found()
        value = fluid.comm.allreduce(weights @ fluid.flow[dofs])
        if may_be_covered and _covered(fluid, x):
            value = np.full_like(value, np.nan)
        return _components(value) if quantity == "velocity" else {"": float(value[0])}

    return probe


def _covered(fluid: Fluid, x: Array) -> bool:
    """Whether a point [m] of the box is in a body."""
    images = fluid.cut.images
    return winding(x, images.motion(fluid.cut.motion), images.facets) > INSIDE


def interpolation(fluid: Fluid, nodes: FlowNodes, degree: int, x: Array) -> tuple[np.ndarray, Array]:
    """(dofs (n, components), shape functions (n,)) of the owned nodes whose cell has the point x [m]."""
    nested, sheets = fluid.grid.nested, fluid.grid.sheets
    if nested is not None:
        cell, numbers, weights = _in_nested(nested, degree, x)
        if sheets is not None and nested.width[cell] == 1:
            low, high = nested.bounds(np.array([cell]))
            there = sheets.cell_at(int(nested.first[cell]), ((x - low) / (high - low))[0])
            numbers = sheets.nodes(np.array([there]), degree, _node_steps(degree, fluid.dim))[0]
        return _of_nodes(nodes, numbers, weights)
    number, weight, stride = np.zeros(1, dtype=np.int64), np.ones(1), 1
    indices: list[int] = []
    reference: list[float] = []
    counts = fluid.unknowns.lattice_shape(degree)
    for edge, coordinate, count in zip(fluid.grid.grid.edges, x, counts, strict=True):
        cell = int(np.clip(np.searchsorted(edge, coordinate) - 1, 0, len(edge) - 2))
        s, at_nodes = (coordinate - edge[cell]) / (edge[cell + 1] - edge[cell]), np.arange(degree + 1) / degree
        shape = lagrange(at_nodes, np.array(s))
        steps = (degree * cell + np.arange(degree + 1)) % count
        number = np.add.outer(stride * steps, number).ravel()
        weight = np.multiply.outer(shape, weight).ravel()
        stride *= count
        indices.append(cell)
        reference.append(s)
    if sheets is not None:
        box = int(np.ravel_multi_index(indices, fluid.grid.grid.shape, order="F"))
        there = sheets.cell_at(box, np.array(reference))
        number = sheets.nodes(np.array([there]), degree, _node_steps(degree, fluid.dim))[0]
    return _of_nodes(nodes, number, weight)


def _node_steps(degree: int, dim: int) -> np.ndarray:
    """Steps from the first node of a cell to each, the first direction fastest, shape (nodes, dim)."""
    return np.indices((degree + 1,) * dim).reshape(dim, -1)[::-1].T


def _in_nested(grid: Nested, degree: int, x: Array) -> tuple[int, np.ndarray, Array]:
    """(the nested cell at a point, numbers of its nodes, their shape functions), the first direction fastest."""
    index = [
        int(np.clip(np.searchsorted(edge, at) - 1, 0, len(edge) - 2)) for edge, at in zip(grid.edges, x, strict=True)
    ]
    cell = grid.cell_of[[np.ravel_multi_index(index, grid.shape, order="F")]].astype(np.int64)
    low, high = grid.bounds(cell)
    along = lagrange(np.arange(degree + 1) / degree, ((x - low) / (high - low))[0])
    steps = _node_steps(degree, grid.dim)
    shapes = np.prod(np.take_along_axis(along, steps.T, axis=1), axis=0)
    return int(cell[0]), grid.nodes(cell, degree, steps)[0], shapes


def _of_nodes(nodes: FlowNodes, number: np.ndarray, weight: Array) -> tuple[np.ndarray, Array]:
    """(dofs, weights) of the nodes that this process owns."""
    owned = nodes.numbers[: nodes.owned]
    order = np.argsort(owned)
    at = np.minimum(np.searchsorted(owned[order], number), max(len(owned) - 1, 0))
    mine = owned[order[at]] == number if len(owned) else np.zeros(len(number), dtype=bool)
    return nodes.dofs[order[at[mine]]], weight[mine]


def difference(first: Probe, second: Probe) -> Probe:
    """Probe of the difference of two probes."""

    def probe() -> dict[str, float]:
        subtracted = second()
        return {name: value - subtracted[name] for name, value in first().items()}

    return probe


# --------------------------------------------------------------------------------------------------------- patches


def on_patch(fluid: Fluid, quantity: str, patch: str) -> Probe:
    """Probe of the flow_rate [m^3/s] out of the box through a patch, or of its mean pressure [Pa] (collective)."""
    if quantity == "flow_rate":
        rate = flow_rate(fluid)
        return lambda: {"": rate([patch])}

    def integrals() -> tuple[fem.Integral, fem.Integral]:
        domain, p = fluid.grid.domain, fluid.unknowns.parts(fluid.system.flow)[1]
        ds = fem.measure(domain, "ds", 1)
        return fem.Integral(domain, p * ds), fem.Integral(domain, fem.constant(domain, 1.0) * ds)

    latest = renewed(fluid, integrals)

    def pressure(part: CoveredFaces) -> Array:
        return part.pressure(fluid.flow)

    def probe() -> dict[str, float]:
        facets, covered = _facets(fluid, [patch])
        total, size = (fem.assemble_scalar(f.on(exterior_facet=facets), fluid.comm) for f in latest())
        total += fluid.comm.allreduce(sum(float((p.weights * pressure(p)).sum()) for p in covered))
        size += fluid.comm.allreduce(sum(float(p.weights.sum()) for p in covered))
        return {"": total / size if size else float("nan")}

    return probe


def force_on_patch(fluid: Fluid, patch: str) -> Probe:
    """Probe of the force [N] of the fluid on a patch, int p n - 2 mu eps(u) n over its wet part, n out of the box.

    (collective)
    """

    def integral() -> tuple[fem.Integral, Any]:
        domain = fluid.grid.domain
        along = fem.direction(domain)
        u, p = fluid.unknowns.parts(fluid.system.flow)
        n = ufl.FacetNormal(domain.mesh)
        force = p * n - ufl.dot(forms.viscous_stress(fluid.system.terms, u), n)
        ds = fem.measure(domain, "ds", fluid.unknowns.degree)
        return fem.Integral(domain, ufl.dot(force, along) * ds), along

    latest = renewed(fluid, integral)

    def on_covered(part: CoveredFaces) -> Array:
        mu = fluid.system.viscosity.of(part.cells)
        viscous = part.viscous_traction(fluid.flow, mu if isinstance(mu, float) else mu[:, None])
        traction = part.along_normal(part.pressure(fluid.flow)) - viscous
        return np.asarray(np.einsum("cq,cqi->i", part.weights, traction))

    def probe() -> dict[str, float]:
        facets, covered = _facets(fluid, [patch])
        force, along = latest()
        whole = np.array(fem.assemble_components(force.on(exterior_facet=facets), along, fluid.comm))
        return _components(whole + fluid.comm.allreduce(sum((on_covered(p) for p in covered), np.zeros(fluid.dim))))

    return probe


def of_outlet(fluid: Fluid, patch: str) -> Probe:
    """Probe of the pressure [Pa] that the law of an outlet gives for its flow rate (collective)."""
    number = list(outlet_laws(fluid.patches)).index(patch)
    return lambda: {"": float(fluid.system.outlets.pressures(fluid.iterate.values())[number])}


def driving_force(fluid: Fluid, patch: str) -> Probe:
    """Probe of the force per volume [N/m^3] that drives the rate of a period; nan before the first step."""
    return lambda: {"": fluid.on_cells.driving_forces[patch]}


class FlowRate(Protocol):
    def __call__(self, patches: Sequence[str], among: NDArray[np.bool_] | None = None) -> float: ...


def flow_rate(fluid: Fluid) -> FlowRate:
    """A function: names of patches -> flow rate [m^3/s] out of the box through them (collective).

    Its second argument is a mask of the local cells whose faces count; None: all.
    """

    def integral() -> fem.Integral:
        domain, u = fluid.grid.domain, fluid.unknowns.parts(fluid.system.flow)[0]
        outward = ufl.dot(u, ufl.FacetNormal(domain.mesh))
        return fem.Integral(domain, outward * fem.measure(domain, "ds", fluid.unknowns.degree))

    latest = renewed(fluid, integral)

    def outflow(part: CoveredFaces) -> Array:
        return part.outward(part.velocity(fluid.flow))

    def rate(patches: Sequence[str], among: NDArray[np.bool_] | None = None) -> float:
        facets, covered = _facets(fluid, patches, among)
        whole = fem.assemble_scalar(latest().on(exterior_facet=facets), fluid.comm)
        whole += _across_edges(fluid, patches, among)
        return whole + fluid.comm.allreduce(sum(float((p.weights * outflow(p)).sum()) for p in covered))

    return rate


def _across_edges(fluid: Fluid, patches: Sequence[str], among: NDArray[np.bool_] | None) -> float:
    """What patches let out [m^3/s] beyond their edges, since nodes there have the mean velocity of all that meet.

    The sum over all patches is zero. Nodes beside bodies are left out.
    """
    boundary, shared = fluid.parts.boundary, fluid.parts.boundary.shared
    if not boundary.any_shared:
        return 0.0
    given = [number for number, patch in enumerate(boundary.patches) if patch.record.normal_given]
    wet, _ = _facets(fluid, [boundary.patches[number].name for number in given], among)
    facets, cells = (np.concatenate([parts[number] for number in given]) for parts in (boundary.facets, boundary.cells))
    beside = np.zeros(fluid.unknowns.local)
    beside[fluid.unknowns.cell_velocity[cells[~np.isin(facets, wet)]]] = 1.0
    fem.add_ghosts(fluid.unknowns.space, beside)
    chosen = [number for number, patch in enumerate(boundary.patches) if patch.name in patches]
    counts = np.isin(shared.patches, chosen) & (shared.dofs < fluid.unknowns.owned) & (beside[shared.dofs] == 0.0)
    more = shared.measures * (boundary.given_at_shared(fluid.on_cells.prescribed_at) - fluid.flow[shared.dofs])
    return fluid.comm.allreduce(float(more[counts].sum()))


def _facets(
    fluid: Fluid, patches: Sequence[str], among: NDArray[np.bool_] | None = None
) -> tuple[np.ndarray, list[CoveredFaces]]:
    """(sorted local facets of patches that are wet, those that bodies cover in part); of a period those at its end.

    among: mask of the local cells whose faces count.
    """
    boundary, grid, cut = fluid.parts.boundary, fluid.grid, fluid.cut
    chosen = [i for i, patch in enumerate(boundary.patches) if patch.name in patches]
    facets = np.concatenate([boundary.facets[i][boundary.at_end[i]] for i in chosen])
    cells = np.concatenate([boundary.cells[i][boundary.at_end[i]] for i in chosen])
    order = np.argsort(facets)
    facets, cells = facets[order], cells[order]
    wet = np.zeros(len(grid.numbers), dtype=bool)
    wet[np.concatenate([cut.uncut, cut.cut])] = True
    if among is not None:
        wet &= among
    points = fluid.unknowns.degree + 1
    free, covered = covered_faces(grid, fluid.unknowns, cut, points, facets, cells, boundary.wet_faces)
    return facets[wet[cells] & free], [part.only(wet) for part in covered]


# ---------------------------------------------------------------------------------------------------------- bodies


class Forces:
    """Probes of the forces on bodies, which are computed once per step."""

    def __init__(self, fluid: Fluid):
        self.fluid = fluid
        self._found: dict[str, Array] = {}
        self._step: Step | None = None  #: that these forces belong to

    def probe(self, quantity: str, body: str | None, about: Sequence[float] | None = None) -> Probe:
        """Probe of the force [N] on a body, its moment [N m] about a point (None: the origin), or its power [W].

        body: None for all.
        """
        fluid = self.fluid
        names = [body] if body is not None else [b.surface.name for b in fluid.bodies]
        vertices = fluid.moving.surfaces.vertices_of(names)
        centre = np.zeros(fluid.dim) if about is None else np.asarray(about, dtype=float)

        def measure() -> dict[str, float]:
            force = self._on(names)
            if quantity == "force":
                return _components(force.sum(axis=0))
            if quantity == "power":
                return {"": float((force * fluid.cut.motion.v[vertices]).sum())}
            x = fluid.cut.motion.x[vertices]
            arms, forces = (np.pad(a, ((0, 0), (0, 3 - fluid.dim))) for a in (x - centre, force))
            moment = np.cross(arms, forces).sum(axis=0)
            return _components(moment) if fluid.dim == 3 else {"": float(moment[2])}

        return measure

    def coefficient(self, body: str | None, scale: Array) -> Probe:
        """Probe of the force on a body (None: on all), times a vector [1/N]."""
        names = [body] if body is not None else [b.surface.name for b in self.fluid.bodies]
        return lambda: {"": float(self._on(names).sum(axis=0) @ scale)}

    def _on(self, names: Sequence[str]) -> Array:
        """Forces [N] on the vertices of bodies."""
        if self._step is not self.fluid.current:
            self._found, self._step = self.fluid.force(), self.fluid.current
        return np.concatenate([self._found[name] for name in names])


# ------------------------------------------------------------------------------------------------------- the whole


def of_fluid(fluid: Fluid, quantity: str) -> Probe:
    """Probe of the volume [m^3], kinetic_energy [J] or viscous dissipation [W] of the whole fluid (collective)."""
    if quantity == "volume":

        def volume() -> dict[str, float]:
            owned = slice(fluid.grid.owned)
            size = fluid.cut.fraction[owned] @ fluid.grid.sizes[owned].prod(axis=1)
            return {"": fluid.comm.allreduce(float(size))}

        return volume

    def integrals() -> list[fem.Integral]:
        settings, domain, degree = fluid.settings, fluid.grid.domain, fluid.unknowns.degree
        u, weights = fluid.unknowns.parts(fluid.system.flow)[0], fluid.system.weights
        density = fem.constant(domain, settings.density)

        def density_of(flow: forms.Coefficients) -> Any:
            if quantity == "kinetic_energy":
                return 0.5 * density * ufl.dot(u, u)
            return ufl.inner(forms.viscous_stress(flow, u), forms.eps(u))

        parts = [fem.Integral(domain, density_of(fluid.system.terms) * fem.measure(domain, "dx", 2 * degree))]
        if fluid.bodies:
            on_cut = weights.fluid * density_of(fluid.system.on_cut) * fem.measure(domain, "dx", weights.degree)
            parts.append(fem.Integral(domain, on_cut))
        return parts

    latest = renewed(fluid, integrals)

    def probe() -> dict[str, float]:
        cells = [some[some < fluid.grid.owned] for some in (fluid.cut.uncut, fluid.cut.cut)]
        forms_there = [part.on(cell=some) for part, some in zip(latest(), cells, strict=False)]
        return {"": sum(fem.assemble_scalar(form, fluid.comm) for form in forms_there)}

    return probe


def _components(values: Sequence[float] | Array) -> dict[str, float]:
    return {axis: float(value) for axis, value in zip("xyz", values, strict=False)}
