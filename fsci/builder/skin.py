"""The boundary of an elastic body in the fluid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fsci.builder.dry_side import DrySideError, close
from fsci.case import Case
from fsci.meshes.mesh import MeshError, require_surface
from solvers.mesh import Mesh
from solvers.skin import Skin, cut_out_skin
from solvers.tessellation import tessellate

Array = NDArray[np.float64]


def find_skin(case: Case, name: str, mesh: Mesh) -> tuple[Skin, Array | None]:
    """The skin of a body from its mesh, and corners of the line that closes the solid behind it. Raises CaseError.

    The corners [m] of shape (n, dim) are there for bodies with a dry side, None for others.
    """
    try:
        return _find(case, name, mesh)
    except DrySideError as error:
        raise case.error(("coupling", "dry_side", name), str(error)) from None
    except (MeshError, ValueError) as error:
        raise case.error(("coupling", "wetted", name), str(error)) from None


def _find(case: Case, body: str, mesh: Mesh) -> tuple[Skin, Array | None]:
    assert case.coupling is not None
    names = case.coupling.wetted.get(body)
    for name in names or ():
        require_surface(mesh, name)
    if body not in case.coupling.dry_side:
        return cut_out_skin(mesh, names), None
    assert case.fluid is not None
    facets, nodes = tessellate(mesh, names)
    given, box = case.coupling.dry_side[body], (case.fluid.grid.start, case.fluid.grid.to)
    middles = mesh.points[mesh.cells].mean(axis=1)
    low, high = (np.array(corner) for corner in box)
    corners = close(mesh.points[nodes], facets, middles, np.array(given), (low, high))
    return Skin(mesh.points[nodes], facets, nodes, np.ones(len(facets), dtype=bool)), corners
