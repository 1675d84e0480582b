"""Rigid bodies: free or with held components, on springs, in contact with rigid obstacles."""

from solvers.lazy import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "body": ["PointLoad", "PointSpring", "RigidBody", "hinged"],
        "field": ["RigidBodies"],
        "inertia": ["Inertia", "inertia_of_surface"],
        "line_springs": ["LineSpring"],
    },
)
