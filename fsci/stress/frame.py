"""Frames: a scene rotated, shifted or in other units. Results are transformed back and must agree."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import cos, radians, sin
from typing import Any, get_args, get_origin

import numpy as np

from fsci.case.case import Case
from fsci.case.quantities import QUANTITIES
from fsci.case.section import Section
from fsci.running.history import History

Powers = tuple[int, int, int]  #: of length, mass and time

#: Units of settings. Those of forces in 2D are per depth, and no scene has any.
POWERS: dict[str, Powers] = {
    "m": (1, 0, 0),
    "m^3": (3, 0, 0),
    "s": (0, 0, 1),
    "1/s": (0, 0, -1),
    "m/s": (1, 0, -1),
    "m/s^2": (1, 0, -2),
    "kg/m^3": (-3, 1, 0),
    "Pa": (-1, 1, -2),
    "Pa s": (-1, 1, -1),
}
SAME = ("", "1", "degrees")  #: units of what is the same in all frames of a plane
#: Settings with the unit m that are points, not displacements.
POINTS = ("at", "minus", "about", "centre", "translate", "origin")

#: Quantities that are not per metre of depth in 2D.
LOCAL = (
    "displacement",
    "velocity",
    "speed",
    "acceleration",
    "gap",
    "mean_gap",
    "overlap",
    "pressure",
    "mean_pressure",
    "centre",
    "first_contact",
)


class FrameError(ValueError):
    """A case that cannot be seen in another frame."""


@dataclass(frozen=True)
class Frame:
    """x' = length R (x + shift), with other units of mass and time."""

    angle: float = 0.0  #: [degrees]; where there is a grid, such that it becomes a grid again
    shift: tuple[float, ...] = (0.0, 0.0, 0.0)  #: [m]
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)  #: that is turned about; in 2D out of the plane
    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    @property
    def rotation(self) -> np.ndarray:
        """R in space; exact if it takes axes to axes."""
        x, y, z = np.array(self.axis) / np.linalg.norm(self.axis)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        angle = radians(self.angle)
        turned = np.eye(3) + sin(angle) * cross + (1.0 - cos(angle)) * cross @ cross
        return np.rint(turned) if np.abs(turned - np.rint(turned)).max() < 1e-12 else turned

    def turned(self, values: Sequence[float] | np.ndarray) -> np.ndarray:
        """R v, in the plane or in space."""
        dim = len(values)
        return self.rotation[:dim, :dim] @ np.asarray(values, dtype=float)

    def unit(self, powers: Powers) -> float:
        return self.length ** powers[0] * self.mass ** powers[1] * self.time ** powers[2]

    def number(self, value: float | str, powers: Powers) -> float | str:
        """A number, or a function of place and time."""
        unit = self.unit(powers)
        return f"{unit!r}*({self.function(value)})" if isinstance(value, str) else float(value * unit)

    def vector(self, values: Sequence[float | str], powers: Powers) -> list[Any]:
        """Components, which may be functions of place and time."""
        turn, unit, dim = self.rotation, self.unit(powers), len(values)
        if not any(isinstance(value, str) for value in values):
            return [float(v) for v in unit * self.turned(values)]  # type: ignore[arg-type]
        parts = [(j, self.function(str(value))) for j, value in enumerate(values) if value != 0]
        sums = [[(float(unit * turn[i, j]), text) for j, text in parts if turn[i, j]] for i in range(dim)]
        return [" + ".join(f"{factor!r}*({text})" for factor, text in one) or 0.0 for one in sums]

    def function(self, text: str) -> str:
        """A function of x, y, z and t of the scene as one of those of the frame."""
        return re.sub(r"\b[xyzt]\b", lambda found: self._own(found[0]), text)

    def _own(self, name: str) -> str:
        """A coordinate of the scene, or its time, by those of the frame."""
        if name == "t":
            return f"(t/{self.time!r})"
        i = "xyz".index(name)
        parts = (f"{float(r) / self.length!r}*{axis}" for r, axis in zip(self.rotation[:, i], "xyz", strict=True) if r)
        return f"({' + '.join(parts)} - {(*self.shift, 0.0)[i]!r})"

    def point(self, x: Sequence[float]) -> list[float]:
        return [float(v) for v in self.length * self.turned(np.asarray(x, dtype=float) + self.shift[: len(x)])]

    def side(self, name: str) -> str:
        """Name of a face of the box, such as x-."""
        outward = np.zeros(3)
        outward["xyz".index(name[0])] = 1 if name[1] == "+" else -1
        turned = self.turned(outward)
        axis = int(np.argmax(np.abs(turned)))
        return "xyz"[axis] + ("+" if turned[axis] > 0 else "-")

    def grid(self, low: Sequence[float], high: Sequence[float], cells: Sequence[int]) -> dict:
        corners = np.array([self.point(low), self.point(high)])
        turned = np.abs(self.turned(cells))
        return {
            "from": [float(v) for v in corners.min(axis=0)],
            "to": [float(v) for v in corners.max(axis=0)],
            "cells": [round(float(n)) for n in turned],
        }

    def case(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """A case in this frame: its settings by the units that they have, its meshes, grid and sides of the box turned.

        Raises FrameError for a unit that a frame does not know, and for a mesh that has no place.
        """
        return self._section(data, Case)

    def _section(self, data: Mapping[str, Any], section: type[Section]) -> dict[str, Any]:
        fields = {field.alias or name: field for name, field in section.model_fields.items()}
        found: dict[str, Any] = {}
        for name, value in data.items():
            extra = fields[name].json_schema_extra if name in fields else None
            unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
            if name == "mesh":
                found[name] = self._mesh(value, fields[name].annotation)
            elif name == "grid":
                found[name] = self._grid(value)
            elif name == "patches":
                found[name] = {key: {**patch, "on": self._sides(patch["on"])} for key, patch in value.items()}
                found[name] = {key: self._nested(patch, fields[name].annotation) for key, patch in found[name].items()}
            elif name == "held":
                found[name] = [self.side(f"{axis}+")[0] if axis in ("x", "y", "z") else axis for axis in value]
            elif unit in SAME:
                found[name] = self._nested(value, fields[name].annotation) if name in fields else value
            elif unit not in POWERS:
                raise FrameError(f"there is no rule for '{name}', whose unit is {unit}, in other frames")
            elif name in POINTS:
                found[name] = self.point(value)
            elif isinstance(value, list):
                found[name] = self.vector(value, POWERS[unit])
            else:
                found[name] = self.number(value, POWERS[unit])
        return found

    def _nested(self, value: Any, kind: Any) -> Any:
        """A section, or what has sections in it, of a type."""
        sections = list(_sections(kind))
        if isinstance(value, Mapping) and sections:
            fitting = [one for one in sections if value.keys() <= _names(one)]
            return self._section(value, fitting[0]) if fitting else {k: self._nested(v, kind) for k, v in value.items()}
        return [self._nested(one, kind) for one in value] if isinstance(value, list) and sections else value

    def _mesh(self, mesh: Mapping[str, Any], kind: Any) -> dict[str, Any]:
        """Lengths of a mesh, which is turned and moved as a whole."""
        if "translate" not in mesh:
            raise FrameError("a mesh needs 'translate', its place, to be seen in other frames")
        own = {key: value for key, value in mesh.items() if key not in ("rotate", "translate")}
        turn = {"angle": self.angle + sum(one["angle"] for one in mesh.get("rotate", []))}
        place = mesh["translate"]
        return {
            **replace(self, angle=0.0, shift=(0.0, 0.0, 0.0))._nested(own, kind),
            "rotate": [turn if len(place) == 2 else {"axis": list(self.axis), **turn}],
            "translate": self.point(place),
        }

    def _grid(self, grid: Mapping[str, Any]) -> dict[str, Any]:
        refine = []
        for one in grid.get("refine", []):
            if "box" in one:
                turned = self.grid(one["box"][0], one["box"][1], [1] * len(grid["cells"]))
                one = {**one, "box": [turned["from"], turned["to"]]}
            refine.append(one)
        return {**self.grid(grid["from"], grid["to"], grid["cells"]), **({"refine": refine} if refine else {})}

    def _sides(self, on: str | Sequence[str]) -> Any:
        return self.side(on) if isinstance(on, str) else [self.side(name) for name in on]

    def back(self, history: History, quantities: Mapping[str, str], dim: int = 2) -> History:
        """Time and probes (name -> quantity) of a history as they are in the scene's own frame."""
        found = {"time": history["time"] / self.time}
        for name, kind in quantities.items():
            quantity = QUANTITIES[kind]
            length, mass, time = quantity.powers
            unit = self.unit((length - (dim == 2 and kind not in LOCAL), mass, time))
            columns = quantity.columns(name, dim)
            values = np.array([history[column] for column in columns]) / unit
            if quantity.parts == "vector":
                values = self.rotation[:dim, :dim].T @ values
                if kind == "centre":
                    values = values - np.asarray(self.shift[:dim])[:, None]
            found |= dict(zip(columns, values, strict=True))
        return found


def _sections(kind: Any) -> Iterator[type[Section]]:
    """The sections that a type of a setting may be, or may have in it."""
    if isinstance(kind, type) and get_origin(kind) is None and issubclass(kind, Section):
        yield kind
    for inner in get_args(kind):
        yield from _sections(inner)


def _names(section: type[Section]) -> set[str]:
    return {field.alias or name for name, field in section.model_fields.items()}
