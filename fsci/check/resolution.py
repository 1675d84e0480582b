"""Warnings about cells that are too large for bodies and films, before the flow is known."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case
from fsci.case.contact import PairSection
from fsci.case.flow_element import flow_element
from fsci.case.fluid import Movement
from fsci.case.rigid_motion import rigid_motion
from fsci.check.scene import Keys, Placed, Said, pair_between
from fsci.meshes.nested import read_grid
from fsci.resolution.words import before_the_run
from solvers.fluid.flow.resolution.shape import at_start, walls_of_box
from solvers.fluid.terms.boundary.patch_kinds import PATCH_KINDS
from solvers.mesh.tessellation import tessellate


def coarse(case: Case, bodies: list[Placed], pairs: dict[str, PairSection]) -> Iterator[Said]:
    """What errors rigid bodies and their films had at best, at the start, and of driven ones at the end, too.

    Of elastic bodies it is not known which forces count, nor in the gap of a pair of contact, which contact may close.
    """
    assert case.fluid is not None
    dry = () if case.coupling is None else case.coupling.dry_side
    placed = [body for body in bodies if body.name not in dry]
    periodic = ["xyz".index(patch.on[0][0]) for patch in case.fluid.patches.values() if patch.periodic]
    walls = walls_of_box((patch.on, PATCH_KINDS[patch.kind]) for patch in case.fluid.patches.values())
    keys: dict[str, Keys] = {body.name: body.keys for body in placed}
    driven = {body.name for body in placed if _motion(case, body) is not None}
    films = driven | {body.name for body in placed if body.moves and not body.elastic}
    grid, said = read_grid(case), set()
    start = case.time.start + (case.time.step if case.fluid.scheme == "steady" else 0.0)
    for t in (start, case.time.end) if driven else (start,):
        for body in at_start(grid, walls, [(body.name, _corners(case, body, t)) for body in placed], periodic):
            if body.body not in case.fluid.bodies:
                continue
            for about, text in before_the_run(body, flow_element(case).element, films=body.body in films):
                if about not in said and pair_between(pairs, *about) is None:
                    said.add(about)
                    yield keys[body.body], text


def _corners(case: Case, body: Placed, t: float) -> NDArray[np.float64]:
    facets, nodes = tessellate(body.mesh)
    x = body.mesh.points[nodes]
    motion = _motion(case, body)
    return (x if motion is None else rigid_motion(x, motion, case.time.start, case.time.step)(t)[0])[facets]


def _motion(case: Case, body: Placed) -> Movement | None:
    assert case.fluid is not None
    settings = case.fluid.bodies.get(body.name)
    return None if settings is None else settings.motion
