"""The element of the flow: q2q1, unless elastic bodies may touch something in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from fsci.case.case import Case


@dataclass(frozen=True)
class FlowElement:
    """The element of a flow, and why if the program has chosen it."""

    element: Literal["q1q1", "q2q1"]
    why: str = ""  #: empty: the case says it

    @property
    def degree(self) -> int:
        """Of velocities."""
        return 1 if self.element == "q1q1" else 2

    def __str__(self) -> str:
        return f"{self.element} ({self.why})" if self.why else self.element


def flow_element(case: Case) -> FlowElement:
    """The element of a case with a flow: what it says, else q2q1, but q1q1 where elastic bodies may touch something.

    For the same error q2q1 takes less time, but films that close between elastic bodies are robust with q1q1 only
    (docs/benchmarks.md).
    """
    assert case.fluid is not None
    if case.fluid.element != "auto":
        return FlowElement(case.fluid.element)
    if case.fluid.narrow_gaps:
        return FlowElement("q1q1", "for narrow_gaps")
    if touching := bodies_that_may_touch(case):
        return FlowElement("q1q1", f"elastic body '{touching[0]}' may touch something in the flow")
    return FlowElement("q2q1", "no elastic body may touch something in the flow")


def bodies_that_may_touch(case: Case) -> list[str]:
    """Elastic bodies in a flow that contact is asked for, or that may reach a wall because nothing holds them."""
    if case.contact_off or case.coupling is None or case.fluid is None:
        return []
    return [name for name in case.elastic_bodies if name in case.bodies_in_contact or not _held(case, name)]


def _held(case: Case, name: str) -> bool:
    """Whether a displacement is prescribed to some of the body, or as many planes of symmetry hold it as there are
    directions."""
    assert case.fluid is not None
    supports = case.elastic_bodies[name].supports
    planes = sum(1 if isinstance(one.on, str) else len(one.on or ()) for one in supports if one.symmetry)
    return any(not one.symmetry for one in supports) or planes >= case.fluid.grid.dimension
