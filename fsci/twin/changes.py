"""Changes of a case that must not change its answer: what its answer changes by is an error, or a defect."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

from fsci.builder.automatic_pairs import with_pairs
from fsci.case import Case
from fsci.case.contact import PairSection
from fsci.case.flow_element import flow_element
from fsci.case.material import OwnLawSection
from fsci.case.mesh import FileMesh
from fsci.meshes.of_case import read_body
from fsci.twin.frames import MIRRORED, TURNED, Coordinates
from fsci.twin.grids import Settings, coarser, low_discrepancy, shifted

#: What a difference means: the error of cells or steps, the scatter by where cells lie, contact that depends on the
#: roles of its surfaces, a defect of the program, or nothing but another problem.
Meaning = Literal["space", "time", "scatter", "roles", "defect", "study"]
SHIFTED_TWINS = 8
#: Twins, those first that find most, and what they cost in 2D over the case; `element` is that of a case with q2q1.
COSTS = {"coarse": 1.0, "scheme": 1.0, "exchange": 1.0, "facets": 1.0, "order": 1.5, "step": 2.0, "element": 0.5}
QUICK_COST = 2.5


@dataclass(frozen=True)
class Twin:
    """The case with some settings changed."""

    name: str
    words: str  #: what is other
    meaning: Meaning
    settings: Settings = ()
    processes: int = 1
    opposite: tuple[str, ...] = ()  #: columns whose values change their sign
    frame: Coordinates | None = None  #: other coordinates


def twins(case: Case) -> list[Twin]:
    """All twins that a case has."""
    found = (_elements, _schemes, _steps, _shifts, _facets, _orders_of_cells, _roles, _orders_of_bodies, _c_n, _frames)
    return [twin for make in found for twin in make(case)] + [Twin("processes", "two processes", "defect", processes=2)]


def quick(all_twins: list[Twin]) -> list[Twin]:
    """One or two that find most and together cost at most QUICK_COST times the case."""
    found = {twin.name: twin for twin in all_twins}
    if "coarse" in found:
        found.pop("element")  # which says the same, for four times the cost
    chosen: list[Twin] = []
    left = QUICK_COST
    for name, cost in COSTS.items():
        if name in found and cost <= left and len(chosen) < 2:
            chosen.append(found[name])
            left -= cost
    return chosen


def _elements(case: Case) -> Iterator[Twin]:
    if case.fluid is None:
        return
    if flow_element(case).element == "q2q1":
        yield Twin("element", "element q1q1", "space", (("fluid.element", "q1q1"),))
        return
    other: Settings = (("fluid.element", "q2q1"), *((("fluid.narrow_gaps", "false"),) * case.fluid.narrow_gaps))
    yield Twin("coarse", "element q2q1, cells twice as large", "space", (*other, *coarser(case.fluid.grid)))
    yield Twin("element", "element q2q1", "space", other)


def _schemes(case: Case) -> Iterator[Twin]:
    settings: list[tuple[str, str]] = []
    words: list[str] = []
    if case.fluid is not None and case.fluid.scheme != "steady":
        other = "bdf2_optimized" if case.fluid.scheme == "bdf2" else "bdf2"
        settings.append(("fluid.scheme", other))
        words.append(other)
    dynamics = None if case.structure is None else case.structure.dynamics
    if dynamics is not None and dynamics.rho_inf is not None:
        settings.append(("structure.dynamics.rho_inf", str(_other_radius(dynamics.rho_inf))))
        words.append(f"rho_inf {_other_radius(dynamics.rho_inf)}")
    if settings:
        yield Twin("scheme", ", ".join(words), "time", tuple(settings))


def _other_radius(rho_inf: float) -> float:
    """A spectral radius with other damping, which the time integration is stable with."""
    return 0.9 if rho_inf < 0.7 else 0.5


def _steps(case: Case) -> Iterator[Twin]:
    if case.fluid is None or case.fluid.scheme != "steady" or case.elastic_bodies:
        yield Twin("step", "half of the step", "time", (("time.step", repr(case.time.shared_step / 2.0)),))


def _shifts(case: Case) -> Iterator[Twin]:
    if case.fluid is None or not (case.fluid.bodies or case.elastic_bodies):
        return
    for number, shares in enumerate(low_discrepancy(case.fluid.grid.dimension, SHIFTED_TWINS), 1):
        words = f"planes moved by {', '.join(f'{share:+.2f}' for share in shares)} cells"
        yield Twin(f"shift_{number}", words, "scatter", shifted(case.fluid.grid, shares.tolist()))


def _facets(case: Case) -> Iterator[Twin]:
    """Rigid bodies and obstacles of built-in shapes: only their surfaces count."""
    obstacles = {} if case.contact is None else case.contact.obstacles
    meshes = {".".join(surface.keys): surface.mesh for surface in case.rigid_surfaces.values()}
    meshes |= {f"contact.obstacles.{name}": obstacle.mesh for name, obstacle in obstacles.items()}
    settings = tuple(
        (f"{name}.mesh.cells", json.dumps([2 * count for count in mesh.cells]))
        for name, mesh in meshes.items()
        if not isinstance(mesh, FileMesh) and not mesh.plan.flat
    )
    if settings:
        yield Twin("facets", "twice as many facets along rigid surfaces", "space", settings)


def _orders_of_cells(case: Case) -> Iterator[Twin]:
    """Bodies of first order from scripts and built-in shapes get cells of second order; other files have their own."""
    from fsci.case.solid_order import chooses_order
    from fsci.meshes.of_case import degree_of_cells

    settings = tuple(
        (f"structure.bodies.{name}.mesh.order", "2")
        for name, body in case.elastic_bodies.items()
        if (chooses_order(body.mesh) or body.mesh.order == 1) and degree_of_cells(case, name) == 1
    )
    if settings:
        yield Twin("order", "elastic bodies of second order", "space", settings)


def _roles(case: Case) -> Iterator[Twin]:
    pairs = _pairs(case)
    own = {} if case.contact is None else case.contact.pairs
    swapped = [name for name in pairs if name not in own or _can_be_swapped(own[name])]
    for name in swapped:
        pairs[name] = {**pairs[name], "slave": pairs[name]["master"], "master": pairs[name]["slave"]}
    if swapped:
        columns = tuple(f"contact.{name}.{axis}" for name in swapped for axis in "xyz")
        settings = (("contact.pairs", json.dumps(pairs)),)
        yield Twin("exchange", "slave and master exchanged", "roles", settings, opposite=columns)


def _pairs(case: Case) -> dict[str, Any]:
    """Pairs as the file says them, and those of elastic bodies that it leaves to the program, with their roles.

    Raises CaseError where meshes of these cannot be read.
    """
    found = dict(_section(case, "contact", "pairs"))
    if case.contact is not None and case.contact.bodies is not None:
        complete = with_pairs(case).contact
        assert complete is not None
        for name, pair in complete.pairs.items():
            if name not in found and _can_be_swapped(pair):
                found[name] = {role: {"body": side.body, "on": list(side.on or ())} for role, side in pair.sides}
    return found


def _can_be_swapped(pair: PairSection) -> bool:
    return pair.itself is None and pair.master is not None and pair.master.body is not None


def _orders_of_bodies(case: Case) -> Iterator[Twin]:
    """Roles stay: of two equal bodies the first one would be the slave."""
    members = {
        "structure.bodies": _section(case, "structure", "bodies"),
        "fluid.bodies": _section(case, "fluid", "bodies"),
        "rigid.bodies": _section(case, "rigid", "bodies"),
        "contact.pairs": _pairs(case),
    }
    left_to_the_program = members["contact.pairs"].keys() - _section(case, "contact", "pairs").keys()
    settings = tuple(
        (name, json.dumps(dict(reversed(some.items()))))
        for name, some in members.items()
        if len(some) > 1 or (name == "contact.pairs" and left_to_the_program)
    )
    if settings:
        yield Twin("reversed", "bodies and pairs in the opposite order", "defect", settings)


def _c_n(case: Case) -> Iterator[Twin]:
    if case.contact is not None and case.structure is not None:
        yield Twin("c_n", "ten times c_n", "defect", (("contact.c_n", repr(10.0 * case.contact.c_n)),))


def _frames(case: Case) -> Iterator[Twin]:
    """Not with laws of the user, whose code may have directions of its own.

    Raises CaseError where only a mesh file says how many dimensions there are, and cannot be read.
    """
    if any(isinstance(body.material, OwnLawSection) for body in case.elastic_bodies.values()):
        return
    dimension = case.dimension or read_body(case, next(iter(case.elastic_bodies))).points.shape[1]
    for frame in (MIRRORED, TURNED):
        yield Twin(frame.name, frame.words, "defect", frame.settings(case, dimension), frame=frame)


def _section(case: Case, *keys: str) -> dict[str, Any]:
    """A section as the file says it; empty if it does not."""
    section: Any = case.settings
    for key in keys:
        section = (section or {}).get(key)
    return section or {}
