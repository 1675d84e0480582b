"""The whole case: all sections, and the file they come from."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import PrivateAttr

from fsci.case.contact import ContactSection
from fsci.case.coupling import Coupling
from fsci.case.curve import Curve, CurveName
from fsci.case.document import Document, override
from fsci.case.errors import CaseError, Place
from fsci.case.fluid import FluidSection
from fsci.case.free_body import FreeMotion
from fsci.case.mesh import Mesh
from fsci.case.output import Output
from fsci.case.probes import Probe
from fsci.case.rigid import RigidSection
from fsci.case.section import Section, setting
from fsci.case.shapes import ShapeSection
from fsci.case.solver import Solver
from fsci.case.structure import BodySection, StructureSection
from fsci.case.time import Time
from fsci.case.units import Units
from fsci.case.values import Name, OrNone, Surfaces, Text
from fsci.case.verify import Check


@dataclass(frozen=True)
class RigidSurface:
    """Where a case describes the closed surface of a rigid body."""

    keys: tuple[str, ...]  #: of its section
    mesh: Mesh
    on: Surfaces | None  #: names of the surfaces that enclose it; None: all of the mesh


class Case(Section):
    """One simulation of structure, fluid, rigid bodies, contact, or all of them."""

    title: Text = setting("", "title of the case, for pictures and tables")
    units: Units = setting(Units, "units of all numbers")
    time: Time = setting(..., "time interval and steps")
    curves: dict[CurveName, Curve] = setting(dict, "functions that expressions may call, by name")
    structure: StructureSection | None = setting(None, "elastic bodies")
    fluid: FluidSection | None = setting(None, "incompressible flow")
    rigid_section: RigidSection | None = setting(
        None, "free rigid bodies without a fluid; in a flow they are 'fluid.bodies' with 'free'", name="rigid"
    )
    coupling: Coupling | None = setting(None, "how fluid and structure are solved together")
    contact: Annotated[ContactSection | None, OrNone()] = setting(
        None,
        "surfaces that may touch; none: free rigid bodies pass walls, other rigid bodies, and each other",
    )
    probes: dict[Name, Probe] = setting(dict, "quantities that every step records, by name")
    output: Output = setting(Output, "which files are written, and how often")
    verify: tuple[Check, ...] = setting(tuple, "results that the run must reach")
    solver: Solver = setting(Solver, "how equations are solved")

    _document: Document = PrivateAttr()
    _places: Document | None = PrivateAttr(default=None)  # whose positions messages give; None: those of the document
    _trusted: bool = PrivateAttr(default=False)
    _warnings: tuple[str, ...] = PrivateAttr(default=())
    _meshes: dict[str, str] = PrivateAttr(default_factory=dict)

    @property
    def contact_off(self) -> bool:
        """The case says `contact: none`."""
        return bool(self.settings.get("contact") == "none")

    @property
    def path(self) -> Path:
        """The case file, as the user gave it."""
        return (self._places or self._document).path

    @property
    def folder(self) -> Path:
        """The folder that paths in the case file are relative to."""
        return self._document.path.parent

    @property
    def name(self) -> str:
        """Name of the file without its endings; of `case.yaml` that of the folder."""
        path = self._document.path.absolute()
        return path.parent.name if path.name == "case.yaml" else path.name.partition(".")[0]

    @property
    def settings(self) -> dict[str, Any]:
        """What the file says, overrides applied; not to be changed."""
        return dict(self._document.data)

    @property
    def trusted(self) -> bool:
        """Whether code of files that the case names may run."""
        return self._trusted

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about implausible settings, with their positions."""
        return self._warnings

    @property
    def meshes(self) -> dict[str, str]:
        """Section of a body or obstacle -> checksum of its mesh, of all meshes that this process has read."""
        return self._meshes

    @property
    def elastic_bodies(self) -> dict[str, BodySection]:
        """The bodies of the structure; none without one."""
        return {} if self.structure is None else self.structure.bodies

    @property
    def bodies_in_contact(self) -> set[str]:
        """Elastic bodies that may touch something."""
        if self.contact is None:
            return set()
        if self.coupling is not None:  # there are walls
            return set(self.elastic_bodies)
        named = self.elastic_bodies if self.contact.bodies == "all" else self.contact.bodies or ()
        sides = [side for pair in self.contact.pairs.values() for _, side in pair.sides]
        return {*named, *(side.body for side in sides if side.body is not None)}

    @property
    def rigid(self) -> dict[str, FreeMotion] | None:
        """Free rigid bodies of the flow, of the section `rigid`, and free obstacles; None without any."""
        found: dict[str, FreeMotion] = {}
        for section in (self.fluid, self.rigid_section):
            found |= section.free_bodies if section is not None else {}
        obstacles = {} if self.contact is None else self.contact.obstacles
        gravity = None if self.rigid_section is None else self.rigid_section.gravity
        found |= {name: one.free.with_gravity(gravity) for name, one in obstacles.items() if one.free is not None}
        return found or None

    @property
    def moving(self) -> set[str]:
        """Names of all bodies that forces move: free and elastic ones."""
        return {*(self.rigid or {}), *self.elastic_bodies}

    @property
    def joined(self) -> set[frozenset[str]]:
        """Free bodies, by twos, that a spring without length joins."""
        return {
            frozenset((name, spring.to.body))
            for name, free in (self.rigid or {}).items()
            for spring in free.springs
            if spring.to is not None and spring.to.body is not None and spring.free_length == 0.0
        }

    @property
    def rigid_surfaces(self) -> dict[str, RigidSurface]:
        """Closed surfaces of rigid bodies: all of the flow, those of the section `rigid`, and free obstacles."""
        fluid = {} if self.fluid is None else self.fluid.bodies
        loose = {} if self.rigid_section is None else self.rigid_section.bodies
        obstacles = {} if self.contact is None else self.contact.obstacles
        return {
            **{name: RigidSurface(("fluid", "bodies", name), body.mesh, body.on) for name, body in fluid.items()},
            **{name: RigidSurface(("rigid", "bodies", name), body.mesh, body.on) for name, body in loose.items()},
            **{
                name: RigidSurface(("contact", "obstacles", name), one.mesh, None)
                for name, one in obstacles.items()
                if one.free is not None
            },
        }

    @property
    def dimension(self) -> int | None:
        """2 or 3 by the grid of the fluid or a built-in mesh, else None: mesh files are not read here."""
        if self.fluid is not None:
            return self.fluid.grid.dimension
        meshes: list[Any] = [body.mesh for body in self.elastic_bodies.values()]
        meshes += [surface.mesh for surface in self.rigid_surfaces.values()]
        return next((mesh.plan.dimension for mesh in meshes if isinstance(mesh, ShapeSection)), None)

    def worded(self, text: str) -> str:
        """A text of a solver with units of the case in place of [length], [volume], ..."""
        return self.units.worded(text, self.dimension or 3)

    def with_places_of(self, other: Case) -> Case:
        """The same case, whose messages give positions in the file of another one of the same settings."""
        case = self.model_copy()
        case._places, case._trusted = other._document, other._trusted
        return case

    def place(self, *keys: str | int) -> Place:
        return (self._places or self._document).place(keys)

    def locate(self, *keys: str | int) -> str:
        """Position of a setting, as case.yaml:12:5; that of the nearest section around it if it is not in the file."""
        return str(self.place(*keys))

    def error(self, keys: tuple[str | int, ...], message: str) -> CaseError:
        """An error about a setting, with its position and line."""
        return CaseError([(self._places or self._document).problem(self.place(*keys), message)])

    def dump(self, changes: Iterable[tuple[str, str]] = ()) -> str:
        """The YAML text of the case with overrides applied, then `changes` of the same form; comments stay."""
        document = self._document
        for dotted, text in changes:
            document = override(document, dotted, text)
        return document.dump()
