"""Scenes with a flow: prescribed motion, elastic bodies, and bodies that fall to the floor."""

from __future__ import annotations

import random
from typing import Any

from fsci.stress.frame import ACCELERATION, DENSITY, LENGTH, SPEED, VISCOSITY, Frame
from fsci.stress.scenes import Case, StressScene, solid, spread, timing

#: Cells per unit of length. Where bodies begin is drawn in cells: flush, almost flush, anywhere.
CELLS = 10
OUT = {"quantity": "flow_rate", "through": "outlet"}
OFFSETS = (0.0, 1e-12, 1e-9, -1e-9, 1e-6, 1e-3, -1e-3, 0.37, 0.5, -0.43)


def flow(frame: Frame, p: dict[str, Any], *, speed: float, inlet: float) -> Case:
    """A channel of 2 x 1; Reynolds number by its width and `speed`."""
    patches: Case = {
        "outlet": {"on": frame.side("x+"), "outflow": True},
        "walls": {"on": [frame.side("y-"), frame.side("y+")], p["walls"]: True},
    }
    if inlet:
        over_time = f"min(s_/{5 * p['dt']!r}, 1)"
        patches["inlet"] = {"on": frame.side("x-"), "velocity": frame.vector((inlet, 0), SPEED, over_time)}
    else:
        patches["end"] = {"on": frame.side("x-"), "slip": True}
    return {
        "density": frame.number(p["density"], DENSITY),
        "viscosity": frame.number(p["density"] * speed / p["Re"], VISCOSITY),
        "element": p["fluid"],
        "scheme": p["scheme"],
        "grid": frame.grid((0, 0), (2, 1), (2 * CELLS, CELLS)),
        "patches": patches,
    }


def common(chance: random.Random, longest: float = 100.0) -> dict[str, Any]:
    """Parameters of all flows; steps from 0.01 to `longest` times that in which the flow passes a cell."""
    step = spread(chance, 0.01, longest)
    return {
        "Re": spread(chance, 0.01, 2000),
        "density": spread(chance, 1e-3, 1e3),
        "fluid": chance.choice(["q1q1", "q1q1", "q2q1"]),
        "scheme": chance.choice(["bdf2", "backward_euler"]),
        "walls": chance.choice(["slip", "no_slip"]),
        "step": step,
        "dt": step / CELLS,
        "offset": [chance.choice(OFFSETS) / CELLS for _ in range(2)],
    }


def moved(chance: random.Random) -> StressScene:
    """A rigid body moved through a flow: thin, slanted, by up to 5 cells in a step, out of the box."""
    p = common(chance) | {
        "thickness": chance.choice([1e-3, 0.3, 1.5, 2.5, 4.0, 5.0, 5.0]),
        "slant": chance.choice([0.0, 0.0, 1e-6, 30.0, 45.0]),
        "cells per step": chance.choice([0.0, 1e-3, 0.3, 1.0, 2.0, 3.0, 5.0]),
        "direction": chance.choice(["along", "across"]),
    }
    steps = 6
    thickness, height = p["thickness"] / CELLS, 0.37
    speed = p["cells per step"] / CELLS / p["dt"]
    way = (speed, 0) if p["direction"] == "along" else (0, speed)

    def case(frame: Frame) -> Case:
        low = (0.5 + p["offset"][0], 0.2 + p["offset"][1])
        mesh = {
            **frame.rectangle((thickness, height), low, (2, 6)),
            "rotate": [{"angle": frame.angle + p["slant"]}],
        }
        motion = {"motion": {"displacement": frame.vector(way, LENGTH, "s_")}} if speed else {}
        return {
            "time": timing(frame, p["dt"], steps),
            "fluid": {**flow(frame, p, speed=1.0, inlet=1.0), "bodies": {"body": {"mesh": mesh, **motion}}},
        }

    warn = []
    if p["thickness"] < (2.0 if not speed else 4.0):
        warn.append("passes through")
    if p["cells per step"] > 2.0:
        warn.append("cells in a time step")
    probes = {"force": {"quantity": "force", "body": "body"}, "energy": {"quantity": "kinetic_energy"}, "out": OUT}
    return StressScene("moved", p, case, probes, must_warn=tuple(warn))


def gate(chance: random.Random) -> StressScene:
    """A gate closes a basin and opens it again: a pocket without an outlet comes and goes."""
    p = common(chance) | {"past the floor": chance.choice([-1e-3, 0.0, 1e-3, 0.3])}
    steps = 8
    depth = 0.15 + p["past the floor"] / CELLS

    def case(frame: Frame) -> Case:
        mesh = frame.rectangle((0.43, 1.2), (0.8 + p["offset"][0], 0.15), (4, 12))
        over_time = f"sin(pi*s_/{steps * p['dt']!r})"
        motion = {"displacement": frame.vector((0, -depth), LENGTH, over_time)}
        return {
            "time": timing(frame, p["dt"], steps),
            "fluid": {**flow(frame, p, speed=1.0, inlet=0.0), "bodies": {"gate": {"mesh": mesh, "motion": motion}}},
        }

    return StressScene("gate", p, case, {"force": {"quantity": "force", "body": "gate"}, "out": OUT})


def post(chance: random.Random) -> StressScene:
    """An elastic post in a flow: density ratio, stiffness, Reynolds number, both schemes of coupling."""
    p = common(chance) | {
        "solid density": spread(chance, 1e-3, 1e3),
        "E": spread(chance, 1e1, 1e9),
        "nu": chance.choice([0.0, 0.3, 0.49]),
        "coupling": chance.choice(["monolithic", "monolithic", "iqn", "aitken"]),
        "rho_inf": chance.choice([0.0, 0.8]),
    }
    ratio = p["density"]  # both scale with the fluid's, so that ratios are those drawn

    def case(frame: Frame) -> Case:
        by = p["coupling"]
        coupling = {"scheme": "monolithic"} if by == "monolithic" else {"scheme": "partitioned", "accelerator": by}
        if by != "monolithic":
            coupling["tolerance"] = 1e-9  # type: ignore[assignment]
        body = {
            "mesh": frame.rectangle((0.45, 0.41), (0.62 + p["offset"][0], 0), (4, 4)),
            "material": solid(frame, p["E"] * ratio, p["nu"], p["solid density"] * ratio),
            "supports": [{"on": "bottom", "displacement": [0, 0]}],
        }
        return {
            "time": timing(frame, p["dt"], 5),
            "fluid": flow(frame, {**p, "walls": "no_slip"}, speed=1.0, inlet=1.0),
            "structure": {"dynamics": {"rho_inf": p["rho_inf"]}, "bodies": {"post": body}},
            "coupling": coupling,
        }

    tip = {"quantity": "displacement", "on": "top"}
    return StressScene("post", p, case, {"force": {"quantity": "force"}, "out": OUT, "tip": tip})


def fall(chance: random.Random) -> StressScene:
    """An elastic block falls to the floor of a basin: fluid, structure and contact together, at any speed."""
    p = common(chance) | {
        "solid density": spread(chance, 1.1, 1e3),
        "E": spread(chance, 1e2, 1e9),
        "height": chance.choice([0.0, 1e-3, 0.3, 1.0]),
        "speed": chance.choice([0.0, 1.0, 10.0]),
        "rho_inf": chance.choice([0.0, 0.8]),
    }
    p["dt"] = spread(chance, 1e-3, 0.1)
    del p["step"]
    steps = 10

    def case(frame: Frame) -> Case:
        height = p["height"] / CELLS
        body = {
            "mesh": frame.rectangle((0.52, 0.45), (0.7 + p["offset"][0], height), (4, 4)),
            "material": solid(frame, p["E"] * p["density"], 0.3, p["solid density"] * p["density"]),
            "gravity": frame.vector((0, -1), ACCELERATION),
            "initial_velocity": frame.vector((0, -p["speed"]), SPEED),
        }
        floor = {"mesh": frame.rectangle((4, 0.2), (-1, -0.2), (4, 1)), "on": "top"}
        pair = {"slave": {"body": "block", "on": "bottom"}, "master": {"obstacle": "floor"}}
        return {
            "time": timing(frame, p["dt"], steps),
            "fluid": flow(frame, p, speed=1.0, inlet=0.0),
            "structure": {"dynamics": {"rho_inf": p["rho_inf"]}, "bodies": {"block": body}},
            "contact": {"obstacles": {"floor": floor}, "pairs": {"floor": pair}},
            "coupling": {"scheme": "monolithic"},
        }

    probes = {"force": {"quantity": "force"}, "out": OUT, "centre": {"quantity": "centre"}}
    return StressScene("fall", p, case, probes)
