"""Free rigid bodies: their settings besides the shape."""

from __future__ import annotations

from math import degrees, dist
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import TypeAdapter, ValidationError, model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import (
    EntryCount,
    Name,
    NotNegative,
    Number,
    NumberVector,
    OneOrMany,
    Positive,
    Share,
    TimeFormula,
    TimeVector,
    Vector,
)

if TYPE_CHECKING:
    from solvers.spring_law import SpringLaw

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


class SpringEndSection(Section):
    """The other end of a spring: a point of another body, or at rest."""

    body: Name | None = setting(None, "another free or elastic body; default: the point is at rest")
    at: NumberVector = setting(..., "the point, at the start", unit="m")


class PointSpringSection(Section):
    """A spring with a damper from a point of the body to the position of this point at the start, or to another point.

    To another point it acts along the line between both; with the length 0, in all directions, as a joint.
    """

    at: NumberVector = setting(..., "the point", unit="m")
    stiffness: Annotated[tuple[NotNegative, ...], EntryCount(1, 3), OneOrMany()] = setting(
        ..., "one number, or without 'to' one along each axis; in 2D per depth", unit="N/m"
    )
    damping: NotNegative = setting(
        0.0, "damping over stiffness: the damping force is damping * stiffness * velocity", unit="s"
    )
    dashpot: NotNegative = setting(0.0, "force per velocity of a damper in parallel; in 2D per depth", unit="N s/m")
    to: SpringEndSection | None = setting(None, "the other end; default: the position of the point at the start")
    length: NotNegative | None = setting(
        None, "with 'to': the length without force; default: the distance of both points at the start", unit="m"
    )

    @property
    def free_length(self) -> float:
        """The length without force [m] of a spring to another point."""
        assert self.to is not None
        return dist(self.at, self.to.at) if self.length is None else self.length

    def law(self) -> SpringLaw:
        """That of a spring to another point."""
        from solvers.spring_law import SpringLaw

        k = self.stiffness[0]
        return SpringLaw(k, self.damping * k + self.dashpot, self.free_length)

    @model_validator(mode="after")
    def _line(self) -> PointSpringSection:
        if self.to is None and self.length is not None:
            raise fault("'length' is for a spring to another point: give 'to', too", "length")
        if self.to is not None and len(self.stiffness) > 1:
            raise fault("must be one number for a spring along a line", "stiffness")
        return self


class RigidLoadSection(Section):
    """A force and a moment on the body. They do not turn with it; the point does."""

    force: TimeVector | None = setting(None, "force by components; in 2D per depth", unit="N")
    moment: Annotated[tuple[TimeFormula, ...], EntryCount(1, 3), OneOrMany()] | None = setting(
        None, "moment: one formula in 2D, per depth, three in 3D", unit="N m"
    )
    at: NumberVector | None = setting(
        None, "point of the body that the force acts at, at the start; default: the centre of mass", unit="m"
    )

    @model_validator(mode="after")
    def _something(self) -> RigidLoadSection:
        if self.force is None and self.moment is None:
            raise fault("a load needs 'force' or 'moment'")
        if self.force is None and self.at is not None:
            raise fault("'at' is the point of a 'force': a moment has none", "at")
        return self


class FreeMotion(Section):
    """The body moves under the forces and moments on it: its weight, contact, springs, and given ones."""

    density: Positive = setting(..., "mass per volume", unit="kg/m^3")
    gravity: Vector | None = setting(
        None, "acceleration of gravity; default: that of the section 'fluid' or 'rigid'", unit="m/s^2"
    )
    springs: tuple[PointSpringSection, ...] = setting(tuple, "springs and dampers at points")
    loads: tuple[RigidLoadSection, ...] = setting(tuple, "given forces and moments")
    pivot: NumberVector | None = setting(
        None, "a point at rest that the body turns about, as a pendulum; default: none", unit="m"
    )
    held: tuple[Literal["x", "y", "z", "rotation", "rotation_x", "rotation_y", "rotation_z"], ...] = setting(
        tuple, "degrees of freedom that do not move; rotations are about the axes of coordinates"
    )
    initial_velocity: NumberVector | None = setting(None, "velocity of the centre at the start", unit="m/s")
    initial_angular_velocity: Annotated[tuple[Number, ...], EntryCount(1, 3), OneOrMany()] | None = setting(
        None, "angular velocity at the start: one number in 2D, three in 3D", unit="degrees/s"
    )

    @model_validator(mode="before")
    @classmethod
    def _no_radians(cls, data: Any) -> Any:
        if isinstance(data, dict) and "initial_spin" in data:
            value = _in_degrees(data["initial_spin"])
            raise fault(f"'initial_spin' [rad/s] is now 'initial_angular_velocity' [degrees/s]{value}", "initial_spin")
        return data

    def with_gravity(self, default: tuple[Any, ...] | None) -> Self:
        """The same with the gravity of its section if it has none of its own."""
        return self if self.gravity is not None else self.model_copy(update={"gravity": default})


class Free(FreeMotion):
    """A body that the forces and moments on it move: those of the flow, its weight, contact, springs, given ones."""

    leaves: Literal["warn", "stop"] = setting(
        "warn", "when it has left the box: warn: it goes on without fluid, with a warning; stop: the run ends"
    )


def _in_degrees(spin: Any) -> str:
    """The new setting with the converted value of the old one [rad/s], as a message ends; none of what is no number."""
    try:
        values = [f"{degrees(TypeAdapter(Number).validate_python(one)):.12g}" for one in _entries(spin)]
    except ValidationError:
        return ""
    text = f"[{', '.join(values)}]" if isinstance(spin, list) else values[0]
    return f": write 'initial_angular_velocity: {text}'"


def _entries(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


class RigidDynamics(Section):
    """Generalised-alpha time integration of rigid bodies."""

    rho_inf: Share = setting(
        1.0, "spectral radius at infinite frequency: 1 conserves energy, smaller values damp high frequencies", unit="1"
    )


#: Degrees of freedom in 2D.
PLANE = ("x", "y", "rotation")
