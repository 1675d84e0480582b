"""Coupling of a flow with solids: interface operators, and partitioned and monolithic schemes."""

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
