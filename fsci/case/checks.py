"""Mistakes that show only between settings: names that must exist, lengths of vectors, data that a setting needs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fsci.case.case import Case
from fsci.case.contact import ContactSection, Side
from fsci.case.coupling_checks import coupling_mistakes
from fsci.case.errors import did_you_mean
from fsci.case.fluid_checks import fluid_mistakes
from fsci.case.material import has_mass
from fsci.case.mesh_checks import Mistake, length_mistakes, mesh_mistakes, surfaces_mistakes
from fsci.case.probe_checks import probe_mistakes, verify_mistakes
from fsci.case.shapes import Shape
from fsci.case.structure import NO_MIXED_SIMPLICES, BodySection, StructureSection
from fsci.case.yaml_text import Keys

VECTORS = ("gravity", "body_force", "initial_displacement", "initial_velocity")


def mistakes(case: Case) -> Iterator[Mistake]:
    """All of them."""
    yield from _sections(case)
    if case.structure is not None:
        yield from _structure(case, case.structure)
    if case.fluid is not None:
        yield from fluid_mistakes(case, case.fluid)
    if case.contact is not None:
        yield from _contact(case, case.contact)
    yield from probe_mistakes(case)
    yield from verify_mistakes(case)


def _sections(case: Case) -> Iterator[Mistake]:
    if case.structure is None and case.fluid is None:
        yield (), "a case needs a section 'structure' or 'fluid'"
    elif case.structure is not None and case.fluid is not None and case.coupling is None:
        yield (
            ("fluid",),
            "'fluid' and 'structure' together need the section 'coupling'; 'coupling: {}' for its defaults",
        )
    if case.coupling is not None:
        yield from coupling_mistakes(case, case.coupling)
    if case.contact is not None and case.structure is None:
        yield ("contact",), "'contact' needs the section 'structure'"


def _structure(case: Case, structure: StructureSection) -> Iterator[Mistake]:
    yield from _plane(case, structure)
    for name, body in structure.bodies.items():
        keys: Keys = ("structure", "bodies", name)
        yield from mesh_mistakes(body.mesh, case.dimension, case.folder, (*keys, "mesh"))
        if isinstance(body.mesh, Shape) and body.region is not None:
            yield (*keys, "region"), "'region' is for mesh files; a built-in shape is one region"
        yield from _element(case, structure, body, keys)
        yield from _surfaces(body, keys)
        yield from _vectors(case, body, keys)
        yield from _needs(case, structure, body, keys)


def _plane(case: Case, structure: StructureSection) -> Iterator[Mistake]:
    if case.dimension == 3 and "plane" in structure.model_fields_set:
        yield ("structure", "plane"), "'plane' is for 2D, but the mesh is 3D"
    elif structure.plane == "stress":
        for name, body in structure.bodies.items():
            if body.material.law != "st_venant_kirchhoff" and body.kinematics == "finite":
                keys = ("structure", "bodies", name, "material", "law")
                yield keys, f"plane stress needs the law 'st_venant_kirchhoff', not '{body.material.law}'"


def _element(case: Case, structure: StructureSection, body: BodySection, keys: Keys) -> Iterator[Mistake]:
    if body.element != "mixed":
        return
    if case.dimension == 2 and structure.plane == "stress":
        yield (*keys, "element"), "'mixed' is not available in plane stress, which does not lock; take 'displacement'"
    elif isinstance(body.mesh, Shape) and body.mesh.cell in ("tri", "tet"):
        yield (*keys, "element"), NO_MIXED_SIMPLICES


def _surfaces(body: BodySection, keys: Keys) -> Iterator[Mistake]:
    for kind in ("supports", "springs", "tractions", "pressures"):
        for i, item in enumerate(getattr(body, kind)):
            yield from surfaces_mistakes(body.mesh, item.on or (), (*keys, kind, i, "on"))
    for kind, word in (("line_forces", "lines"), ("point_forces", "points")):
        for i, item in enumerate(getattr(body, kind)):
            if item.on is not None and isinstance(body.mesh, Shape):
                hint = "; give its position with 'at'" if word == "points" else ""
                yield (*keys, kind, i, "on"), f"a built-in shape has no {word} with names{hint}"


def _vectors(case: Case, body: BodySection, keys: Keys) -> Iterator[Mistake]:
    for name in VECTORS:
        yield from length_mistakes(getattr(body, name), case.dimension, (*keys, name))
    for place, vector in load_vectors(body):
        yield from length_mistakes(vector, case.dimension, (*keys, *place))


def load_vectors(body: BodySection) -> Iterator[tuple[Keys, tuple[Any, ...]]]:
    """Path from a body and value of all vectors of its supports, springs and loads."""
    for kind in ("supports", "springs", "tractions", "line_forces", "point_forces"):
        for i, item in enumerate(getattr(body, kind)):
            for name in ("at", "displacement", "direction", "value"):
                vector = getattr(item, name, None)
                if isinstance(vector, tuple):
                    yield (kind, i, name), vector


def _needs(case: Case, structure: StructureSection, body: BodySection, keys: Keys) -> Iterator[Mistake]:
    dynamic = structure.dynamics is not None
    reason = "gravity" if body.gravity else "dynamics" if dynamic else ""
    if reason and body.material.density is None:
        yield (*keys, "material"), f"missing setting 'density' in 'material': {reason} needs it"
    elif reason and not has_mass(body.material):
        yield (*keys, "material", "density"), f"'density' must be greater than 0: {reason} needs it"
    if body.slip_length and case.fluid is None:
        yield (
            (*keys, "slip_length"),
            "'slip_length' is a property of the flow around the body and needs the section 'fluid'",
        )
    if body.initial_velocity and not dynamic:
        yield (*keys, "initial_velocity"), "'initial_velocity' needs 'dynamics' in 'structure'"


def _contact(case: Case, contact: ContactSection) -> Iterator[Mistake]:
    if not contact.pairs and contact.bodies is None:
        missing: Keys = ("contact", "pairs") if "pairs" in contact.model_fields_set else ("contact",)
        yield missing, "'contact' needs 'pairs', or 'bodies: all' for automatic pairs"
    film = contact.film
    if (film.value or film.seal or film.closed != "dry") and case.fluid is None:
        yield ("contact", "film"), "'film' describes the fluid between surfaces and needs the section 'fluid'"
    for setting in ("friction", "reach"):
        if setting in contact.model_fields_set and contact.bodies is None:
            yield (
                ("contact", setting),
                f"'{setting}' applies only to the pairs that 'bodies' finds; give 'bodies', too, or remove it",
            )
    for i, name in enumerate(() if contact.bodies in (None, "all") else contact.bodies or ()):
        if name not in case.elastic_bodies:
            yield ("contact", "bodies", i), f"unknown body '{name}'{did_you_mean(name, case.elastic_bodies)}"
    for name, obstacle in contact.obstacles.items():
        keys: Keys = ("contact", "obstacles", name)
        yield from length_mistakes(obstacle.motion, case.dimension, (*keys, "motion"))
        yield from surfaces_mistakes(obstacle.mesh, obstacle.on, (*keys, "on"))
        if case.fluid is not None and name in case.fluid.bodies:
            remedy = "remove the obstacle and take the body as master"
            yield keys, f"'{name}' is also the name of a rigid body of the flow; {remedy}"
    for name, pair in contact.pairs.items():
        (_, slave), (_, master) = pair.sides
        for where, side in dict(pair.sides).items():
            yield from _side(case, contact, side, ("contact", "pairs", name, where))
        first = next(other for other in contact.pairs if contact.pairs[other].sides[0][1] == slave)
        for setting in ("friction", "tied"):
            if getattr(contact.pairs[first], setting) != getattr(pair, setting):
                message = f"pair '{first}' has the same slave: both need the same '{setting}'"
                yield ("contact", "pairs", name, *([setting] if setting in pair.model_fields_set else [])), message
        if pair.itself is None and slave.body == master.body and set(slave.on or ()) & set(master.on or ()):
            message = "a surface that may touch itself is not a slave and a master: write 'self: {body, on}'"
            yield ("contact", "pairs", name, "master"), message


def _side(case: Case, contact: ContactSection, side: Side, keys: Keys) -> Iterator[Mistake]:
    bodies = case.elastic_bodies
    if side.body is None:
        rigid = [*contact.obstacles, *([] if case.fluid is None else case.fluid.bodies)]
        if side.obstacle not in rigid:
            hint = did_you_mean(side.obstacle or "", rigid)
            yield (*keys, "obstacle"), f"unknown obstacle '{side.obstacle}'{hint}"
    elif side.body not in bodies:
        yield (*keys, "body"), f"unknown body '{side.body}'{did_you_mean(side.body, bodies)}"
    elif side.on is not None:
        yield from surfaces_mistakes(bodies[side.body].mesh, side.on, (*keys, "on"))
