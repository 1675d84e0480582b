"""Frames: a scene rotated, shifted or in other units. Results are transformed back and must agree."""

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

    def number(self, value: float, powers: Powers) -> float:
        return float(value * self.unit(powers))

    def vector(self, values: Sequence[float], powers: Powers, over_time: str = "") -> list[Any]:
        """Components; `over_time`: a function of s, the time in the scene's own unit, that they are multiplied by."""
        turned = [float(v) for v in self.unit(powers) * self.turned(values)]
        if not over_time:
            return turned
        return [f"{v!r}*({self.function(over_time)})" for v in turned]

    def function(self, over_time: str) -> str:
        """A function of s as one of t."""
        return over_time.replace("s_", f"(t/{self.time!r})")

    def point(self, x: Sequence[float]) -> list[float]:
        return [float(v) for v in self.length * self.turned(np.asarray(x, dtype=float) + self.shift[: len(x)])]

    def rectangle(self, size: Sequence[float], origin: Sequence[float], cells: Sequence[int], **more: Any) -> dict:
        """Mesh of a rectangle or box with its lowest corner at `origin`, before it is turned."""
        plane = len(size) == 2
        return {
            "shape": "rectangle" if plane else "box",
            "size": [self.number(v, LENGTH) for v in size],
            "cells": list(cells),
            "rotate": [{"angle": self.angle} if plane else {"axis": list(self.axis), "angle": self.angle}],
            "translate": self.point(origin),
            **more,
        }

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
