"""Table of the energy balance of each dynamic case: python docs/make_energy_table.py [RESULTS_FOLDER] [NAME ...]

Runs what is not yet in RESULTS_FOLDER (default: results/energy; one to two hours in all) and prints a row for each
case, or for those that are named.
"""

from __future__ import annotations

import copy
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fsci.bench.program import run_case
from fsci.case import load_case
from fsci.running.checkpoint import read_checkpoint
from fsci.running.history import read_history

DOCS = Path(__file__).parent
CASES = DOCS.parent / "cases"
ENOUGH = 1e-3  #: of the energy exchanged; a case that errs by less needs no other steps and meshes

#: cells of the tori: half as many, those of the cases, and twice as many
TORI = [
    {f"structure.bodies.{body}.mesh.cells": [2 * n, n, 1] for body in ("lower", "upper")} for n in (10, 20, 40)
]  # fmt: skip


def steps(*lengths: float) -> list[dict[str, Any]]:
    """Levels: steps of these lengths [s]."""
    return [{"time.step": length} for length in lengths]


def share_of_cells(case: str, share: float) -> dict[str, Any]:
    """The grid of the flow of a case with such a share of the cells along each axis."""
    fluid = load_case(CASES / case).settings["fluid"]
    grid = copy.deepcopy(fluid["grid"])
    stretches = [stretch for axis in "xyz" for stretch in grid.get(axis, [])]
    for stretch in stretches:
        stretch["cells"] = max(2, round(share * stretch["cells"]))
    if "cells" in grid:
        grid["cells"] = [round(share * count) for count in grid["cells"]]
    return {"fluid.grid": grid}


def finer(case: str, *levels: tuple[float, float]) -> list[dict[str, Any]]:
    """Levels: steps [s] with a share of the case's cells along each axis."""
    return [{"time.step": length, **share_of_cells(case, share)} for length, share in levels]


#: The block of the piston is so soft that steps resolve how its damping stops it: (4/pi^2) L^2 density / (damping E) is
#: 2 ms instead of 20 us. Steps that do not resolve this lose the energy that the damping should take, a quarter.
SOFT_BLOCK = {"time.end": 0.7, "structure.bodies.block.material.E": 1e4}
#: The water presses the block from the first step on, which is longer than the 10 ms of its damping: it loses as much.
SMOOTH_LOAD = {
    "fluid.patches.surface.traction": [0, "-3.5*(1-cos(pi*min(t/0.5,1)))"],
    "structure.bodies.block.tractions": [{"on": "top", "value": [0, "-2*ramp(t,0,0.5)+9.7*ramp(t,1,2)"]}],
}


#: The flow begins at rest, and a load bends the flag. The case's gust begins across a flag at rest: what its impulse
#: exchanges in two steps is wrong by a third, however short they are.
SMOOTH_FLAG = {
    "time.end": 0.2,
    "fluid.initial_velocity": [0, 0],
    "fluid.patches.inlet.velocity": ["(1-cos(pi*min(t,0.2)/0.2))/2*1.5*4*y*(0.41 - y)/0.41^2", 0],
    "structure.bodies.flag.tractions": [{"on": "top", "value": [0, "100*sin(pi*min(t,0.2)/0.2)^2"]}],
}


@dataclass(frozen=True)
class Row:
    """A case, as it is or shorter, and its levels."""

    case: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    levels: Sequence[Mapping[str, Any]] = ()  #: settings of each; none: the step, a half and a quarter of it
    words: str = "step"  #: what the levels are


COARSE_FLAG = {"time.end": 0.2, "fluid.element": "q1q1"}
ROWS = (
    Row("csm3", {"time.end": 2.0}),
    Row("two_tori", levels=TORI, words="cells"),
    Row("two_tori_friction", levels=TORI, words="cells"),
    Row("sphere_tube"),
    Row("balloon"),
    Row("ring_added_mass"),
    Row("elastic_bar_column"),
    Row("elastic_tube", {"time.end": 4.0}, finer("elastic_tube", (0.4, 0.5), (0.2, 1.0), (0.1, 1.0)), "step and cells"),
    Row("cavity_flexible_bottom", {"time.end": 10.0}),
    Row("flap", {"time.end": 1.0}),
    Row("fsi3", COARSE_FLAG, finer("fsi3", (0.01, 0.4), (0.005, 0.6), (0.0025, 0.8)), "step and cells"),
    Row("thin_flag", SMOOTH_FLAG),
    Row(
        "falling_sphere",
        {"time.end": 0.4},
        finer("falling_sphere", (0.1, 0.35), (0.05, 0.5), (0.025, 0.6)),
        "step and cells",
    ),
    Row("hydrostatic_contact", SMOOTH_LOAD, steps(0.05, 0.025, 0.0125)),
    Row("piston_impact", SOFT_BLOCK, steps(0.005, 0.0025, 0.00125)),
    Row("rebound"),
    Row("rebound_stokes", {"time.end": 0.16}),
    Row("valve", {"time.end": 1.0}),
    Row("valve_thin"),
    Row("valve_3d", {"time.end": 0.8}),
    Row("torus_rough", {"time.end": 0.42}),
    Row("torus_wall", {"time.end": 0.45}),
)


def main(arguments: Sequence[str]) -> None:
    results = Path(arguments[0]) if arguments else Path("results/energy")
    named = arguments[1:]
    print("| case | until [s] | refined | structure | interface |\n|---|---|---|---|---|", flush=True)
    for row in ROWS:
        if not named or row.case in named:
            print(line(results, row), flush=True)


def line(results: Path, row: Row) -> str:
    """The row of the table of a case."""
    case = load_case(CASES / row.case)
    levels = row.levels or [{"time.step": case.time.step / 2**k} for k in range(3)]
    found: list[tuple[float, float]] = []
    for number, level in enumerate(levels):
        if not row.levels and found and max(found[0]) < ENOUGH:
            break
        found.append(errors(results / f"{row.case}_{number}", row, level))
    structure, interface = (", ".join(map(shown, values)) for values in zip(*found, strict=True))
    words = row.words if len(found) > 1 else ""
    end = row.settings.get("time.end", case.time.end)
    return f"| `{row.case}` | {end:g} | {words} | {structure} | {interface if case.fluid else ''} |"


def shown(value: float) -> str:
    return f"{value:.1e}"


def errors(out: Path, row: Row, level: Mapping[str, Any]) -> tuple[float, float]:
    """Largest errors of the structure's balance and at the interface in a run, over the energy exchanged in it."""
    summary = out / "summary.json"
    if not summary.exists() or json.loads(summary.read_text())["status"] != "finished":
        print(f"running {out.name}", file=sys.stderr, flush=True)
        run_case(CASES / row.case, out, {"output.fields_every": 0, **row.settings, **level})
    history = read_history(out / "history.csv")
    state, _ = read_checkpoint(out / "checkpoint")
    exchanged = energy_of(state)["exchanged"]
    of_structure, of_interface = (
        float(np.abs(history.get(column, np.zeros(1))).max()) / exchanged
        for column in ("structure.energy", "interface.work")
    )
    return of_structure, of_interface


def energy_of(state: Mapping[str, Any]) -> Mapping[str, float]:
    """The balance of the structure in the state of a run."""
    for name, value in state.items():
        if name == "energy" and isinstance(value, dict) and "exchanged" in value:
            return value
        if isinstance(value, dict) and (found := energy_of(value)):
            return found
    return {}


if __name__ == "__main__":
    main(sys.argv[1:])
