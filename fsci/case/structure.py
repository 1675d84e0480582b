"""Section `structure`: elastic bodies, how they are held and loaded, and how they move in time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, model_validator

from fsci.case.free_body import PointSpringSection
from fsci.case.loads import (
    ActiveSection,
    LineForceSection,
    PointForceSection,
    PressureSection,
    PreStretchSection,
    TractionSection,
)
from fsci.case.material import Material
from fsci.case.mesh import Mesh
from fsci.case.section import Section, fault, setting
from fsci.case.supports import SpringSection, SupportSection
from fsci.case.values import (
    Name,
    NotNegative,
    Number,
    Positive,
    Share,
    Text,
    Vector,
)

if TYPE_CHECKING:
    from solvers.generalised_alpha import GeneralisedAlpha
    from solvers.structure.time_scheme import TimeScheme

ALPHAS = ("alpha_m", "alpha_f", "beta", "gamma")


class DampingSection(Section):
    """Rayleigh damping: C = mass M + stiffness K, with the stiffness K of the undeformed body."""

    mass: NotNegative = setting(0.0, "factor of the mass matrix", unit="1/s")
    stiffness: NotNegative = setting(0.0, "factor of the stiffness matrix", unit="s")


class DynamicsSection(Section):
    """Generalised-alpha time integration, by rho_inf or by its four parameters."""

    rho_inf: Share | None = setting(
        None,
        "spectral radius at infinite frequency: 1 conserves energy, smaller values damp high frequencies; default 1",
        unit="1",
    )
    alpha_m: Number | None = setting(None, "weight of the acceleration at the start of the step", unit="1")
    alpha_f: Number | None = setting(None, "weight of the forces at the start of the step", unit="1")
    beta: Positive | None = setting(None, "Newmark's beta", unit="1")
    gamma: Positive | None = setting(None, "Newmark's gamma", unit="1")
    predictor: Literal["constant_displacement", "constant_velocity"] = setting(
        "constant_displacement", "predictor: first iterate of Newton's method in a step"
    )
    damping: DampingSection = setting(DampingSection, "Rayleigh damping")

    @model_validator(mode="before")
    @classmethod
    def _one_form(cls, data: Any) -> Any:
        """Check that either rho_inf or all four parameters are given; rho_inf = 1 without any."""
        if not isinstance(data, dict):
            return data
        given = [name for name in ALPHAS if name in data]
        if "rho_inf" in data and given:
            raise fault("give either 'rho_inf' or the four of alpha_m, alpha_f, beta and gamma", given[0])
        if 0 < len(given) < len(ALPHAS):
            absent = [name for name in ALPHAS if name not in given]
            raise fault(f"alpha_m, alpha_f, beta and gamma belong together; missing: {', '.join(absent)}", given[0])
        return data if given or data.get("rho_inf") is not None else data | {"rho_inf": 1.0}

    def generalised_alpha(self) -> GeneralisedAlpha:
        """Its parameters."""
        from solvers.generalised_alpha import GeneralisedAlpha

        alphas: list[Any] = [getattr(self, name) for name in ALPHAS]
        return GeneralisedAlpha(*alphas) if self.rho_inf is None else GeneralisedAlpha.from_rho_inf(self.rho_inf)

    def time_scheme(self) -> TimeScheme:
        """The scheme with these settings."""
        from solvers.structure.dynamics import Damping, Dynamics

        return Dynamics(
            self.generalised_alpha(),
            damping=Damping(self.damping.mass, self.damping.stiffness),
            predictor=self.predictor,
        )


#: Why a body of triangles or tetrahedra cannot have mixed elements.
NO_MIXED_SIMPLICES = (
    "'mixed' is for quadrilaterals and hexahedra; take 'displacement' and second order for triangles and tetrahedra"
)


class BodySection(Section):
    """One elastic body."""

    mesh: Mesh = setting(..., "mesh file or built-in shape")
    region: Text | None = setting(None, "name of the group of cells in the mesh file that is the body")
    material: Material = setting(..., "hyperelastic law")
    element: Literal["auto", "displacement", "mixed"] = setting(
        "auto",
        "mixed: volume ratio and pressure are constant (order 1) or linear (order 2) in each cell, which does not lock "
        "where the volume hardly changes; quadrilaterals and hexahedra only; auto: mixed there if Poisson's ratio is "
        "0.45 or more anywhere, in plane stress displacement",
    )
    kinematics: Literal["finite", "linear"] = setting(
        "finite", "linear: small displacements, Hooke's law with the constants of the material at small strain"
    )
    supports: tuple[SupportSection, ...] = setting(tuple, "prescribed displacements")
    springs: tuple[SpringSection, ...] = setting(tuple, "elastic supports")
    point_springs: tuple[PointSpringSection, ...] = setting(
        tuple, "springs and dampers from points of the body to other points, with 'to'"
    )
    gravity: Vector | None = setting(None, "acceleration of gravity", unit="m/s^2")
    body_force: Vector | None = setting(None, "force per reference volume", unit="N/m^3")
    tractions: tuple[TractionSection, ...] = setting(tuple, "dead loads on surfaces")
    pressures: tuple[PressureSection, ...] = setting(tuple, "follower loads on surfaces")
    active: tuple[ActiveSection, ...] = setting(tuple, "stresses along fibres, as of muscles")
    pre_stretch: tuple[PreStretchSection, ...] = setting(
        tuple, "stretches of the body in its mesh, one after another, of which it would be free without the rest"
    )
    line_forces: tuple[LineForceSection, ...] = setting(tuple, "dead loads along lines, 3D only")
    point_forces: tuple[PointForceSection, ...] = setting(tuple, "dead loads at points")
    slip_length: NotNegative = setting(
        0.0, "Navier slip of the flow around it: slip velocity = slip_length * shear rate; 0: no slip", unit="m"
    )
    initial_displacement: Vector | None = setting(None, "displacement at the start", unit="m")
    initial_velocity: Vector | None = setting(None, "velocity at the start", unit="m/s")


def _not_empty(value: Any) -> Any:
    if value is None:
        raise fault("is empty: write 'dynamics: {}' for its defaults, or remove the line for a static case")
    return value


def some(value: Any) -> Any:
    """The value, unless it is an empty section."""
    if value == {}:
        raise fault("needs at least one body")
    return value


class StructureSection(Section):
    """Elastic bodies of finite deformation."""

    plane: Literal["strain", "stress"] = setting(
        "strain", "2D only: plane strain or plane stress (st_venant_kirchhoff)"
    )
    dynamics: Annotated[DynamicsSection | None, BeforeValidator(_not_empty)] = setting(
        None, "time integration; absent: static, without inertia"
    )
    bodies: Annotated[dict[Name, BodySection], BeforeValidator(some)] = setting(..., "the bodies by name")
