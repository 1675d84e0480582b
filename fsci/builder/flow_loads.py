"""The load of the flow on elastic bodies, as fields."""

from __future__ import annotations

from collections.abc import Mapping

from coupling.elastic import Elastic
from coupling.ports import Solid
from coupling.surface_loads import surface_loads
from solvers.api import Array
from solvers.fluid.flow.field import Fluid


def loads_of_flow(solid: Solid, fluid: Fluid, force: Mapping[str, Array]) -> dict[str, Array]:
    """Field -> values at owned dofs of the structure, see `surface_loads` (collective).

    force: of the flow on the vertices of each body [N], zero before the first step.
    """
    elastic = solid if isinstance(solid, Elastic) else _of_both(solid)
    x = fluid.moving.surfaces.by_name(fluid.cut.motion.x)
    facets = {body.surface.name: body.surface.facets for body in fluid.bodies}
    return surface_loads(elastic, force, x, facets)


def _of_both(solid: Solid) -> Elastic:
    from coupling.composite import Composite

    assert isinstance(solid, Composite)
    return solid.elastic
