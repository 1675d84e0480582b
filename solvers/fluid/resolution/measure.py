"""How well the grid resolves the flow along each body: cells across the body, its boundary layer and its gaps.

The boundary layer is as thick as the layer in which the mean shear stress tau on the free part of the surface would
change the velocity by U linearly,

    delta = mu U / tau,

U the largest velocity relative to the body within half of its extent around it. Gaps count by what acts there: the
share of the force in them is the part of int |t - t_0 n| dS over the surface that lies in front of another wall, within
`NARROW` cells; t is the traction and t_0 the median of its normal part, which the level of the pressure changes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.field import Fluid
from solvers.fluid.resolution.cells import BodyCells
from solvers.fluid.resolution.gaps import Gaps, Samples, gaps, samples_of
from solvers.fluid.resolution.shape import NARROW, shape_of, walls_of_box
from solvers.tessellation import unit_normals


def measure(fluid: Fluid) -> list[BodyCells]:
    """Of all bodies with wet surfaces, in the present cut and flow (collective)."""
    if not fluid.bodies or fluid.system.cut is None:
        return []
    cut, names = fluid.cut, [body.surface.name for body in fluid.bodies]
    force, wet = fluid.system.force_on_facets()
    corners, grid = cut.motion.x[cut.facets], fluid.grid.grid
    samples = samples_of(grid, corners)
    samples = samples[wet[samples.facet] > 0.0]
    walls = walls_of_box((patch.faces, patch.record) for patch in fluid.patches)
    owner = np.repeat(np.arange(len(names)), [len(body.surface.facets) for body in fluid.bodies])
    found = gaps(grid, samples, [plane for plane, _ in walls])
    normal = unit_normals(corners)
    return [
        _of_body(fluid, number, samples, found, owner, [*names, *(face for _, face in walls)], force, wet, normal)
        for number in np.unique(owner[samples.facet]).tolist()
    ]


def _of_body(
    fluid: Fluid, number: int, samples: Samples, found: Gaps, owner: NDArray[np.int64], names: list[str],
    force: Array, wet: Array, normal: Array,
) -> BodyCells:  # fmt: skip
    facets = owner == number
    along = np.einsum("fi,fi->f", force, normal)
    level = _median(along[facets & (wet > 0.0)] / wet[facets & (wet > 0.0)], wet[facets & (wet > 0.0)])
    acting = np.linalg.norm(force - level * wet[:, None] * normal, axis=1)
    shear = np.linalg.norm(force - along[:, None] * normal, axis=1)
    total = np.bincount(samples.facet, samples.area, len(facets))
    part = samples.area / total[samples.facet]
    corners = fluid.cut.motion.x[fluid.cut.facets]
    body = shape_of(number, samples, found, owner, names, (acting[samples.facet] * part), corners)
    free = (owner[samples.facet] == number) & (found.cells >= NARROW)
    drag, area = (float((values[samples.facet] * part)[free].sum()) for values in (shear, wet))
    layer = np.inf
    if drag > 0.0:
        across = area / float((part * wet[samples.facet] / samples.across)[free].sum())
        layer = fluid.settings.viscosity * _speed(fluid, number) * area / drag / across
    return replace(body, layer=float(layer))


def _median(values: Array, weights: Array) -> float:
    order = np.argsort(values)
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, 0.5 * sums[-1])])


def _speed(fluid: Fluid, number: int) -> float:
    """Largest velocity relative to a body within half of its extent around it [m/s] (collective)."""
    motion, nodes = fluid.motions[number], fluid.unknowns.velocity
    low, high = motion.x.min(axis=0), motion.x.max(axis=0)
    margin = 0.5 * (high - low).max()
    x = nodes.points[: nodes.owned, : fluid.dim]
    near = ((x > low - margin) & (x < high + margin)).all(axis=1)
    active = fluid.system.active_dofs[nodes.dofs[: nodes.owned]].all(axis=1)
    velocity = fluid.flow[nodes.dofs[: nodes.owned]][near & active] - motion.v.mean(axis=0)
    return float(fluid.comm.allreduce(np.linalg.norm(velocity, axis=1).max(initial=0.0), op=MPI.MAX))
