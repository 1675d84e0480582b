"""Press fits of straight facets: how far these lie from the curved surfaces that they stand for."""

from __future__ import annotations

from collections.abc import Mapping

from fsci.case import Case
from fsci.case.contact import PairSection, Side
from fsci.meshes.curved import facet_height
from fsci.meshes.of_case import read_rigid_side
from solvers.mesh.mesh import Mesh

#: Largest mean gap that is none over the height of the arcs of both sides: dual functions, negative in places, weigh
#: with more than 1. From 2 to 1000 rings of any order that fit have the same pressure; with 1 some do not touch.
OF_HEIGHT = 4.0


def off_curve(case: Case, pair: PairSection, meshes: Mapping[str, Mesh]) -> float:
    """The largest gap [m] that facets explain, 0 without an interference; meshes: of the elastic bodies."""
    if pair.interference is None:
        return 0.0
    return OF_HEIGHT * sum(height_of_side(case, side, meshes) for _, side in pair.sides)


def height_of_side(case: Case, side: Side, meshes: Mapping[str, Mesh]) -> float:
    """Height [m] of the curve over the straight facets of a side."""
    if side.body is not None:
        return facet_height(meshes[side.body], side.on)
    return facet_height(*read_rigid_side(case, str(side.obstacle)))
