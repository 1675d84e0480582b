"""Section `contact`: which surfaces may touch, rigid obstacles, and how contact is enforced."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from fsci.case.mesh import Mesh
from fsci.case.section import Section, fault, setting
from fsci.case.values import Name, Positive, Text, Vector


class Side(Section):
    """A surface of a body, or an obstacle."""

    body: Name | None = setting(None, "name of the body")
    on: Text | None = setting(None, "name of its surface")
    obstacle: Name | None = setting(None, "name of the obstacle")

    @model_validator(mode="after")
    def _one_kind(self) -> Side:
        if (self.body is None) == (self.obstacle is None):
            raise fault("give either 'body' and 'on', or 'obstacle'")
        if self.body is not None and self.on is None:
            raise fault("a side of a body needs the setting 'on', the name of its surface", "body")
        if self.obstacle is not None and self.on is not None:
            raise fault("the surface of an obstacle is named where the obstacle is", "on")
        return self


class Pair(Section):
    """Two surfaces that may touch; the slave should be the finer or softer one."""

    slave: Side = setting(..., "surface that carries the contact pressure; of a body")
    master: Side = setting(..., "surface it may touch")
    integration: Literal["segments", "elements"] = setting(
        "segments", "segments: exact where facets overlap; elements: faster, fixed points on slave facets"
    )

    @model_validator(mode="after")
    def _deformable_slave(self) -> Pair:
        if self.slave.obstacle is not None:
            raise fault("the slave must be a surface of a body: make the obstacle the master", "slave")
        return self


class Obstacle(Section):
    """A rigid surface, at rest or moved as a whole."""

    mesh: Mesh = setting(..., "mesh file or built-in shape that has the surface")
    on: Text = setting(..., "name of the surface")
    motion: Vector | None = setting(None, "displacement; default: at rest", unit="m")


class Contact(Section):
    """Frictionless contact by dual mortar multipliers."""

    pairs: dict[Name, Pair] = setting(..., "pairs of surfaces by name")
    obstacles: dict[Name, Obstacle] = setting(dict, "rigid surfaces by name")
    c_n: Positive = setting(1.0, "factor of the complementarity parameter; the result does not depend on it", unit="1")
    force_at: Literal["mid", "end"] = setting(
        "mid", "dynamics: contact force averaged over the step like all forces, or that at its end"
    )
