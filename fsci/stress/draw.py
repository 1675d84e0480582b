"""A draw: a random case and its twin, an equivalent case whose results must be the same."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from fsci.stress import composed_scenes, flow_scenes, further_scenes, scenes, space_scenes
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

SPACE_SCENES: dict[str, Callable[[random.Random], StressScene]] = {
    "press 3D": space_scenes.press,
    "drop 3D": space_scenes.drop,
    "moved 3D": space_scenes.moved,
    "post 3D": space_scenes.post,
}
SPACE = 100_000  #: from this number on draws are in space

FURTHER_SCENES: dict[str, Callable[[random.Random], StressScene]] = {
    "free": further_scenes.free,
    "nested": further_scenes.nested,
    "rough": further_scenes.rough,
}
FURTHER = 200_000  #: from this number on they are of these scenes

COMPOSED_SCENES: dict[str, Callable[[random.Random], StressScene]] = {
    "stack": composed_scenes.stack,
    "roam": composed_scenes.roam,
    "curl": composed_scenes.curl,
}
COMPOSED = 300_000  #: from this number on several kinds of contact act together

Twin = Literal["rotated", "shifted", "rescaled", "parallel", "resumed", "beside"]
#: Twins of every scene.
TWINS: tuple[Twin, ...] = ("rotated", "shifted", "rescaled", "parallel", "resumed")

#: The scenes of the numbers from a first one on, newest first: those of earlier ones stay what they are.
SERIES = ((COMPOSED, COMPOSED_SCENES), (FURTHER, FURTHER_SCENES), (SPACE, SPACE_SCENES), (0, SCENES))


@dataclass(frozen=True)
class Draw:
    """The case and twin of one random seed."""

    seed: int
    scene: StressScene
    twin: Twin
    frame: Frame  #: of the twin
    processes: int = 1  #: of the twin
    kill_after: int = 0  #: steps after which the twin is killed and resumed
    kill_delay: float = 0.0  #: part of a step that it continues for then
    neighbour: float = 0.0  #: stiffness of a body that stands beside the twin [Pa]; 0: there is none

    @property
    def how(self) -> str:
        """The twin in a few words."""
        f = self.frame
        return {
            "rotated": f"rotated by {f.angle:.5g} degrees",
            "shifted": f"shifted by ({', '.join(f'{s:.3g}' for s in f.shift[: self.scene.dim])})",
            "rescaled": f"units times {f.length:g}, {f.mass:g}, {f.time:g}",
            "parallel": f"{self.processes} processes",
            "resumed": f"killed after {self.kill_after} steps",
            "beside": f"beside a body of {self.neighbour:.2g} Pa",
        }[self.twin]

    def case(self, frame: Frame, twin: bool = False) -> dict[str, Any]:
        """The content of the case file in a frame; twin: with the body beside it."""
        scene = self.scene.case(frame)
        if twin and self.neighbour and self.scene.beside:
            scene["structure"]["bodies"]["beside"] = self.scene.beside(frame, self.neighbour)
        return {
            "title": f"{self.scene.name} {self.seed}",
            **scene,
            "probes": self.scene.probes,
            "solver": scenes.SOLVER,
            "output": {"fields_every": 0, "checkpoint_every": 1 if self.twin == "resumed" else 0},
        }


def draw(seed: int, by: float = 0.0) -> Draw:
    """The draw of a number, which does not depend on earlier draws; by [m]: shift of the body against the grid."""
    chance = random.Random(seed)
    kinds = next(kinds for first, kinds in SERIES if seed >= first)
    scene = kinds[chance.choice(sorted(kinds))](chance)
    scene.move_against_grid(by)
    twin = chance.choice((*TWINS, "beside", "beside") if scene.beside else TWINS)
    frame, processes, kill_after, delay, neighbour = Frame(), 1, 0, 0.0, 0.0
    if twin == "rotated":
        frame = _turned(chance, scene)
    elif twin == "shifted":
        frame = Frame(shift=tuple(chance.uniform(-10, 10) for _ in range(scene.dim)))
    elif twin == "rescaled":
        frame = Frame(
            length=chance.choice([1e-6, 1e-3, 1e3]), mass=10.0 ** chance.randint(-12, 12),
            time=10.0 ** chance.randint(-6, 6),
        )  # fmt: skip
    elif twin == "parallel":
        processes = chance.choice([2, 2, 3, 4])
    elif twin == "beside":
        neighbour = scenes.spread(chance, 1e-2, 1e12)
    else:
        kill_after, delay = chance.randint(2, 4), chance.random()
    return Draw(seed, scene, twin, frame, processes, kill_after, delay, neighbour)


def _turned(chance: random.Random, scene: StressScene) -> Frame:
    """By any angle, in space about any axis; with a grid by quarter turns, in space also about a diagonal of a cube."""
    if scene.dim == 2:
        angle = chance.choice([90.0, 180.0, 270.0])
        return Frame(angle=chance.uniform(0, 360) if scene.any_angle and chance.random() < 0.7 else angle)
    if scene.any_angle:
        return Frame(angle=chance.uniform(0, 360), axis=tuple(chance.uniform(-1, 1) for _ in range(3)))
    if chance.random() < 0.5:
        return Frame(angle=chance.choice([120.0, 240.0]), axis=tuple(chance.choice([-1.0, 1.0]) for _ in range(3)))
    axis = chance.choice([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
    return Frame(angle=chance.choice([90.0, 180.0, 270.0]), axis=axis)
