"""The text of `fsci check` for a valid case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from textwrap import wrap

from fsci.case import Case
from fsci.case.contact import Friction, PairSection
from fsci.case.flow_element import flow_element
from fsci.case.fluid import FluidSection
from fsci.case.mesh import Mesh
from fsci.case.probe_checks import CONTACT_COLUMNS, FRICTION_COLUMNS, known_columns
from fsci.case.shapes import ShapeSection
from fsci.case.solid_order import with_order
from fsci.case.structure import StructureSection
from fsci.meshes.nested import cells_of, fluid_dofs
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh as BodyMesh

Row = tuple[str, str]

VECTOR_PARTS = ("x", "y", "z")
LINE_WIDTH = 120  #: characters of a line of text, longer ones are divided


def summary(
    case: Case,
    meshes: Mapping[str, BodyMesh] = {},
    pairs: Mapping[str, PairSection] = {},
    walls: Mapping[str, Sequence[str]] = {},
) -> str:
    """A few lines: steps, fields and bodies with their size where it is known, pairs of contact, probes, checks.

    `meshes`: of elastic bodies, by name, as far as they were read; `pairs`: also those that the case does not name;
    `walls`: names of the pairs of each elastic body with faces of the box.
    """
    time = case.time
    rows = [
        ("title", case.title),
        (
            "time",
            f"{time.start:g} to {time.end:g} {case.units.time}, {_count(time.steps, 'step')} of {time.shared_step:.6g}",
        ),
    ]
    if case.structure is not None:
        rows += _structure(case, case.structure, meshes)
    if case.fluid is not None:
        rows += _fluid(case, case.fluid)
    else:
        rows += [(f"body {name}", f"{_name(case.rigid_surfaces[name].mesh)}, rigid, free") for name in case.rigid or ()]
    if case.coupling is not None:
        scheme, by = case.coupling.scheme, case.coupling.accelerator
        rows.append(("coupling", scheme if scheme == "monolithic" else f"{scheme}, {by}"))
    rows += [(f"pair {name}", _sides(pair)) for name, pair in pairs.items()]
    rows += [(f"walls of {name}", f"pairs {', '.join(found)}, once it is near") for name, found in walls.items()]
    rows.append(("columns", _columns(case, bool(pairs or walls))))
    if case.verify:
        rows.append(("verify", _count(len(case.verify), "value")))
    width = max(len(word) for word, _ in rows)
    return "\n".join(f"  {word:<{width}}  {_wrapped(text, width + 4)}" for word, text in rows if text)


def _wrapped(text: str, indent: int) -> str:
    """Lists of many names in lines below each other."""
    lines = wrap(text, max(LINE_WIDTH - indent, LINE_WIDTH // 2), break_long_words=False, break_on_hyphens=False)
    return ("\n" + " " * indent).join(lines)


def _columns(case: Case, pairs: bool) -> str:
    """What history.csv will have beside its counters; the columns of pairs have their names."""
    known = [name for name in known_columns(case) if "." in name or name in case.probes]
    columns = [name for name in known if not name.startswith("contact.") or name.startswith("contact.on_")]
    if pairs:
        axes = "xyz"[: case.dimension or 3]
        columns += [f"contact.PAIR.{axis}" for axis in axes] + [
            n for n in known if n in (*CONTACT_COLUMNS, *FRICTION_COLUMNS)
        ]
    families: dict[str, list[str]] = {}
    for name in dict.fromkeys(columns):
        family, _, axis = name.rpartition(".")
        families.setdefault(family if axis in VECTOR_PARTS else name, []).append(axis)
    return ", ".join(
        " .".join([f"{name}.{axes[0]}", *axes[1:]]) if axes[0] in VECTOR_PARTS else name
        for name, axes in families.items()
    )


def _structure(case: Case, structure: StructureSection, meshes: Mapping[str, BodyMesh]) -> Iterator[Row]:
    motion = "static"
    if structure.dynamics is not None:
        rho_inf = structure.dynamics.rho_inf
        motion = "generalised-alpha" + ("" if rho_inf is None else f", rho_inf {rho_inf:g}")
    # a mesh file in space is known only by its mesh
    dimension = next((mesh.points.shape[1] for mesh in meshes.values()), case.dimension)
    yield "structure", motion + (f", plane {structure.plane}" if dimension == 2 else "")
    for name, body in structure.bodies.items():
        text = f"{_name(body.mesh)}, {body.material.law}"
        if isinstance(chosen := with_order(case, name), ShapeSection):
            order = CELL_TYPES[meshes[name].cell_type].degree if name in meshes else chosen.order
            text += f", {_count(chosen.plan.counts[0], 'cell')} (order {order} {chosen.cell})"
        elif name in meshes:
            mesh = meshes[name]
            text += f", {_count(len(mesh.cells), 'cell')} ({mesh.cell_type})"
        yield f"body {name}", text
    dofs = structure_dofs(case, meshes)
    if dofs is not None:
        yield "dofs", f"{dofs:,}"


def structure_dofs(case: Case, meshes: Mapping[str, BodyMesh]) -> int | None:
    """Unknowns of all elastic bodies; None if a mesh file cannot be read."""
    total = 0
    for name in case.elastic_bodies:
        if name in meshes:
            total += meshes[name].points.size
        elif isinstance(mesh := with_order(case, name), ShapeSection):
            total += mesh.plan.counts[1] * mesh.plan.dimension
        else:
            return None
    return total


def _fluid(case: Case, fluid: FluidSection) -> Iterator[Row]:
    flow = "Navier-Stokes" if fluid.flow == "navier_stokes" else "Stokes"
    yield "fluid", f"{flow}, {fluid.scheme.replace('_', ' ')}, {flow_element(case)}"
    cells = " x ".join(f"{count:,}" for count in fluid.grid.shape)
    box = " x ".join(f"[{low:g}, {high:g}]" for low, high in zip(fluid.grid.start, fluid.grid.to, strict=True))
    yield "grid", f"{box}, {cells} cells{_finer(case)}"
    kinds = [f"{name} ({patch.kind.replace('_', ' ')})" for name, patch in fluid.patches.items()]
    yield "patches", ", ".join(kinds)
    for name, body in fluid.bodies.items():
        kind = "free" if body.free else "moved" if body.motion else "at rest"
        kind += ", gravity of the flow" if body.free and body.free.gravity is None and fluid.gravity else ""
        yield f"body {name}", f"{_name(body.mesh)}, rigid, {kind}"
    yield "dofs", f"{fluid_dofs(case):,} with those inside of bodies"


def _finer(case: Case) -> str:
    assert case.fluid is not None
    levels = case.fluid.grid.levels
    return f", in parts halved {_count(levels, 'time')}: {cells_of(case):,} in all" if levels else ""


def _sides(pair: PairSection) -> str:
    sides = [side.obstacle or f"{side.body}.{' + '.join(side.on or ())}" for _, side in pair.sides]
    law, friction = ", tied" if pair.tied else "", pair.friction or Friction()
    law += f", friction {friction.coefficient:g}" if friction.coefficient else ""
    law += f", friction up to {friction.bound:g}" if friction.bound is not None else ""
    return f"{sides[0]} on itself{law}" if pair.itself is not None else f"{sides[0]} (slave) on {sides[1]}{law}"


def _name(mesh: Mesh) -> str:
    return mesh.shape if isinstance(mesh, ShapeSection) else mesh.file


def _count(number: int, word: str) -> str:
    return f"{number:,} {word}" + "s" * (number != 1)
