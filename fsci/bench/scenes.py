"""Cases of benchmarks that are no cases of `cases/`: their `verify` has exact values, or those of a much finer run."""

from __future__ import annotations

from typing import Any

#: Tip of the cantilever by 60 x 6 x 6 hex27 [m]; 40 x 4 x 4 give 4e-4 less.
TIP = -0.9906

CANTILEVER: dict[str, Any] = {
    "title": "A bent beam",
    "time": {"step": 1.0, "end": 1.0},
    "structure": {
        "bodies": {
            "beam": {
                "mesh": {"shape": "box", "size": [10, 1, 1], "cells": [10, 1, 1]},
                "material": {"law": "neo_hooke", "E": 1000, "nu": 0.3},
                "supports": [{"on": "left", "displacement": [0, 0, 0]}],
                "tractions": [{"on": "right", "value": [0, 0, -0.25]}],
            }
        }
    },
    "probes": {"tip": {"quantity": "displacement", "at": [10, 0.5, 0.5]}},
    "verify": [{"value": "tip.z", "statistic": "final", "reference": TIP, "relative": 1.0}],
}

#: A bar of E = density = length = 1 (waves of speed 1) hits a rigid wall with 0.01: it leaves with as much after
#: a time of 2, in the middle of which its centre is farthest, 0.005 from where it was at the first touch.
BAR: dict[str, Any] = {
    "title": "A bar hits a wall",
    "time": {"step": 0.05, "end": 3.0},
    "structure": {
        "dynamics": {"rho_inf": 1.0},
        "bodies": {
            "bar": {
                "mesh": {"shape": "rectangle", "size": [1, 0.1], "cells": [20, 1], "origin": [-0.495, 0]},
                "material": {"law": "st_venant_kirchhoff", "E": 1, "nu": 0, "density": 1},
                "initial_velocity": [-0.01, 0],
                "supports": [{"on": ["bottom", "top"], "symmetry": True}],
            }
        },
    },
    "contact": {
        "obstacles": {
            "wall": {
                "mesh": {"shape": "rectangle", "size": [1, 1], "cells": [1, 1], "origin": [-1.5, -0.5]},
                "on": "right",
            }
        },
        "pairs": {"wall": {"slave": {"body": "bar", "on": "left"}, "master": {"obstacle": "wall"}}},
    },
    "probes": {"momentum": {"quantity": "momentum"}, "centre": {"quantity": "centre"}},
    "verify": [
        {"value": "momentum.x", "statistic": "final", "reference": 0.001, "relative": 1.0},
        {"value": "centre.x", "statistic": "min", "reference": -0.005, "relative": 1.0},
    ],
}
