"""The whole case: all sections, and the file they come from."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pydantic import PrivateAttr

from fsci.case.contact import ContactSection
from fsci.case.coupling import Coupling
from fsci.case.curve import Curve, CurveName
from fsci.case.document import Document, override
from fsci.case.errors import CaseError, Place
from fsci.case.fluid import FluidSection
from fsci.case.free_body import Free
from fsci.case.output import Output
from fsci.case.probes import Probe
from fsci.case.section import Section, setting
from fsci.case.shapes import Shape
from fsci.case.solver import Solver
from fsci.case.structure import BodySection, StructureSection
from fsci.case.time import Time
from fsci.case.units import Units
from fsci.case.values import Name, Text
from fsci.case.verify import Check


class Case(Section):
    """One simulation of structure, fluid, contact, or all of them."""

    title: Text = setting("", "title of the case, for pictures and tables")
    units: Units = setting(Units, "units of all numbers")
    time: Time = setting(..., "time interval and steps")
    curves: dict[CurveName, Curve] = setting(dict, "functions that expressions may call, by name")
    structure: StructureSection | None = setting(None, "elastic bodies")
    fluid: FluidSection | None = setting(None, "incompressible flow")
    coupling: Coupling | None = setting(None, "how fluid and structure are solved together")
    contact: ContactSection | None = setting(None, "surfaces that may touch")
    probes: dict[Name, Probe] = setting(dict, "quantities that every step records, by name")
    output: Output = setting(Output, "which files are written, and how often")
    verify: tuple[Check, ...] = setting(tuple, "results that the run must reach")
    solver: Solver = setting(Solver, "how equations are solved")

    _document: Document = PrivateAttr()
    _places: Document | None = PrivateAttr(default=None)  # whose positions messages give; None: those of the document
    _warnings: tuple[str, ...] = PrivateAttr(default=())
    _meshes: dict[str, str] = PrivateAttr(default_factory=dict)

    @property
    def path(self) -> Path:
        """The case file, as the user gave it."""
        return (self._places or self._document).path

    @property
    def folder(self) -> Path:
        """The folder that paths in the case file are relative to."""
        return self._document.path.parent

    @property
    def settings(self) -> dict[str, Any]:
        """What the file says, overrides applied; not to be changed."""
        return dict(self._document.data)

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
        named = self.elastic_bodies if self.contact.bodies == "all" else self.contact.bodies or ()
        sides = [side for pair in self.contact.pairs.values() for _, side in pair.sides]
        return {*named, *(side.body for side in sides if side.body is not None)}

    @property
    def rigid(self) -> dict[str, Free] | None:
        """Rigid bodies that the flow moves; None without any."""
        return (self.fluid.free_bodies or None) if self.fluid is not None else None

    @property
    def dimension(self) -> int | None:
        """2 or 3 by the grid of the fluid or a built-in mesh, else None: mesh files are not read here."""
        if self.fluid is not None:
            return self.fluid.grid.dimension
        meshes: list[Any] = [body.mesh for body in self.elastic_bodies.values()]
        return next((mesh.dimension for mesh in meshes if isinstance(mesh, Shape)), None)

    def with_places_of(self, other: Case) -> Case:
        """The same case, whose messages give positions in the file of another one of the same settings."""
        case = self.model_copy()
        case._places = other._document
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
