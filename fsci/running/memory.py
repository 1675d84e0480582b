"""Check whether a case fits into memory, before anything is allocated."""

from __future__ import annotations

import os
from typing import Any

from fsci.case import Case
from fsci.case.flow_element import flow_element
from fsci.case.shapes import ShapeSection
from fsci.case.solid_order import with_order
from fsci.case.yaml_text import Keys

#: Memory [bytes] that an unknown takes at least: its row of a matrix in 2D with its nine neighbours, twice. In 3D with
#: factors or a preconditioner it is up to twenty times as much.
LEAST_PER_UNKNOWN = 2 * 9 * 2 * 12

#: Numbers of unknowns are integers of 32 bits.
MOST_UNKNOWNS = 2**31 - 1


def unknowns(case: Case) -> dict[Keys, int]:
    """Setting that determines the count -> unknowns, as far as no mesh file is needed."""
    found: dict[Keys, int] = {}
    for name in case.elastic_bodies:
        if isinstance(mesh := with_order(case, name), ShapeSection):
            found["structure", "bodies", name, "mesh"] = mesh.plan.counts[1] * mesh.plan.dimension
    if case.fluid is not None:
        found["fluid", "grid"] = case.fluid.dofs(flow_element(case).degree)
    return found


def require_memory(case: Case, comm: Any) -> None:
    """Raises CaseError if there are more unknowns than can be numbered or stored on the machines of `comm`."""
    numbers = unknowns(case)
    machines = dict(comm.allgather((os.uname().nodename, _physical_memory())))
    memory = sum(machines.values())
    total = sum(numbers.values())
    if total > MOST_UNKNOWNS:
        reason = f"more than the {MOST_UNKNOWNS:,} that can be numbered"
    elif total * LEAST_PER_UNKNOWN > memory:
        reason = f"at least {total * LEAST_PER_UNKNOWN / 1e9:.3g} GB, and there are {memory / 1e9:.3g} GB"
    else:
        return
    largest = max(numbers, key=lambda keys: numbers[keys])
    raise case.error(largest, f"the case has {total:,} unknowns: {reason}")


def _physical_memory() -> int:
    """Physical memory of this machine [bytes]."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
