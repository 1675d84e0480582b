"""Scenes that combine what contact of solids has: ties, friction, several pairs, a surface with itself."""

from __future__ import annotations

import random
from itertools import pairwise
from typing import Any

from fsci.stress.frame import LENGTH, STRESS, Frame
from fsci.stress.scenes import PRESS_PROBES, Case, StressScene, solid, spread, timing

#: Where the body stands that nothing touches.
FAR = 12.0


def beside(frame: Frame, E: float) -> Case:
    """A column that nothing touches, with its own load of a tenth of its stiffness."""
    return {
        "mesh": frame.rectangle((0.4, 1.3), (FAR, -0.5), (2, 3)),
        "material": solid(frame, E, 0.3, 1.0),
        "supports": [{"on": "bottom", "displacement": [0, 0]}],
        "tractions": [{"on": "top", "value": frame.vector((0.05 * E, -0.1 * E), STRESS, "s_")}],
    }


def _coefficient(chance: random.Random) -> float:
    return chance.choice([0.0, 0.2, 0.5, 1.0])


def _friction(coefficient: float) -> Case:
    return {"friction": {"coefficient": coefficient}} if coefficient else {}


def stack(chance: random.Random) -> StressScene:
    """Three blocks, pressed together and drawn along: glued, rough or smooth, soft and stiff ones in any order."""
    p: dict[str, Any] = {
        "E": [spread(chance, 1e1, 1e7) for _ in range(3)],
        "nu": chance.choice([0.0, 0.3, 0.45]),
        "cells": [chance.choice([2, 3, 5]) for _ in range(3)],
        "order": chance.choice([1, 1, 2]),
        "glued": chance.choice([0, 0, 1, 2]),  # the first or the second joint
        "friction": [_coefficient(chance), _coefficient(chance)],
        "lower is slave": [chance.choice([True, False]), chance.choice([True, False])],
        "press": spread(chance, 1e-4, 0.1),
        "aside": chance.choice([0.0, 0.02, 0.2]),
        "gap": chance.choice([0.0, 1e-12, 1e-3, 0.1]),
        "found": chance.choice([True, False]),
    }

    def case(frame: Frame) -> Case:
        way = f"-{p['gap'] + p['press']!r} * min(s_, 1)", f"{p['aside']!r} * max(s_ - 1, 0)"
        names, widths = ("base", "middle", "block"), (2.0, 1.5, 1.0)
        bodies: Case = {}
        for k, (name, width) in enumerate(zip(names, widths, strict=True)):
            low = (-0.5 * width, 0.5 * k + (p["gap"] if k == 2 else 0.0))
            bodies[name] = {
                "mesh": frame.rectangle((width, 0.5), low, (p["cells"][k], 2), order=p["order"]),
                "material": solid(frame, p["E"][k], p["nu"], 1.0),
            }
        bodies["base"]["supports"] = [{"on": "bottom", "displacement": [0, 0]}]
        bodies["block"]["supports"] = [{"on": "top", "displacement": _along(frame, *reversed(way))}]
        pairs: Case = {}
        for k, (lower, upper) in enumerate(pairwise(names)):
            sides = {"body": lower, "on": "top"}, {"body": upper, "on": "bottom"}
            slave, master = sides if p["lower is slave"][k] else sides[::-1]
            kind = {"tied": True} if p["glued"] == k + 1 and not (k == 1 and p["gap"]) else _friction(p["friction"][k])
            pairs[f"{lower}_{upper}"] = {"slave": slave, "master": master, **kind}
        contact: Case = {"pairs": pairs}
        if p["found"]:
            contact = {"pairs": {"base_middle": pairs["base_middle"]}, "bodies": "all"}
        return {
            "time": timing(frame, 0.25, 8),
            "structure": {"bodies": bodies},
            "contact": contact,
        }

    probes = {name: PRESS_PROBES[name] for name in ("top", "bottom")}
    return StressScene("stack", p, case, probes, any_angle=True, beside=beside)


def roam(chance: random.Random) -> StressScene:
    """A block, of one piece or of two that are glued, is driven into a base, along it, off it and into another one."""
    p: dict[str, Any] = {
        "E": spread(chance, 1e1, 1e7),
        "stiffness ratio": [spread(chance, 1e-2, 1e2), spread(chance, 1e-2, 1e2)],
        "nu": chance.choice([0.0, 0.3]),
        "cells": [chance.choice([2, 3, 4]), chance.choice([4, 7]), chance.choice([4, 7])],
        "glued": chance.choice([True, False]),
        "friction": _coefficient(chance),
        "press": spread(chance, 1e-3, 0.05),
        "reach": spread(chance, 1e-2, 1.0),
        "dynamic": chance.choice([None, None, 0.0, 0.8]),
    }

    def case(frame: Frame) -> Case:
        depth = p["press"] + p["reach"]
        m, left, right = p["cells"]
        bodies: Case = {}
        for name, low, cells, ratio in (("left", -0.25, left, 0), ("right", 2.1, right, 1)):
            bodies[name] = {
                "mesh": frame.rectangle((2.2, 0.5), (low, -0.5), (cells, 2)),
                "material": solid(frame, p["E"] * p["stiffness ratio"][ratio], p["nu"], 1.0),
                "supports": [{"on": "bottom", "displacement": [0, 0]}],
            }
        height = 0.25 if p["glued"] else 0.5
        heights = {"block": p["reach"], **({"head": p["reach"] + height} if p["glued"] else {})}
        for k, (name, low) in enumerate(heights.items()):
            bodies[name] = {
                "mesh": frame.rectangle((1.0, height), (0.0, low), (m + k, 2)),
                "material": solid(frame, p["E"], p["nu"], 1.0),
            }
        way = _along(frame, "2 * s_", f"-{depth!r} * sin(2 * pi * s_)")
        bodies[list(heights)[-1]]["supports"] = [{"on": "top", "displacement": way}]
        slave = {"body": "block", "on": "bottom"}
        pairs: Case = {
            name: {"slave": slave, "master": {"body": name, "on": "top"}, **_friction(p["friction"])}
            for name in ("left", "right")
        }
        if p["glued"]:
            pairs["glue"] = {"slave": {"body": "head", "on": "bottom"}, "master": {"body": "block", "on": "top"}}
            pairs["glue"]["tied"] = True
        structure: Case = {"bodies": bodies}
        if p["dynamic"] is not None:
            structure["dynamics"] = {"rho_inf": p["dynamic"]}
        return {"time": timing(frame, 0.05, 28), "structure": structure, "contact": {"pairs": pairs}}

    probes = {
        "left": {"quantity": "reaction", "body": "left", "on": "bottom"},
        "right": {"quantity": "reaction", "body": "right", "on": "bottom"},
        "block": {"quantity": "displacement", "body": "block", "on": "bottom"},
    }
    return StressScene("roam", p, case, probes, any_angle=True, beside=beside)


def curl(chance: random.Random) -> StressScene:
    """A ring with an opening that outer pressure closes: its ends meet, and its inside may meet a block."""
    p: dict[str, Any] = {
        "E": spread(chance, 1e1, 1e7),
        "nu": chance.choice([0.0, 0.3, 0.45]),
        "thickness": chance.choice([0.1, 0.2, 0.3]),
        "opening": chance.choice([20.0, 40.0, 90.0]),
        "cells": chance.choice([16, 24, 40]),
        "order": chance.choice([1, 1, 2]),
        "friction": _coefficient(chance),
        "pressure": spread(chance, 0.02, 1.0),  # of 0.2 E (thickness / radius)^3
        "block": chance.choice([0.0, 0.0, 1e-1, 1e2]),  # its stiffness relative to the ring
    }
    inner, outer, start = 1.0 - 0.5 * p["thickness"], 1.0 + 0.5 * p["thickness"], 0.5 * p["opening"]
    pressure = 0.2 * p["E"] * p["thickness"] ** 3 * p["pressure"]

    def case(frame: Frame) -> Case:
        ring: Case = {
            "mesh": {
                "shape": "ring",
                "inner_radius": frame.number(inner, LENGTH),
                "outer_radius": frame.number(outer, LENGTH),
                "cells": [p["cells"], 2],
                "angle": 360.0 - p["opening"],
                "start": start,
                "order": p["order"],
                "rotate": [{"angle": frame.angle}],
                "translate": frame.point((0, 0)),
            },
            "material": solid(frame, p["E"], p["nu"], 1.0),
            "pressures": [{"on": "outer", "value": f"{frame.number(pressure, STRESS)!r}*({frame.function('s_')})"}],
            "supports": [{"at": frame.point((-r, 0)), "displacement": [0, 0]} for r in (inner, outer)],
        }
        bodies, friction = {"ring": ring}, _friction(p["friction"])
        pairs: Case = {"itself": {"self": {"body": "ring", "on": ["inner", "start", "end", "outer"]}, **friction}}
        if p["block"]:
            bodies["block"] = {
                "mesh": frame.rectangle((0.5, 0.7), (-0.3, -0.31), (3, 4)),
                "material": solid(frame, p["E"] * p["block"], 0.3, 1.0),
                "supports": [{"at": frame.point((-0.3, y)), "displacement": [0, 0]} for y in (-0.31, 0.39)],
            }
            for side in ("top", "bottom", "right"):
                sides = {"slave": {"body": "block", "on": side}, "master": {"body": "ring", "on": "inner"}}
                pairs[side] = {**sides, **friction}
        return {"time": timing(frame, 0.1, 10), "structure": {"bodies": bodies}, "contact": {"pairs": pairs}}

    ends = {name: {"quantity": "displacement", "body": "ring", "on": name} for name in ("start", "end")}
    return StressScene("curl", p, case, ends, any_angle=True, beside=beside)


def _along(frame: Frame, x: str, y: str) -> list[str]:
    """A displacement with two components that are functions of s_."""
    turned = [frame.vector(axis, LENGTH) for axis in ((1.0, 0.0), (0.0, 1.0))]
    ways = [frame.function(x), frame.function(y)]
    return [" + ".join(f"{axis[i]!r} * ({way})" for axis, way in zip(turned, ways, strict=True)) for i in range(2)]
