"""The grid of a case with finer cells in boxes and around bodies. Nothing here needs a finite element."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case
from fsci.case.flow_element import flow_element
from fsci.case.grid import Refinement
from fsci.meshes.of_case import read_body, read_rigid_body
from solvers.fluid.grid.box import Grid
from solvers.mesh.tessellation import tessellate

if TYPE_CHECKING:  # SciPy, which cases without nested cells do not need to be checked
    from solvers.fluid.grid.following import Following
    from solvers.fluid.grid.nested import Nested, RefinedRegion

Surface = tuple[NDArray[np.float64], NDArray[np.int64]]


def read_grid(case: Case) -> Grid:
    """The grid of the flow at its start. Raises CaseError."""
    assert case.fluid is not None
    grid = Grid(case.fluid.grid.planes)
    return _refined(case, grid) if case.fluid.grid.refine else grid


def following(case: Case) -> Following | None:
    """How nested cells follow the bodies that they are around and that move; None if they do not."""
    from solvers.fluid.grid.following import Following, RefinedBody

    assert case.fluid is not None
    section = case.fluid.grid
    resting = {name for name, body in case.fluid.bodies.items() if body.motion is None and body.free is None}
    bodies = [
        RefinedBody(part.around, part.layers, part.level)
        for part in section.refine
        if part.around is not None and part.around not in resting
    ]
    if not bodies or case.fluid.scheme == "steady":
        return None
    surfaces = {name: body_surface(case, name) for name in resting}
    regions = [_region(part, surfaces) for part in section.refine if part.around is None or part.around in resting]
    return Following(Grid(section.planes), regions, bodies)


def cells_of(case: Case) -> int:
    """Cells of the flow. Raises CaseError."""
    assert case.fluid is not None
    grid = Grid(case.fluid.grid.planes)
    return len(_refined(case, grid).first) if case.fluid.grid.refine else grid.size


def fluid_dofs(case: Case) -> int:
    """Unknowns of velocity and pressure, those inside of bodies included. Raises CaseError."""
    assert case.fluid is not None
    degree = flow_element(case).degree
    if not case.fluid.grid.refine:
        return case.fluid.dofs(degree)
    grid = _refined(case, Grid(case.fluid.grid.planes))
    return grid.dim * grid.unknowns(degree) + grid.unknowns(1)


def _refined(case: Case, grid: Grid) -> Nested:
    """Raises CaseError if a body is too close to coarse cells."""
    from solvers.fluid.grid.nested import FINE_LAYERS, Nested, RefinedSurface, refined

    assert case.fluid is not None
    section = case.fluid.grid
    surfaces = {name: body_surface(case, name) for name in [*case.fluid.bodies, *case.elastic_bodies]}
    nested = refined(grid, [_region(refinement, surfaces) for refinement in section.refine])
    assert isinstance(nested, Nested)
    for name, (points, facets) in surfaces.items():
        close = RefinedSurface(points, facets, FINE_LAYERS, section.levels).cells(nested)
        if (close & nested.coarse).any():
            message = (
                f"body '{name}' comes within {FINE_LAYERS} cells of cells that are not of the finest level, "
                f"{section.levels}: refine around it with {FINE_LAYERS} layers or more, or in a box over all of its way"
            )
            raise case.error(("fluid", "grid", "refine"), message)
    return nested


def _region(refinement: Refinement, surfaces: dict[str, Surface]) -> RefinedRegion:
    from solvers.fluid.grid.nested import RefinedBox, RefinedSurface

    if refinement.box is not None:
        low, high = refinement.box
        return RefinedBox(low, high, refinement.level)
    assert refinement.around is not None
    return RefinedSurface(*surfaces[refinement.around], refinement.layers, refinement.level)


def body_surface(case: Case, name: str) -> Surface:
    """Points [m] and facets of a body at its start."""
    if name in case.elastic_bodies:
        mesh = read_body(case, name)
        facets, nodes = tessellate(mesh, None)
        return mesh.points[nodes], facets
    _, points, facets = read_rigid_body(case, name)
    return points, facets
