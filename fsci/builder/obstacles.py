"""Obstacles of contact as parts of the output: closed rigid surfaces that are where their motion puts them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fsci.builder.obstacle_motion import motion_of_obstacle
from fsci.case import Case
from fsci.meshes.of_case import read_obstacle
from solvers.api import Snapshot
from solvers.mesh.tessellation import tessellate


def obstacle_snapshots(case: Case) -> Callable[[float], list[Snapshot]]:
    """A function: time [s] -> snapshots of the obstacles with a given motion or at rest.

    Free ones are rigid bodies. One that is called as a body is left out: its files would have the same names.
    """
    obstacles = {} if case.contact is None else case.contact.obstacles
    parts = []
    for name, settings in obstacles.items():
        if settings.free is None and name not in (*case.elastic_bodies, "fluid"):
            mesh = read_obstacle(case, name)
            facets, nodes = tessellate(mesh)
            points = mesh.points[nodes]
            parts.append((name, points, facets, motion_of_obstacle(case, name, points)))

    def at(t: float) -> list[Snapshot]:
        found = []
        for name, points, facets, motion in parts:
            x = points if motion is None else motion(t)
            kind = "line" if x.shape[1] == 2 else "triangle"
            found.append(Snapshot(name, np.pad(x, ((0, 0), (0, 3 - x.shape[1]))), facets, kind, {}))
        return found

    return at
