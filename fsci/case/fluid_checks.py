"""Mistakes in the section `fluid` that show only between settings."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fsci.case.case import Case
from fsci.case.errors import did_you_mean, listed
from fsci.case.fluid import FluidSection, Movement, RigidBodySection
from fsci.case.free_body import Free
from fsci.case.free_checks import free_mistakes
from fsci.case.mesh_checks import Mistake, axis_mistakes, length_mistakes, mesh_mistakes, surface_mistakes
from fsci.case.yaml_text import Keys
from solvers.fluid.grid.box import FACES


def fluid_mistakes(case: Case, fluid: FluidSection) -> Iterator[Mistake]:
    """All of them."""
    dimension = fluid.grid.dimension
    for name in ("gravity", "body_force", "initial_velocity"):
        yield from length_mistakes(getattr(fluid, name), dimension, ("fluid", name))
    if fluid.shear is not None and fluid.narrow_gaps:
        yield ("fluid", "narrow_gaps"), "'narrow_gaps' is for a constant viscosity"
    if fluid.shear is not None and case.contact is not None and case.contact.film.closed == "seeping":
        yield (
            ("contact", "film"),
            "seepage through closed contact needs a constant viscosity: remove 'shear' of the fluid",
        )
    yield from _patches(fluid)
    yield from _refinements(case, fluid)
    for name, body in fluid.bodies.items():
        keys: Keys = ("fluid", "bodies", name)
        if name == "fluid":
            yield keys, "a body cannot be called 'fluid', which is the name of the files of the flow"
        yield from mesh_mistakes(body.mesh, dimension, case.folder, (*keys, "mesh"), "the grid")
        for i, surface in enumerate(body.on or ()):
            yield from surface_mistakes(body.mesh, surface, (*keys, "on", i))
        yield from _motion(fluid, body, keys)
        if body.free is not None:
            yield from _free(case, fluid, body.free, (*keys, "free"))


def _patches(fluid: FluidSection) -> Iterator[Mistake]:
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
        yield (
            ("fluid", "scheme"),
            "a steady flow that is periodic in all directions does not determine its mean velocity",
        )
    if any(patch.where is not None for patch in fluid.patches.values()) and (open_faces := uncovered(fluid)):
        yield ("fluid", "patches"), f"no patch is on part of the box's boundary: {', '.join(open_faces)}"
    if bare := [face for face in faces if not any(face in patch.on for patch in fluid.patches.values())]:
        verb = "face" if len(bare) == 1 else "faces"
        yield ("fluid", "patches"), f"no patch is on the {verb} {listed(bare, 'and')} of the box"


def uncovered(fluid: FluidSection) -> list[str]:
    """Faces of the box of which a part, the middle of some cell's face, is on no patch though the face is on one."""
    planes, found = fluid.grid.planes, []
    for face in FACES[: 2 * fluid.grid.dimension]:
        patches = [patch for patch in fluid.patches.values() if face in patch.on]
        if not patches or any(patch.where is None for patch in patches):
            continue
        axis, side = "xyz".index(face[0]), -1 if face[1] == "+" else 0
        middles = [p[[side]] if i == axis else 0.5 * (p[1:] + p[:-1]) for i, p in enumerate(planes)]
        x = np.stack([part.ravel() for part in np.meshgrid(*middles, indexing="ij")])
        on = [np.broadcast_to(patch.where(x, 0.0), x.shape[1]) > 0.0 for patch in patches if patch.where is not None]
        if not np.any(on, axis=0).all():
            found.append(face)
    return found


def _refinements(case: Case, fluid: FluidSection) -> Iterator[Mistake]:
    names = [*fluid.bodies, *case.elastic_bodies]
    if fluid.grid.refine and any(patch.periodic for patch in fluid.patches.values()):
        yield ("fluid", "grid", "refine"), "a grid with periodic patches cannot be refined: use stretches"
    for number, refinement in enumerate(fluid.grid.refine):
        if refinement.around is not None and refinement.around not in names:
            hint = did_you_mean(refinement.around, names)
            yield ("fluid", "grid", "refine", number, "around"), f"there is no body '{refinement.around}'{hint}"


def _periods(fluid: FluidSection, name: str) -> Iterator[Mistake]:
    """Mistakes: other patches on the faces of a period."""
    for i, face in enumerate(fluid.patches[name].on):
        for other, patch in fluid.patches.items():
            if patch.periodic and other != name and face in patch.on:
                yield (
                    ("fluid", "patches", name, "on", i),
                    f"the patch '{other}' makes the face '{face}' periodic, which allows no other patch on it",
                )


def _free(case: Case, fluid: FluidSection, free: Free, keys: Keys) -> Iterator[Mistake]:
    dimension = fluid.grid.dimension
    if case.coupling is None:
        yield keys, "a free body needs the section 'coupling'; 'coupling: {}' for its defaults"
    if fluid.scheme == "steady":
        yield keys, "a free body needs a time-dependent flow: choose the scheme bdf2"
    yield from free_mistakes(free, dimension, case.moving, keys)


def _motion(fluid: FluidSection, body: RigidBodySection, keys: Keys) -> Iterator[Mistake]:
    if body.motion is None:
        return
    yield from movement_mistakes(body.motion, fluid.grid.dimension, (*keys, "motion"))


def movement_mistakes(movement: Movement, dimension: int | None, keys: Keys) -> Iterator[Mistake]:
    """Vectors of a rigid motion, and its axis, do not fit the dimension; None: it is not known."""
    for name in ("displacement", "velocity"):
        yield from length_mistakes(getattr(movement, name), dimension, (*keys, name))
    if movement.rotation is not None:
        if dimension is not None:
            yield from axis_mistakes(movement.rotation.axis, dimension, (*keys, "rotation"))
        yield from length_mistakes(movement.rotation.centre, dimension, (*keys, "rotation", "centre"))
