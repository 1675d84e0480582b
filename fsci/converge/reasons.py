"""What a case or its run has that makes its error fall slowly, or not by a law."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fsci.case import Case
from fsci.meshes.curved import outward_edges
from fsci.meshes.of_case import read_body, read_rigid_body
from fsci.running.history import History

#: Steps until a flow or a body that starts at once has forgotten how; all that moves in `cases/` has as many or more.
STEPS_TO_FORGET = 10
#: Distance from the boundary of the box, over its size, up to which an edge is on it: mesh files have seven digits.
ON_THE_BOX = 1e-6


def first_order(case: Case, history: History, summary: Mapping[str, Any]) -> list[str]:
    """Reasons for errors of first order."""
    return [*_backward_euler(case), *_corners(case), *_impacts(case, history), *_films(summary)]


def indicative(case: Case, history: History, summary: Mapping[str, Any]) -> list[str]:
    """Reasons to trust no band of a value that levels change."""
    return [*_impacts(case, history), *_films(summary), *_start(case)]


def unseen(fixed: Sequence[str], unchanged: Sequence[str]) -> list[str]:
    """Errors that no level shows.

    `fixed` are bodies from mesh files, the facets of whose curved surfaces stay; `unchanged` are words for sources.
    """
    return [*_files(fixed), *([f"no level changes the {', '.join(unchanged)}"] if unchanged else ())]


def _backward_euler(case: Case) -> Iterator[str]:
    if case.fluid is not None and case.fluid.scheme == "backward_euler":
        yield "the scheme is backward_euler"


def _corners(case: Case) -> Iterator[str]:
    """Edges of bodies that stick out into the flow.

    Around one of 90 degrees velocities are r^0.54 and stresses r^-0.46 (Moffatt, J. Fluid Mech. 18, 1964): forces and
    the flow elsewhere have errors of order 2 x 0.54, in all elements.
    """
    if case.fluid is None:
        return
    low, high = np.array(case.fluid.grid.start), np.array(case.fluid.grid.to)
    inside = ON_THE_BOX * (high - low)
    wetted = {} if case.coupling is None else case.coupling.wetted
    meshes = {name: (read_rigid_body(case, name)[0], body.on) for name, body in case.rigid_surfaces.items()}
    meshes |= {name: (read_body(case, name), wetted.get(name)) for name in case.elastic_bodies}
    for name, (mesh, surfaces) in meshes.items():
        edges = outward_edges(mesh, surfaces)
        if ((edges > low + inside) & (edges < high - inside)).all(axis=1).any():
            yield f"'{name}' has sharp edges in the flow"


def _impacts(case: Case, history: History) -> Iterator[str]:
    """Contact that begins while inertia counts."""
    active = history.get("contact.active", np.zeros(0))
    sections = (case.fluid, case.rigid_section)  # a free obstacle of a statical case has no inertia
    free = any(section is not None and section.free_bodies for section in sections)
    moves = free or (case.structure is not None and case.structure.dynamics is not None)
    if moves and len(active) and active.max() > 0 and (active == 0).any():
        yield "an impact"


def _films(summary: Mapping[str, Any]) -> Iterator[str]:
    """A gap once, whichever of its two sides was measured."""
    cells: dict[frozenset[str], float] = {}
    for found in summary.get("resolution", ()):
        if found["to"] and found["warns"]:
            pair = frozenset((found["body"], found["to"]))
            cells[pair] = min(cells.get(pair, found["cells"]), found["cells"])
    yield from (f"{count:.2g} cells in the film between {' and '.join(sorted(pair))}" for pair, count in cells.items())


def _start(case: Case) -> Iterator[str]:
    flows = case.fluid is not None and case.fluid.scheme != "steady"
    moves = case.structure is not None and case.structure.dynamics is not None
    if (flows or moves) and case.time.steps < STEPS_TO_FORGET:
        yield f"a start: {case.time.steps} steps"


def _files(fixed: Sequence[str]) -> Iterator[str]:
    if fixed:
        yield f"the facets of curved surfaces in mesh files are the same on all levels: {', '.join(fixed)}"
