"""Incompressible flow on a fixed grid that moving surfaces cut (CutFEM)."""

from solvers.lazy import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "field": ["Fluid"],
        "background.grid": ["Grid", "uniform"],
        "bodies.immersed": ["ImmersedBody", "rigid_body"],
        "boundary.patches": ["Patch"],
        "flow_settings": ["FlowSettings"],
    },
)
