"""The choice of the penalty on poorly cut cells by element."""

from __future__ import annotations

from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.penalties import Penalties
from solvers.fluid.terms.forms import Coefficients
from solvers.fluid.terms.gap_terms import GapTerms
from solvers.fluid.terms.poorly_cut.extension_penalty import ExtensionPenalty
from solvers.fluid.terms.poorly_cut.face_penalty import FacePenalty
from solvers.fluid.terms.poorly_cut.ghost import CutPenalty
from solvers.fluid.terms.poorly_cut.seam_penalty import SeamPenalty


def choose_cut_penalty(
    unknowns: Unknowns, flow: Coefficients, penalties: Penalties, gaps: GapTerms | None
) -> CutPenalty:
    """The more accurate one for the element; `solvers.fluid.terms.poorly_cut.ghost` has the reason.

    flow: on faces between cells; gaps: those of first degree.
    """
    if gaps is None:
        return ExtensionPenalty(unknowns, penalties.extension)
    thin = unknowns.grid.sheets is not None  # around thin bodies no surface is at the ends of a period
    seams = SeamPenalty(unknowns) if unknowns.periodic and not thin else None
    return FacePenalty(unknowns, flow, penalties, gaps, seams)
