"""A draw: a random case and its twin, an equivalent case whose results must be the same."""

from __future__ import annotations

import random
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from fsci.stress.frame import Frame
from fsci.stress.scene import SCENES, StressScene, draw_scene, series, spread

SOLVER = {"newton": {"residual": 1e-10, "max_iterations": 25}}

Twin = Literal["rotated", "shifted", "rescaled", "parallel", "resumed", "beside"]
#: Twins of every scene.
TWINS: tuple[Twin, ...] = ("rotated", "shifted", "rescaled", "parallel", "resumed")


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

    def moved(self, by: float) -> Draw:
        """The same with the body shifted along every axis of the grid [m]; nothing without a grid."""
        return replace(self, scene=replace(self.scene, by=by))

    def case(self, frame: Frame, twin: bool = False) -> dict[str, Any]:
        """The content of the case file in a frame; twin: with the body beside it."""
        scene = self.scene.case(frame)
        if twin and self.neighbour:
            scene["structure"]["bodies"]["beside"] = self.scene.beside(frame, self.neighbour)
        return {
            "title": f"{self.scene.name} {self.seed}",
            **scene,
            "time": {"retry": {"halvings": 2}, **scene["time"]},  # failed steps are halved twice
            "solver": SOLVER,
            "output": {"fields_every": 0, "checkpoint_every": 1 if self.twin == "resumed" else 0},
        }


def draw(seed: int, path: Path = SCENES) -> Draw:
    """The draw of a number, which does not depend on earlier draws. Raises SceneError, ExpressionError."""
    chance = random.Random(seed)
    kinds = series(seed, path)
    name = chance.choice(sorted(kinds))
    scene = draw_scene(name, kinds[name], chance)
    twin = chance.choice((*TWINS, "beside", "beside") if scene.body_beside else TWINS)
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
        neighbour = spread(chance, 1e-2, 1e12)
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
