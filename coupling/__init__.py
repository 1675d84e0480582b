"""Fluid and structure together: what they exchange, and the schemes that bring them into balance."""

from solvers.lazy import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "contact_surfaces": ["contact_surface"],
        "parts": ["couple", "couple_rigid"],
        "monolithic": ["Monolithic"],
        "partitioned": ["Partitioned"],
    },
)
