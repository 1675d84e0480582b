"""Checks of the section `coupling` against the other sections."""

from __future__ import annotations

from collections.abc import Iterator

from fsci.case.case import Case
from fsci.case.coupling import Coupling
from fsci.case.errors import did_you_mean, listed
from fsci.case.mesh_checks import Mistake, surface_mistakes
from fsci.case.yaml_text import Keys
from solvers.fluid.terms.boundary.patch_kinds import PATCH_KINDS


def coupling_mistakes(case: Case, coupling: Coupling) -> Iterator[Mistake]:
    """All of them."""
    for section in ("fluid", "structure"):
        if getattr(case, section) is None and not (section == "structure" and case.rigid):
            yield ("coupling",), f"'coupling' needs the section '{section}'"
    bodies = case.elastic_bodies
    for name, surfaces in coupling.wetted.items():
        if name not in bodies:
            yield ("coupling", "wetted", name), f"unknown body '{name}'{did_you_mean(name, bodies)}"
            continue
        for i, surface in enumerate(surfaces):
            yield from surface_mistakes(bodies[name].mesh, surface, ("coupling", "wetted", name, i))
    yield from _dry_side_mistakes(case, coupling)
    if case.fluid is None or case.structure is None:
        return
    for name in case.fluid.bodies:
        if name in bodies:
            yield (
                ("fluid", "bodies", name),
                f"'{name}' is already the name of an elastic body; give this rigid body another one",
            )
    steady, static = case.fluid.scheme == "steady", case.structure.dynamics is None
    if steady and not static:
        yield (
            ("fluid", "scheme"),
            "a steady flow needs a static structure: remove 'dynamics', or choose the scheme bdf2",
        )
    if static and not steady:
        yield ("fluid", "scheme"), "a flow in time needs 'dynamics' in 'structure', or choose the scheme steady"
    is_open = any(patch.open for patch in case.fluid.patches.values())
    if not is_open and (mistake := level_unknown(case)):
        where, why = mistake
        kinds = listed([name for name, kind in PATCH_KINDS.items() if kind.open])
        yield where, f"the boundary encloses the fluid, and {why}, or give a patch with {kinds}"


def level_unknown(case: Case) -> Mistake | None:
    """Why the coupling does not find the pressure level of enclosed fluid; None if it does."""
    assert case.fluid is not None
    assert case.coupling is not None
    if case.fluid.scheme == "steady":
        return ("fluid", "scheme"), "a steady flow does not determine its pressure: take 'bdf2'"
    if case.coupling.scheme == "partitioned" and case.coupling.accelerator != "iqn":
        return ("coupling", "accelerator"), "relaxation alone does not find its pressure: take 'iqn'"
    return None


def _dry_side_mistakes(case: Case, coupling: Coupling) -> Iterator[Mistake]:
    bodies = case.elastic_bodies
    for name, corners in coupling.dry_side.items():
        keys: Keys = ("coupling", "dry_side", name)
        if name not in bodies:
            yield keys, f"unknown body '{name}'{did_you_mean(name, bodies)}"
        elif case.dimension == 3 and corners != "outside":
            yield keys, "'dry_side' with corners is for 2D only; in 3D 'outside' is for closed surfaces and tubes"
        elif name not in coupling.wetted:
            yield keys, f"say which surface is wet: 'wetted: {{{name}: [..]}}'"
        for i, corner in enumerate(corners if corners != "outside" else ()):
            if len(corner) != 2 and case.dimension == 2:
                yield (*keys, i), f"a corner has 2 entries in 2D, not {len(corner)}"
