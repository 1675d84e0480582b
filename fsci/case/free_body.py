"""Rigid bodies that the flow moves: their settings besides the shape."""

from __future__ import annotations

from typing import Annotated, Literal

from fsci.case.section import Section, setting
from fsci.case.values import EntryCount, NotNegative, Number, NumberVector, Positive, Share, Vector

#: Ways that can be held, and which of the six they are.
HELD = {
    "x": ("x",),
    "y": ("y",),
    "z": ("z",),
    "rotation": ("rotation_x", "rotation_y", "rotation_z"),
    "rotation_x": ("rotation_x",),
    "rotation_y": ("rotation_y",),
    "rotation_z": ("rotation_z",),
}


class PointSpringSection(Section):
    """A spring between a point of the body and the position of this point at the start."""

    at: NumberVector = setting(..., "the point", unit="m")
    stiffness: Annotated[tuple[NotNegative, ...], EntryCount(2, 3)] = setting(
        ..., "along each axis; in 2D per depth", unit="N/m"
    )
    damping: NotNegative = setting(
        0.0, "damping over stiffness: the damping force is damping * stiffness * velocity", unit="s"
    )


class Free(Section):
    """The body follows from forces and moments on it: those of the flow, its weight, and springs."""

    density: Positive = setting(..., "mass per volume", unit="kg/m^3")
    gravity: Vector | None = setting(None, "acceleration of gravity", unit="m/s^2")
    springs: tuple[PointSpringSection, ...] = setting(tuple, "springs and dampers at points")
    held: tuple[Literal["x", "y", "z", "rotation", "rotation_x", "rotation_y", "rotation_z"], ...] = setting(
        tuple, "degrees of freedom that do not move"
    )
    initial_velocity: NumberVector | None = setting(None, "velocity of the centre at the start", unit="m/s")
    initial_spin: Annotated[tuple[Number, ...], EntryCount(1, 3)] | None = setting(
        None, "angular velocity at the start: one number in 2D, three in 3D", unit="rad/s"
    )


class RigidDynamics(Section):
    """Generalised-alpha time integration of rigid bodies."""

    rho_inf: Share = setting(
        1.0, "spectral radius at infinite frequency: 1 conserves energy, smaller values damp high frequencies", unit="1"
    )


#: Degrees of freedom in 2D.
PLANE = ("x", "y", "rotation")
