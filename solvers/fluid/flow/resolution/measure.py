"""How well the grid resolves the flow along each body: cells across the body, its boundary layer and its gaps.

The boundary layer is as thick as the layer in which the mean shear stress tau on the free part of the surface would
change the velocity by U linearly,

    delta = mu U / tau,

U the largest velocity relative to the body within half of its extent around it. Gaps count by what acts there: the
share of the force in them is the part of int |t - t_0 n| dS over the surface that lies in front of another wall, within
`NARROW` cells and the extent of the body; t is the traction and t_0 the median of its normal part, which the level of
the pressure changes. This level pushes bodies that are dry on one side: the rest counts beside that push. Force on the
rest that nothing there explains is that of a film whose friction holds it: a plug that squeezes fluid through the gaps
beside it. So is the pressure on the rest, as (V / U)^2, where V is the largest velocity in the film: a flap that leaves
a narrow way, in which the flow is fastest, has in front of it the pressure that drives the flow through there, against
friction and as the dynamic pressure rho V^2 / 2.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from solvers.api import Array
from solvers.fluid.cut.extension import FREE_SHARE
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.resolution.cells import BodyCells
from solvers.fluid.flow.resolution.shape import (
    SurfaceScene,
    films_of,
    is_narrow,
    present,
    scene_of,
    shape_of,
    walls_of_box,
)
from solvers.mesh.tessellation import unit_normals

#: Force that friction and dynamic pressure may explain, in multiples of them, around bodies and in films. Around bodies
#: friction is a third of the drag or more, else dynamic pressure counts; in films the pressure is by their length over
#: their height larger. What is more around bodies comes from films, as far as their pressure drop explains it, else it
#: is weight or inertia of the fluid, which needs no boundary layer.
AROUND_BODIES, IN_FILMS = 3.0, 100.0


def measure(fluid: Fluid) -> list[BodyCells]:
    """Of all bodies with wet surfaces, in the present cut and flow (collective)."""
    if not fluid.bodies or fluid.system.cut is None:
        return []
    cut, starts = fluid.cut, np.cumsum([len(body.surface.facets) for body in fluid.bodies])[:-1]
    corners = np.split(cut.motion.x[cut.facets], starts)
    homes = [_home(fluid, motion.x) for motion in fluid.moving.motions]
    bodies = [(body.surface.name, part + way) for body, part, way in zip(fluid.bodies, corners, homes, strict=True)]
    walls = walls_of_box((patch.faces, patch.record) for patch in fluid.patches)
    force, wet = fluid.system.force_on_facets()
    scene = scene_of(fluid.grid.grid, walls, bodies, wet > 0.0, fluid.unknowns.periodic)
    return [_of_body(fluid, scene, body, force, wet) for body in present(scene)]


def _of_body(fluid: Fluid, scene: SurfaceScene, body: int, force: Array, wet: Array) -> BodyCells:
    normal, speed = unit_normals(scene.corners), _speed(fluid, body)
    along = np.einsum("fi,fi->f", force, normal)
    level = _median(along / np.maximum(wet, 1e-300), np.where(scene.owner == body, wet, 0.0))
    own = np.where(scene.owner == body, wet, 0.0)[:, None] * normal
    apart = force - level * wet[:, None] * normal
    acting = np.linalg.norm(apart, axis=1)
    shear = np.linalg.norm(force - along[:, None] * normal, axis=1)
    dynamic = fluid.settings.density * speed**2 * wet if fluid.settings.convection else 0.0
    samples, of_flow = scene.samples, scene.of_samples(shear + dynamic)
    all_of_it = scene.of_samples(acting)
    free = (scene.owner[samples.facet] == body) & ~is_narrow(scene, body)
    around = AROUND_BODIES * float(of_flow[free].sum()) / max(float(all_of_it[free].sum()), 1e-300)
    counts = np.where(free, min(1.0, around) * all_of_it, np.minimum(all_of_it, IN_FILMS * of_flow))
    area, friction = scene.of_samples(wet), scene.of_samples(shear)
    rest, drag = float((all_of_it - counts)[free].sum()), float(friction[free].sum())
    of_pressure = float(scene.of_samples(np.abs(along - level * wet))[free].sum())
    beyond = {}
    for film, here in films_of(scene, body).items():
        through = _speed_in(fluid, scene, body, here)
        drop = pressure_drop(scene, here, friction)
        drop += 0.5 * fluid.settings.density * through**2 if fluid.settings.convection else 0.0
        caused = max(rest, min(1.0, through / max(speed, 1e-300)) ** 2 * of_pressure)
        beyond[film] = min(caused, drop * float(area[free].sum()))
    found = shape_of(scene, body, all_of_it, counts, beyond)
    around_body = np.array([scene.of_samples(np.abs(part))[free].sum() for part in apart.T])
    found = replace(found, share=found.share * beside_level(around_body, np.abs(level * own.sum(axis=0))))
    if drag == 0.0:
        return replace(found, layer=np.inf)
    across = float((area / samples.across)[free].sum())  # the area in cells along the normal
    return replace(found, layer=fluid.settings.viscosity * speed * across / drag)


def beside_level(force: Array, push: Array) -> float:
    """Mean over the axes, weighted by a force [N], of its share in this force and the push of the pressure's level [N].

    Where a body is dry on one side, the level pushes it towards there. It is no flow, and has no error. Along other
    axes it changes nothing.
    """
    return float((force**2 / np.maximum(force + push, 1e-300)).sum() / max(float(force.sum()), 1e-300))


def pressure_drop(scene: SurfaceScene, film: NDArray[np.int64], friction: Array) -> float:
    """Pressure [Pa] that friction at the walls of a film balances from one of its ends to the other.

    The gradient is G = 2 tau / g in a gap g under the shear stress tau. In the plane the drop is int G ds; in space the
    film is taken for a square as large as where the gradient is: sqrt(int G^2 dA).

    film: its samples; friction: forces [N] at all samples.
    """
    samples = scene.samples
    area, gap = samples.area[film], np.maximum(scene.gaps.cells[film], 1e-6) * samples.across[film]
    gradient = 2.0 * friction[film] / (area * gap)
    if scene.corners.shape[2] == 2:
        return float((gradient * area).sum())
    return float(np.sqrt((gradient**2 * area).sum()))


def _home(fluid: Fluid, x: Array) -> Array:
    """The way [m] into the box for a body that went through periods, by its middle."""
    return fluid.parts.cutter.periods.home(x)


def _median(values: Array, weights: Array) -> float:
    """The value with half of the weight below it."""
    order = np.argsort(values)
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, 0.5 * sums[-1])])


def _speed(fluid: Fluid, body: int) -> float:
    """Largest velocity relative to a body within half of its extent around it [m/s] (collective)."""
    motion, nodes = fluid.moving.motions[body], fluid.unknowns.velocity
    low, high = (end + _home(fluid, motion.x) for end in (motion.x.min(axis=0), motion.x.max(axis=0)))
    margin = 0.5 * (high - low).max()
    x = nodes.points[:, : fluid.dim]
    near = ((x > low - margin) & (x < high + margin)).all(axis=1)
    active = fluid.system.active_dofs[nodes.dofs].all(axis=1)
    velocity = fluid.flow[nodes.dofs[near & active & _well_cut(fluid)]] - motion.v.mean(axis=0)
    return float(fluid.comm.allreduce(np.linalg.norm(velocity, axis=1).max(initial=0.0), op=MPI.MAX))


def _speed_in(fluid: Fluid, scene: SurfaceScene, body: int, film: NDArray[np.int64]) -> float:
    """Largest velocity relative to a body in one of its films, or within a cell of its middle [m/s] (collective)."""
    motion, nodes, samples = fluid.moving.motions[body], fluid.unknowns.velocity, scene.samples
    half = 0.5 * scene.gaps.cells[film] * samples.across[film]
    middle, reach = samples.x[film] + half[:, None] * samples.normal[film], np.maximum(half, samples.across[film])
    low, high = middle.min(axis=0) - reach.max(), middle.max(axis=0) + reach.max()
    x = nodes.points[:, : fluid.dim]
    active = fluid.system.active_dofs[nodes.dofs].all(axis=1) & _well_cut(fluid)
    near = np.flatnonzero(active & ((x > low) & (x < high)).all(axis=1))
    distance, nearest = cKDTree(middle).query(x[near])
    velocity = fluid.flow[nodes.dofs[near[distance <= reach[nearest]]]] - motion.v.mean(axis=0)
    return float(fluid.comm.allreduce(np.linalg.norm(velocity, axis=1).max(initial=0.0), op=MPI.MAX))


def _well_cut(fluid: Fluid) -> NDArray[np.bool_]:
    """Mask of the nodes of the velocity of which a cell has so much fluid that they are free.

    Others may have the velocity of a film, which a parabola continues into its walls (h / g)^2 times as large.
    """
    unknowns, cells = fluid.unknowns, np.flatnonzero(fluid.cut.fraction >= FREE_SHARE[fluid.dim])
    found = np.zeros(unknowns.local, dtype=bool)
    found[unknowns.cell_velocity[cells]] = True
    mask: NDArray[np.bool_] = found[unknowns.velocity.dofs[:, 0]]
    return mask
