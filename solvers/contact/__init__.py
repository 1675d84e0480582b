"""Dual mortar contact between surfaces: multipliers, active sets, laws."""

from solvers.lazy import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "contact": ["Contact"],
        "law.coulomb": ["Coulomb"],
        "law.frictionless": ["Frictionless"],
        "law.tied": ["Tied"],
        "law.tresca": ["Tresca"],
        "pair": ["Pair"],
        "surface": ["Surface"],
    },
)
