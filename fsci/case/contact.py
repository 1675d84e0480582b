"""Section `contact`: which surfaces may touch, rigid obstacles, and how contact is enforced."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Discriminator, Tag, model_validator

from fsci.case.fluid import Movement
from fsci.case.free_body import FreeMotion
from fsci.case.mesh import Mesh
from fsci.case.section import Section, fault, setting
from fsci.case.values import (
    EntryCount,
    Name,
    NotNegative,
    OrNone,
    Positive,
    Share,
    Surfaces,
    SwitchOrNotNegative,
    TimeFormula,
    Vector,
)

#: Displacement by components, or a rigid motion.
ObstacleMotion = Annotated[
    Annotated[Movement, Tag("rigid motion")] | Annotated[Vector, Tag("displacement")],
    Discriminator(lambda value: "rigid motion" if isinstance(value, dict | Movement) else "displacement"),
]


class Side(Section):
    """A surface of a body, or an obstacle, which may be a rigid body."""

    body: Name | None = setting(None, "name of the body")
    on: Surfaces | None = setting(None, "name of its surface, or list of names that are one surface together")
    obstacle: Name | None = setting(None, "name of the obstacle, or of a rigid body")

    @model_validator(mode="after")
    def _one_kind(self) -> Side:
        if (self.body is None) == (self.obstacle is None):
            raise fault("give either 'body' and 'on', or 'obstacle'")
        if self.body is not None and self.on is None:
            raise fault("a side of a body needs the setting 'on', the name of its surface", "body")
        if self.obstacle is not None and self.on is not None:
            raise fault(
                "the surface of an obstacle is named in its own section under 'obstacles'; remove 'on' here", "on"
            )
        return self


class Friction(Section):
    """Coulomb's law by a coefficient, or Tresca's by a bound."""

    coefficient: NotNegative | None = setting(
        None, "Coulomb's coefficient: largest tangential traction / pressure", unit="1"
    )
    bound: Positive | None = setting(
        None, "Tresca's bound: largest tangential traction, independent of the pressure", unit="Pa"
    )

    @property
    def some(self) -> bool:
        """There is friction, if only with a coefficient of zero."""
        return self.coefficient is not None or self.bound is not None

    @model_validator(mode="after")
    def _one_law(self) -> Friction:
        if self.coefficient is not None and self.bound is not None:
            raise fault("give either 'coefficient' or 'bound'", "bound")
        return self


class PairSection(Section):
    """Two surfaces that may touch, or one that may touch itself; the slave should be the finer or softer one."""

    slave: Side | None = setting(None, "surface of a body; the contact pressure is an unknown of its nodes")
    master: Side | None = setting(None, "the other surface, of a body or an obstacle")
    itself: Side | None = setting(None, "instead of 'slave' and 'master': a surface that may touch itself", name="self")
    integration: Literal["segments", "elements"] = setting(
        "segments", "segments: exact on each overlap of two facets; elements: fixed points on each slave facet, faster"
    )

    friction: Annotated[Friction | None, OrNone(Friction())] = setting(
        None, "friction law, or none; default: that of 'contact'"
    )
    interference: TimeFormula | None = setting(
        None,
        "overlap of the bodies that their meshes do not show, as of a press fit: contact holds the surfaces of the"
        " meshes so far apart; default: none",
        unit="m",
    )
    adjust: SwitchOrNotNegative = setting(
        False,
        "true: slave nodes that lie in the master's body are moved onto its surface before the run, without strain;"
        " a length: also those that are so near; false: the first step closes the overlap",
    )
    tied: bool = setting(False, "true: the surfaces are joined where they touch at the start")

    @property
    def law(self) -> str:
        """Name of its law, of a file in solvers/contact/law/."""
        if self.tied:
            return "tied"
        if self.friction is None or not self.friction.some:
            return "frictionless"
        return "tresca" if self.friction.coefficient is None else "coulomb"

    @property
    def moves_nodes(self) -> bool:
        """Whether slave nodes are moved onto the master before the run."""
        return self.tied or self.adjust is not False

    @property
    def law_parameters(self) -> tuple[float, ...]:
        """The arguments of the law."""
        given = () if self.tied or self.friction is None else (self.friction.coefficient, self.friction.bound)
        return tuple(value for value in given if value is not None)

    def overlap(self, t: float) -> float:
        """The interference [m] at the time t [s]: by how much the bodies as meshed overlap; zero if none is given."""
        return 0.0 if self.interference is None else float(self.interference(np.zeros((3, 1)), t)[0])

    @property
    def sides(self) -> tuple[tuple[str, Side], tuple[str, Side]]:
        """(setting, surface) of the slave and of the master."""
        if self.itself is not None:
            return ("self", self.itself), ("self", self.itself)
        assert self.slave is not None
        assert self.master is not None
        return ("slave", self.slave), ("master", self.master)

    @model_validator(mode="after")
    def _both_sides(self) -> PairSection:
        if self.itself is not None and (self.slave or self.master) is not None:
            raise fault("give either 'slave' and 'master', or 'self'", "self")
        if self.itself is None and (self.slave is None or self.master is None):
            raise fault("a pair needs 'slave' and 'master', or 'self' for a surface that may touch itself")
        if self.itself is not None and self.tied:
            raise fault("a surface cannot be tied to itself", "tied")
        where, slave = self.sides[0]
        if slave.obstacle is not None:
            raise fault(
                "the slave must be a surface of a body: make the obstacle the master; friction of two rigid bodies is"
                " in 'rigid_pairs'",
                where,
            )
        if self.tied and self.friction is not None and self.friction.some:
            raise fault("tied surfaces do not slide: remove 'friction' or 'tied'", "friction")
        if self.tied and self.interference is not None:
            raise fault("tied surfaces stay where they are: remove 'interference' or 'tied'", "interference")
        if self.interference is not None and (self.interference.constant or 0.0) < 0.0:
            raise fault("a clearance is a gap of the meshes: 'interference' must be at least 0", "interference")
        if self.adjust is not False and (self.tied or self.itself is not None):
            which = "tied surfaces are moved onto each other anyway" if self.tied else "'adjust' needs two surfaces"
            raise fault(f"{which}: remove 'adjust'", "adjust")
        return self


class ObstacleSection(Section):
    """A rigid surface, at rest, moved as given, or free: a tool on which given forces act."""

    mesh: Mesh = setting(..., "mesh file, also of a closed surface (STL, OBJ), or built-in shape that has the surface")
    on: Surfaces | None = setting(
        None,
        "name of the surface, or list of names that are one surface together; default: the whole boundary of the mesh",
    )
    motion: ObstacleMotion | None = setting(
        None, "displacement, or a rigid motion with its rotation; default: at rest", unit="m"
    )
    free: FreeMotion | None = setting(
        None, "instead of 'motion': the solid in the mesh moves under its weight, contact, springs and 'loads'"
    )

    @model_validator(mode="after")
    def _one_kind(self) -> ObstacleSection:
        if self.motion is not None and self.free is not None:
            raise fault("give either 'motion' or 'free', not both", "free")
        return self


class RigidPairSection(Section):
    """Two that may touch, of which one at least is a free rigid body: how they do it."""

    bodies: Annotated[tuple[Name, ...], EntryCount(2, 2)] = setting(
        ...,
        "two names: free rigid bodies, or one of these and a body of given motion, an obstacle, or a closed patch",
    )
    friction: Annotated[Friction | None, OrNone(Friction())] = setting(
        None, "friction law by its coefficient, or none; default: none"
    )


class FilmSection(Section):
    """Fluid between surfaces that touch or nearly do: a layer that lets it pass, or a tight one.

    A layer that lets fluid pass covers the whole surface of bodies in contact pairs; between two of them the layers add
    up.
    """

    transmissivity: NotNegative | None = setting(
        None, "the flux per width in the layer is transmissivity / viscosity * pressure gradient", unit="m^3"
    )
    roughness: NotNegative | None = setting(
        None,
        "instead of 'transmissivity': height of a gap of the same transmissivity, which is roughness^3 / 12",
        unit="m",
    )

    zone: Literal["dry", "wetted", "seeping"] | None = setting(
        None,
        "where contact is closed: dry: no fluid; wetted: fluid with the pressure of the rim;"
        " seeping: fluid passes through it, too, in the layer; default: seeping with a layer, otherwise dry",
    )

    seal: Positive | None = setting(
        None,
        "thickness of a tight layer on contact surfaces of elastic bodies, where the fluid ends: closes the slits that"
        " contact of meshes leaves; default: none",
        unit="m",
    )

    @model_validator(mode="after")
    def _one_of_them(self) -> FilmSection:
        if self.transmissivity is not None and self.roughness is not None:
            raise fault("give either 'transmissivity' or 'roughness', not both", "roughness")
        if self.seal and self.value:
            raise fault(
                "surfaces are either tight or let fluid pass: give 'seal', or 'transmissivity' or 'roughness'", "seal"
            )
        if self.zone == "seeping" and not self.value:
            raise fault("fluid seeps in a layer: give 'transmissivity' or 'roughness'", "zone")
        return self

    @property
    def value(self) -> float:
        """Transmissivity of a surface [m^3]."""
        return (self.roughness or 0.0) ** 3 / 12.0 if self.transmissivity is None else self.transmissivity

    @property
    def closed(self) -> Literal["dry", "wetted", "seeping"]:
        """The fluid in closed contact."""
        return self.zone or ("seeping" if self.value else "dry")


class ContactSection(Section):
    """Contact by dual mortar multipliers."""

    pairs: dict[Name, PairSection] = setting(dict, "pairs of surfaces by name")
    bodies: Literal["all"] | tuple[Name, ...] | None = setting(
        None,
        "all, or names of elastic bodies: the program finds the pairs of their surfaces, also with rigid "
        "bodies and obstacles",
    )
    friction: Annotated[Friction | None, OrNone(Friction())] = setting(
        None,
        "friction law of all pairs without one of their own, also of those that 'bodies' finds and of free rigid bodies"
        " with each other, with bodies of given motion and with walls; default: none",
    )
    restitution: Share = setting(
        0.0,
        "of free rigid bodies: speed away from each other after an impact over that towards each other before",
        unit="1",
    )
    reach: Positive | None = setting(
        None,
        "largest distance of two surfaces at the start that 'bodies' makes a pair; default: any",
        unit="m",
    )
    rigid_pairs: dict[Name, RigidPairSection] = setting(
        dict, "friction of two free rigid bodies, or of one and what it touches, other than that of 'contact'"
    )
    obstacles: dict[Name, ObstacleSection] = setting(dict, "rigid surfaces by name")
    film: FilmSection = setting(
        FilmSection, "rough or porous layer on the surfaces, through which fluid passes; default: none"
    )
    c_n: Positive = setting(1.0, "factor of the complementarity parameter; the result does not depend on it", unit="1")

    @property
    def complete_pairs(self) -> dict[str, PairSection]:
        """The pairs by name, each with its friction: its own, or that of the section; tied surfaces have none."""
        default = self.friction or Friction()
        return {
            name: pair.model_copy(update={"friction": Friction() if pair.tied else default})
            if pair.friction is None
            else pair
            for name, pair in self.pairs.items()
        }
