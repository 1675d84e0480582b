"""The choice of the penalty on poorly cut cells by element."""

from __future__ import annotations

from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.penalties import Penalties
from solvers.fluid.terms import forms
from solvers.fluid.terms.gap_terms import GapTerms
from solvers.fluid.terms.poorly_cut.extension_penalty import ExtensionPenalty
from solvers.fluid.terms.poorly_cut.face_penalty import FacePenalty
from solvers.fluid.terms.poorly_cut.ghost import CutPenalty


def choose_cut_penalty(
    unknowns: Unknowns, flow: forms.Coefficients, penalties: Penalties, gaps: GapTerms | None
) -> CutPenalty:
    """The more accurate one for the element; `solvers.fluid.terms.poorly_cut.ghost` has the reason.

    gaps: those of first degree.
    """
    if gaps is None:
        return ExtensionPenalty(unknowns, penalties.extension)
    return FacePenalty(unknowns, flow, penalties, gaps)
