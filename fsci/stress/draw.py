"""A draw: a scene, and its twin - the same thing done otherwise, with a result that must be the same."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from fsci.stress import flow_scenes, scenes
from fsci.stress.frame import Frame
from fsci.stress.scenes import StressScene

SCENES: dict[str, Callable[[random.Random], StressScene]] = {
    "beam": scenes.beam,
    "press": scenes.press,
    "drop": scenes.drop,
    "moved": flow_scenes.moved,
    "gate": flow_scenes.gate,
    "post": flow_scenes.post,
    "fall": flow_scenes.fall,
}

Twin = Literal["rotated", "shifted", "rescaled", "parallel", "resumed"]
TWINS: tuple[Twin, ...] = ("rotated", "shifted", "rescaled", "parallel", "resumed")


@dataclass(frozen=True)
class Draw:
    """What one number makes."""

    seed: int
    scene: StressScene
    twin: Twin
    frame: Frame  #: of the twin
    processes: int = 1  #: of the twin
    kill_after: int = 0  #: steps after which the twin is killed and resumed
    kill_delay: float = 0.0  #: part of a step that it goes on then

    @property
    def how(self) -> str:
        """The twin in a few words."""
        f = self.frame
        return {
            "rotated": f"rotated by {f.angle:.5g} degrees",
            "shifted": f"shifted by ({f.shift[0]:.3g}, {f.shift[1]:.3g})",
            "rescaled": f"units times {f.length:g}, {f.mass:g}, {f.time:g}",
            "parallel": f"{self.processes} processes",
            "resumed": f"killed after {self.kill_after} steps",
        }[self.twin]

    def case(self, frame: Frame) -> dict[str, Any]:
        """The case file's content as the scene is seen in a frame."""
        return {
            "title": f"{self.scene.name} {self.seed}",
            **self.scene.case(frame),
            "probes": self.scene.probes,
            "solver": scenes.SOLVER,
            "output": {"fields_every": 0, "checkpoint_every": 1 if self.twin == "resumed" else 0},
        }


def draw(seed: int) -> Draw:
    """The same for the same number, whatever was drawn before."""
    chance = random.Random(seed)
    scene = SCENES[chance.choice(sorted(SCENES))](chance)
    twin = chance.choice(TWINS)
    frame, processes, kill_after, delay = Frame(), 1, 0, 0.0
    if twin == "rotated":
        angle = chance.choice([90.0, 180.0, 270.0])
        frame = Frame(angle=chance.uniform(0, 360) if scene.any_angle and chance.random() < 0.7 else angle)
    elif twin == "shifted":
        frame = Frame(shift=(chance.uniform(-10, 10), chance.uniform(-10, 10)))
    elif twin == "rescaled":
        frame = Frame(
            length=chance.choice([1e-6, 1e-3, 1e3]), mass=10.0 ** chance.randint(-12, 12),
            time=10.0 ** chance.randint(-6, 6),
        )  # fmt: skip
    elif twin == "parallel":
        processes = chance.choice([2, 2, 3, 4])
    else:
        kill_after, delay = chance.randint(2, 4), chance.random()
    return Draw(seed, scene, twin, frame, processes, kill_after, delay)
