"""Scenes of random cases: few cells, and parameters far from those of textbooks.

A scene is a function of a random generator. It returns its parameters and a function of a `Frame` that gives the case.
Lengths, times and masses of a scene are of the order of 1; the frame converts them, and functions of time too.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from fsci.stress.frame import ACCELERATION, DENSITY, LENGTH, SPEED, STRESS, Frame

Case = dict[str, Any]


@dataclass(frozen=True)
class StressScene:
    """One draw of a scene."""

    name: str
    parameters: dict[str, Any]
    case: Callable[[Frame], Case]
    probes: dict[str, dict[str, Any]]  #: their settings
    any_angle: bool = False  #: no grid: it may be turned by any angle
    dim: int = 2
    must_warn: tuple[str, ...] = field(default=())  #: texts that the output of a successful run must contain
    beside: Callable[[Frame, float], Case] | None = None  #: a body of a given stiffness that nothing touches

    def move_against_grid(self, by: float) -> None:
        """Shift the body by [m] along every axis of the grid; nothing without a grid."""
        offset = self.parameters.get("offset", [])
        offset[:] = [start + by for start in offset]


def spread(chance: random.Random, low: float, high: float) -> float:
    """A number with log-uniform distribution between two bounds, rounded to three digits."""
    return float(f"{low * (high / low) ** chance.random():.3g}")


def timing(frame: Frame, step: float, steps: int) -> Case:
    """Section `time`: failed steps are halved twice."""
    dt = frame.number(step, (0, 0, 1))
    return {"step": dt, "end": dt * steps, "retry": {"halvings": 2}}


def solid(frame: Frame, E: float, nu: float, density: float, law: str = "neo_hooke") -> Case:
    return {"law": law, "E": frame.number(E, STRESS), "nu": nu, "density": frame.number(density, DENSITY)}


SOLVER: Case = {"newton": {"residual": 1e-10, "max_iterations": 25}}


def beam(chance: random.Random) -> StressScene:
    """An elastic beam, held at one end, that is pulled sideways: stiffness, nearly incompressible, long cells."""
    p: dict[str, Any] = {
        "E": spread(chance, 1e1, 1e9),
        "nu": chance.choice([0.0, 0.3, 0.45, 0.49, 0.499, 0.4999]),
        "aspect": spread(chance, 1, 20),
        "order": chance.choice([1, 2]),
        "element": chance.choice(["displacement", "mixed"]),
        "step": spread(chance, 0.01, 100),
        "pull": spread(chance, 1e-3, 0.1),
        "rho_inf": chance.choice([0.0, 0.5, 0.9, 1.0]),
    }
    step, size = 0.1 * p["step"] / p["E"] ** 0.5, (p["aspect"], 0.5)
    pull, over_time = p["pull"] * p["E"] / p["aspect"], f"min(s_/{3 * step!r}, 1)"

    def case(frame: Frame) -> Case:
        return {
            "time": timing(frame, step, 6),
            "structure": {
                "dynamics": {"rho_inf": p["rho_inf"]},
                "bodies": {
                    "beam": {
                        "mesh": frame.rectangle(size, (0, 0), (4, 2), order=p["order"]),
                        "material": solid(frame, p["E"], p["nu"], 1.0),
                        "element": p["element"],
                        "supports": [{"on": "left", "displacement": [0, 0]}],
                        "tractions": [{"on": "right", "value": frame.vector((0, pull), STRESS, over_time)}],
                    }
                },
            },
        }

    warn = ("lock",) if p["order"] == 1 and p["element"] == "displacement" and p["nu"] > 0.49 else ()
    probes = {"tip": {"quantity": "displacement", "on": "right"}, "energy": {"quantity": "energy"}}
    return StressScene("beam", p, case, probes, any_angle=True, must_warn=warn)


#: A block pressed onto a base: its pair, and what is compared.
PRESSED = {"slave": {"body": "block", "on": "bottom"}, "master": {"body": "base", "on": "top"}}
PRESS_PROBES = {
    "top": {"quantity": "reaction", "body": "block", "on": "top"},
    "bottom": {"quantity": "reaction", "body": "base", "on": "bottom"},
    "energy": {"quantity": "energy"},
}


def press(chance: random.Random) -> StressScene:
    """A block pressed onto another one: facets of very different size, stiffness ratio, small gaps, friction."""
    coarse = chance.choice([2, 3, 4])
    p: dict[str, Any] = {
        "E": spread(chance, 1e1, 1e9),
        "stiffness ratio": spread(chance, 1e-3, 1e3),
        "nu": chance.choice([0.0, 0.3, 0.45]),
        "facets": spread(chance, 0.1, 10),
        "gap": chance.choice([0.0, 1e-3, -1e-3, 0.3]),
        "friction": chance.choice([0.0, 0.0, 0.3, 1.0]),
        "press": spread(chance, 1e-4, 0.2),
        "order": chance.choice([1, 2]),
    }
    cells = (max(2, round(coarse * p["facets"])), coarse) if p["facets"] >= 1 else (coarse, round(coarse / p["facets"]))

    def case(frame: Frame) -> Case:
        gap = p["gap"] / max(cells)
        friction = {"friction": {"coefficient": p["friction"]}} if p["friction"] else {}
        down = frame.vector((0, -gap - p["press"]), LENGTH, "s_")
        return {
            "time": timing(frame, 0.25, 4),
            "structure": {
                "bodies": {
                    "block": {
                        "mesh": frame.rectangle((1, 0.5), (0, gap), (cells[0], 2), order=p["order"]),
                        "material": solid(frame, p["E"], p["nu"], 1.0),
                        "supports": [{"on": "top", "displacement": down}],
                    },
                    "base": {
                        "mesh": frame.rectangle((1.5, 0.5), (-0.25, -0.5), (cells[1], 2), order=p["order"]),
                        "material": solid(frame, p["E"] * p["stiffness ratio"], p["nu"], 1.0),
                        "supports": [{"on": "bottom", "displacement": [0, 0]}],
                    },
                }
            },
            "contact": {"pairs": {"p": {**PRESSED, **friction}}},
        }

    return StressScene("press", p, case, PRESS_PROBES, any_angle=True)


def drop(chance: random.Random) -> StressScene:
    """A block thrown onto a floor: contact at speed, one step that would pass the floor, friction."""
    p: dict[str, Any] = {
        "E": spread(chance, 1e2, 1e9),
        "nu": chance.choice([0.0, 0.3, 0.49]),
        "cells": chance.choice([1, 2, 5]),
        "speed over wave": spread(chance, 1e-3, 0.3),
        "sideways": chance.choice([0.0, 0.5, 2.0]),
        "gap": spread(chance, 1e-3, 1.0),
        "friction": chance.choice([0.0, 0.0, 0.3]),
        "step": spread(chance, 0.03, 10),
        "rho_inf": chance.choice([0.0, 0.8, 1.0]),
    }
    wave = p["E"] ** 0.5
    speed = p["speed over wave"] * wave
    gap = p["gap"] / p["cells"]
    step = p["step"] * 0.1 / wave
    steps = min(40, max(8, round((gap / speed + 1.5 / wave) / step)))

    def case(frame: Frame) -> Case:
        friction = {"friction": {"coefficient": p["friction"]}} if p["friction"] else {}
        return {
            "time": timing(frame, step, steps),
            "structure": {
                "dynamics": {"rho_inf": p["rho_inf"]},
                "bodies": {
                    "block": {
                        "mesh": frame.rectangle((1, 0.5), (0, gap), (p["cells"] + 1, p["cells"] + 1)),
                        "material": solid(frame, p["E"], p["nu"], 1.0),
                        "initial_velocity": frame.vector((p["sideways"] * speed, -speed), SPEED),
                        "gravity": frame.vector((0, -0.1 * speed * wave), ACCELERATION),
                    }
                },
            },
            "contact": {
                "obstacles": {"floor": {"mesh": frame.rectangle((9, 1), (-4, -1), (9, 1)), "on": "top"}},
                "pairs": {
                    "p": {"slave": {"body": "block", "on": "bottom"}, "master": {"obstacle": "floor"}, **friction}
                },
            },
        }

    probes = {name: {"quantity": name} for name in ("momentum", "centre", "energy")}
    return StressScene("drop", p, case, probes, any_angle=True)
