"""The boundary of an elastic body in the fluid."""

from __future__ import annotations

import numpy as np

from fsci.builder.dry_side import Closing, DrySideError, close
from fsci.builder.outside import surround
from fsci.case import Case
from fsci.meshes.mesh import MeshError, require_surface
from solvers.mesh.mesh import Mesh
from solvers.mesh.skin import Skin, cut_out_skin, middle_vertices
from solvers.mesh.tessellation import tessellate


def find_skin(case: Case, name: str, mesh: Mesh) -> tuple[Skin, Closing | None]:
    """The skin of a body from its mesh, and for bodies with a dry side what closes the solid. Raises CaseError."""
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
    skin = Skin(points, facets, nodes, np.ones(len(facets), dtype=bool), middle_vertices(mesh, nodes))
    inside = mesh.points[mesh.cells].mean(axis=1)
    if given == "outside":
        return skin, surround(points, facets, inside, box)
    return skin, close(points, facets, inside, np.array(given), box)
