"""What is measured of a body in a flow: how many cells are across it, its boundary layer and its gaps."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class GapCells:
    """The gap between a body and another one, itself, or a face of the box."""

    body: str
    to: str  #: name of the other body, or of the face
    cells: float  #: geometric mean, weighted by what acts there
    least: float  #: cells at the narrowest place
    along: float  #: along the film, from edge to edge; without edges along the part of it in which the force acts
    ends: bool  #: it ends at edges
    share: float  #: of the force on the body, as far as a flow explains it; also what its pressure makes elsewhere


@dataclass(frozen=True)
class BodyCells:
    """A body in the flow."""

    body: str
    across: float  #: cells across its extent: the longer one of a rectangle, the middle one in space
    layer: float  #: cells in its boundary layer; infinite: no shear acts, nan: the flow is not known
    sharp: bool  #: it has edges
    dim: int  #: of space
    facets: float  #: facets per cell, by their edge lengths
    share: float  #: of the force that does not act in narrow gaps, as far as a flow explains it
    gaps: tuple[GapCells, ...]
