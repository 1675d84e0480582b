"""Finite-deformation solids: bodies of hyperelastic material, static or in motion."""

from solvers.lazy import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "active": ["Active"],
        "body": ["Body"],
        "field": ["Structure"],
        "loads": ["LineForce", "PointForce", "Pressure", "Traction"],
        "elastic_constants": ["lame"],
        "materials": [
            *("CoupNeoHooke", "HolzapfelGasserOgden", "LinearElastic", "MooneyRivlin", "NeoHooke"),
            *("Ogden", "StVenantKirchhoff", "Yeoh"),
        ],
        "relaxation": ["Branch"],
        "springs": ["Spring"],
        "supports": ["Roller", "Support", "Symmetry"],
        "dynamics": ["Damping", "Dynamics"],
        "time_scheme": ["Statics"],
    },
)
