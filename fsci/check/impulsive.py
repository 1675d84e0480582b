"""Flows that start with a jump: the force of the first step is an impulse over the step, and means nothing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case

Array = NDArray[np.float64]

#: probes of a body in the flow that the impulse is in
MEASURED_FORCES = ("force", "moment", "power", "drag_coefficient", "lift_coefficient")
SAMPLES = 9  #: along each side of a face


def impulsive(case: Case) -> Iterator[str]:
    """Notes on patches with a velocity at the start of a flow at rest, where forces on bodies are measured."""
    fluid = case.fluid
    measured = any(probe.quantity in MEASURED_FORCES for probe in case.probes.values())
    if fluid is None or fluid.scheme == "steady" or fluid.initial_velocity is not None or not measured:
        return
    unit = f"{case.units.length}/{case.units.time}"
    for name, patch in fluid.patches.items():
        if patch.velocity is None:
            continue
        points = np.concatenate([_points(case, face) for face in patch.on], axis=1)
        if patch.where is not None:
            points = points[:, np.broadcast_to(patch.where(points, 0.0), points.shape[1]) > 0.0]
        at_start = [
            np.broadcast_to(component(points, case.time.start), points.shape[1]) for component in patch.velocity
        ]
        speed = float(np.linalg.norm(at_start, axis=0).max(initial=0.0))
        if speed > 0.0:
            yield (
                f"{case.place('fluid', 'patches', name)}: {speed:.3g} {unit} at the start of a flow at rest: forces on "
                "bodies in the first step are an impulse over the step; let it rise, as by ramp(t, 0, 1), or give "
                "'initial_velocity'"
            )


def _points(case: Case, face: str) -> Array:
    """Points of a face, shape (dim, n)."""
    assert case.fluid is not None
    low, high = np.asarray(case.fluid.grid.start, dtype=float), np.asarray(case.fluid.grid.to, dtype=float)
    axis = "xyz".index(face[0])
    sides = [np.linspace(a, b, SAMPLES) for a, b in zip(low, high, strict=True)]
    sides[axis] = np.array([low[axis] if face[1] == "-" else high[axis]])
    return np.stack([x.ravel() for x in np.meshgrid(*sides, indexing="ij")])
