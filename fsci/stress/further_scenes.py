"""Scenes with a flow that came later: free rigid bodies on long cells, nested cells, rough surfaces in contact."""

from __future__ import annotations

import random
from dataclasses import replace

from fsci.stress.flow_scenes import CELLS, OUT, common, fall, flow
from fsci.stress.frame import ACCELERATION, DENSITY, LENGTH, Frame
from fsci.stress.scenes import Case, StressScene, spread, timing

#: Cells of a channel of 2 x 1: squares, and cells of aspect 4 and 20
LONG = ((20, 10), (40, 5), (80, 2))


def free(chance: random.Random) -> StressScene:
    """A free rigid body in a flow, lighter or heavier than it, held in part or not at all, with slip, on long cells."""
    p = common(chance, longest=10.0) | {
        "body density": spread(chance, 1e-3, 1e3),
        "slip": chance.choice([0.0, 0.0, 1e-3, 0.1, 10.0]),
        "held": chance.choice([[], [], ["rotation"], ["x"]]),
        "slant": chance.choice([0.0, 30.0, 45.0]),
        "cells": chance.choice(LONG),
        "rho_inf": chance.choice([0.0, 0.8]),
    }

    def case(frame: Frame) -> Case:
        low = (0.6 + p["offset"][0], 0.31 + p["offset"][1])
        mesh = {**frame.rectangle((0.51, 0.43), low, (4, 4)), "rotate": [{"angle": frame.angle + p["slant"]}]}
        way = frame.turned((1, 0))
        held = ["xy"[round(abs(float(way[1])))] if name == "x" else name for name in p["held"]]
        body: Case = {
            "mesh": mesh,
            "free": {
                "density": frame.number(p["body density"] * p["density"], DENSITY),
                "gravity": frame.vector((0, -1), ACCELERATION),
                **({"held": held} if held else {}),
            },
        }
        if p["slip"]:
            body["slip_length"] = frame.number(p["slip"], LENGTH)
        return {
            "time": timing(frame, p["dt"], 6),
            "fluid": {
                **flow(frame, p, speed=1.0, inlet=1.0),
                "grid": frame.grid((0, 0), (2, 1), p["cells"]),
                "dynamics": {"rho_inf": p["rho_inf"]},
                "bodies": {"body": body},
            },
            "coupling": {"scheme": "monolithic"},
        }

    of_body = {name: {"quantity": name, "body": "body"} for name in ("force", "centre")}
    return StressScene("free", p, case, {**of_body, "out": OUT})


def nested(chance: random.Random) -> StressScene:
    """A rigid body moved through nested cells: far from coarse ones, or near to them where a box has fine ones."""
    p = common(chance) | {
        "level": chance.choice([1, 1, 2]),
        "layers": 4,
        "slant": chance.choice([0.0, 1e-6, 30.0, 45.0]),
        "cells per step": chance.choice([0.0, 0.3, 1.0]),
    }
    p["box"] = p["cells per step"] > 0.0 or chance.choice([True, False])
    if p["box"]:
        p["layers"] = chance.choice([1, 4])
    steps, size = 5, (0.45, 0.37)
    speed = p["cells per step"] / CELLS / 2 ** p["level"] / p["dt"]

    def case(frame: Frame) -> Case:
        low = (0.5 + p["offset"][0], 0.3 + p["offset"][1])
        mesh = {**frame.rectangle(size, low, (4, 4)), "rotate": [{"angle": frame.angle + p["slant"]}]}
        motion = {"motion": {"displacement": frame.vector((speed, 0), LENGTH, "s_")}} if speed else {}
        grid = frame.grid((0, 0), (2, 1), (2 * CELLS, CELLS))
        refine: list[Case] = [{"around": "body", "layers": p["layers"], "level": p["level"]}]
        if p["box"]:
            around = frame.grid((0.1, 0.0), (1.7, 1.0), (1, 1))
            refine.append({"box": [around["from"], around["to"]], "level": p["level"]})
        return {
            "time": timing(frame, p["dt"], steps),
            "fluid": {
                **flow(frame, p, speed=1.0, inlet=1.0),
                "grid": {**grid, "refine": refine},
                "bodies": {"body": {"mesh": mesh, **motion}},
            },
        }

    probes = {"force": {"quantity": "force", "body": "body"}, "energy": {"quantity": "kinetic_energy"}, "out": OUT}
    return StressScene("nested", p, case, probes)


def rough(chance: random.Random) -> StressScene:
    """An elastic block falls to a rough floor: a layer in which fluid passes below it."""
    smooth = fall(chance)
    p = smooth.parameters | {"roughness": spread(chance, 1e-3, 1.0)}

    def case(frame: Frame) -> Case:
        found = smooth.case(frame)
        film = {"roughness": frame.number(p["roughness"] / CELLS, LENGTH)}
        return {**found, "contact": {**found["contact"], "film": film}}

    return replace(smooth, name="rough", parameters=p, case=case)
