"""The boundary of an elastic body as the fluid sees it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case
from fsci.dry_side import DrySideError, close
from fsci.mesh import MeshError, require_surface
from solvers.mesh import Mesh
from solvers.tessellation import tessellate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Skin:
    """The boundary of an elastic body as the fluid sees it; the same on every process."""

    name: str
    points: Array  #: reference positions [m], shape (n, dim)
    facets: NDArray[np.int64]
    nodes: NDArray[np.int64]  #: numbers in the mesh
    wet: NDArray[np.bool_] | None  #: facets that the case names; None: it names none
    corners: Array | None  #: of the line that closes the solid behind a wetted surface [m]; None: it is closed


def cut_out_skin(case: Case, name: str, mesh: Mesh) -> Skin:
    """The skin of a body from its mesh. Raises CaseError."""
    try:
        return _cut_out(case, name, mesh)
    except DrySideError as error:
        raise case.error(("coupling", "dry_side", name), str(error)) from None
    except (MeshError, ValueError) as error:
        raise case.error(("coupling", "wetted", name), str(error)) from None


def _cut_out(case: Case, body: str, mesh: Mesh) -> Skin:
    assert case.coupling is not None
    names = case.coupling.wetted.get(body)
    for name in names or ():
        require_surface(mesh, name)
    if body in case.coupling.dry_side:
        assert case.fluid is not None
        facets, nodes = tessellate(mesh, names)
        given, box = case.coupling.dry_side[body], (case.fluid.grid.start, case.fluid.grid.to)
        middles = mesh.points[mesh.cells].mean(axis=1)
        low, high = (np.array(corner) for corner in box)
        corners = close(mesh.points[nodes], facets, middles, np.array(given), (low, high))
        return Skin(body, mesh.points[nodes], facets, nodes, np.ones(len(facets), dtype=bool), corners)
    facets, nodes = tessellate(mesh)
    wet = None
    if names is not None:
        some, some_nodes = tessellate(mesh, names)
        chosen = {tuple(facet) for facet in np.sort(some_nodes[some], axis=1).tolist()}
        wet = np.array([tuple(facet) in chosen for facet in np.sort(nodes[facets], axis=1).tolist()])
    return Skin(body, mesh.points[nodes], facets, nodes, wet, None)
