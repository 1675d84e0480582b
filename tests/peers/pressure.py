"""Errors of the pressure of contact by Hertz' solution."""

from __future__ import annotations

from typing import Any

import numpy as np

from fsci.bench import hertz


def pressure_errors(found: dict[str, Any]) -> dict[str, Any]:
    """Errors of the pressure by Hertz' solution for the force found; nodes of the core have equal areas nearly."""
    radius = (0.75 * found["force"] * hertz.RADIUS * (1.0 - hertz.NU**2) / hertz.E) ** (1.0 / 3.0)
    peak = 1.5 * found["force"] / (np.pi * radius**2)
    distance, pressure = np.asarray(found["distance"]), np.asarray(found["pressure"])
    core = distance < hertz.CORE
    exact = peak * np.sqrt(np.maximum(0.0, 1.0 - (distance[core] / radius) ** 2))
    return {
        **{name: found[name] for name in ("dofs", "newton", "time [s]", "force")},
        "peak [%]": 100.0 * (pressure.max() / peak - 1.0),
        "pressure [%]": 100.0 * float(np.linalg.norm(pressure[core] - exact) / np.linalg.norm(exact)),
    }
