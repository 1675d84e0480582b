"""The ball of `fsci.bench.hertz` and a rigid plane below it as input of other programs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mdpa
import numpy as np
from numpy.typing import NDArray

from fsci import shapes
from fsci.bench.hertz import CORE, NU, PRESS, E, graded, quarter_ball
from solvers.api import Array
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import surface_facets

#: Faces of CalculiX' bricks by their corners
FACES = {(0, 1, 2, 3): 1, (4, 5, 6, 7): 2, (0, 1, 4, 5): 3, (1, 2, 5, 6): 4, (2, 3, 6, 7): 5, (0, 3, 4, 7): 6}


def base(per_radius: int, outer: int) -> Mesh:
    """A layer below the ball, its cells a tenth larger than the ball's: programs search for pairs of like size."""
    across = graded(round(CORE * per_radius), outer)
    coordinates = 1.1 * np.concatenate([[-across[1]], across])
    count = len(coordinates) - 1
    unit = shapes.box([1, 1, 1], [count, count, 1])
    index = np.rint(unit.points * [count, count, 1]).astype(int)
    points = np.column_stack([coordinates[index[:, 0]], coordinates[index[:, 1]], index[:, 2] - 1.0])
    return replace(unit, points=points)


def both(per_radius: int, outer: int) -> tuple[Mesh, Mesh, Array, NDArray[np.int64], dict[str, list[int]]]:
    """(ball, base, all points, all cells, node sets); all nodes of the base are in one set."""
    ball, below = quarter_ball(per_radius, outer), base(per_radius, outer)
    count = len(ball.points)
    sets = {name: sorted(set(ball.surfaces[name].ravel().tolist())) for name in ("left", "front", "top", "bottom")}
    sets["plane"] = list(range(count, count + len(below.points)))
    points, cells = np.vstack([ball.points, below.points]), np.vstack([ball.cells, below.cells + count])
    return ball, below, points, cells, sets


def write_calculix(path: Path, per_radius: int, outer: int) -> None:
    """Contact of faces by a penalty, finite displacement, in one increment; forces, contact stresses.

    Its mortar contact (TYPE=MORTAR of version 2.20) takes minutes for the second iteration already, and was given up.
    """
    ball, below, points, cells, sets = both(per_radius, outer)
    count = len(ball.cells)
    lines = ["*NODE, NSET=ALL", *_numbered(points), "*ELEMENT, TYPE=C3D8, ELSET=BALL", *_numbered(cells[:count] + 1)]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=BASE", *_numbered(cells[count:] + 1, first=count + 1)]
    for name, nodes in sets.items():
        lines += [f"*NSET, NSET={name.upper()}", *(str(node + 1) for node in nodes)]
    lines += ["*SURFACE, NAME=SLAVE", *_faces(ball, "bottom", 1), "*SURFACE, NAME=MASTER"]
    lines += _faces(below, "top", count + 1)
    lines += ["*MATERIAL, NAME=RUBBER", "*ELASTIC", f"{E}, {NU}"]
    lines += ["*SOLID SECTION, ELSET=BALL, MATERIAL=RUBBER", "*SOLID SECTION, ELSET=BASE, MATERIAL=RUBBER"]
    lines += ["*SURFACE INTERACTION, NAME=TOUCH", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD"]
    lines += ["*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "SLAVE, MASTER"]
    lines += ["*BOUNDARY", "LEFT, 1, 1", "FRONT, 2, 2", "PLANE, 1, 3"]
    lines += ["*STEP, NLGEOM", "*STATIC, DIRECT", "1., 1.", "*BOUNDARY", f"TOP, 3, 3, {-PRESS}"]
    lines += ["*NODE PRINT, NSET=PLANE, TOTALS=ONLY", "RF", "*CONTACT FILE", "CDIS, CSTR", "*END STEP"]
    path.write_text("\n".join(lines) + "\n")


def write_kratos(path: Path, per_radius: int, outer: int) -> None:
    """The mesh; `kratos_hertz.py` has the rest."""
    ball, below, points, cells, sets = both(per_radius, outer)
    slave, master = surface_facets(ball, "bottom"), surface_facets(below, "top") + len(ball.points)
    facets, everything = np.vstack([slave, master]), range(len(points))
    lines = [*mdpa.PROPERTIES, *mdpa.nodes(points), *mdpa.block("Elements TotalLagrangianElement3D8N", cells)]
    lines += mdpa.block("Conditions SurfaceCondition3D4N", facets)
    lines += mdpa.part("Solid", everything, cells=range(len(cells)))
    for name in ("left", "front", "top", "bottom", "plane"):
        lines += mdpa.part(name, sets[name], facets=range(len(slave) if name == "bottom" else 0))
    lines += mdpa.part("Contact_Part", np.unique(facets), facets=range(len(facets)))
    path.write_text("\n".join(lines) + "\n")


def _faces(mesh: Mesh, name: str, first: int) -> list[str]:
    """Lines that name the faces of a surface of bricks, numbered from `first` on."""
    wanted = {tuple(sorted(facet)) for facet in mesh.surfaces[name].tolist()}
    return [
        f"{first + cell}, S{number}"
        for cell, nodes in enumerate(mesh.cells)
        for corners, number in FACES.items()
        if tuple(sorted(nodes[list(corners)].tolist())) in wanted
    ]


def _numbered(rows: NDArray[Any], first: int = 1) -> list[str]:
    return [f"{i + first}, {mdpa.row(row, ', ')}" for i, row in enumerate(rows)]
