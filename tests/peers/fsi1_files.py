"""Turek and Hron's FSI1 on fitted meshes, as input of Kratos: triangles of the fluid, quadrilaterals of the flag."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import mdpa
import numpy as np

from fsci import shapes
from solvers.api import Array
from solvers.mesh.mesh import Mesh

#: Channel, cylinder, corners of the flag [m]
LENGTH, HEIGHT, CENTRE, RADIUS = 2.5, 0.41, 0.2, 0.05
ROOT, TIP, LOW, HIGH = 0.248989795, 0.6, 0.19, 0.21


def flag(cells: int) -> Mesh:
    """Quadrilaterals of second order, nearly square: `cells` along, two or more across."""
    across = max(2, round(cells * (HIGH - LOW) / (TIP - ROOT)))
    return shapes.rectangle([TIP - ROOT, HIGH - LOW], [cells, across], order=2, origin=[ROOT, LOW])


def write_flag(path: Path, mesh: Mesh) -> None:
    """Each edge of second order is two straight conditions, which carry what is mapped."""
    outline = along(mesh)
    lines = np.stack([outline[:-1], outline[1:]], axis=1)
    points = np.column_stack([mesh.points, np.zeros(len(mesh.points))])
    text = [*mdpa.PROPERTIES, *mdpa.nodes(points), *mdpa.block("Elements TotalLagrangianElement2D9N", mesh.cells)]
    text += mdpa.block("Conditions LineCondition2D2N", lines)
    text += mdpa.part("Solid", range(len(points)), cells=range(len(mesh.cells)))
    text += mdpa.part("root", np.flatnonzero(mesh.points[:, 0] < ROOT + 1e-9))
    text += mdpa.part("wet", outline, facets=range(len(lines)))
    path.write_text("\n".join(text) + "\n")


def along(mesh: Mesh) -> Array:
    """Nodes of the wet sides in their order, from the lower end of the root around the tip to the upper one."""
    x, y = mesh.points.T
    bottom, right, top = (np.flatnonzero(on) for on in (y < LOW + 1e-9, x > TIP - 1e-9, y > HIGH - 1e-9))
    bottom, right, top = bottom[np.argsort(x[bottom])], right[np.argsort(y[right])], top[np.argsort(-x[top])]
    return np.concatenate([bottom, right[1:-1], top])


def write_fluid(path: Path, outline: Array, largest: float) -> int:
    """Triangles whose edges on the flag are those of the outline, up to `largest` at the walls [m]; how many nodes."""
    import gmsh

    size = float(np.linalg.norm(outline[1] - outline[0]))
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        sides = _geometry(outline, size, largest)
        gmsh.model.mesh.generate(2)
        tags, places, _ = gmsh.model.mesh.getNodes()
        number = np.zeros(int(tags.max()) + 1, dtype=int)
        kept = np.unique(gmsh.model.mesh.getElementsByType(2)[1])
        number[kept] = np.arange(len(kept))
        place = np.zeros((int(tags.max()) + 1, 3))
        place[tags] = places.reshape(-1, 3)
        triangles = number[gmsh.model.mesh.getElementsByType(2)[1].reshape(-1, 3)]
        edges = {
            name: np.concatenate([number[gmsh.model.mesh.getElementsByType(1, c)[1].reshape(-1, 2)] for c in curves])
            for name, curves in sides.items()
        }
    finally:
        gmsh.finalize()
    text = [*mdpa.PROPERTIES, *mdpa.nodes(place[kept]), *mdpa.block("Elements Element2D3N", triangles)]
    text += mdpa.block("Conditions LineCondition2D2N", np.concatenate(list(edges.values())))
    text += mdpa.part("Fluid", range(len(kept)), cells=range(len(triangles)))
    first = 0
    for name, lines in edges.items():
        text += mdpa.part(name, np.unique(lines), facets=range(first, first + len(lines)))
        first += len(lines)
    path.write_text("\n".join(text) + "\n")
    return len(kept)


def _geometry(outline: Array, size: float, largest: float) -> dict[str, list[int]]:
    """Curves of the model by side. Cells grow with the distance from cylinder and flag."""
    import gmsh

    make = gmsh.model.geo
    corners = [make.addPoint(x, y, 0.0) for x, y in ((0, 0), (LENGTH, 0), (LENGTH, HEIGHT), (0, HEIGHT))]
    box = [make.addLine(corners[i], corners[(i + 1) % 4]) for i in range(4)]
    wet = [make.addPoint(x, y, 0.0) for x, y in outline]
    flag = [make.addLine(a, b) for a, b in pairwise(wet)]
    centre, back = make.addPoint(CENTRE, CENTRE, 0.0), make.addPoint(CENTRE - RADIUS, CENTRE, 0.0)
    cylinder = [make.addCircleArc(wet[-1], centre, back), make.addCircleArc(back, centre, wet[0])]
    loops = [make.addCurveLoop(box), make.addCurveLoop([*flag, *cylinder])]
    make.addPlaneSurface(loops)
    make.synchronize()
    for line in flag:
        gmsh.model.mesh.setTransfiniteCurve(line, 2)
    field = gmsh.model.mesh.field
    distance, threshold = field.add("Distance"), field.add("Threshold")
    field.setNumbers(distance, "CurvesList", [*flag, *cylinder])
    for name, value in (
        ("InField", distance), ("SizeMin", size), ("SizeMax", largest), ("DistMin", 0.01), ("DistMax", 0.15)
    ):  # fmt: skip
        field.setNumber(threshold, name, value)
    field.setAsBackgroundMesh(threshold)
    for name in ("Mesh.MeshSizeExtendFromBoundary", "Mesh.MeshSizeFromPoints"):
        gmsh.option.setNumber(name, 0)
    return {"wet": flag, "cylinder": cylinder, "walls": [box[0], box[2]], "outlet": [box[1]], "inlet": [box[3]]}
