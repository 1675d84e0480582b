"""The scheme of a flow whose given velocities may jump."""

from __future__ import annotations

from coupling.jumps import AtJumps, Restarting
from fsci.case import Case
from fsci.case.velocity_jumps import velocity_jumps
from solvers.api import Scheme


def at_jumps(case: Case, scheme: Restarting) -> Scheme:
    """The scheme, with steps that end where velocities jump."""
    jumps = velocity_jumps(case) if scheme.can_start else ()
    return AtJumps(scheme, jumps) if jumps else scheme
