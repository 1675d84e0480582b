"""Mistakes that show only between settings: names that must exist, lengths of vectors, data that a setting needs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fsci.case.case import Case
from fsci.case.contact import ContactSection, Side
from fsci.case.coupling_checks import coupling_mistakes
from fsci.case.errors import did_you_mean
from fsci.case.fluid import Movement
from fsci.case.fluid_checks import fluid_mistakes, movement_mistakes
from fsci.case.free_checks import free_mistakes, spring_mistakes
from fsci.case.material import HolzapfelGasserOgdenSection, OwnLawSection, has_mass
from fsci.case.mesh_checks import Mistake, length_mistakes, mesh_mistakes, surfaces_mistakes
from fsci.case.probe_checks import probe_mistakes, verify_mistakes
from fsci.case.rigid_pair_checks import rigid_pair_mistakes, shared_names
from fsci.case.shapes import ShapeSection
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
        yield from shared_names(case)
    if case.contact is not None:
        yield from _contact(case, case.contact)
    yield from _loose(case)
    yield from probe_mistakes(case)
    yield from verify_mistakes(case)


#: Settings of 'contact' for free rigid bodies.
OF_FREE_BODIES = ("friction", "restitution", "obstacles", "bodies", "rigid_pairs")


def _sections(case: Case) -> Iterator[Mistake]:
    if case.structure is None and case.fluid is None and case.rigid_section is None:
        yield (), "a case needs a section 'structure', 'fluid' or 'rigid'"
    elif case.structure is not None and case.fluid is not None and case.coupling is None:
        yield (
            ("fluid",),
            "'fluid' and 'structure' together need the section 'coupling'; 'coupling: {}' for its defaults",
        )
    if case.coupling is not None:
        yield from coupling_mistakes(case, case.coupling)
    if case.contact is not None and case.structure is None:
        yield from _contact_of_free_bodies(case, case.contact)


def _contact_of_free_bodies(case: Case, contact: ContactSection) -> Iterator[Mistake]:
    """Free bodies find what they touch: without elastic bodies, the section has friction and restitution alone."""
    if case.rigid is None:
        yield ("contact",), "'contact' needs the section 'structure'"
        return
    for name in sorted(contact.model_fields_set - set(OF_FREE_BODIES)):
        yield ("contact", name), f"'{name}' needs the section 'structure': it is not for contact of free bodies"
    if contact.friction is not None and contact.friction.bound is not None:
        yield ("contact", "friction", "bound"), "free rigid bodies have Coulomb's friction: give 'coefficient'"


def _loose(case: Case) -> Iterator[Mistake]:
    """Mistakes of free bodies that are not in a flow."""
    others, free = case.rigid or {}, case.rigid_surfaces
    for name, surface in free.items():
        keys: Keys = surface.keys
        if keys[0] == "fluid":
            continue
        whole = keys if keys[0] == "rigid" else (*keys, "free")
        if case.fluid is not None:
            yield (
                whole,
                "free bodies of a case with 'fluid' are in the flow: put it into 'fluid.bodies', with 'free'; outside"
                " of the box it is dry",
            )
        elif case.structure is not None and case.structure.dynamics is None:
            for setting in ("initial_velocity", "initial_angular_velocity"):
                if getattr(others[name], setting):
                    yield (*whole, setting), f"'{setting}' needs 'dynamics' in 'structure'"
        if name in case.elastic_bodies:
            yield keys, f"'{name}' is already the name of an elastic body; give this rigid body another one"
        if keys[0] == "rigid":
            if case.contact is not None and name in case.contact.obstacles:
                yield keys, f"'{name}' is also the name of an obstacle; give this rigid body another one"
            yield from mesh_mistakes(surface.mesh, case.dimension, case.folder, (*keys, "mesh"))
            yield from surfaces_mistakes(surface.mesh, surface.on or (), (*keys, "on"))
        yield from free_mistakes(others[name], case.dimension, case.moving, whole)
    if case.rigid_section is not None:
        yield from length_mistakes(case.rigid_section.gravity, case.dimension, ("rigid", "gravity"))


def _structure(case: Case, structure: StructureSection) -> Iterator[Mistake]:
    yield from _plane(case, structure)
    for name, body in structure.bodies.items():
        keys: Keys = ("structure", "bodies", name)
        yield from mesh_mistakes(body.mesh, case.dimension, case.folder, (*keys, "mesh"))
        if isinstance(body.mesh, ShapeSection) and body.region is not None:
            yield (*keys, "region"), "'region' is for mesh files; a built-in shape is one region"
        yield from _element(case, structure, body, keys)
        yield from _surfaces(body, keys)
        yield from _vectors(case, body, keys)
        yield from _needs(case, structure, body, keys)
        for i, spring in enumerate(body.point_springs):
            place = (*keys, "point_springs", i)
            yield from spring_mistakes(spring, case.dimension, case.moving, place)
            if spring.to is None:
                yield place, "a spring at a point of an elastic body needs 'to', the other point"


def _plane(case: Case, structure: StructureSection) -> Iterator[Mistake]:
    if case.dimension == 3 and "plane" in structure.model_fields_set:
        yield ("structure", "plane"), "'plane' is for 2D, but the mesh is 3D"
    elif structure.plane == "stress":
        for name, body in structure.bodies.items():
            if body.material.viscous:
                keys = ("structure", "bodies", name, "material", "viscous")
                yield keys, "'viscous' is not available in plane stress, where the thickness would relax, too"
            if body.material.law != "st_venant_kirchhoff" and body.kinematics == "finite":
                keys = ("structure", "bodies", name, "material", "law")
                yield keys, f"plane stress needs the law 'st_venant_kirchhoff', not '{body.material.law}'"


def _element(case: Case, structure: StructureSection, body: BodySection, keys: Keys) -> Iterator[Mistake]:
    if body.kinematics == "linear" and isinstance(body.material, HolzapfelGasserOgdenSection):
        yield (*keys, "material", "law"), "'kinematics: linear' needs an isotropic law, and fibres carry tension only"
    if body.kinematics == "linear" and isinstance(body.material, OwnLawSection):
        yield (*keys, "material", "law"), "'kinematics: linear' needs a law of the program, such as 'neo_hooke'"
    if body.element != "mixed":
        return
    if case.dimension == 2 and structure.plane == "stress":
        yield (*keys, "element"), "'mixed' is not available in plane stress, which does not lock; take 'displacement'"
    elif isinstance(body.mesh, ShapeSection) and body.mesh.cell in ("tri", "tet"):
        yield (*keys, "element"), NO_MIXED_SIMPLICES


def _surfaces(body: BodySection, keys: Keys) -> Iterator[Mistake]:
    for kind in ("supports", "springs", "tractions", "pressures"):
        for i, item in enumerate(getattr(body, kind)):
            yield from surfaces_mistakes(body.mesh, item.on or (), (*keys, kind, i, "on"))
    for kind, word in (("line_forces", "lines"), ("point_forces", "points")):
        for i, item in enumerate(getattr(body, kind)):
            if item.on is not None and isinstance(body.mesh, ShapeSection):
                hint = "; give its position with 'at'" if word == "points" else ""
                yield (*keys, kind, i, "on"), f"a built-in shape has no {word} with names{hint}"


def _vectors(case: Case, body: BodySection, keys: Keys) -> Iterator[Mistake]:
    for name in VECTORS:
        yield from length_mistakes(getattr(body, name), case.dimension, (*keys, name))
    for place, vector in vectors_of(body):
        yield from length_mistakes(vector, case.dimension, (*keys, *place))


def vectors_of(body: BodySection) -> Iterator[tuple[Keys, tuple[Any, ...]]]:
    """Path from a body and value of all vectors of its material, supports, springs and loads."""
    for i, direction in enumerate(getattr(body.material, "fibres", ())):
        yield ("material", "fibres", i), direction
    for kind in ("supports", "springs", "tractions", "active", "pre_stretch", "line_forces", "point_forces"):
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
    without_pairs = case.rigid is not None or case.coupling is not None  # of free bodies, and with walls
    if not contact.pairs and contact.bodies is None and not without_pairs:
        missing: Keys = ("contact", "pairs") if "pairs" in contact.model_fields_set else ("contact",)
        yield missing, "'contact' needs 'pairs', or 'bodies: all' for automatic pairs"
    if "restitution" in contact.model_fields_set and case.rigid is None:
        yield ("contact", "restitution"), "'restitution' is for free rigid bodies, which this case has not"
    yield from rigid_pair_mistakes(case, contact)
    film = contact.film
    if (film.value or film.seal or film.closed != "dry") and case.fluid is None:
        yield ("contact", "film"), "'film' describes the fluid between surfaces and needs the section 'fluid'"
    if contact.reach is not None and contact.bodies is None:
        message = "'reach' applies only to the pairs that 'bodies' finds; give 'bodies', too, or remove it"
        yield ("contact", "reach"), message
    for i, name in enumerate(() if contact.bodies in (None, "all") else contact.bodies or ()):
        if name not in case.elastic_bodies:
            yield ("contact", "bodies", i), f"unknown body '{name}'{did_you_mean(name, case.elastic_bodies)}"
    for name, obstacle in contact.obstacles.items():
        keys: Keys = ("contact", "obstacles", name)
        if isinstance(obstacle.motion, Movement):
            yield from movement_mistakes(obstacle.motion, case.dimension, (*keys, "motion"))
        else:
            yield from length_mistakes(obstacle.motion, case.dimension, (*keys, "motion"))
        yield from surfaces_mistakes(obstacle.mesh, obstacle.on or (), (*keys, "on"))
        if case.fluid is not None and name in case.fluid.bodies:
            remedy = "remove the obstacle and take the body as master"
            yield keys, f"'{name}' is also the name of a rigid body of the flow; {remedy}"
    pairs = contact.complete_pairs
    for name, pair in pairs.items():
        (_, slave), (_, master) = pair.sides
        for where, side in dict(pair.sides).items():
            yield from _side(case, contact, side, ("contact", "pairs", name, where))
        first = next(other for other in pairs if pairs[other].sides[0][1] == slave)
        if pairs[first].tied != pair.tied:
            given = ["tied"] if "tied" in contact.pairs[name].model_fields_set else []
            yield ("contact", "pairs", name, *given), f"pair '{first}' has the same slave: both need the same 'tied'"
        if pair.itself is None and slave.body == master.body and set(slave.on or ()) & set(master.on or ()):
            message = "a surface that may touch itself is not a slave and a master: write 'self: {body, on}'"
            yield ("contact", "pairs", name, "master"), message


def _side(case: Case, contact: ContactSection, side: Side, keys: Keys) -> Iterator[Mistake]:
    bodies = case.elastic_bodies
    if side.body is None:
        rigid = dict.fromkeys([*contact.obstacles, *case.rigid_surfaces])
        if side.obstacle not in rigid:
            hint = did_you_mean(side.obstacle or "", rigid)
            yield (*keys, "obstacle"), f"unknown obstacle '{side.obstacle}'{hint}"
    elif side.body not in bodies:
        yield (*keys, "body"), f"unknown body '{side.body}'{did_you_mean(side.body, bodies)}"
    elif side.on is not None:
        yield from surfaces_mistakes(bodies[side.body].mesh, side.on, (*keys, "on"))
