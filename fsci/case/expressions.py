"""All expressions of a case, and those that have no finite value where a run needs them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.case.case import Case
from fsci.case.fluid import FluidSection, PatchSection
from fsci.case.mesh_checks import Mistake
from fsci.case.messages import subject
from fsci.case.section import Section
from fsci.case.yaml_text import Keys
from fsci.expression import Expression

Array = NDArray[np.float64]

#: Times at which formulas and motions in time alone are evaluated, and formulas of position and time: steps of a run,
#: evenly chosen.
MOST_TIMES, FEW_TIMES = 20_000, 20
#: Points of a face of the box at which its formulas are evaluated.
MOST_POINTS = 10_000


def expressions(section: Any, keys: Keys = ()) -> Iterator[tuple[Keys, Expression]]:
    """(path, expression) of all settings of a case, or of a section, that are expressions."""
    if isinstance(section, Expression):
        yield keys, section
    elif isinstance(section, Section):
        for name, field in type(section).model_fields.items():
            yield from expressions(getattr(section, name), (*keys, field.alias or name))
    elif isinstance(section, dict):
        for name, value in section.items():
            yield from expressions(value, (*keys, name))
    elif isinstance(section, tuple):
        for index, value in enumerate(section):
            yield from expressions(value, (*keys, index))


def dotted(keys: Keys) -> str:
    """The name of a setting, as fluid.bodies.a.motion.displacement[1]; entries count from 0, as in `--set`."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).lstrip(".")


def run_times(case: Case, most: int) -> Array:
    """Ends of the steps of a run, the start among them; at most so many, evenly chosen, the last one among them."""
    time = case.time
    steps = max(int(np.ceil((time.end - time.start) / time.step - 1e-9)), 1)
    chosen = np.unique(np.linspace(0, steps, min(steps + 1, most)).astype(np.int64))
    return np.minimum(time.start + chosen * time.step, time.end)


def needs_start(case: Case, keys: Keys) -> bool:
    """Whether a run evaluates a formula at its first time, too: motions, and in dynamics loads, not a patch's value."""
    dynamic = case.structure is not None and case.structure.dynamics is not None
    moves = bool({"motion", "displacement"} & set(keys)) and not {"velocity", "angular_velocity"} & set(keys)
    return moves or (dynamic and keys[0] == "structure")


def not_finite(formula: Expression, value: float, t: float, point: Array | None = None) -> str:
    """What is said of a formula without a finite value."""
    what = "not a number" if np.isnan(value) else "infinite"
    where = "" if point is None or not formula.uses - {"t"} else f" at ({', '.join(f'{x:.6g}' for x in point)})"
    when = f" at t = {t:.6g}" if "t" in formula.uses else ""
    return f"'{formula.text}' is {what}{where}{when}"


def value_mistakes(case: Case) -> Iterator[Mistake]:
    """Formulas of time that are not finite at some step, and those of patches that are not on their faces."""
    times = run_times(case, MOST_TIMES)
    for keys, formula in expressions(case):
        if formula.uses == {"t"}:
            of_run = times if needs_start(case, keys) else times[1:]
            values = formula.at_times(of_run)
            wrong = np.flatnonzero(~np.isfinite(values))
            if len(wrong):
                yield keys, f"{subject(keys)}: {not_finite(formula, values[wrong[0]], of_run[wrong[0]])}"
    if case.fluid is not None:
        few = run_times(case, FEW_TIMES)[1:]
        for name in case.fluid.patches:
            yield from _patch(case.fluid, name, few)
        if not case.fluid.bodies and not case.elastic_bodies:  # formulas need no value in bodies
            yield from _volume(case.fluid, few)


def _patch(fluid: FluidSection, name: str, times: Array) -> Iterator[Mistake]:
    patch = fluid.patches[name]
    for keys, formula in expressions(patch, ("fluid", "patches", name)):
        if keys[3] == "where" or not formula.uses - {"t"}:
            continue
        for face in patch.on:
            x = _nodes(fluid, name, face) if keys[3] == "velocity" else _chosen(patch, face_middles(fluid, face))
            if (found := first_not_finite(formula, x, times)) is not None:
                yield keys, f"{subject(keys)}: {found}"
                break


def missed_formula(case: Case, begin: float) -> str | None:
    """The setting whose formula had no finite value in a step from the time `begin` on, or None."""
    for keys, formula in expressions(case):
        miss = formula.missed
        if miss is not None and ("t" not in formula.uses or miss.t > begin):
            return f"{dotted(keys)}: {not_finite(formula, miss.value, miss.t, np.array(miss.x))}"
    return None


def first_not_finite(formula: Expression, x: Array, times: Array) -> str | None:
    """What is said of a formula that is not finite at one of the points (dim, n) and times; None if there is none."""
    for t in times if "t" in formula.uses else times[:1]:
        values = formula(x, t)
        wrong = np.flatnonzero(~np.isfinite(values))
        if len(wrong):
            return not_finite(formula, values[wrong[0]], t, x[:, wrong[0]])
    return None


def _volume(fluid: FluidSection, times: Array) -> Iterator[Mistake]:
    planes = [0.5 * (plane[1:] + plane[:-1]) for plane in fluid.grid.planes]
    every = max(int(np.ceil((np.prod([len(p) for p in planes]) / MOST_POINTS) ** (1.0 / len(planes)))), 1)
    x = np.stack([part.ravel() for part in np.meshgrid(*(plane[::every] for plane in planes), indexing="ij")])
    for name in ("gravity", "body_force", "initial_velocity"):
        for keys, formula in expressions(getattr(fluid, name), ("fluid", name)):
            if formula.uses - {"t"} and (found := first_not_finite(formula, x, times)) is not None:
                yield keys, f"{subject(keys)}: {found}"


def _nodes(fluid: FluidSection, name: str, face: str) -> Array:
    """Nodes of the grid on a face of the box at which no patch that is named later decides, (dim, n)."""
    names = list(fluid.patches)
    later = [fluid.patches[other] for other in names[names.index(name) + 1 :]]
    ends: dict[str, list[int]] = {}
    for other in (face for patch in later for face in patch.on):
        ends.setdefault(other[0], []).append(-1 if other[1] == "+" else 0)
    planes = [np.delete(plane, ends.get(axis, [])) for axis, plane in zip("xyz", fluid.grid.planes, strict=False)]
    return _chosen(fluid.patches[name], _on_face(fluid, face, planes))


def face_middles(fluid: FluidSection, face: str) -> Array:
    """Middles of the cells' faces on a face of the box, (dim, n), the last axis fastest."""
    return _on_face(fluid, face, [0.5 * (plane[1:] + plane[:-1]) for plane in fluid.grid.planes])


def _on_face(fluid: FluidSection, face: str, lines: list[Array]) -> Array:
    """Crossings of lines in a face of the box."""
    axis, side = "xyz".index(face[0]), -1 if face[1] == "+" else 0
    parts = [fluid.grid.planes[axis][[side]] if i == axis else line for i, line in enumerate(lines)]
    return np.stack([part.ravel() for part in np.meshgrid(*parts, indexing="ij")])


def _chosen(patch: PatchSection, x: Array) -> Array:
    """The points where the patch is; of many every so many."""
    if patch.where is not None:
        x = x[:, patch.where(x, 0.0) > 0.0]
    return x[:, :: max(x.shape[1] // MOST_POINTS, 1)]
