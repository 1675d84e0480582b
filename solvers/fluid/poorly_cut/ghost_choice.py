"""The choice of the ghost penalty by element."""

from __future__ import annotations

from solvers.fluid import forms
from solvers.fluid.background.space import Unknowns
from solvers.fluid.films.gap_terms import GapTerms
from solvers.fluid.poorly_cut.extension_penalty import ExtensionPenalty
from solvers.fluid.poorly_cut.face_penalty import FacePenalty
from solvers.fluid.poorly_cut.ghost import GhostPenalty


def choose_ghost_penalty(
    unknowns: Unknowns, flow: forms.Coefficients, penalties: forms.Penalties, gaps: GapTerms | None
) -> GhostPenalty:
    """The more accurate one for the element; `solvers.fluid.poorly_cut.ghost` has the reason.

    gaps: those of first degree.
    """
    if gaps is None:
        return ExtensionPenalty(unknowns, penalties.extension)
    return FacePenalty(unknowns, flow, penalties, gaps)
