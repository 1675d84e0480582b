"""The boundary of an elastic body in the fluid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fsci.builder.dry_side import DrySideError, close, surround
from fsci.case import Case
from fsci.meshes.mesh import MeshError, require_surface
from solvers.mesh import Mesh
from solvers.skin import Skin, cut_out_skin
from solvers.tessellation import tessellate

Array = NDArray[np.float64]
Closing = tuple[Array, NDArray[np.int64] | None]


def find_skin(case: Case, name: str, mesh: Mesh) -> tuple[Skin, Closing | None]:
    """The skin of a body from its mesh, and for bodies with a dry side what closes the solid behind it.

    That is (corners [m], shape (n, dim), and facets between them if they are not a line from end to end).
    Raises CaseError.
    """
    try:
        return _find(case, name, mesh)
    except DrySideError as error:
        raise case.error(("coupling", "dry_side", name), str(error)) from None
    except (MeshError, ValueError) as error:
        raise case.error(("coupling", "wetted", name), str(error)) from None


def _find(case: Case, body: str, mesh: Mesh) -> tuple[Skin, Closing | None]:
    assert case.coupling is not None
    names = case.coupling.wetted.get(body)
    for name in names or ():
        require_surface(mesh, name)
    if body not in case.coupling.dry_side:
        return cut_out_skin(mesh, names), None
    assert case.fluid is not None
    facets, nodes = tessellate(mesh, names)
    given, points = case.coupling.dry_side[body], mesh.points[nodes]
    box = np.array(case.fluid.grid.start), np.array(case.fluid.grid.to)
    skin = Skin(points, facets, nodes, np.ones(len(facets), dtype=bool))
    if given == "outside":
        return skin, surround(points, facets, box)
    return skin, (close(points, facets, mesh.points[mesh.cells].mean(axis=1), np.array(given), box), None)
