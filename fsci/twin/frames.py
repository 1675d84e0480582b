"""The case mirrored, and turned by 90 degrees: the same scene in other coordinates, its history back in the old ones.

New coordinates are x'_i = sign_i x_source(i). Vectors and points go with them; axes of rotations are pseudovectors and
get the determinant as a factor. Formulas have the old coordinates, written in the new ones.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from fsci.case import Case
from fsci.case.fluid import PatchSection, Turn
from fsci.case.free_body import FreeMotion, PointSpringSection, RigidLoadSection
from fsci.case.grid import GridSection, Stretch
from fsci.case.probes import Probe, Reference
from fsci.case.section import Section
from fsci.case.shapes import PlacedMesh, Rotation
from fsci.expression import Expression
from fsci.running.history import History
from fsci.twin.grids import Settings

AXIS_NAMES = "xyz"
#: Sections with places or directions.
SECTIONS_WITH_PLACES = ("structure", "fluid", "rigid_section", "contact", "coupling", "probes")
#: Lists of numbers that are points or vectors.
TURNING_VECTORS = (
    *("at", "minus", "about", "centre", "direction", "initial_velocity", "dry_side", "box", "pivot", "point", "normal"),
)


@dataclass(frozen=True)
class Coordinates:
    """Other coordinates of a case."""

    name: str
    words: str
    source: tuple[int, int, int]
    sign: tuple[int, int, int]
    determinant: int

    def settings(self, case: Case, dimension: int) -> Settings:
        """The case in these coordinates, without `verify`, whose columns may be others."""
        there = [(type(case).model_fields[name].alias or name, getattr(case, name)) for name in SECTIONS_WITH_PLACES]
        return tuple(
            [(name, json.dumps(_Sections(self, dimension).value(name, value))) for name, value in there if value]
        ) + (("verify", "[]"),) * bool(case.verify)

    def history(self, history: History, case: Case) -> History:
        """That of the case, from that in these coordinates."""
        found = dict(history)
        axes = [name for name, probe in case.probes.items() if probe.measured.parts == "axis"]
        for name in axes:
            if name in history:  # in 2D it has one column
                found[name] = self.determinant * history[name]
        for column in history:
            group, dot, axis = column.rpartition(".")
            if dot and axis in AXIS_NAMES and f"{group}.x" in history and f"{group}.y" in history:
                number = AXIS_NAMES.index(axis)
                factor = self.sign[number] * (self.determinant if group in axes else 1)
                found[f"{group}.{AXIS_NAMES[self.source[number]]}"] = factor * history[column]
        return found


MIRRORED = Coordinates("mirrored", "mirrored at x = 0", (0, 1, 2), (-1, 1, 1), -1)
TURNED = Coordinates("turned", "turned by 90 degrees about z", (1, 0, 2), (-1, 1, 1), 1)


@dataclass(frozen=True)
class _Sections:
    """Values of settings, as case files say them, in other coordinates."""

    frame: Coordinates
    dimension: int

    def value(self, name: str, value: Any) -> Any:
        """By the type of a value, and of lists of numbers by the name of their setting."""
        match value:
            case PlacedMesh():
                return self.mesh(value)
            case Section():
                return self.section(value)
            case dict():
                return {key: self.value(name, inner) for key, inner in value.items()}
            case Expression():
                return self.formula(value)
            case tuple() if any(isinstance(inner, Expression) for inner in value):
                return self.vector([None if inner is None else self.formula(inner) for inner in value])
            case tuple() if name in TURNING_VECTORS and isinstance(value[0], float):
                return self.vector(value)
            case tuple():
                return [self.value(name, inner) for inner in value]
        return value

    def section(self, section: Section) -> dict[str, Any]:
        special: dict[type, Callable[[Any], dict[str, Any]]] = {
            GridSection: self.grid,
            PatchSection: self.patch,
            Turn: self.turn,
            PointSpringSection: self.point_spring,
            RigidLoadSection: self.rigid_load,
            Probe: self.probe,
        }
        changed = special[type(section)](section) if type(section) in special else {}
        if isinstance(section, FreeMotion):
            changed = self.free(section)
        fields = type(section).model_fields
        return {
            alias: changed[alias] if alias in changed else self.value(name, getattr(section, name))
            for name in fields
            if (alias := fields[name].alias or name) in changed or name in section.model_fields_set
        }

    def mesh(self, mesh: PlacedMesh) -> dict[str, Any]:
        """R (M x) + t in other coordinates Q: Q R M = (Q R Q^T) Q M, or (Q R) M where Q is a rotation."""
        given = {
            (field.alias or name): mesh.model_dump(include={name}, exclude_unset=True)[name]
            for name, field in type(mesh).model_fields.items()
            if name in mesh.model_fields_set and name not in ("mirror", "rotate", "translate")
        }
        mirror, rotations = mesh.mirror, [one.model_dump(exclude_unset=True) for one in mesh.rotate]
        if self.frame is TURNED:
            rotations = [*rotations, self.rotation(2, 90.0)]
        else:
            rotations = [self.turned(one) for one in mesh.rotate]
            if mirror in ("y", "z"):  # with that at x = 0 it is half a turn about the third axis
                rotations = [self.rotation(2 if mirror == "y" else 1, 180.0), *rotations]
            mirror = "x" if mirror is None else None
        given |= {"mirror": mirror, "rotate": rotations}
        return given | ({} if mesh.translate is None else {"translate": self.vector(mesh.translate)})

    def rotation(self, axis: int, angle: float) -> dict[str, Any]:
        return {"angle": angle} | ({"axis": [float(axis == n) for n in range(3)]} if self.dimension == 3 else {})

    def turned(self, rotation: Rotation) -> dict[str, Any]:
        if rotation.axis is None:
            return {"angle": self.frame.determinant * rotation.angle}
        return {"angle": rotation.angle, "axis": self.pseudovector(rotation.axis)}

    def turn(self, turn: Turn) -> dict[str, Any]:
        if turn.axis is not None:
            return {"axis": self.pseudovector(turn.axis)}
        rates = {"angle": turn.angle, "angular_velocity": turn.angular_velocity}
        return {
            name: self.signed(self.frame.determinant, self.formula(formula))
            for name, formula in rates.items()
            if formula is not None
        }

    def free(self, free: FreeMotion) -> dict[str, Any]:
        held = [f"{turns}{self.axis(axis)}" for turns, axis in map(_axis_at_the_end, free.held)]
        rate = free.initial_angular_velocity
        if rate is None:
            return {"held": held}
        turned = [self.frame.determinant * rate[0]] if len(rate) == 1 else self.pseudovector(rate)
        return {"held": held, "initial_angular_velocity": turned}

    def rigid_load(self, load: RigidLoadSection) -> dict[str, Any]:
        if load.moment is None:
            return {}
        moment = [self.formula(formula) for formula in load.moment]
        turned = [self.signed(self.frame.determinant, moment[0])] if len(moment) == 1 else self.pseudovector(moment)
        return {"moment": turned}

    def point_spring(self, spring: PointSpringSection) -> dict[str, Any]:
        if len(spring.stiffness) == 1:
            return {}
        return {"stiffness": [spring.stiffness[old] for old in self.frame.source[: self.dimension]]}

    def patch(self, patch: PatchSection) -> dict[str, Any]:
        return {"on": [self.face(face) for face in patch.on]}

    def probe(self, probe: Probe) -> dict[str, Any]:
        box = {} if probe.box is None else {"box": self.corners([self.vector(corner) for corner in probe.box])}
        return box | ({} if probe.reference is None else {"reference": self.reference(probe.reference)})

    def reference(self, reference: Reference) -> dict[str, Any]:
        """With the directions, whose defaults are those of the axes."""
        drag = reference.drag or (1.0, 0.0, 0.0)[: self.dimension]
        lift = reference.lift or ((-drag[1], drag[0]) if self.dimension == 2 else (0.0, 1.0, 0.0))
        given = {name: getattr(reference, name) for name in reference.model_fields_set}
        return given | {"drag": self.vector(drag), "lift": self.vector(lift)}

    def grid(self, grid: GridSection) -> dict[str, Any]:
        """Directions change places; one whose sign changes has its stretches in the opposite order."""
        sources = self.frame.source[: self.dimension]
        low, high = (self.vector(corner) for corner in (grid.start, grid.to))
        found: dict[str, Any] = {
            "from": [min(ends) for ends in zip(low, high, strict=True)],
            "to": [max(ends) for ends in zip(low, high, strict=True)],
            "cells": None if grid.cells is None else [grid.cells[old] for old in sources],
            "refine": [self.refinement(self.section(refinement)) for refinement in grid.refine],
        }
        for new, old in enumerate(sources):
            stretches = grid.graded[old]
            if stretches is None:
                found[AXIS_NAMES[new]] = None
            elif self.frame.sign[new] > 0:
                found[AXIS_NAMES[new]] = [stretch.model_dump() for stretch in stretches]
            else:
                found[AXIS_NAMES[new]] = _reversed(grid.start[old], stretches)
        return found

    def refinement(self, given: dict[str, Any]) -> dict[str, Any]:
        if given.get("box") is None:
            return given
        return given | {"box": self.corners(given["box"])}

    def corners(self, box: Sequence[Sequence[float]]) -> list[list[float]]:
        """The lowest corner and the highest one."""
        by_axis = list(zip(*box, strict=True))
        return [[min(ends) for ends in by_axis], [max(ends) for ends in by_axis]]

    def vector(self, values: Sequence[Any]) -> list[Any]:
        return [self.signed(self.frame.sign[new], values[old]) for new, old in self.places(values)]

    def pseudovector(self, values: Sequence[Any]) -> list[Any]:
        return [
            self.signed(self.frame.determinant * self.frame.sign[new], values[old]) for new, old in self.places(values)
        ]

    def places(self, values: Sequence[Any]) -> list[tuple[int, int]]:
        return list(enumerate(self.frame.source[: len(values)]))

    def signed(self, sign: int, value: Any) -> Any:
        if value is None or sign > 0:
            return value
        return f"-({value})" if isinstance(value, str) else 0.0 - value

    def formula(self, formula: Expression) -> str | float:
        """Old coordinates in it written in new ones."""
        if formula.constant is not None:
            return float(formula.constant)
        return re.sub(r"\b[xyz]\b", lambda found: self.old(AXIS_NAMES.index(found[0])), formula.text)

    def old(self, axis: int) -> str:
        new = self.frame.source.index(axis)
        return AXIS_NAMES[new] if self.frame.sign[new] > 0 else f"(-{AXIS_NAMES[new]})"

    def axis(self, name: str) -> str:
        """The new name of an axis; other words stay."""
        return AXIS_NAMES[self.frame.source.index(AXIS_NAMES.index(name))] if name and name in AXIS_NAMES else name

    def face(self, face: str) -> str:
        name = self.axis(face[0])
        opposite = self.frame.sign[AXIS_NAMES.index(name)] < 0
        return name + ({"-": "+", "+": "-"}[face[1]] if opposite else face[1])


def _axis_at_the_end(word: str) -> tuple[str, str]:
    """rotation_x: (rotation_, x); rotation: (rotation, )."""
    return (word[:-1], word[-1]) if word[-1] in AXIS_NAMES else (word, "")


def _reversed(start: float, stretches: Sequence[Stretch]) -> list[dict[str, Any]]:
    begins = [start, *(stretch.to for stretch in stretches[:-1])]
    pairs = list(zip(begins, stretches, strict=True))
    return [{"to": 0.0 - begin, "cells": one.cells, "ratio": 1.0 / one.ratio} for begin, one in reversed(pairs)]
