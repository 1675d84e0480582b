"""Assembly of a flow with elastic and free rigid bodies. Only cases with both load this module."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from coupling.composite import Composite
from coupling.composite_start import CompositeStart
from coupling.coupled import Coupled
from coupling.elastic import Elastic
from coupling.interface import DrySide
from coupling.ports import Start
from coupling.sealing_layer import SealingLayer
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.start import FlowStart
from solvers.rigid.field import RigidBodies

if TYPE_CHECKING:
    from coupling.near_walls import NearWalls


def coupled_both(
    fluid: Fluid,
    elastic: Elastic,
    bodies: RigidBodies,
    dry_sides: Sequence[DrySide] = (),
    layers: Mapping[str, SealingLayer] = {},
    walls: NearWalls | None = None,
) -> Coupled:
    """A structure with inertia and rigid bodies in one flow; arguments as in `parts.coupled_elastic`."""
    solid = Composite(elastic, bodies)
    return Coupled(fluid, solid, dry_sides, Start(FlowStart(fluid), CompositeStart(solid)), layers, walls)
