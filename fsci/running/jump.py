"""Rigid bodies whose motion has changed: a resumed run goes on from where they are."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fsci.case import Case, CaseError
from fsci.case.errors import Problem
from fsci.case.rigid_motion import rigid_motion
from fsci.meshes.of_case import read_rigid_body
from solvers.api import State

#: Part of the body's size that formulas may differ by where one takes over from another: rounding is below 1e-12, and
#: a distance that matters is above 1e-3.
NO_JUMP = 1e-7


def require_continuous(case: Case, state: State) -> None:
    """Raises CaseError for bodies that are not at the time of a checkpoint where the checkpoint has them."""
    if problems := list(_jumps(case, state)):
        raise CaseError(problems)


def _jumps(case: Case, state: State) -> Iterator[Problem]:
    scheme, time = state["scheme"], float(state["clock"]["time"])
    motions = scheme.get("fluid", scheme).get("motion", {})
    for name, body in ({} if case.fluid is None else case.fluid.bodies).items():
        if body.free is not None:
            continue
        points = read_rigid_body(case, name)[1]
        movement, there = body.motion, np.asarray(motions[name]["x"])
        here = points if movement is None else rigid_motion(points, movement, case.time.start, case.time.step)(time)[0]
        jump = float(np.linalg.norm(here - there, axis=1).max())
        if jump > NO_JUMP * float(np.ptp(points, axis=0).max()):
            remedy = f"'where(t > {time:.12g}, NEW, OLD)', with the formula that it had as OLD"
            message = f"the body would jump by {jump:.3g} at {time:.6g}, the time of the checkpoint: write {remedy}"
            yield from case.error(("fluid", "bodies", name, "motion"), message).problems
