"""Mistakes in the section `fluid` that show only between settings."""

from __future__ import annotations

from collections.abc import Iterator

from fsci.case.case import Case
from fsci.case.errors import listed
from fsci.case.fluid import FACES, Fluid, RigidBody
from fsci.case.mesh_checks import Mistake, axis_mistakes, length_mistakes, mesh_mistakes, surface_mistakes
from fsci.case.yaml_text import Keys


def fluid_mistakes(case: Case, fluid: Fluid) -> Iterator[Mistake]:
    """All of them."""
    dimension = fluid.grid.dimension
    for name in ("gravity", "body_force", "initial_velocity"):
        yield from length_mistakes(getattr(fluid, name), dimension, ("fluid", name))
    yield from _patches(fluid)
    for name, body in fluid.bodies.items():
        keys: Keys = ("fluid", "bodies", name)
        if name == "fluid":
            yield keys, "a body cannot be called 'fluid': the files of the flow are"
        yield from mesh_mistakes(body.mesh, dimension, case.folder, (*keys, "mesh"), "the grid")
        for i, surface in enumerate(body.on or ()):
            yield from surface_mistakes(body.mesh, surface, (*keys, "on", i))
        yield from _motion(fluid, body, keys)


def _patches(fluid: Fluid) -> Iterator[Mistake]:
    dimension = fluid.grid.dimension
    faces = FACES[: 2 * dimension]
    for name, patch in fluid.patches.items():
        keys: Keys = ("fluid", "patches", name)
        for i, face in enumerate(patch.on):
            if face not in faces:
                yield (*keys, "on", i), f"a box in {dimension}D has no face '{face}'"
        yield from length_mistakes(patch.velocity, dimension, (*keys, "velocity"))
        yield from length_mistakes(patch.traction, dimension, (*keys, "traction"))
        yield from _periods(fluid, name)
    ends = {face[0] for patch in fluid.patches.values() if patch.periodic for face in patch.on}
    if fluid.scheme == "steady" and len(ends) == dimension and not fluid.bodies:
        yield ("fluid", "scheme"), "a steady flow that is periodic in all directions has no velocity of its own"
    if bare := [face for face in faces if not any(face in patch.on for patch in fluid.patches.values())]:
        verb = "face" if len(bare) == 1 else "faces"
        yield ("fluid", "patches"), f"no patch is on the {verb} {listed(bare, 'and')} of the box"


def _periods(fluid: Fluid, name: str) -> Iterator[Mistake]:
    """Nothing else is on the faces of a period."""
    for i, face in enumerate(fluid.patches[name].on):
        for other, patch in fluid.patches.items():
            if patch.periodic and other != name and face in patch.on:
                yield ("fluid", "patches", name, "on", i), f"the face '{face}' is periodic by the patch '{other}'"


def _motion(fluid: Fluid, body: RigidBody, keys: Keys) -> Iterator[Mistake]:
    if body.motion is None:
        return
    dimension, keys = fluid.grid.dimension, (*keys, "motion")
    for name in ("displacement", "velocity"):
        yield from length_mistakes(getattr(body.motion, name), dimension, (*keys, name))
    if body.motion.rotation is not None:
        yield from axis_mistakes(body.motion.rotation.axis, dimension, (*keys, "rotation"))
        yield from length_mistakes(body.motion.rotation.centre, dimension, (*keys, "rotation", "centre"))
