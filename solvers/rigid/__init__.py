"""Rigid bodies in motion: free, on springs, held in some directions, against rigid obstacles."""

from solvers.lazy import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "body": ["PointSpring", "RigidBody"],
        "field": ["RigidBodies"],
        "inertia": ["Inertia", "inertia_of_surface"],
    },
)
