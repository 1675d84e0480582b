"""Mistakes in the settings of free rigid bodies, of the flow, of the section `rigid`, or of obstacles."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from fsci.case.errors import did_you_mean, listed
from fsci.case.free_body import HELD, PLANE, FreeMotion, PointSpringSection
from fsci.case.mesh_checks import Mistake, length_mistakes
from fsci.case.yaml_text import Keys


def free_mistakes(free: FreeMotion, dimension: int | None, others: Collection[str], keys: Keys) -> Iterator[Mistake]:
    """All of one body. dimension: None if only its mesh tells; others: names of all free and elastic bodies."""
    for name in ("gravity", "initial_velocity", "pivot"):
        yield from length_mistakes(getattr(free, name), dimension, (*keys, name))
    for i, spring in enumerate(free.springs):
        yield from spring_mistakes(spring, dimension, others, (*keys, "springs", i))
    for i, load in enumerate(free.loads):
        for name in ("force", "at"):
            yield from length_mistakes(getattr(load, name), dimension, (*keys, "loads", i, name))
        yield from _turn_mistakes(load.moment, dimension, (*keys, "loads", i, "moment"))
    for i, way in enumerate(free.held):
        if dimension == 2 and way not in PLANE:
            yield (*keys, "held", i), f"a body in 2D has no degree of freedom '{way}'; choose {listed(PLANE)}"
        elif free.pivot is not None and way in "xyz":
            yield (*keys, "held", i), f"a body with a 'pivot' does not move along {way}: remove '{way}' from 'held'"
    if free.pivot is not None and any(free.initial_velocity or ()):
        message = "a body with a 'pivot' only turns: give 'initial_angular_velocity' instead"
        yield (*keys, "initial_velocity"), message
    if wrong := list(_turn_mistakes(free.initial_angular_velocity, dimension, (*keys, "initial_angular_velocity"))):
        yield from wrong
    elif dimension is not None:
        yield from _held_but_moving(free, dimension, keys)


def spring_mistakes(
    spring: PointSpringSection, dimension: int | None, others: Collection[str], keys: Keys
) -> Iterator[Mistake]:
    """Of one spring; others: names of all free and elastic bodies."""
    yield from length_mistakes(spring.at, dimension, (*keys, "at"))
    if len(spring.stiffness) > 1:
        yield from length_mistakes(spring.stiffness, dimension, (*keys, "stiffness"))
    if spring.to is None:
        return
    yield from length_mistakes(spring.to.at, dimension, (*keys, "to", "at"))
    if spring.to.body == keys[2] and keys[0] != "structure":
        yield (*keys, "to", "body"), f"a spring leads to another body, but '{spring.to.body}' is the body itself"
    elif spring.to.body is not None and spring.to.body not in others:
        hint = did_you_mean(spring.to.body, others)
        yield (*keys, "to", "body"), f"there is no free or elastic body '{spring.to.body}'{hint}"


def _turn_mistakes(values: tuple[object, ...] | None, dimension: int | None, keys: Keys) -> Iterator[Mistake]:
    """Turns have one entry in 2D, three in 3D."""
    wanted = 1 if dimension == 2 else 3
    if values is not None and dimension is not None and len(values) != wanted:
        words = "1 entry" if wanted == 1 else "3 entries"
        yield keys, f"'{keys[-1]}' must have {words} in {dimension}D, not {len(values)}"


def _held_but_moving(free: FreeMotion, dimension: int, keys: Keys) -> Iterator[Mistake]:
    """A body does not begin to move in a way that is held."""
    held = {way for word in free.held for way in HELD[word]}
    turns = ("rotation_z",) if dimension == 2 else HELD["rotation"]
    for setting, ways in (("initial_velocity", "xyz"), ("initial_angular_velocity", turns)):
        values = getattr(free, setting)
        for i, (way, value) in enumerate(zip(ways, values or (), strict=False)):
            if way in held and value != 0.0:
                word = next(word for word in free.held if way in HELD[word])
                yield (
                    (*keys, setting, i),
                    f"the body begins to move in a way that is held: remove '{word}' from 'held', or give 0 here",
                )
