"""Common parts of the scripts for ngsxfem: a disc cut out of a mesh, unknowns, measures and ghost penalties.

The scripts are run as files, so that this module is found in their folder.
"""

from dataclasses import dataclass
from typing import Any

import ngsolve as ng
import xfem
from xfem.lsetcurv import LevelSetMeshAdaptation


@dataclass(frozen=True)
class CutFlow:
    """Velocity, and pressure of order 1, outside of a disc, and where they are integrated."""

    velocity: Any
    pressure: Any
    both: Any
    wet: Any  #: cells with fluid
    ghost_faces: Any  #: faces between a cell with fluid and a cut one
    normal: Any  #: out of the fluid
    dx: Any
    ds: Any
    dw: Any  #: over the two cells of each ghost face

    def form(self) -> Any:
        """A bilinear form with the couplings of ghost penalties on the faces that have some only."""
        return xfem.RestrictedBilinearForm(
            self.both, element_restriction=self.wet, facet_restriction=self.ghost_faces, check_unused=False
        )


def cut_flow(mesh: ng.Mesh, centre: tuple[float, float], radius: float, order: int, dirichlet: str) -> CutFlow:
    """The cut of a mesh by a disc, its boundary of the order of the velocity; `dirichlet`: boundaries of the box."""
    distance = radius - ng.sqrt((ng.x - centre[0]) ** 2 + (ng.y - centre[1]) ** 2)  # negative in the fluid
    adaptation = LevelSetMeshAdaptation(mesh, order=order, threshold=10.5, discontinuous_qn=True)
    deformation = adaptation.CalcDeformation(distance)
    level = adaptation.lset_p1
    info = xfem.CutInfo(mesh, level)
    wet, cut = info.GetElementsOfType(xfem.HASNEG), info.GetElementsOfType(xfem.IF)
    faces = xfem.GetFacetsWithNeighborTypes(mesh, a=wet, b=cut)
    V, Q = ng.VectorH1(mesh, order=order, dirichlet=dirichlet), ng.H1(mesh, order=1)
    V = ng.Compress(V, xfem.GetDofsOfElements(V, wet))
    Q = ng.Compress(Q, xfem.GetDofsOfElements(Q, wet))
    return CutFlow(
        V,
        Q,
        ng.FESpace([V, Q], dgjumps=True),
        wet,
        faces,
        ng.Grad(level) / ng.Norm(ng.Grad(level)),
        xfem.dCut(level, xfem.NEG, definedonelements=wet, deformation=deformation),
        xfem.dCut(level, xfem.IF, definedonelements=cut, deformation=deformation),
        xfem.dFacetPatch(definedonelements=faces, deformation=deformation),
    )
