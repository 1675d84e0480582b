"""The bodies in a flow and their motion: now, at the beginning of the step, and at earlier times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, State
from solvers.fluid.flow.thin_bodies import ThinBodies
from solvers.fluid.geometry.thin.sheets import Sheets, sheets_of
from solvers.fluid.grid.box import Grid
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.settings.time_scheme import FlowStep
from solvers.fluid.surfaces.all_surfaces import AllSurfaces
from solvers.fluid.surfaces.fast_bodies import FastBodies
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import Motion
from solvers.fluid.surfaces.sweep import Sweep
from solvers.fluid.terms.slip_history import SlipHistory


class MovingBodies:
    """All bodies, as one surface with vertices and facets numbered body by body."""

    def __init__(self, grid: Grid, bodies: Sequence[ImmersedBody], settings: FlowSettings, repeated: tuple[int, ...]):
        """repeated: periodic axes of the box."""
        self.bodies, self._box, self._repeated, self._steady = list(bodies), grid, repeated, settings.steady
        self.sheets_at_start = sheets_of(grid, bodies, repeated)  #: around bodies at rest
        self.thin = ThinBodies(grid, bodies, repeated, self.sheets_at_start)
        self.motions: list[Motion] = []  #: of the bodies at present
        self.surfaces = AllSurfaces([body.surface for body in bodies], grid.dim)
        sweep = [np.full(len(b.surface.facets), b.sweeps) for b in bodies]
        self.sweep = Sweep(settings.time.times, np.concatenate([*sweep, np.empty(0, dtype=bool)]))
        self.slip = SlipHistory(settings.time.times)
        self._fast_bodies = FastBodies(grid)

    @property
    def coupled(self) -> bool:
        """Whether another field moves some of them."""
        return any(body.motion is None for body in self.bodies)

    @property
    def rest(self) -> bool:
        """Whether no one ever moves."""
        return all(body.rests for body in self.bodies)

    def moved(self) -> Iterator[tuple[ImmersedBody, Motion]]:
        """Pairs of each body and its present motion."""
        return zip(self.bodies, self.motions, strict=True)

    def by_others(self) -> dict[str, Motion]:
        """Present motions of those that another field moves, by name."""
        return {body.surface.name: motion for body, motion in self.moved() if body.motion is None}

    def outside(self, surfaces: Mapping[str, Motion]) -> set[str]:
        """Names of the surfaces that lie outside of the box, which have nothing to do with the flow."""
        edges = [(axis, edge[0], edge[-1]) for axis, edge in enumerate(self._box.edges) if axis not in self._repeated]
        away = {name: [(m.x[:, i].max() < a, m.x[:, i].min() > b) for i, a, b in edges] for name, m in surfaces.items()}
        return {name for name, sides in away.items() if np.any(sides)}

    def begin_step(self) -> None:
        """Keep the present positions; facets and thin bodies are found anew."""
        self.sweep.begin_step(self.surfaces.together(self.motions)[1].x)
        self.thin.begin_step()
        self.surfaces.begin_step()

    def move(self, coupled: Mapping[str, Motion], t: float) -> tuple[NDArray[np.int64], Motion]:
        """Move all to the time t [s]; returns (facets, motion). coupled: see `Fluid.move`."""
        self.motions = [coupled[b.surface.name] if b.motion is None else b.motion(t) for b in self.bodies]
        self.surfaces.follow(self.motions)
        return self.surfaces.together(self.motions)

    def sheets(self) -> Sheets | None:
        """Those around thin bodies at the present positions, see `ThinBodies.sheets`."""
        return self.thin.sheets(*self.surfaces.together(self.motions))

    def release(self) -> bool:
        """Whether sheets without what cycles join have other unknowns, see `ThinBodies.release`."""
        return self.thin.release(*self.surfaces.together(self.motions))

    def ways(self, t: float, dt: float) -> dict[str, tuple[NDArray[np.int64], tuple[Array, Array]]]:
        """Facets, and positions [m] now and after a step from t of length dt [s], by name."""
        found = {}
        for body, motion in self.moved():
            after = motion.x + dt * motion.v if body.motion is None else body.motion(t + dt).x
            found[body.surface.name] = body.surface.facets, (motion.x, after)
        return found

    def notes(self, step: FlowStep) -> list[str]:
        """New warnings of bodies that are too fast for a step; none of a steady flow."""
        if self._steady:
            return []
        return self._fast_bodies.notes({body.surface.name: motion for body, motion in self.moved()}, step.dt)

    def dry_in_contact(self) -> NDArray[np.bool_]:
        """Mask of the facets of all surfaces that may touch others and are dry where they do."""
        surfaces = [body.surface for body in self.bodies]
        dry = [s.zone == "dry" and s.in_contact is not None and bool(s.in_contact.any()) for s in surfaces]
        return np.repeat(dry, [len(s.facets) for s in surfaces])

    # ----------------------------------------------------------------------------------------------------- the start

    @contextmanager
    def with_later_velocities(self, dt: float) -> Iterator[None]:
        """A context in which prescribed bodies have the velocities that they have dt [s] later."""
        bodies = self.bodies
        self.bodies = [body if body.motion is None else _later(body, dt) for body in bodies]
        try:
            yield
        finally:
            self.bodies = bodies

    def continue_back(self, t: float, dt: float, short: float, coupled: Sequence[Mapping[str, Motion]]) -> None:
        """Set the positions at the times t - dt, t - 2 dt, ... before the start at t [s].

        Prescribed bodies are extrapolated by their acceleration in a step of length `short` [s]; coupled: motions of
        the others at these times.
        """
        found = []
        for number, moved in enumerate(coupled, 1):
            back, parts = number * dt, [np.empty((0, self._box.dim))]
            for body in self.bodies:
                if body.motion is None:
                    parts.append(moved[body.surface.name].x)
                    continue
                now, later = body.motion(t), body.motion(t + short)
                parts.append(now.x - back * now.v + 0.5 * back**2 * (later.v - now.v) / short)
            found.append(np.concatenate(parts))
        self.sweep.past = tuple(found)

    # ---------------------------------------------------------------------------------------------- save and restore

    def save(self) -> State:
        return {
            "thin": self.thin.save(),
            "swept": self.sweep.save(),
            "slip": self.slip.save(),
            "motion": {body.surface.name: {"x": motion.x, "v": motion.v} for body, motion in self.moved()},
        }

    def restore(self, state: State) -> None:
        self.thin.restore(state["thin"])
        self.sweep.restore(state["swept"])
        self.slip.restore(state["slip"])
        self.motions = [Motion(m["x"], m["v"]) for m in state["motion"].values()]


def _later(body: ImmersedBody, dt: float) -> ImmersedBody:
    """The body with the velocity that it has dt [s] later."""
    motion = body.motion
    assert motion is not None
    return replace(body, motion=lambda t: Motion(motion(t).x, motion(t + dt).v))
