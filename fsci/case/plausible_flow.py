"""Warnings about a flow that can be computed: cells too coarse, steps too long, nothing that drives it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fsci.case.case import Case
from fsci.case.fluid import FluidSection, Movement, PatchSection
from fsci.case.rigid_motion import rigid_motion
from fsci.case.shapes import ShapeSection
from fsci.case.yaml_text import Keys
from solvers.fluid.geometry.thin.thickness import free_length
from solvers.fluid.surfaces.fast_bodies import MOST_CELLS_PASSED

MOST_CELLS_PER_STEP = 10.0  #: above which `check` warns: cells that a flow or a body crosses in a time step
#: Cells across a body that both of its sides need to share no unknowns: with fewer, fluid passes through the body.
CELLS_ACROSS_AT_REST, CELLS_ACROSS_IF_MOVING = 2.0, 4.0
#: Cells across up to which bodies in contact have unknowns of each side, by dimension: `THICK_IN_CONTACT` of the flow,
#: which a check of a case does not import.
CELLS_ACROSS_IN_CONTACT = {2: CELLS_ACROSS_AT_REST, 3: 1.0}
#: Nitsche's shear in a film that closes is several hundred times the viscous one, and zero where it is closed.
NO_SLIP_IN_THE_LAYER = (
    "the shear of a film that closes jumps to zero without slip, and Newton's method may fail in contact; "
    "give the bodies a 'slip_length' as large as the roughness"
)
#: Thicknesses of a boundary layer, L / sqrt(Re), in the smallest cell above which `check` warns.
MOST_LAYERS_PER_CELL = 10.0
FLOW_DENSITIES = (1e-2, 3e4)  #: [kg/m^3] from thin gas to heavy liquid metal, with a margin


def flow_warnings(case: Case, fluid: FluidSection) -> Iterator[tuple[Keys, str]]:
    """Paths of settings with a warning about each."""
    density = fluid.density * case.units.density
    if not FLOW_DENSITIES[0] <= density <= FLOW_DENSITIES[1]:
        value = in_si(fluid.density, case.units.density, f"{case.units.mass}/{case.units.length}^3", "kg/m^3")
        yield ("fluid", "density"), f"implausible density: {value}; check 'units'"
    else:
        yield from _reynolds(case, fluid)
    if case.coupling is None and not _driven(fluid):
        yield ("fluid", "patches"), "nothing drives the flow: no velocity, traction, pressure, force or moving body"
    yield from _thin_bodies(case, fluid)
    if fluid.narrow_gaps and case.contact is not None and case.contact.film.value and not _slips(case, fluid):
        yield ("contact", "film"), NO_SLIP_IN_THE_LAYER
    if fluid.scheme == "steady":
        return
    yield from _fast_bodies(case, fluid)
    for name, patch in fluid.patches.items():
        crossed = _cells_per_step(case, fluid, patch)
        if crossed > MOST_CELLS_PER_STEP:
            message = f"the flow crosses {crossed:.0f} cells in a time step here; take a smaller 'step'"
            yield ("fluid", "patches", name), message


def in_si(value: float, factor: float, unit: str, si: str) -> str:
    """A value in the units of the case, and in SI where these are others."""
    return f"{value:g} {si}" if factor == 1.0 else f"{value:g} {unit}, which is {value * factor:.3g} {si}"


def _slips(case: Case, fluid: FluidSection) -> bool:
    """Whether the flow slips along a body."""
    elastic = () if case.structure is None else case.structure.bodies.values()
    return any(body.slip_length for body in elastic) or any(body.slip_length for body in fluid.bodies.values())


def _fast_bodies(case: Case, fluid: FluidSection) -> Iterator[tuple[Keys, str]]:
    """Bodies that cross too many cells in a step; rotating ones need the mesh."""
    for name, body in fluid.bodies.items():
        if body.motion is not None and body.motion.rotation is None:
            if warning := fast_body(case, fluid, body.motion, np.zeros((1, fluid.grid.dimension))):
                yield ("fluid", "bodies", name, "motion"), warning


def fast_body(case: Case, fluid: FluidSection, motion: Movement, points: NDArray[np.float64]) -> str | None:
    """The warning if points [m] of a body, shape (n, dim), cross too many cells in a step, or None."""
    smallest = fluid.grid.smallest
    time = case.time
    moved, cells = rigid_motion(points, motion, time.start, time.step), 0.0
    for t in np.linspace(time.start, max(time.end - time.step, time.start), 50):
        (before, _), (after, velocity) = moved(t), moved(t + time.step)
        ways = np.maximum(np.abs(after - before), np.abs(velocity) * time.step)
        cells = max(cells, float((ways / smallest).max()))
    if cells <= MOST_CELLS_PASSED * (1.0 + 1e-9):
        return None
    return (
        f"the body crosses {cells:.2g} cells in a time step: forces are inaccurate; "
        f"a 'step' below {MOST_CELLS_PASSED * time.step / cells:.2g} keeps it below {MOST_CELLS_PASSED:g} cells"
    )


def _thin_bodies(case: Case, fluid: FluidSection) -> Iterator[tuple[Keys, str]]:
    """Built-in shapes through which fluid passes; those of files need the mesh."""
    rigid = fluid.bodies.items()
    moving = {("fluid", "bodies", name): (body.mesh, bool(body.motion or body.free)) for name, body in rigid}
    elastic = {("structure", "bodies", name): (body.mesh, True) for name, body in case.elastic_bodies.items()}
    one_sided = set(case.coupling.dry_side) if case.coupling is not None else set()
    for (section, kind, name), (mesh, moves) in (moving | elastic).items():
        if not isinstance(mesh, ShapeSection) or name in one_sided:
            continue
        length = sorted(mesh.plan.extents)[-1 if fluid.grid.dimension == 2 else -2]
        if warning := thin_body(case, fluid, mesh.plan.thickness, length, moves=moves, hollow=mesh.plan.hollow):
            yield (section, kind, name, "mesh"), warning


def thin_body(
    case: Case, fluid: FluidSection, extent: float, length: float, *, moves: bool, hollow: bool
) -> str | None:
    """What may go wrong with a body of this thickness [m]: fluid passes if both of its sides share unknowns.

    length [m]: its largest extent, in 3D the second one; hollow: it encloses fluid, and has unknowns of each side.
    """
    smallest = float(fluid.grid.smallest.min())
    rests = not case.elastic_bodies and not any(body.motion or body.free for body in fluid.bodies.values())
    least = CELLS_ACROSS_IF_MOVING if moves else CELLS_ACROSS_AT_REST
    size = f"the body is {extent:.4g} thick, {extent / smallest:.2g} of the smallest cells"
    body = "a body that moves" if moves else "a body"
    free = free_length(fluid.grid.dimension, moves=not rests) * smallest
    separate = length >= free  # each side has unknowns of its own
    if separate and (rests or case.contact is None):
        ends_at_walls = length >= min(b - a for a, b in zip(fluid.grid.start, fluid.grid.to, strict=True))
        if ends_at_walls or length >= 2.0 * free or extent >= least * smallest:
            return None
        why = f"if all of its edges are in the fluid, some passes through {body} with less than"
        return f"{size}, and {length / smallest:.2g} of them long: {why} {2.0 * free / smallest:.3g} cells along"
    if extent >= least * smallest:
        return None
    if separate and (hollow or extent < CELLS_ACROSS_IN_CONTACT[fluid.grid.dimension] * smallest):
        return f"{size}: nothing passes through it, but where it is in contact and opens again, steps may fail"
    why = f"where it has fluid on both sides, fluid passes through {body} with less than {least:g} cells across"
    return f"{size}: {why}; refine the grid"


def _driven(fluid: FluidSection) -> bool:
    loads = (fluid.gravity, fluid.body_force, fluid.initial_velocity)
    moved = any(body.motion or body.free for body in fluid.bodies.values())
    charged = (p.windkessel and p.windkessel.initial_pressure for p in fluid.patches.values())
    driven = any(p.velocity or p.traction or p.pressure or p.rate for p in fluid.patches.values())
    return any(loads) or moved or driven or any(charged)


def _reynolds(case: Case, fluid: FluidSection) -> Iterator[tuple[Keys, str]]:
    """Cells much larger than boundary layers, by the velocities prescribed on patches."""
    if fluid.flow == "stokes":
        return
    speed = max((_largest(case, fluid, patch)[0] for patch in fluid.patches.values()), default=0.0)
    width = float((np.array(fluid.grid.to) - np.array(fluid.grid.start)).min())
    reynolds = fluid.density * speed * width / fluid.viscosity
    layer = width / np.sqrt(max(reynolds, 1.0))
    cell = float(fluid.grid.smallest.min())
    if cell > MOST_LAYERS_PER_CELL * layer:
        length = case.units.length
        yield (
            ("fluid", "grid"),
            f"the Reynolds number is {reynolds:.2g} (velocity {speed:.3g}, width of the box {width:.3g} {length}): "
            f"boundary layers are about {layer:.2g} {length} thick, the smallest cells {cell:.2g} {length}: forces and "
            "separation are those of the grid, and there is no model of turbulence; refine the grid, or check 'units'",
        )


def _cells_per_step(case: Case, fluid: FluidSection, patch: PatchSection) -> float:
    """Largest |u_i| dt / h_i of the velocity prescribed on a patch."""
    return _largest(case, fluid, patch)[1] * case.time.step


def _largest(case: Case, fluid: FluidSection, patch: PatchSection) -> tuple[float, float]:
    """Largest |u_i| and |u_i| / h_i prescribed on a patch, over its nodes and some times of the run."""
    if patch.velocity is None:
        return 0.0, 0.0
    edges, fastest, largest = fluid.grid.planes, 0.0, 0.0
    cells = [np.pad(np.diff(edge), 1, mode="edge") for edge in edges]
    sizes = [np.minimum(h[1:], h[:-1]) for h in cells]
    times = np.linspace(case.time.start, case.time.end, 5)
    for face in patch.on:
        axis, side = "xyz".index(face[0]), -1 if face[1] == "+" else 0
        on_face = [edge[[side]] if i == axis else edge for i, edge in enumerate(edges)]
        near = [h[[side]] if i == axis else h for i, h in enumerate(sizes)]
        x, h = (np.stack([part.ravel() for part in np.meshgrid(*parts, indexing="ij")]) for parts in (on_face, near))
        inside = np.ones(x.shape[1], dtype=bool) if patch.where is None else patch.where(x, 0.0) > 0.0
        for t in times:
            speed = np.abs([component(x, t) for component in patch.velocity])[:, inside]
            with np.errstate(over="ignore"):
                largest = max(largest, float(np.nanmax(speed / h[:, inside], initial=0.0)))
            fastest = max(fastest, float(np.nanmax(speed, initial=0.0)))
    return fastest, largest
