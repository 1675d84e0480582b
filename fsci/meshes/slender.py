"""Bodies that bend: walls that are long against their thickness, and the error of first-order cells in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.api import Array
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import boundary_rows, cell_facets, signed_volumes
from solvers.mesh.wall_thickness import wall_thickness

#: Length over thickness of a wall from which on it counts as slender. A force across the end of a cantilever moves it
#: 4 (L/t)^2 times as far as the same force along it, there a hundred times.
SLENDER = 5.0

#: Share by which the lengths of a body may be off by the rounding of its place: that of 1e7 of its thicknesses.
PLACE_ROUNDING = 1e-9

#: Facets whose walls are measured.
WALLS_MEASURED = 64


def is_slender(mesh: Mesh) -> bool:
    """Whether half of a body or more lies in walls that are five times thinner than the body is long."""
    return _walls(mesh).slender


def bending_error(mesh: Mesh, nu: float) -> float:
    r"""Share by which first-order cells make a slender body too stiff in bending; 0 for others and for second order.

    A wall of thickness t that bends with the curvature k has the energy E k^2 t^2 / 12 per volume. Cells of length l
    and height h add to it what they cannot follow, relative to it

        quadrilaterals, hexahedra  (G/E) (l/t)^2 + P (h/t)^2
        triangles, tetrahedra    3 (G/E) (l/t)^2 + (2 + P) (h/t)^2,   P = (1 - nu)^2 / (1 - 2 nu) - 1

    the shear of a parallelogram that should be bent, G k^2 l^2 / 12; the transverse strain, which is constant in each
    cell (P, plane strain); in simplices the strain along the wall, which is constant, too (2), with all of the shear
    of interpolated displacements. The mean over the facets of slender walls.
    """
    kind = CELL_TYPES[mesh.cell_type]
    if kind.degree > 1 or not (walls := _walls(mesh)).slender:
        return 0.0
    shear, strain = (3.0, 2.0) if kind.shape.simplex else (1.0, 0.0)
    transverse = (1.0 - nu) ** 2 / (1.0 - 2.0 * nu) - 1.0
    excess = shear / (2.0 * (1.0 + nu)) * walls.edges**2 + (strain + transverse) * walls.heights**2
    return float(np.average(excess, weights=walls.areas))


@dataclass(frozen=True)
class _Walls:
    """The slender walls of a body behind a sample of the facets of its surface."""

    edges: Array  #: root mean square of the edges of each facet over the thickness of the wall
    heights: Array  #: height of the cell at the facet over this thickness
    areas: Array  #: of the facets [m^2, in 2D m]
    slender: bool  #: whether half of the body is behind them


def _walls(mesh: Mesh) -> _Walls:
    kind = CELL_TYPES[mesh.cell_type]
    rows = boundary_rows(mesh)
    corners = mesh.points[cell_facets(mesh)[rows][:, : CELL_TYPES[kind.facet].corners]]
    around = np.roll(corners, -1, axis=1) - corners
    if mesh.points.shape[1] == 2:
        vectors = around[:, 0, ::-1] * [1.0, -1.0]
    else:
        vectors = 0.5 * np.cross(corners, np.roll(corners, -1, axis=1)).sum(axis=1)
    areas = np.maximum(np.linalg.norm(vectors, axis=1), np.finfo(float).tiny)  # wrong meshes are refused later
    edges = np.sqrt((around**2).sum(axis=2).mean(axis=1))
    volumes = np.abs(signed_volumes(mesh))
    heights = volumes[rows // len(kind.facets)] / areas * (mesh.points.shape[1] if kind.shape.simplex else 1)

    sample = np.arange(0, len(rows), max(1, len(rows) // WALLS_MEASURED))
    walls = wall_thickness(corners.mean(axis=1), vectors / areas[:, None], sample)
    x = mesh.points - mesh.points.mean(axis=0)
    length = np.ptp(x @ np.linalg.eigh(x.T @ x)[1], axis=0).max()
    some = SLENDER * walls <= (1.0 + PLACE_ROUNDING) * length
    chosen, walls = sample[some], walls[some]
    behind = 0.5 * float(walls @ areas[chosen]) * areas.sum() / areas[sample].sum()
    slender = bool(behind >= 0.5 * volumes.sum())
    return _Walls(edges[chosen] / walls, heights[chosen] / walls, areas[chosen], slender)
