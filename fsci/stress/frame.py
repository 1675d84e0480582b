"""The same scene seen otherwise: rotated, shifted, in other units. What comes out is brought back and must agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, radians, sin
from typing import Any

import numpy as np

from fsci.case.quantities import QUANTITIES
from fsci.run.history import History

Powers = tuple[int, int, int]  #: of length, mass and time

LENGTH, SPEED, ACCELERATION = (1, 0, 0), (1, 0, -1), (1, 0, -2)
DENSITY, STRESS, VISCOSITY = (-3, 1, 0), (-1, 1, -2), (-1, 1, -1)

#: Quantities that are not per metre of depth in 2D.
LOCAL = ("displacement", "velocity", "acceleration", "gap", "pressure", "centre", "first_contact")


@dataclass(frozen=True)
class Frame:
    """x' = length R (x + shift), with other units of mass and time."""

    angle: float = 0.0  #: [degrees]; quarter turns where there is a grid
    shift: tuple[float, float] = (0.0, 0.0)  #: [m]
    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    @property
    def rotation(self) -> np.ndarray:
        """R; of quarter turns exact."""
        if self.angle % 90 == 0:
            c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[int(self.angle // 90) % 4]
        else:
            c, s = cos(radians(self.angle)), sin(radians(self.angle))  # type: ignore[assignment]
        return np.array([[c, -s], [s, c]])

    def unit(self, powers: Powers) -> float:
        return self.length ** powers[0] * self.mass ** powers[1] * self.time ** powers[2]

    def number(self, value: float, powers: Powers) -> float:
        return float(value * self.unit(powers))

    def vector(self, values: Sequence[float], powers: Powers, over_time: str = "") -> list[Any]:
        """Components; `over_time`: a function of s, the time in the scene's own unit, that they are multiplied by."""
        turned = [float(v) for v in self.unit(powers) * (self.rotation @ np.asarray(values, dtype=float))]
        if not over_time:
            return turned
        return [f"{v!r}*({self.function(over_time)})" for v in turned]

    def function(self, over_time: str) -> str:
        """A function of s as one of t."""
        return over_time.replace("s_", f"(t/{self.time!r})")

    def point(self, x: Sequence[float]) -> list[float]:
        moved = np.asarray(x, dtype=float) + self.shift
        return [float(v) for v in self.length * (self.rotation @ moved)]

    def rectangle(self, size: Sequence[float], origin: Sequence[float], cells: Sequence[int], **more: Any) -> dict:
        """Mesh of a rectangle with its lower left corner at `origin`, before it is turned."""
        return {
            "shape": "rectangle",
            "size": [self.number(v, LENGTH) for v in size],
            "cells": list(cells),
            "rotate": [{"angle": self.angle}],
            "translate": self.point(origin),
            **more,
        }

    def side(self, name: str) -> str:
        """Name of a face of the box: x-, x+, y-, y+."""
        outward = np.zeros(2)
        outward["xy".index(name[0])] = 1 if name[1] == "+" else -1
        turned = self.rotation @ outward
        axis = int(np.argmax(np.abs(turned)))
        return "xy"[axis] + ("+" if turned[axis] > 0 else "-")

    def grid(self, low: Sequence[float], high: Sequence[float], cells: Sequence[int]) -> dict:
        corners = np.array([self.point(low), self.point(high)])
        turned = np.abs(self.rotation @ np.asarray(cells))
        return {
            "from": [float(v) for v in corners.min(axis=0)],
            "to": [float(v) for v in corners.max(axis=0)],
            "cells": [round(float(n)) for n in turned],
        }

    def back(self, history: History, quantities: Mapping[str, str]) -> History:
        """Time and probes (name -> quantity) of a history as they are in the scene's own frame."""
        found = {"time": history["time"] / self.time}
        for name, kind in quantities.items():
            quantity = QUANTITIES[kind]
            length, mass, time = quantity.powers
            unit = self.unit((length - (kind not in LOCAL), mass, time))
            columns = quantity.columns(name, 2)
            values = np.array([history[column] for column in columns]) / unit
            if quantity.parts == "vector":
                values = self.rotation.T @ values
                if kind == "centre":
                    values = values - np.asarray(self.shift)[:, None]
            found |= dict(zip(columns, values, strict=True))
        return found
