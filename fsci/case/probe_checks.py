"""Checks of `probes` and `verify` against the rest of the case."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import product

from fsci.case.case import Case
from fsci.case.errors import did_you_mean, listed
from fsci.case.fluid import FluidSection
from fsci.case.grid import GridSection
from fsci.case.material import has_mass
from fsci.case.mesh_checks import Mistake, length_mistakes, surface_mistakes
from fsci.case.probes import RESERVED_COLUMNS, PlaneSection, Probe, Reference
from fsci.case.structure import StructureSection
from fsci.case.verify import (
    BODY_COLUMN,
    CONTACT_COLUMNS,
    COUPLING_COLUMNS,
    FIELD_COLUMNS,
    FRICTION_COLUMNS,
    RUN_COLUMNS,
    SEEPAGE_COLUMN,
)
from fsci.case.yaml_text import Keys


def field_of(case: Case, probe: Probe) -> str | None:
    """The field that a probe measures: structure or fluid; None if the case leaves it open or has none."""
    if probe.field is not None:
        return probe.field if probe.field in probe.fields and getattr(case, probe.field) is not None else None
    there = [name for name in probe.fields if getattr(case, name) is not None]
    if "rigid" in there and probe.body in (case.rigid or {}):
        return "rigid"
    if probe.body is None and len(there) > 1:
        there = [name for name in there if name != "rigid"]
    if len(there) == 2 and probe.body is not None:  # of a point in a body, or of its volume
        return "structure"
    return there[0] if len(there) == 1 else None


def probe_mistakes(case: Case) -> Iterator[Mistake]:
    """Mistakes in all probes."""
    for name, probe in case.probes.items():
        keys: Keys = ("probes", name)
        if set(probe.columns(name, 3)) & set(RESERVED_COLUMNS):
            yield keys, f"a probe cannot be called '{name}': history.csv has a column of this name"
        yield from length_mistakes(probe.at, case.dimension, (*keys, "at"))
        pairs = [*([] if case.contact is None else case.contact.pairs), *possible_walls(case)]
        found_later = case.contact is not None and case.contact.bodies is not None
        if probe.pair is not None and probe.pair not in pairs and not found_later:
            yield (*keys, "pair"), f"unknown pair '{probe.pair}'{did_you_mean(probe.pair, pairs)}"
        match field_of(case, probe):
            case "structure" if case.structure is not None:
                yield from _of_structure(case.structure, name, probe)
            case "fluid" if case.fluid is not None:
                yield from _of_fluid(case, case.fluid, name, probe)
            case "rigid" if case.rigid is not None:
                yield from _of_rigid(case, case.rigid, name, probe)
            case _:
                yield from _of_none(case, name, probe)


def _of_rigid(case: Case, rigid: Collection[str], name: str, probe: Probe) -> Iterator[Mistake]:
    keys: Keys = ("probes", name)
    if probe.on is None:
        if probe.body not in rigid:
            hint = did_you_mean(probe.body or "", rigid)
            yield keys, f"'{name}' is measured on a free body: name it as 'body'{hint}"
        return
    names = [*(() if case.contact is None else case.contact.obstacles)]
    names += [*case.fluid.bodies, *case.fluid.patches] if case.fluid is not None else []
    given = [one for one in names if one not in rigid]
    if probe.on not in given:
        yield (*keys, "on"), f"there is no obstacle, given body or patch '{probe.on}'{did_you_mean(probe.on, given)}"
    if probe.body is not None and probe.body not in rigid:
        yield (*keys, "body"), f"unknown free body '{probe.body}'{did_you_mean(probe.body, rigid)}"


def _of_none(case: Case, name: str, probe: Probe) -> Iterator[Mistake]:
    there = [field for field in probe.fields if getattr(case, field) is not None]
    if len(there) == 2 and probe.field is None:
        yield ("probes", name), f"missing setting 'field' in '{name}': there are {listed(there, 'and')}"
    elif probe.field is not None and probe.field not in probe.fields:
        yield ("probes", name, "field"), f"the {probe.field} has no such quantity '{probe.quantity}'"
    else:
        needed = probe.field or probe.fields[0]
        yield ("probes", name, "quantity"), f"quantity '{probe.quantity}' needs the section '{needed}'"


def _of_structure(structure: StructureSection, name: str, probe: Probe) -> Iterator[Mistake]:
    keys, bodies = ("probes", name), structure.bodies
    if probe.minus is not None:
        yield (*keys, "minus"), "'minus' is for points of the fluid"
    if probe.body is None and len(bodies) > 1 and probe.place not in ("", "pair"):
        yield keys, f"missing setting 'body' in '{name}': there are several bodies ({', '.join(bodies)})"
        return
    if probe.body is not None and probe.body not in bodies:
        yield (*keys, "body"), f"unknown body '{probe.body}'{did_you_mean(probe.body, bodies)}"
        return
    measured = [bodies[probe.body]] if probe.body else list(bodies.values())
    if probe.on is not None:
        yield from surface_mistakes(measured[0].mesh, probe.on, (*keys, "on"))
    needs = probe.measured.needs
    if "dynamics" in needs and structure.dynamics is None:
        yield (*keys, "quantity"), f"quantity '{probe.quantity}' needs 'dynamics' in 'structure'"
    if "density" in needs and not all(has_mass(body.material) for body in measured):
        yield (*keys, "quantity"), f"quantity '{probe.quantity}' needs the 'density' of the material"


def _of_fluid(case: Case, fluid: FluidSection, name: str, probe: Probe) -> Iterator[Mistake]:
    keys, grid = ("probes", name), fluid.grid
    bodies = [*fluid.bodies, *case.elastic_bodies]
    if "body" not in probe.measured.needs or probe.on is not None:
        if probe.body is not None:
            yield (*keys, "body"), f"quantity '{probe.quantity}' of the fluid is not measured on a body"
    elif probe.body is not None and probe.body not in bodies:
        yield (*keys, "body"), f"unknown body '{probe.body}'{did_you_mean(probe.body, bodies)}"
    elif not bodies:
        yield (*keys, "quantity"), f"quantity '{probe.quantity}' needs a body in the flow"
    for place in ("on", "through"):
        patch = getattr(probe, place)
        if patch is not None and patch not in fluid.patches:
            yield (*keys, place), f"unknown patch '{patch}'{did_you_mean(patch, fluid.patches)}"
    if probe.quantity == "outlet_pressure" and (through := fluid.patches.get(probe.through or "")):
        if through.outlet is None:
            yield (*keys, "through"), f"the patch '{probe.through}' is neither a 'resistance' nor a 'windkessel'"
    if probe.quantity == "driving_force" and (through := fluid.patches.get(probe.through or "")):
        if through.rate is None:
            yield (*keys, "through"), f"the patch '{probe.through}' is not periodic with a 'rate'"
    if probe.reference is not None:
        yield from _reference(probe.reference, grid.dimension, (*keys, "reference"))
    if probe.plane is not None:
        yield from _plane(probe.plane, grid, (*keys, "plane"))
    if probe.box is not None:
        yield from _box(probe.box, grid, (*keys, "box"))
    yield from length_mistakes(probe.about, grid.dimension, (*keys, "about"))
    yield from length_mistakes(probe.minus, grid.dimension, (*keys, "minus"))
    for key in ("at", "minus"):
        point = getattr(probe, key)
        inside = zip(grid.start, point or (), grid.to, strict=False)
        if point is not None and not all(low <= x <= high for low, x, high in inside):
            place = ", ".join(f"{x:g}" for x in point)
            yield (*keys, key), f"the point ({place}) is outside of the fluid's box"


def _plane(plane: PlaneSection, grid: GridSection, keys: Keys) -> Iterator[Mistake]:
    wrong = [
        *length_mistakes(plane.point, grid.dimension, (*keys, "point")),
        *length_mistakes(plane.normal, grid.dimension, (*keys, "normal")),
    ]
    yield from wrong
    if wrong:
        return
    if not any(plane.normal):
        yield (*keys, "normal"), "the normal of a plane must not be zero"
        return
    corners = product(*zip(grid.start, grid.to, strict=True))
    sides = [sum(n * (x - p) for n, x, p in zip(plane.normal, at, plane.point, strict=True)) for at in corners]
    if not min(sides) < 0.0 < max(sides):
        yield keys, "the plane does not pass through the inside of the fluid's box; on its faces are patches: 'through'"


def _box(corners: tuple[tuple[float, ...], ...], grid: GridSection, keys: Keys) -> Iterator[Mistake]:
    for end, corner in enumerate(corners):
        if len(corner) != grid.dimension:
            yield (*keys, end), f"a corner must have {grid.dimension} entries in {grid.dimension}D, not {len(corner)}"
            return
    for axis, low, high in zip("xyz", *corners, strict=False):
        if not low < high:
            yield keys, f"give the lowest corner first: along {axis} {low:g} is not below {high:g}"
            return
    if not all(a < high and b > low for a, b, low, high in zip(*corners, grid.start, grid.to, strict=True)):
        yield keys, "this box is outside of that of the fluid"


def _reference(reference: Reference, dimension: int, keys: Keys) -> Iterator[Mistake]:
    wanted, other = ("length", "area") if dimension == 2 else ("area", "length")
    if getattr(reference, wanted) is None:
        yield keys, f"coefficients in {dimension}D need the setting '{wanted}'"
    if getattr(reference, other) is not None:
        yield (*keys, other), f"coefficients in {dimension}D refer to '{wanted}', not '{other}'"
    directions = [(key, getattr(reference, key)) for key in ("drag", "lift")]
    for key, direction in directions:
        yield from length_mistakes(direction, dimension, (*keys, key))
        if direction is not None and not any(direction):
            yield (*keys, key), f"the direction of the {key} must not be zero"
    drag, lift = (direction for _, direction in directions)
    if drag is not None and lift is None and dimension == 3:
        yield keys, "the directions of drag and lift go together in 3D: give both"
    elif lift is not None and len(lift) == dimension and any(lift):
        along = drag if drag is not None and len(drag) == dimension else (1.0, 0.0, 0.0)[:dimension]
        both = sum(a * b for a, b in zip(along, lift, strict=True))
        if abs(both) > 1e-9 * sum(a * a for a in along) ** 0.5 * sum(b * b for b in lift) ** 0.5:
            yield (*keys, "lift"), "the direction of the lift must be at a right angle to that of the drag"


def known_columns(case: Case) -> list[str]:
    """Columns of history.csv and counters, as far as the case file alone tells them.

    Pairs that the program finds and pockets of the fluid have more.
    """
    columns = [column for name, probe in case.probes.items() for column in probe.columns(name, case.dimension or 3)]
    columns += RUN_COLUMNS
    columns += [column for field, column in FIELD_COLUMNS.items() if getattr(case, field) is not None]
    if case.fluid is not None and (case.fluid.bodies or case.coupling is not None):
        columns.append(BODY_COLUMN)
    if case.coupling is not None:
        columns += COUPLING_COLUMNS
    if case.rigid is not None and not case.contact_off:
        columns += [f"contact.on_{name}.{axis}" for name in case.rigid for axis in "xyz"[: case.dimension or 3]]
        columns.append(CONTACT_COLUMNS[0])
    if case.contact is not None:
        columns += [f"contact.{name}.{axis}" for name in case.contact.pairs for axis in "xyz"[: case.dimension or 3]]
        columns += CONTACT_COLUMNS
        columns += [SEEPAGE_COLUMN] if case.contact.film.closed == "seeping" else []
        if any(pair.law in ("coulomb", "tresca") for pair in case.contact.complete_pairs.values()):
            columns += FRICTION_COLUMNS
    return columns + _of_walls(case)


def verify_mistakes(case: Case) -> Iterator[Mistake]:
    """Mistakes in all checks: columns that the run does not have, times outside of the run."""
    columns = known_columns(case)
    for i, check in enumerate(case.verify):
        keys: Keys = ("verify", i)
        found_later = case.contact is not None and case.contact.bodies is not None and check.value[:8] == "contact."
        found_later |= case.fluid is not None and check.value.startswith("fluid.pocket_")
        if check.value not in columns and not found_later:
            hint = did_you_mean(check.value, columns)
            yield (*keys, "value"), f"there is no value '{check.value}'{hint}"
        if check.start is not None and not case.time.start <= check.start < case.time.end:
            span = f"{case.time.start:g} to {case.time.end:g}"
            yield (*keys, "from"), f"'from' must be a time of the run, {span}, not {check.start:g}"


def possible_walls(case: Case) -> list[str]:
    """Names of the pairs that elastic bodies have with faces of the box, also with open ones."""
    if case.fluid is None or case.coupling is None or case.contact_off:
        return []
    faces = [(name, face) for name, patch in case.fluid.patches.items() for face in patch.on]
    names = [f"{name}_{face[0]}_{'low' if face[1] == '-' else 'high'}" for name, face in faces]
    return [f"{body}_{name}" for body in case.elastic_bodies for name in names]


def _of_walls(case: Case) -> list[str]:
    """Columns of pairs with walls."""
    pairs = possible_walls(case)
    columns = [f"contact.{pair}.{axis}" for pair in pairs for axis in "xyz"[: case.dimension or 3]]
    return [*(CONTACT_COLUMNS if pairs else ()), *columns]
