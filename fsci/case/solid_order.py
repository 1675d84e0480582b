"""The order of the cells of elastic bodies: 2, but for thick ones where contact is fragile."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fsci.case.flow_element import bodies_that_may_touch
from fsci.case.mesh import FileMesh

if TYPE_CHECKING:
    from fsci.case.case import Case
    from fsci.case.mesh import Mesh


def is_meshed_here(mesh: Mesh) -> bool:
    """Whether the case may say the order of the cells: no file has it."""
    return not isinstance(mesh, FileMesh) or mesh.thickness is not None or mesh.file.endswith(".geo")


def chooses_order(mesh: Mesh) -> bool:
    """Whether the program chooses the order of the cells of an elastic body."""
    return mesh.order == "auto" and is_meshed_here(mesh)


def with_order(case: Case, name: str, *, slender: bool = False, fitted: bool = False) -> Mesh:
    """The settings of the mesh of an elastic body, with the order of its cells if the program chooses it.

    For the same time second order has the smaller error, in thick bodies, too (docs/benchmarks.md). Slender ones are
    wrong with first order: nothing is worth it. Where flows leave a gap the films of `q1q1` are as coarse as cells of
    first order. With friction, nodes at the edge of a quadratic surface may stick and slip in turn (`ironing`), and in
    space a ball that presses a part of one facet may find no equilibrium. What a support draws off a wall in a flow
    has the suction of the new film, in the cell at its end, too: there elements of second order invert. Where bodies
    are fitted into each other all around, contact has no edge, and straight facets would decide about its pressure.
    """
    mesh = case.elastic_bodies[name].mesh
    if not chooses_order(mesh):
        return mesh
    rubs = touches(case, name, with_friction=case.dimension == 2) and not fitted
    fragile = rubs or _is_drawn(case, name) or name in bodies_that_may_touch(case)
    return mesh.model_copy(update={"order": 1 if fragile and not slender else 2})


def touches(case: Case, name: str, *, with_friction: bool) -> bool:
    """Whether an elastic body may be in contact, or in contact with friction."""
    contact = case.contact
    if contact is None:
        return False
    automatic = contact.bodies == "all" or name in (contact.bodies or ())
    if automatic and (not with_friction or (contact.friction is not None and contact.friction.some)):
        return True
    pairs = contact.complete_pairs.values()
    counted = [pair for pair in pairs if not with_friction or (pair.friction is not None and pair.friction.some)]
    return any(side.body == name for pair in counted for _, side in pair.sides)


def _is_drawn(case: Case, name: str) -> bool:
    """Whether a support moves an elastic body that is in a flow."""
    moved = [one.displacement for one in case.elastic_bodies[name].supports if one.displacement is not None]
    parts = [part for one in moved for part in (one if isinstance(one, tuple) else (one,))]
    return (
        case.fluid is not None
        and case.coupling is not None
        and any(part is not None and part.constant != 0.0 for part in parts)
    )
