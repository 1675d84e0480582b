"""Section `rigid`: free rigid bodies in a case without fluid."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator

from fsci.case.free_body import FreeMotion, RigidDynamics
from fsci.case.mesh import Mesh
from fsci.case.section import Section, setting
from fsci.case.structure import some
from fsci.case.values import Name, Surfaces, Vector


class FreeBodySection(FreeMotion):
    """A free rigid body."""

    mesh: Mesh = setting(
        ..., "mesh file, or one of a closed surface (STL, OBJ), or built-in shape; its boundary counts"
    )
    on: Surfaces | None = setting(
        None, "names of the surfaces that enclose the body; default: the whole boundary of the mesh"
    )


class RigidSection(Section):
    """Free rigid bodies without a fluid, beside elastic ones or alone; in one they are `fluid.bodies` with `free`."""

    bodies: Annotated[dict[Name, FreeBodySection], BeforeValidator(some)] = setting(..., "the bodies by name")
    gravity: Vector | None = setting(
        None, "acceleration of gravity of bodies without one of their own; default: none", unit="m/s^2"
    )
    dynamics: RigidDynamics | None = setting(None, "time integration; default: that of 'structure', or rho_inf 1")

    @property
    def free_bodies(self) -> dict[str, FreeMotion]:
        """The bodies with their gravity."""
        return {name: body.with_gravity(self.gravity) for name, body in self.bodies.items()}
