"""Warnings about bodies in a flow with gravity whose own gravity is another one, or none."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from fsci.case.case import Case
from fsci.case.fluid import FluidSection
from fsci.case.material import has_mass
from fsci.case.yaml_text import Keys
from fsci.expression import Expression

#: Difference of two accelerations, relative to the larger one, that is rounding of the numbers in a case.
SAME = 1e-6
#: Times at which accelerations are compared, from the start to the end of the run.
TIMES = 9


def gravity_warnings(case: Case, fluid: FluidSection) -> Iterator[tuple[Keys, str]]:
    """Paths of bodies, or of their gravity, with a warning about each; zeros are taken as meant."""
    if fluid.gravity is None or not (flow := _values(case, fluid, fluid.gravity)).any():
        return
    free = fluid.free_bodies
    bodies: dict[Keys, Sequence[Expression] | None] = {
        **{("fluid", "bodies", name, "free"): body.gravity for name, body in free.items()},
        **{
            ("structure", "bodies", name): body.gravity
            for name, body in case.elastic_bodies.items()
            if has_mass(body.material)
        },
    }
    for keys, gravity in bodies.items():
        if gravity is None:
            yield (
                keys,
                "the flow has gravity, the body has none: buoyancy acts on it, but no weight; "
                "give it 'gravity', zeros if this is meant",
            )
            continue
        own = _values(case, fluid, gravity)
        if own.any() and np.abs(own - flow).max() > SAME * max(np.abs(own).max(), np.abs(flow).max()):
            yield (*keys, "gravity"), "the gravity of the body is not that of the flow: weight and buoyancy differ"


def _values(case: Case, fluid: FluidSection, gravity: Sequence[Expression]) -> NDArray[np.float64]:
    """In the middle of the box at some times [m/s^2], shape (times, dim)."""
    middle = (0.5 * (np.array(fluid.grid.start) + np.array(fluid.grid.to)))[:, None]
    times = np.linspace(case.time.start, case.time.end, TIMES)
    return np.array([[float(component(middle, t)[0]) for component in gravity] for t in times])
