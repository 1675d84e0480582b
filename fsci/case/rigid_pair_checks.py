"""Mistakes in `contact.rigid_pairs`, and names that it could not tell apart."""

from __future__ import annotations

from collections.abc import Iterator

from fsci.case.case import Case
from fsci.case.contact import ContactSection
from fsci.case.errors import did_you_mean, listed
from fsci.case.mesh_checks import Mistake
from fsci.case.yaml_text import Keys
from solvers.fluid.terms.boundary.patch_kinds import PATCH_KINDS


def rigid_pair_mistakes(case: Case, contact: ContactSection) -> Iterator[Mistake]:
    """Names of no rigid bodies, pairs without a free one, pairs that are given twice, laws of elastic surfaces."""
    free = case.rigid or {}
    if contact.rigid_pairs and not free:
        yield ("contact", "rigid_pairs"), "'rigid_pairs' is for free rigid bodies, which this case has not"
        return
    rigid, walls = [*free, *case.rigid_surfaces, *contact.obstacles], _closed_patches(case)
    known = dict.fromkeys([*rigid, *walls])
    seen: dict[frozenset[str], str] = {}
    for name, pair in contact.rigid_pairs.items():
        keys: Keys = ("contact", "rigid_pairs", name)
        for i, body in enumerate(pair.bodies):
            if body in case.elastic_bodies:
                yield (*keys, "bodies", i), f"'{body}' is an elastic body: its friction is in 'pairs'"
            elif body not in known:
                hint = did_you_mean(body, known)
                yield (*keys, "bodies", i), f"there is no rigid body, obstacle or closed patch '{body}'{hint}"
            elif body not in free and body in rigid and body in walls:
                yield (
                    (*keys, "bodies", i),
                    f"'{body}' is a rigid body and a closed patch: give one of them another name",
                )
        both = frozenset(pair.bodies)
        if len(both) == 1:
            yield (*keys, "bodies"), "give two different names: a rigid body does not touch itself"
        elif both <= known.keys() and not both & free.keys():
            yield (*keys, "bodies"), f"one of both must be a free rigid body: {listed(list(free))}"
        if both in case.joined:
            yield (*keys, "bodies"), "a spring of length 0 joins these bodies, which do not touch then"
        if both in seen:
            yield (*keys, "bodies"), f"'{seen[both]}' is a pair of the same two: remove one of them"
        seen.setdefault(both, name)
        if pair.friction is not None and pair.friction.bound is not None:
            yield (*keys, "friction", "bound"), "rigid bodies have Coulomb's friction: give 'coefficient'"


def shared_names(case: Case) -> Iterator[Mistake]:
    """Free bodies of the flow with the name of a patch that they may touch."""
    walls = _closed_patches(case)
    if case.fluid is None or case.contact_off:
        return
    for name in case.fluid.free_bodies:
        if name in walls:
            message = (
                f"'{name}' is also the name of a closed patch, which the body may touch: give one of them another name"
            )
            yield ("fluid", "bodies", name), message


def _closed_patches(case: Case) -> list[str]:
    patches = {} if case.fluid is None else case.fluid.patches
    return [name for name, patch in patches.items() if _may_close(patch.kind)]


def _may_close(kind: str) -> bool:
    """Whether patches of this kind may be walls that bodies touch."""
    return kind == "velocity" or PATCH_KINDS[kind].normal_given
