"""Time of a step and memory by type and size of the problem, from which `fsci check` estimates the cost."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fsci.bench.program import run_timed
from fsci.bench.table import Row

#: Of the shorter run, by size; the longer one takes twice as many, and the difference counts.
STEPS = (40, 8, 2)

WALLS = {"on": ["y-", "y+"], "no_slip": True}


def _beam(dim: int, n: int) -> dict[str, Any]:
    shape = {2: "rectangle", 3: "box"}[dim]
    size, cells = [4.0, 1.0, 1.0][:dim], [4 * n, n, n][:dim]
    return {
        "structure": {
            "dynamics": {"rho_inf": 0.9},
            "bodies": {
                "beam": {
                    "mesh": {"shape": shape, "size": size, "cells": cells},
                    "material": {"law": "neo_hooke", "E": 1000.0, "nu": 0.3, "density": 1.0},
                    "supports": [{"on": "left", "displacement": [0.0] * dim}],
                    "gravity": [0.0, -1.0, 0.0][:dim],
                }
            },
        }
    }


def _flow(dim: int, n: int, element: str) -> dict[str, Any]:
    """A body moves in a channel."""
    far = [2.0, 1.0, 1.0][:dim]
    patches = {
        "inlet": {"on": "x-", "velocity": ["min(t/0.1, 1)", 0, 0][:dim]},
        "outlet": {"on": "x+", "outflow": True},
        "walls": {**WALLS, "on": WALLS["on"] + (["z-", "z+"] if dim == 3 else [])},  # type: ignore[operator]
    }
    body = {"shape": "rectangle" if dim == 2 else "box", "size": [0.4] * dim, "cells": [4] * dim}
    body["translate"] = [0.61, 0.32, 0.31][:dim]
    motion = {"displacement": ["0.2*t", 0, 0][:dim]}
    return {
        "fluid": {
            "density": 1.0,
            "viscosity": 0.05,
            "element": element,
            "grid": {"from": [0.0] * dim, "to": far, "cells": [2 * n, n, n][:dim]},
            "patches": patches,
            "bodies": {"body": {"mesh": body, "motion": motion}},
        }
    }


def _post(n: int) -> dict[str, Any]:
    """An elastic post in a channel, monolithic."""
    case = _flow(2, n, "q1q1")
    del case["fluid"]["bodies"]
    mesh = {"shape": "rectangle", "size": [0.4, 0.4], "cells": [n // 2, n // 2], "origin": [0.62, 0]}
    material = {"law": "st_venant_kirchhoff", "E": 1000.0, "nu": 0.3, "density": 10.0}
    body = {"mesh": mesh, "material": material, "supports": [{"on": "bottom", "displacement": [0, 0]}]}
    return {
        **case,
        "structure": {"dynamics": {"rho_inf": 0.8}, "bodies": {"post": body}},
        "coupling": {"scheme": "monolithic"},
    }


def _blocks(n: int) -> dict[str, Any]:
    """Two blocks that move towards each other."""
    case = _beam(2, n)
    bodies = case["structure"]["bodies"]
    other = json.loads(json.dumps(bodies["beam"]))
    other["mesh"]["origin"] = [0.1, 1.0001]
    case["structure"]["bodies"] = {"lower": bodies["beam"], "upper": other}
    pair = {"slave": {"body": "upper", "on": "bottom"}, "master": {"body": "lower", "on": "top"}}
    return {**case, "contact": {"pairs": {"p": pair}}}


#: kind -> cases from small to large
CASES: dict[str, list[dict[str, Any]]] = {
    "structure 2D": [_beam(2, n) for n in (3, 16, 40)],
    "structure 3D": [_beam(3, n) for n in (2, 6, 10)],
    "fluid 2D q1q1": [_flow(2, n, "q1q1") for n in (12, 40, 80)],
    "fluid 2D q2q1": [_flow(2, n, "q2q1") for n in (12, 30, 50)],
    "fluid 3D q1q1": [_flow(3, n, "q1q1") for n in (6, 12, 18)],
    "fluid 3D q2q1": [_flow(3, n, "q2q1") for n in (4, 6, 9)],
    "coupled": [_post(n) for n in (12, 40)],
    "contact": [_blocks(n) for n in (3, 16)],
}


def run() -> list[Row]:
    """Processor seconds of a time step and memory of the run."""
    return [measure(kind, case, n) for kind, cases in CASES.items() for case, n in zip(cases, STEPS, strict=False)]


def measure(kind: str, case: dict[str, Any], steps: int) -> Row:
    dt, spent = 0.01, []
    with TemporaryDirectory() as name:
        folder = Path(name)
        for number in (1, steps, 2 * steps):  # the first run compiles the forms
            text = {"title": kind, "time": {"step": dt, "end": number * dt}, "output": {"fields_every": 0}, **case}
            (folder / "case.yaml").write_text(json.dumps(text))
            summary, seconds = run_timed(folder, folder / "out", {})
            spent.append(seconds)
    return {
        "kind": kind,
        "dofs": sum(summary["dofs"].values()),
        "step [s]": (spent[2] - spent[1]) / steps,
        "memory [MB]": summary["memory_mb"],
    }
