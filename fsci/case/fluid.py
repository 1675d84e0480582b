"""Section `fluid`: the flow, its grid, conditions on the boundary of the box, and rigid bodies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator

from fsci.case.errors import listed
from fsci.case.free_body import Free, RigidDynamics
from fsci.case.grid import GridSection
from fsci.case.mesh import Mesh
from fsci.case.section import Section, fault, setting
from fsci.case.values import (
    EntryCount,
    Formula,
    Name,
    NotNegative,
    Number,
    NumberVector,
    OneOrMany,
    Positive,
    SpaceFormula,
    Surfaces,
    Switch,
    TimeFormula,
    TimeVector,
    Vector,
    chosen,
)
from solvers.fluid.terms.boundary.patch_kinds import PATCH_KINDS

if TYPE_CHECKING:
    from solvers.fluid.settings.shear_law import ShearLaw
    from solvers.fluid.terms.boundary.windkessel import Windkessel

Face = Literal["x-", "x+", "y-", "y+", "z-", "z+"]
KINDS_OF_PATCH = tuple(PATCH_KINDS)


class WindkesselSection(Section):
    """Pressure P = proximal q + P_c of an outlet with the flow rate q, capacitance dP_c/dt = q - P_c / distal.

    In 2D the flow rate is per depth, hence the units are Pa s/m^2 and m^2/Pa.
    """

    proximal: NotNegative = setting(..., "resistance next to the outlet", unit="Pa s/m^3")
    capacitance: NotNegative = setting(..., "volume stored per pressure behind it", unit="m^3/Pa")
    distal: NotNegative = setting(..., "resistance through which the stored volume leaves", unit="Pa s/m^3")
    initial_pressure: Number = setting(0.0, "P_c at the start", unit="Pa")


class PatchSection(Section):
    """Part of the boundary of the box, with one condition."""

    on: Annotated[tuple[Face, ...], EntryCount(1, None), OneOrMany()] = setting(
        ..., "face of the box, or list of faces: x- is the one where x is smallest"
    )
    where: SpaceFormula | None = setting(
        None, "only the part of the faces where this is positive at the middle of a cell's face; default: all of it"
    )
    velocity: Vector | None = setting(None, "prescribed velocity", unit="m/s")
    no_slip: Switch = setting(False, "true: a wall at rest, the velocity is zero")
    slip: Switch = setting(False, "true: the normal velocity and the shear stress are zero")
    slip_length: Positive | None = setting(
        None,
        "Navier slip: the normal velocity is zero, the shear stress is viscosity / slip_length times the "
        "tangential velocity",
        unit="m",
    )
    symmetry: Switch = setting(False, "true: a plane of symmetry, the same as slip")
    traction: Vector | None = setting(None, "prescribed force per area", unit="Pa")
    pressure: Formula | None = setting(None, "prescribed pressure; the tangential velocity is zero", unit="Pa")
    outflow: Switch = setting(
        False, "true: the flow leaves at pressure 0, without disturbance if it is parallel: mu du/dn - p n = 0"
    )
    resistance: NotNegative | None = setting(
        None, "outflow at the pressure resistance times flow rate; in 2D Pa s/m^2, the rate per depth", unit="Pa s/m^3"
    )
    windkessel: WindkesselSection | None = setting(
        None, "outflow at the pressure of a Windkessel of three elements, R_p in series with C and R_d in parallel"
    )
    periodic: Switch = setting(
        False,
        "true: the flow is periodic between two opposite faces; 'on' names both, and the patch covers all of them",
    )
    rate: TimeFormula | None = setting(
        None,
        "of a periodic patch, the mean along the period of the fluid's flow rate, towards x+, y+ or z+: a uniform "
        "force per volume, which the run finds, drives it, in addition to 'gravity' and 'body_force'; in 2D m^2/s, "
        "the rate per depth; default: free",
        unit="m^3/s",
    )

    @model_validator(mode="after")
    def _one_kind(self) -> PatchSection:
        given = self._given()
        words = listed(KINDS_OF_PATCH)
        if not given:
            raise fault(f"a patch needs one of {words}")
        if len(given) > 1:
            raise fault(f"give only one of {words}", given[1])
        if self.periodic:
            self._check_period()
        elif self.rate is not None:
            raise fault(f"is for a periodic patch, not for '{given[0]}'", "rate")
        return self

    def _check_period(self) -> None:
        if self.where is not None:
            raise fault("a periodic patch has all of its faces: remove 'where'", "where")
        for index, face in enumerate(self.on):
            other = face[0] + ("+" if face[1] == "-" else "-")
            if other not in self.on:
                raise fault(f"'{face}' is periodic with '{other}': put both into 'on'", "on", index)
        if self.rate is not None and len({face[0] for face in self.on}) > 1:
            raise fault("a rate is along one period: give each direction a patch of its own", "rate")

    @property
    def kind(self) -> str:
        """The name of its condition in `PATCH_KINDS`."""
        return self._given()[0]

    def _given(self) -> list[str]:
        return [kind for kind in KINDS_OF_PATCH if getattr(self, kind) is not None and getattr(self, kind) is not False]

    @property
    def value(self) -> tuple[Any, ...] | None:
        """The given value, by components."""
        value = getattr(self, self.kind) if PATCH_KINDS[self.kind].value else None
        return value if value is None or isinstance(value, tuple) else (value,)

    @property
    def outlet(self) -> Windkessel | None:
        """The law of its pressure; None: there is none."""
        from solvers.fluid.terms.boundary.windkessel import Windkessel

        if self.resistance is not None:
            return Windkessel(self.resistance)
        if (w := self.windkessel) is None:
            return None
        return Windkessel(w.proximal, w.distal, w.capacitance, w.initial_pressure)

    @property
    def open(self) -> bool:
        """Whether it determines the pressure level."""
        return PATCH_KINDS[self.kind].open


class Turn(Section):
    """A rotation that changes with time."""

    centre: NumberVector = setting(..., "centre of rotation", unit="m")
    axis: Annotated[tuple[Number, ...], EntryCount(3, 3)] | None = setting(
        None, "direction of the axis (3D only)", unit="1"
    )
    angle: TimeFormula | None = setting(None, "angle, counterclockwise seen against the axis", unit="degrees")
    angular_velocity: TimeFormula | None = setting(
        None, "instead of 'angle': its rate; the angle is 0 at the first time of the run", unit="degrees/s"
    )

    @model_validator(mode="after")
    def _one_form(self) -> Turn:
        _one_of(self, "angle", "angular_velocity")
        if self.angle is None and self.angular_velocity is None:
            raise fault("a rotation needs 'angle' or 'angular_velocity'")
        return self


class Movement(Section):
    """A rigid motion: the body is rotated about the centre, then displaced.

    Velocities are integrated by Gauss's rule with eight points in each time step.
    """

    displacement: TimeVector | None = setting(None, "displacement by components", unit="m")
    velocity: TimeVector | None = setting(
        None, "instead of 'displacement': its rate; the displacement is 0 at the first time of the run", unit="m/s"
    )
    rotation: Turn | None = setting(None, "rotation")

    @model_validator(mode="after")
    def _one_form(self) -> Movement:
        _one_of(self, "displacement", "velocity")
        return self


def _one_of(section: Section, first: str, second: str) -> None:
    if getattr(section, first) is not None and getattr(section, second) is not None:
        raise fault(f"give either '{first}' or '{second}', not both", second)


class RigidBodySection(Section):
    """A rigid body in the flow: at rest, moved as given, or free."""

    mesh: Mesh = setting(
        ..., "mesh file, or one of a closed surface (STL, OBJ), or built-in shape; its boundary counts"
    )
    on: Surfaces | None = setting(
        None, "names of the surfaces that enclose the body; default: the whole boundary of the mesh"
    )
    motion: Movement | None = setting(None, "prescribed motion, relative to the position of the mesh; default: at rest")
    free: Free | None = setting(
        None, "instead of 'motion': the body moves under the forces of the flow, its weight, springs and contact"
    )
    slip_length: NotNegative = setting(
        0.0, "Navier slip: slip velocity = slip_length * shear rate; 0: no slip", unit="m"
    )

    @model_validator(mode="after")
    def _one_kind(self) -> RigidBodySection:
        if self.motion is not None and self.free is not None:
            raise fault("give either 'motion' or 'free', not both", "free")
        return self


class CarreauSection(Section):
    """mu = infinite + (viscosity - infinite) (1 + (time rate)^2)^((exponent - 1)/2), rate^2 = 2 eps(u):eps(u)."""

    law: Literal["carreau"] = setting(..., "how the viscosity depends on the shear rate")
    infinite: NotNegative = setting(..., "viscosity at high rates", unit="Pa s")
    time: NotNegative = setting(..., "reciprocal of the rate from which on the viscosity changes", unit="s")
    exponent: Positive = setting(..., "below 1: the fluid becomes thinner with the rate", unit="1")

    def of(self, viscosity: float) -> tuple[float, ShearLaw]:
        """(viscosity at rest [Pa s], law) with the given `viscosity`."""
        from solvers.fluid.settings.shear_law import ShearLaw

        return viscosity, ShearLaw(self.infinite, self.time, self.exponent)


class PowerLawSection(Section):
    """mu = viscosity rate^(exponent - 1) with the rate in 1/s, rate^2 = 2 eps(u):eps(u) + least_rate^2."""

    law: Literal["power_law"] = setting(..., "how the viscosity depends on the shear rate")
    exponent: Positive = setting(..., "below 1: the fluid becomes thinner with the rate", unit="1")
    least_rate: Positive = setting(..., "rate below which the viscosity hardly changes, small in the flow", unit="1/s")

    def of(self, viscosity: float) -> tuple[float, ShearLaw]:
        """(viscosity at rest [Pa s], law) with the given `viscosity`, that at the rate 1/s."""
        from solvers.fluid.settings.shear_law import ShearLaw

        return viscosity * self.least_rate ** (self.exponent - 1.0), ShearLaw(0.0, 1.0 / self.least_rate, self.exponent)


ShearSection = Annotated[
    CarreauSection | PowerLawSection, Field(discriminator="law"), chosen("law", ("carreau", "power_law"))
]


class FluidSection(Section):
    """Incompressible flow in a box around bodies that cut its grid."""

    density: Positive = setting(..., "mass per volume", unit="kg/m^3")
    viscosity: Positive = setting(..., "dynamic viscosity", unit="Pa s")
    shear: ShearSection | None = setting(None, "how the viscosity depends on the shear rate; default: it is constant")
    flow: Literal["navier_stokes", "stokes"] = setting(
        "navier_stokes", "stokes: creeping flow, without the convective term"
    )
    scheme: Literal["bdf2", "bdf2_optimized", "backward_euler", "steady"] = setting(
        "bdf2",
        "time integration; bdf2_optimized: half of the error of bdf2 and hardly any damping, twice the noise of moving "
        "bodies; steady: every step computes the steady flow for the boundary conditions of its time",
    )
    element: Literal["auto", "q1q1", "q2q1"] = setting(
        "auto",
        "q1q1: velocity and pressure of first order; q2q1: velocity of second order; auto: q2q1, but q1q1 where "
        "elastic bodies may touch something in the flow, and with 'narrow_gaps'",
    )
    narrow_gaps: bool = setting(
        False,
        "with q1q1: the flow through gaps below 2.5 cells, which first-order velocities lack, is part of the equation "
        "of continuity; not around thin bodies with cells for each side",
    )
    grid: GridSection = setting(..., "box and cells")
    patches: dict[Name, PatchSection] = setting(
        ..., "conditions on the boundary of the box by name; where patches overlap, the one named last decides"
    )
    bodies: dict[Name, RigidBodySection] = setting(dict, "rigid bodies by name")
    dynamics: RigidDynamics | None = setting(
        None, "time integration of free bodies; default: that of 'structure', or rho_inf 0, which damps like the flow"
    )
    gravity: Vector | None = setting(None, "acceleration of gravity", unit="m/s^2")
    body_force: Vector | None = setting(None, "force per volume", unit="N/m^3")
    initial_velocity: Vector | None = setting(None, "velocity at the start; default: at rest", unit="m/s")

    @model_validator(mode="after")
    def _gaps_of_first_order(self) -> FluidSection:
        if self.narrow_gaps and self.element == "q2q1":
            raise fault("is for q1q1; q2q1 has the flow through narrow gaps without it", "narrow_gaps")
        return self

    @property
    def free_bodies(self) -> dict[str, Free]:
        """Bodies that move freely in the flow, with its gravity where they have none of their own."""
        found = {name: body.free for name, body in self.bodies.items() if body.free is not None}
        return {name: free.with_gravity(self.gravity) for name, free in found.items()}

    def dofs(self, degree: int) -> int:
        """Unknowns of velocities of this degree and of pressure, those inside bodies included."""
        dim = self.grid.dimension
        velocity = pressure = 1
        for cells in self.grid.shape:
            velocity, pressure = velocity * (degree * cells + 1), pressure * (cells + 1)
        return dim * velocity + pressure
