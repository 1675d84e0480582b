"""The scheme of a flow whose given velocities may jump."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fsci.case import Case
from fsci.case.velocity_jumps import velocity_jumps
from solvers.api import Scheme

if TYPE_CHECKING:
    from coupling.jumps import Restarting


def at_jumps(case: Case, scheme: Restarting) -> Scheme:
    """The scheme, with steps that end where velocities jump."""
    jumps = velocity_jumps(case) if scheme.can_start else ()
    if not jumps:
        return scheme
    from coupling.jumps import AtJumps

    return AtJumps(scheme, jumps)
