"""The motion of obstacles, and of rigid bodies of the flow as obstacles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fsci.case import Case
from fsci.case.fluid import Movement
from fsci.case.rigid_motion import rigid_motion
from solvers.api import Array


def motion_of_obstacle(case: Case, name: str, points: Array) -> Callable[[float], Array] | None:
    """A function: time [s] -> positions of the points [m]; None if they are at rest."""
    obstacles = {} if case.contact is None else case.contact.obstacles
    if name in obstacles:
        movement = obstacles[name].motion
        if isinstance(movement, tuple):
            components = movement
            return lambda t: points + np.stack([component(points.T, t) for component in components], axis=1)
    else:
        movement = None if case.fluid is None or name not in case.fluid.bodies else case.fluid.bodies[name].motion
    if movement is None:
        return None
    assert isinstance(movement, Movement)
    moved = rigid_motion(points, movement, case.time.start, case.time.step)
    return lambda t: moved(t)[0]
