"""Faces of the box that no fluid passes as obstacles of contact, for pairs that the program finds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.builder.closed_faces import closed_faces
from fsci.case import Case
from fsci.case.contact import ObstacleSection
from fsci.meshes.of_case import read_obstacle
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import cut_out

Array = NDArray[np.float64]

#: Distance from a face relative to the box up to which an obstacle lies on it.
ON_FACE = 1e-6

#: Surfaces of rectangles and boxes at both ends of each axis.
ENDS = {2: (("left", "right"), ("bottom", "top")), 3: (("left", "right"), ("front", "back"), ("bottom", "top"))}


def with_faces(case: Case, meshes: Mapping[str, Mesh]) -> Case:
    """The case with an obstacle on each closed face, unless one of its own is there. Raises CaseError.

    meshes: of the elastic bodies in question. A face that one of them crosses, as a plane of symmetry, is left out.
    """
    if case.contact is None or case.fluid is None:
        return case
    found = dict(case.contact.obstacles)
    for name, settings in _faces(case, [mesh.points for mesh in meshes.values()]):
        found.setdefault(name, ObstacleSection.model_validate(settings))
    return case.model_copy(update={"contact": case.contact.model_copy(update={"obstacles": found})})


def _faces(case: Case, bodies: Sequence[Array]) -> Iterator[tuple[str, dict[str, Any]]]:
    """(name, settings) of the obstacles: slabs behind the faces, which reach beyond the box at all sides."""
    assert case.fluid is not None
    low, high = np.array(case.fluid.grid.start), np.array(case.fluid.grid.to)
    size, dim = high - low, len(low)
    thick = 0.1 * float(size.min())
    occupied = [_surface(case, name) for name in ({} if case.contact is None else case.contact.obstacles)]
    for wall in closed_faces(case):
        axis, upper = "xyz".index(wall.face[0]), wall.face[1] == "+"
        if wall.within is not None or any(_lies_on(x, axis, wall.position, float(size.max())) for x in occupied):
            continue
        if any(wall.depth(x).max() > ON_FACE * np.ptp(x, axis=0).max() for x in bodies):
            continue
        origin, extent = low - 0.5 * size, 2.0 * size
        origin[axis], extent[axis] = (high[axis] if upper else low[axis] - thick), thick
        shape = {"shape": "rectangle" if dim == 2 else "box", "origin": origin.tolist(), "size": extent.tolist()}
        on = ENDS[dim][axis][0 if upper else 1]
        yield (
            f"{wall.name}_{wall.face[0]}_{'high' if upper else 'low'}",
            {"mesh": shape | {"cells": [1] * dim}, "on": on},
        )


def _surface(case: Case, name: str) -> Array:
    """Points [m] of the surface of an obstacle."""
    assert case.contact is not None
    return cut_out(read_obstacle(case, name), case.contact.obstacles[name].on)[0]


def _lies_on(x: Array, axis: int, position: float, size: float) -> bool:
    return bool(np.abs(x[:, axis] - position).max() <= ON_FACE * size)
