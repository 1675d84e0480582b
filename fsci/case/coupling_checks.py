"""Mistakes in the section `coupling` that show only beside the other sections."""

from __future__ import annotations

from collections.abc import Iterator

from fsci.case.case import Case
from fsci.case.coupling import Coupling
from fsci.case.errors import did_you_mean
from fsci.case.mesh_checks import Mistake, surface_mistakes


def coupling_mistakes(case: Case, coupling: Coupling) -> Iterator[Mistake]:
    """All of them."""
    for section in ("fluid", "structure"):
        if getattr(case, section) is None:
            yield ("coupling",), f"'coupling' needs the section '{section}'"
    bodies = case.elastic_bodies
    for name, surfaces in coupling.wetted.items():
        if name not in bodies:
            yield ("coupling", "wetted", name), f"unknown body '{name}'{did_you_mean(name, bodies)}"
            continue
        for i, surface in enumerate(surfaces):
            yield from surface_mistakes(bodies[name].mesh, surface, ("coupling", "wetted", name, i))
    if case.fluid is None or case.structure is None:
        return
    for name in case.fluid.bodies:
        if name in bodies:
            yield ("fluid", "bodies", name), f"'{name}' is an elastic body already: give this rigid one another name"
    steady, static = case.fluid.scheme == "steady", case.structure.dynamics is None
    if steady and not static:
        yield ("fluid", "scheme"), "a steady flow goes with a static structure: remove 'dynamics', or choose bdf2"
    if static and not steady:
        yield ("fluid", "scheme"), "a flow in time needs 'dynamics' in 'structure', or choose the scheme steady"
