"""Meshes that a solid can have: cells with extent and a positive determinant, none of which covers another one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fsci.meshes.covering import covering
from fsci.meshes.folds import folded
from fsci.meshes.jacobians import inverted, middle_maps
from solvers.api import EPS
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import facet_ids

#: Change of the strain by rounded positions above which a cell is flat, cube root of the unit roundoff: a cell on the
#: bound has a height of 4e-11 of the largest coordinate.
STRAIN_OF_ROUNDING = EPS ** (1.0 / 3.0)


class BadMesh(ValueError):
    """A mesh with wrong cells."""


def require_valid(mesh: Mesh, *, parts_meet: bool = False) -> None:
    """Raises BadMesh with the first wrong cell, its position and a remedy.

    `parts_meet`: parts of the mesh may overlap at the start, which their contact resolves.
    """
    largest = float(np.abs(mesh.points).max())
    maps = middle_maps(mesh)
    flat = np.flatnonzero(~(EPS * largest * np.linalg.norm(maps[1], axis=(1, 2)) < STRAIN_OF_ROUNDING))
    _refuse(mesh, flat, "flat: it is so thin that rounding of its nodes' positions strains it; merge its nodes")
    remedy = "move the node that lies across its neighbours, or make the mesh anew"
    if CELL_TYPES[mesh.cell_type].degree == 2:
        remedy = "put its mid nodes near the middle of its edges (gmsh: Mesh.HighOrderOptimize = 2), or refine it there"
    require_positive(mesh, remedy)
    if len(pairs := folded(mesh, facet_ids(mesh))):
        raise BadMesh(_covers(mesh, *pairs[0].tolist()))
    if not parts_meet and (pair := covering(mesh, maps)) is not None:
        raise BadMesh(_covers(mesh, *pair))


def require_positive(mesh: Mesh, remedy: str) -> None:
    """Raises BadMesh with the first cell whose Jacobian determinant is negative somewhere."""
    first_order = CELL_TYPES[mesh.cell_type].degree == 1
    what = "concave or twisted" if first_order else "turned inside out in a part"
    _refuse(mesh, inverted(mesh), f"{what}: its Jacobian determinant changes its sign; {remedy}")


def _refuse(mesh: Mesh, cells: NDArray[np.int64], what: str) -> None:
    if len(cells):
        others = f" (and {len(cells) - 1:,} more)" if len(cells) > 1 else ""
        raise BadMesh(f"{_cell(mesh, int(cells[0]))}{others} is {what}")


def _covers(mesh: Mesh, first: int, second: int) -> str:
    first, second = sorted((first, second))
    remedy = "remove one of them, or move the node that folds the mesh"
    return (
        f"{_cell(mesh, first)} and {_cell(mesh, second)} cover each other: what they share would count twice; {remedy}"
    )


def _cell(mesh: Mesh, cell: int) -> str:
    """Number, from 1 on, and position of a cell."""
    number = cell + 1 if mesh.numbers is None else int(mesh.numbers[cell])
    corners = mesh.points[mesh.cells[cell, : CELL_TYPES[mesh.cell_type].corners]]
    return f"cell {number} at ({', '.join(f'{x:.6g}' for x in corners.mean(axis=0))})"
