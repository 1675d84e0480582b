"""What is measured of runs of the program: a function of a scene gives the columns of its row."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fsci.bench.bands import ELEMENTS, SCHEMES, level
from fsci.bench.family import FamilyRun, FamilyScene, Settings
from fsci.bench.table import ERROR, LEVEL, MEMORY, TIME, UNKNOWNS, Row
from fsci.running.verify import amplitude, frequency

if TYPE_CHECKING:
    from fsci.case import Case


def errors(scene: FamilyScene) -> Row:
    """Errors of the values of its `exact`, VALUE STATISTIC: number, or else of the case's `verify`; time and memory."""
    settings = {"output.fields_every": 0, **checks(scene)}
    ended = scene.run(settings)
    summary = ended.summary
    values = {
        check["name"]: check["value"] / check["reference"]
        for check in summary["verify"]
        if check["reference"] and not check["regression"]
        if not scene.values or check["name"].split()[0] in scene.values
    }
    found = {f"{name} [%]": 100.0 * abs(value - 1.0) for name, value in values.items()}
    return {
        UNKNOWNS: sum(summary["dofs"].values()),
        "steps": summary["steps"]["accepted"],
        TIME: ended.seconds,
        MEMORY: round(summary["memory_mb"]),
        **found,
        ERROR: max(found.values()),
        LEVEL: _level(scene, settings, ended, values),
    }


def _level(scene: FamilyScene, settings: Settings, ended: FamilyRun, values: Mapping[str, float]) -> Mapping[str, Any]:
    """Values over exact ones, with the sizes of the case's sources of errors."""
    from fsci.case import load_case
    from fsci.converge.ladder import sources
    from fsci.converge.reasons import first_order

    text = [(name, json.dumps(value)) for name, value in {**scene.settings, **settings}.items()]
    case = load_case(scene.folder, text)
    sizes = {name: source.size(case) for name, source in sources(case).items()}
    return level(values, sizes, _methods(case), first_order(case, dict(ended.history), ended.summary))


def _methods(case: Case) -> dict[str, int]:
    """Larger numbers for better ones."""
    from fsci.case.flow_element import flow_element
    from fsci.meshes.of_case import degree_of_cells

    found: dict[str, int] = {}
    if case.fluid is not None:
        found["element"] = ELEMENTS.index(flow_element(case).element)
        if case.fluid.scheme in SCHEMES:
            found["scheme"] = SCHEMES.index(case.fluid.scheme)
    orders = [degree_of_cells(case, name) for name in case.elastic_bodies]
    return {**found, "order": min(orders)} if orders else found


def checks(scene: FamilyScene) -> dict[str, Any]:
    """The setting `verify` that has the references."""
    checks = []
    for name, reference in scene.exact.items():
        value, statistic = name.split()
        more = reference if isinstance(reference, Mapping) else {"reference": reference}
        checks.append({"value": value, "statistic": statistic, "relative": 1.0, **more})
    return {"verify": checks} if checks else {}


def small_step(scene: FamilyScene, steps: int = 40) -> Row:
    """Milliseconds of the processor for a step: the difference of two runs, one three times as long as the other."""
    steps = scene.given.get("steps", steps)
    short, long = (_until(scene, number) for number in (steps, 3 * steps))
    return {
        "unknowns": sum(long.summary["dofs"].values()),
        "newton per step": long.summary["newton"]["total"] / (3 * steps),
        "step [ms]": 1e3 * (long.seconds - short.seconds) / (2 * steps),
    }


def cost(scene: FamilyScene) -> Row:
    """Seconds of the processor for a step, and memory of the run; one step before compiles the forms."""
    steps = scene.given["steps"]
    _, short, long = (_until(scene, number) for number in (1, steps, 2 * steps))
    return {
        "dofs": sum(long.summary["dofs"].values()),
        "step [s]": (long.seconds - short.seconds) / steps,
        "memory [MB]": long.summary["memory_mb"],
    }


def _until(scene: FamilyScene, steps: int) -> FamilyRun:
    from fsci.case import load_case

    return scene.run({"time.end": steps * load_case(scene.folder, []).time.step})


def load_step(scene: FamilyScene) -> Row:
    """Seconds by part of a static load step, after a run of few cells that compiles the forms."""
    scene.run(scene.given["small"])
    summary = scene.run().summary
    wall = summary["wall"]
    return {
        "dofs": summary["dofs"]["structure"],
        "newton": summary["newton"]["total"],
        "total [s]": wall["total"],
        "start": wall["start"],
        "assembly": wall["assembly"],
        "solve": wall["solve"],
        "output": wall["output"] + wall["checkpoint"],
        MEMORY: round(summary["memory_mb"]),
    }


def time_step(scene: FamilyScene) -> Row:
    """Milliseconds of a time step by part."""
    summary = scene.run().summary
    steps, wall = summary["steps"]["accepted"], summary["wall"]
    parts = {name: 1e3 * wall[name] / steps for name in ("assembly", "solve", "probes", "output", "checkpoint")}
    total = 1e3 * (wall["total"] - wall["start"]) / steps
    return {
        "dofs": summary["dofs"]["structure"],
        "newton per step": summary["newton"]["total"] / steps,
        "step [ms]": total,
        **parts,
        "rest": total - sum(parts.values()),
        MEMORY: round(summary["memory_mb"]),
    }


def whole_run(scene: FamilyScene) -> Row:
    """Seconds by part of all steps; `contact` is everything but assembly and solution of the system."""
    summary = scene.run().summary
    steps, newton, wall = summary["steps"], summary["newton"], summary["wall"]
    parts = {name: wall[name] for name in ("assembly", "contact", "solve")}
    return {
        "dofs": summary["dofs"]["structure"],
        "steps": steps["accepted"],
        "retried": steps["retried"],
        "newton": newton["total"],
        "most": newton["max"],
        "wall [s]": wall["total"],
        **{f"{name} [s]": seconds for name, seconds in parts.items()},
        "rest [s]": wall["total"] - sum(parts.values()),
    }


def swing(scene: FamilyScene) -> Row:
    """Deviation of A.y from the run whose settings are `exact`, relative to the amplitude."""
    ended, finest = scene.run(), scene.run(scene.exact).history
    time, tip = ended.history["time"], ended.history["A.y"]
    reference = finest["A.y"][np.searchsorted(finest["time"], time - 1e-9)]
    energy = np.abs(ended.history["structure.energy"]).max() / ended.history["energy.internal"].max()
    return {
        "wall [s]": ended.summary["wall"]["total"],
        "newton": ended.summary["newton"]["total"],
        "deviation [%]": 100.0 * float(np.abs(tip - reference).max()) / amplitude(time, tip),
        "frequency [Hz]": f"{frequency(time, tip):.4f}",
        "amplitude [mm]": f"{1e3 * amplitude(time, tip):.3f}",
        "energy error": float(energy),
    }
