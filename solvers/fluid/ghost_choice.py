"""The choice of the ghost penalty by element."""

from __future__ import annotations

from solvers.fluid import forms
from solvers.fluid.extension_penalty import ExtensionPenalty
from solvers.fluid.face_penalty import FacePenalty
from solvers.fluid.ghost import GhostPenalty
from solvers.fluid.space import Unknowns


def choose_ghost_penalty(unknowns: Unknowns, flow: forms.Coefficients, penalties: forms.Penalties) -> GhostPenalty:
    """The more accurate one for the element; `solvers.fluid.ghost` has the reason."""
    if unknowns.degree == 2:
        return ExtensionPenalty(unknowns, penalties.extension)
    return FacePenalty(unknowns, flow, penalties)
