"""Scenes in 3D: contact of rotated blocks, a body moved through a flow, an elastic post in a flow."""

from __future__ import annotations

import random
from typing import Any

from fsci.stress.flow_scenes import OFFSETS, OUT, common
from fsci.stress.frame import ACCELERATION, DENSITY, LENGTH, SPEED, VISCOSITY, Frame
from fsci.stress.scenes import PRESS_PROBES, PRESSED, Case, StressScene, solid, spread, timing

CELLS = 6  #: per unit of length


def press(chance: random.Random) -> StressScene:
    """A block of bricks or tetrahedra pressed onto another one and drawn along."""
    p: dict[str, Any] = {
        "E": spread(chance, 1e1, 1e9),
        "stiffness ratio": spread(chance, 1e-3, 1e3),
        "nu": chance.choice([0.0, 0.3, 0.45]),
        "cells": [chance.choice([1, 2, 3]), chance.choice([1, 2, 4])],
        "cell": chance.choice(["hex", "hex", "tet"]),
        "order": chance.choice([1, 1, 2]),
        "gap": chance.choice([0.0, 1e-3, -1e-3, 0.1]),
        "friction": chance.choice([0.0, 0.0, 0.3, 1.0]),
        "press": spread(chance, 1e-4, 0.1),
        "aside": chance.choice([0.0, 0.01]),
    }
    m, n = p["cells"]

    def case(frame: Frame) -> Case:
        friction = {"friction": {"coefficient": p["friction"]}} if p["friction"] else {}
        way = (p["aside"], 0.5 * p["aside"], -p["gap"] - p["press"])
        kind = {"order": p["order"], "cell": p["cell"]}
        return {
            "time": timing(frame, 0.25, 4),
            "structure": {
                "bodies": {
                    "block": {
                        "mesh": frame.rectangle((1, 1, 0.5), (0, 0, p["gap"]), (m, m, 1), **kind),
                        "material": solid(frame, p["E"], p["nu"], 1.0),
                        "supports": [{"on": "top", "displacement": frame.vector(way, LENGTH, "s_")}],
                    },
                    "base": {
                        "mesh": frame.rectangle((1.5, 1.5, 0.5), (-0.25, -0.3, -0.5), (n, n, 1), **kind),
                        "material": solid(frame, p["E"] * p["stiffness ratio"], p["nu"], 1.0),
                        "supports": [{"on": "bottom", "displacement": [0, 0, 0]}],
                    },
                }
            },
            "contact": {"pairs": {"p": {**PRESSED, **friction}}},
        }

    return StressScene("press 3D", p, case, PRESS_PROBES, any_angle=True, dim=3)


def drop(chance: random.Random) -> StressScene:
    """A block thrown onto a floor, slanted or flat."""
    p: dict[str, Any] = {
        "E": spread(chance, 1e2, 1e9),
        "nu": chance.choice([0.0, 0.3, 0.49]),
        "cells": chance.choice([1, 2, 3]),
        "speed over wave": spread(chance, 1e-3, 0.2),
        "sideways": chance.choice([0.0, 0.5, 2.0]),
        "gap": spread(chance, 1e-3, 0.3),
        "friction": chance.choice([0.0, 0.0, 0.3]),
        "step": spread(chance, 0.1, 3),
        "rho_inf": chance.choice([0.0, 0.8, 1.0]),
    }
    wave = p["E"] ** 0.5
    speed, step = p["speed over wave"] * wave, p["step"] * 0.1 / wave
    steps = min(25, max(8, round((p["gap"] / speed + 1.5 / wave) / step)))

    def case(frame: Frame) -> Case:
        friction = {"friction": {"coefficient": p["friction"]}} if p["friction"] else {}
        velocity = (p["sideways"] * speed, 0.3 * p["sideways"] * speed, -speed)
        floor = {"mesh": frame.rectangle((9, 9, 1), (-4, -4, -1), (3, 3, 1)), "on": "top"}
        return {
            "time": timing(frame, step, steps),
            "structure": {
                "dynamics": {"rho_inf": p["rho_inf"]},
                "bodies": {
                    "block": {
                        "mesh": frame.rectangle((1, 1, 1), (0, 0, p["gap"]), [p["cells"]] * 3),
                        "material": solid(frame, p["E"], p["nu"], 1.0),
                        "initial_velocity": frame.vector(velocity, SPEED),
                        "gravity": frame.vector((0, 0, -0.1 * speed * wave), ACCELERATION),
                    }
                },
            },
            "contact": {
                "obstacles": {"floor": floor},
                "pairs": {
                    "p": {"slave": {"body": "block", "on": "bottom"}, "master": {"obstacle": "floor"}, **friction}
                },
            },
        }

    probes = {name: {"quantity": name} for name in ("momentum", "centre", "energy")}
    return StressScene("drop 3D", p, case, probes, any_angle=True, dim=3)


def _flow(frame: Frame, p: dict[str, Any]) -> Case:
    """A channel of 2 x 1 x 1 whose floor holds the fluid; Reynolds number by its width and a speed of 1."""
    sides = [frame.side(name) for name in ("y-", "y+", "z+")]
    inlet = frame.vector((1.0, 0, 0), SPEED, f"min(s_/{5 * p['dt']!r}, 1)")
    return {
        "density": frame.number(p["density"], DENSITY),
        "viscosity": frame.number(p["density"] / p["Re"], VISCOSITY),
        "element": p["fluid"],
        "scheme": p["scheme"],
        "grid": frame.grid((0, 0, 0), (2, 1, 1), (2 * CELLS, CELLS, CELLS)),
        "patches": {
            "inlet": {"on": frame.side("x-"), "velocity": inlet},
            "outlet": {"on": frame.side("x+"), "outflow": True},
            "walls": {"on": sides, "slip": True},
            "floor": {"on": frame.side("z-"), p["walls"]: True},
        },
    }


def _common(chance: random.Random) -> dict[str, Any]:
    p = common(chance)
    return p | {"fluid": "q1q1", "dt": p["step"] / CELLS, "offset": [chance.choice(OFFSETS) / CELLS for _ in range(3)]}


def moved(chance: random.Random) -> StressScene:
    """A rigid box moved through a flow."""
    p = _common(chance) | {"cells per step": chance.choice([0.0, 1e-3, 0.3, 1.0, 2.0])}
    speed = p["cells per step"] / CELLS / p["dt"]

    def case(frame: Frame) -> Case:
        low = [0.5 + p["offset"][0], 0.2 + p["offset"][1], 0.3 + p["offset"][2]]
        mesh = frame.rectangle((0.4, 0.45, 0.37), low, (2, 2, 2))
        motion = {"motion": {"displacement": frame.vector((0, 0, speed), LENGTH, "s_")}} if speed else {}
        return {
            "time": timing(frame, p["dt"], 4),
            "fluid": {**_flow(frame, p), "bodies": {"body": {"mesh": mesh, **motion}}},
        }

    probes = {"force": {"quantity": "force", "body": "body"}, "energy": {"quantity": "kinetic_energy"}, "out": OUT}
    return StressScene("moved 3D", p, case, probes, dim=3)


def post(chance: random.Random) -> StressScene:
    """An elastic post on the floor."""
    p = _common(chance) | {
        "walls": "no_slip",
        "solid density": spread(chance, 1e-2, 1e2),
        "E": spread(chance, 1e2, 1e8),
        "coupling": chance.choice(["monolithic", "iqn"]),
    }

    def case(frame: Frame) -> Case:
        coupling: Case = {"scheme": "monolithic"}
        if p["coupling"] != "monolithic":
            coupling = {"scheme": "partitioned", "accelerator": p["coupling"], "tolerance": 1e-9}
        body = {
            "mesh": frame.rectangle((0.4, 0.4, 0.41), (0.62, 0.31, 0), (2, 2, 2)),
            "material": solid(frame, p["E"] * p["density"], 0.3, p["solid density"] * p["density"]),
            "supports": [{"on": "bottom", "displacement": [0, 0, 0]}],
        }
        return {
            "time": timing(frame, p["dt"], 3),
            "fluid": _flow(frame, p),
            "structure": {"dynamics": {"rho_inf": 0.8}, "bodies": {"post": body}},
            "coupling": coupling,
        }

    tip = {"quantity": "displacement", "on": "top"}
    return StressScene("post 3D", p, case, {"force": {"quantity": "force"}, "out": OUT, "tip": tip}, dim=3)
