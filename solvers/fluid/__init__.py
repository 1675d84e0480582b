"""Incompressible flow on a fixed grid that moving surfaces cut (CutFEM)."""

from solvers.lazy import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "flow.field": ["Fluid"],
        "grid.box": ["Grid", "uniform"],
        "surfaces.immersed": ["ImmersedBody", "rigid_body"],
        "terms.boundary.patches": ["Patch"],
        "settings.flow_settings": ["FlowSettings"],
    },
)
