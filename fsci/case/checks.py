"""Mistakes that show only between settings: names that must exist, lengths of vectors, data that a setting needs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from fsci.case.case import Case
from fsci.case.contact import Contact, Side
from fsci.case.errors import did_you_mean
from fsci.case.mesh import FileMesh, Mesh, Shape
from fsci.case.probes import RESERVED
from fsci.case.structure import Body
from fsci.case.verify import CONTACT_COLUMNS, RUN_COLUMNS
from fsci.case.yaml_text import Keys

Mistake = tuple[Keys, str]  #: path of the setting, message

VECTORS = ("gravity", "body_force", "initial_displacement", "initial_velocity")
NEEDS_MASS = ("momentum", "angular_momentum", "mass", "centre")


def mistakes(case: Case) -> Iterator[Mistake]:
    """All of them."""
    yield from _plane(case)
    for name, body in case.structure.bodies.items():
        keys: Keys = ("structure", "bodies", name)
        yield from _mesh(case, body, (*keys, "mesh"))
        yield from _surfaces(body, keys)
        yield from _vectors(case, body, keys)
        yield from _needs(case, body, keys)
    if case.contact is not None:
        yield from _contact(case, case.contact)
    yield from _probes(case)
    yield from _verify(case)


def _plane(case: Case) -> Iterator[Mistake]:
    structure = case.structure
    if case.dimension == 3 and "plane" in structure.model_fields_set:
        yield ("structure", "plane"), "'plane' is for 2D, but the mesh is 3D"
    elif structure.plane == "stress":
        for name, body in structure.bodies.items():
            if body.material.law != "st_venant_kirchhoff":
                keys = ("structure", "bodies", name, "material", "law")
                yield keys, f"plane stress needs the law 'st_venant_kirchhoff', not '{body.material.law}'"


def _mesh(case: Case, body: Body, keys: Keys) -> Iterator[Mistake]:
    mesh, dimension = body.mesh, case.dimension
    if isinstance(mesh, Shape):
        if mesh.dimension != dimension:
            yield (*keys, "shape"), f"this shape is {mesh.dimension}D, but another body is {dimension}D"
        if body.region is not None:
            yield (*keys[:-1], "region"), "'region' is for mesh files; a built-in shape is one region"
    else:
        yield from _file(mesh, case.folder, keys)
    for i, rotation in enumerate(mesh.rotate):
        at = (*keys, "rotate", i)
        if rotation.axis is None and dimension == 3:
            yield at, "a rotation in 3D needs the setting 'axis'"
        elif rotation.axis is not None and dimension == 2:
            yield at, "a rotation in 2D has no 'axis'"
        elif rotation.axis is not None and not any(rotation.axis):
            yield at, "the axis of a rotation must not be zero"
    if mesh.translate is not None:
        yield from _length(mesh.translate, dimension, (*keys, "translate"))


def _file(mesh: FileMesh, folder: Path, keys: Keys) -> Iterator[Mistake]:
    path = folder / mesh.file
    try:
        found = path.is_file()
    except (OSError, ValueError):  # a name too long, or with a zero byte
        found = False
    if not found:
        yield (*keys, "file"), f"mesh file '{mesh.file}' not found in {folder.absolute()}"
    if path.suffix != ".geo":
        for name in ("order", "parameters"):
            if name in mesh.model_fields_set:
                yield (*keys, name), f"'{name}' is for .geo files; '{mesh.file}' has its own"


def _surfaces(body: Body, keys: Keys) -> Iterator[Mistake]:
    for kind in ("supports", "tractions", "pressures"):
        for i, item in enumerate(getattr(body, kind)):
            for j, name in enumerate(item.on):
                yield from _surface(body.mesh, name, (*keys, kind, i, "on", j))


def _surface(mesh: Mesh, name: str, keys: Keys) -> Iterator[Mistake]:
    if isinstance(mesh, Shape) and name not in mesh.surfaces:
        there = ", ".join(mesh.surfaces)
        hint = did_you_mean(name, mesh.surfaces)
        hint = f"{hint} (available: {there})" if hint.startswith(";") else hint
        yield keys, f"'{mesh.shape}' has no surface '{name}'{hint}"  # type: ignore[attr-defined]


def _vectors(case: Case, body: Body, keys: Keys) -> Iterator[Mistake]:
    for name in VECTORS:
        yield from _length(getattr(body, name), case.dimension, (*keys, name))
    for i, support in enumerate(body.supports):
        yield from _length(support.displacement, case.dimension, (*keys, "supports", i, "displacement"))
    for i, traction in enumerate(body.tractions):
        yield from _length(traction.value, case.dimension, (*keys, "tractions", i, "value"))


def _length(vector: tuple[object, ...] | None, dimension: int | None, keys: Keys) -> Iterator[Mistake]:
    if vector is not None and dimension is not None and len(vector) != dimension:
        yield keys, f"'{keys[-1]}' must have {dimension} entries in {dimension}D, not {len(vector)}"


def _needs(case: Case, body: Body, keys: Keys) -> Iterator[Mistake]:
    dynamic = case.structure.dynamics is not None
    reason = "gravity" if body.gravity else "dynamics" if dynamic else ""
    if reason and body.material.density is None:
        yield (*keys, "material"), f"missing setting 'density' in 'material': {reason} needs it"
    if body.initial_velocity and not dynamic:
        yield (*keys, "initial_velocity"), "'initial_velocity' needs 'dynamics' in 'structure'"


def _contact(case: Case, contact: Contact) -> Iterator[Mistake]:
    if not contact.pairs:
        yield ("contact", "pairs"), "'pairs' needs at least one pair"
    for name, obstacle in contact.obstacles.items():
        keys: Keys = ("contact", "obstacles", name)
        yield from _length(obstacle.motion, case.dimension, (*keys, "motion"))
        yield from _surface(obstacle.mesh, obstacle.on, (*keys, "on"))
    for name, pair in contact.pairs.items():
        for side in ("slave", "master"):
            yield from _side(case, contact, getattr(pair, side), ("contact", "pairs", name, side))
        if pair.slave == pair.master:
            yield ("contact", "pairs", name, "master"), "a surface cannot touch itself: name another master"


def _side(case: Case, contact: Contact, side: Side, keys: Keys) -> Iterator[Mistake]:
    bodies = case.structure.bodies
    if side.body is None:
        if side.obstacle not in contact.obstacles:
            hint = did_you_mean(side.obstacle or "", contact.obstacles)
            yield (*keys, "obstacle"), f"unknown obstacle '{side.obstacle}'{hint}"
    elif side.body not in bodies:
        yield (*keys, "body"), f"unknown body '{side.body}'{did_you_mean(side.body, bodies)}"
    elif side.on is not None:
        yield from _surface(bodies[side.body].mesh, side.on, (*keys, "on"))


def _probes(case: Case) -> Iterator[Mistake]:
    bodies = case.structure.bodies
    for name, probe in case.probes.items():
        keys: Keys = ("probes", name)
        if set(probe.columns(name, 3)) & set(RESERVED):
            yield keys, f"a probe cannot be called '{name}': history.csv has a column of this name"
        if probe.body is None and len(bodies) > 1 and (probe.at is not None or probe.on is not None):
            yield keys, f"missing setting 'body' in '{name}': there are several bodies ({', '.join(bodies)})"
            continue
        if probe.body is not None and probe.body not in bodies:
            yield (*keys, "body"), f"unknown body '{probe.body}'{did_you_mean(probe.body, bodies)}"
            continue
        measured = [bodies[probe.body]] if probe.body else list(bodies.values())
        if probe.at is not None:
            yield from _length(probe.at, case.dimension, (*keys, "at"))
        if probe.on is not None:
            yield from _surface(measured[0].mesh, probe.on, (*keys, "on"))
        if probe.quantity in ("velocity", "acceleration") and case.structure.dynamics is None:
            yield (*keys, "quantity"), f"quantity '{probe.quantity}' needs 'dynamics' in 'structure'"
        if probe.quantity in NEEDS_MASS and any(body.material.density is None for body in measured):
            yield (*keys, "quantity"), f"quantity '{probe.quantity}' needs the 'density' of the material"


def _verify(case: Case) -> Iterator[Mistake]:
    columns = [column for name, probe in case.probes.items() for column in probe.columns(name, case.dimension or 3)]
    columns += RUN_COLUMNS
    if case.contact is not None:
        columns += [f"contact.{name}.{axis}" for name in case.contact.pairs for axis in "xyz"[: case.dimension or 3]]
        columns += CONTACT_COLUMNS
    for i, check in enumerate(case.verify):
        keys: Keys = ("verify", i)
        if check.value not in columns:
            hint = did_you_mean(check.value, columns)
            yield (*keys, "value"), f"there is no value '{check.value}'{hint}"
        if check.start is not None and not case.time.start <= check.start < case.time.end:
            span = f"{case.time.start:g} to {case.time.end:g}"
            yield (*keys, "from"), f"'from' must be a time of the run, {span}, not {check.start:g}"
