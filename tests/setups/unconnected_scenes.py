"""A generator of small solid scenes that stand anywhere in a case, alone or beside others that they do not touch."""

from __future__ import annotations

import json

import numpy as np

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

STEPS = 3


class Scene:
    """Bodies, obstacles, pairs and probes of one scene, whose names begin with `name`; positions begin at `origin`."""

    def __init__(self, name, origin, stiffness):
        self.name, self.origin, self.E = name, origin, stiffness
        self.bodies, self.obstacles, self.pairs, self.probes = {}, {}, {}, {}
        self.load = 0.0  #: [N], beside which reactions may be small

    def at(self, x, y):
        return [self.origin[0] + x, self.origin[1] + y]

    def rectangle(self, size, cells, x=0.0, y=0.0, order=1):
        return {"shape": "rectangle", "size": size, "cells": cells, "order": order, "origin": self.at(x, y)}

    def body(self, name, mesh, law="neo_hooke", **settings):
        """A body with a density for which a wave crosses a metre in one step of time."""
        material = {"law": law, "E": self.E, "nu": 0.3, "density": self.E}
        self.bodies[self.name + name] = {"mesh": mesh, "material": material} | settings
        self.probes[self.name + name] = {"body": self.name + name, "quantity": "displacement", "on": "top"}

    def pair(self, name, slave, master, **settings):
        slave, on = slave
        self.pairs[self.name + name] = {"slave": {"body": self.name + slave, "on": on}, "master": master} | settings

    def obstacle(self, name, mesh, on):
        self.obstacles[self.name + name] = {"mesh": mesh, "on": on}
        return {"obstacle": self.name + name}

    def reaction(self, name, on):
        self.probes[f"{self.name}{name}_force"] = {"body": self.name + name, "quantity": "reaction", "on": on}


def held(on="bottom"):
    return {"on": on, "displacement": [0, 0]}


def pushed(scene, along, down, on="top"):
    """A support that presses and then moves along."""
    return {"on": on, "displacement": [f"{along}*max(t-0.3,0)", f"-{down}*min(t,0.5)"]}


def bent(scene, rng):
    load = scene.E * 10.0 ** rng.uniform(-5, -3)
    scene.load = 0.1 * load
    scene.body(
        "beam", scene.rectangle([1, 0.1], [8, 2], order=int(rng.integers(1, 3))), supports=[held("left")],
        tractions=[{"on": "right", "value": [0, f"-{load:.3e}*t"]}],
    )  # fmt: skip
    scene.reaction("beam", "left")


def blown(scene, rng):
    pressure = scene.E * 10.0 ** rng.uniform(-6, -4)
    mesh = {"shape": "ring", "inner_radius": 0.9, "outer_radius": 1, "angle": 90, "cells": [8, 1], "order": 2}
    mesh["translate"] = scene.at(0, 0)
    scene.body(
        "arch", mesh, supports=[held("start")], pressures=[{"on": "inner", "value": f"{pressure:.3e}*t"}]
    )  # fmt: skip
    del scene.probes[scene.name + "arch"]
    scene.probes[scene.name + "arch"] = {"body": scene.name + "arch", "quantity": "displacement", "on": "end"}


def moved(scene, rng):
    """No force at all: a support moves a block."""
    way = rng.uniform(-0.1, 0.1, 2)
    support = {"on": "bottom", "displacement": [f"{way[0]:.3f}*t", f"{way[1]:.3f}*t"]}
    scene.body("block", scene.rectangle([0.5, 0.5], [3, 3]), supports=[support])


def pressed(scene, rng, **law):
    scene.body("block", scene.rectangle([1, 0.5], [5, 3]), supports=[pushed(scene, rng.uniform(0, 0.05), 0.03)])
    floor = scene.obstacle("floor", scene.rectangle([2, 0.2], [1, 1], -0.5, -0.2), "top")
    scene.pair("floor", ("block", "bottom"), floor, **law)
    scene.reaction("block", "top")


def dragged(scene, rng):
    pressed(scene, rng, friction={"coefficient": round(float(rng.uniform(0.1, 0.5)), 2)})


def stacked(scene, rng):
    scene.body("lower", scene.rectangle([1, 0.4], [5, 3]), supports=[held()])
    scene.body("upper", scene.rectangle([0.6, 0.3], [4, 2], 0.2, 0.4), supports=[pushed(scene, 0.01, 0.02)])
    scene.pair("touch", ("upper", "bottom"), {"body": scene.name + "lower", "on": "top"})
    scene.reaction("lower", "bottom")


def tied(scene, rng):
    force = scene.E * 10.0 ** rng.uniform(-4, -2)
    scene.load = 0.1 * force
    scene.body("lower", scene.rectangle([1, 0.4], [5, 3]), supports=[held()])
    scene.body(
        "upper", scene.rectangle([1, 0.3], [3, 2], 0, 0.4),
        tractions=[{"on": "top", "value": [f"{force:.3e}*t", f"{force:.3e}*t"]}],
    )  # fmt: skip
    scene.pair("tie", ("upper", "bottom"), {"body": scene.name + "lower", "on": "top"}, tied=True)
    scene.reaction("lower", "bottom")


def on_a_corner(scene, edge, load):
    """A thin strip bends onto a corner; whole Newton steps overshoot it. load: pressure on it relative to E."""
    scene.body(
        "strip", scene.rectangle([2, 0.05], [40, 1], -1.0), supports=[held(["left", "right"])],
        tractions=[{"on": "top", "value": [0, f"-{load * scene.E:.6e}*t"]}],
    )  # fmt: skip
    step = scene.obstacle("step", scene.rectangle([0.5, 0.5], [1, 1], edge - 0.5, -0.58), ["top", "right"])
    scene.pair("step", ("strip", "bottom"), step)


KINDS = (bent, blown, moved, pressed, dragged, stacked, tied)


def draw_pair(rng):
    """Two scenes of a ratio of stiffness between 1e-6 and 1e6, far from each other."""
    stiffness = 10.0 ** rng.uniform(-3, 3, 2)
    origins = [[0.0, 0.0], [float(rng.uniform(5, 10)), float(rng.uniform(-1, 1))]]
    found = []
    for name, origin, E in zip("ab", origins, stiffness, strict=True):
        scene = Scene(name, origin, float(f"{E:.3e}"))
        KINDS[int(rng.integers(len(KINDS)))](scene, rng)
        found.append(scene)
    return found


def case_of(scenes, *, dynamics=False, end=1.0, **more):
    """The text of a case with some scenes, in three steps."""
    case = {
        "time": {"step": end / STEPS, "end": end, "retry": {"halvings": 0}},
        "structure": {"bodies": {}} | ({"dynamics": {"rho_inf": 0.5}} if dynamics else {}),
        "solver": {"newton": {"residual": 1e-12}, "linear": {"method": "direct"}},
        "probes": {},
        "output": {"fields_every": 0, "checkpoint_every": 0},
    }
    contact = {"obstacles": {}, "pairs": {}}
    for scene in scenes:
        case["structure"]["bodies"] |= scene.bodies
        contact["obstacles"] |= scene.obstacles
        contact["pairs"] |= scene.pairs
        case["probes"] |= {name: dict(probe) for name, probe in scene.probes.items()}
    if contact["pairs"]:
        case["contact"] = {key: part for key, part in contact.items() if part}
    return json.dumps(case | more, indent=1)


def computed(folder, text):
    """The history of a run without repeated steps."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


def difference(scene, alone, together):
    """Largest difference of a probe of a scene in two histories, relative to its largest value or to the load."""
    worst = 0.0
    for name in scene.probes:
        one, two = ([[history[f"{name}.{c}"]] for c in "xy"] for history in (alone, together))
        size = max(np.abs(one).max(), scene.load if name.endswith("_force") else 0.0)
        worst = max(worst, float(np.abs(np.subtract(two, one)).max() / size))
    return worst


#: a channel around the post of `post`
FLOW = {
    "density": 1,
    "viscosity": 0.05,
    "element": "q1q1",
    "grid": {"from": [0, 0], "to": [2, 1], "cells": [20, 10]},
    "patches": {
        "inlet": {"on": "x-", "velocity": ["4*y*(1 - y)*min(t/0.1, 1)", 0]},
        "outlet": {"on": "x+", "outflow": True},
        "walls": {"on": ["y-", "y+"], "no_slip": True},
    },
}


def post(scene, rng):
    scene.E = 1000.0
    scene.body("post", scene.rectangle([0.23, 0.41], [3, 5], 0.62), law="st_venant_kirchhoff", supports=[held()])
    scene.bodies[scene.name + "post"]["material"]["density"] = 10.0
    scene.reaction("post", "bottom")


def draw_beside_flow(rng):
    """A post in a channel, and a scene outside of it."""
    in_flow = Scene("a", [0.0, 0.0], 1000.0)
    beside = Scene("b", [float(rng.uniform(4, 6)), 0.3], float(f"{10.0 ** rng.uniform(-3, 9):.3e}"))
    post(in_flow, rng)
    KINDS[int(rng.integers(len(KINDS)))](beside, rng)
    return in_flow, beside


def coupled(scheme, *, dynamics):
    """Settings of the coupled case."""
    settings = {"scheme": scheme} | ({"tolerance": 1e-11} if scheme == "partitioned" else {})
    return {"fluid": FLOW if dynamics else FLOW | {"scheme": "steady"}, "coupling": settings}
