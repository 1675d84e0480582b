"""Bodies that meet through a periodic face: contact looks for the bodies themselves, and does not know their images."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from solvers.api import FailureKind, StepFailed
from solvers.fluid.cut.images import Images
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.inside import INSIDE, windings
from solvers.fluid.surfaces.surface import Motion


def require_apart(bodies: Sequence[ImmersedBody], images: Images) -> None:
    """Raise StepFailed if a body overlaps another one some periods away, and another field moves one of them.

    The images of two bodies that met in the box itself are equally many periods from them. Others are compared.
    """
    if len(bodies) < 2 or not len(images.group) or not images.group.max():
        return
    owner = np.repeat(np.arange(len(bodies)), [len(body.surface.facets) for body in bodies])[images.facet]
    parts = [
        (body, group, images.facets[(owner == body) & (images.group == group)])
        for body, group in np.unique(np.stack([owner, images.group], axis=1), axis=0).tolist()
    ]
    for (one, its, facets), (other, others, walls) in combinations(parts, 2):
        moved = bodies[one].motion is None or bodies[other].motion is None
        if (
            one != other
            and its != others
            and moved
            and (_enters(images, facets, walls) or _enters(images, walls, facets))
        ):
            names = f"'{bodies[one].surface.name}' and '{bodies[other].surface.name}'"
            reason = f"the bodies {names} meet through a periodic face, where contact does not act: take a longer box"
            raise StepFailed("fluid", FailureKind.PERIODIC_FACES, reason)


def _enters(images: Images, facets: np.ndarray, walls: np.ndarray) -> bool:
    """Whether a vertex of facets is inside of the closed surface of others."""
    x, around = images.x[np.unique(facets)], images.x[walls].reshape(-1, images.x.shape[1])
    x = x[((x > around.min(axis=0)) & (x < around.max(axis=0))).all(axis=1)]
    return bool(len(x) and (windings(x, Motion(images.x, np.zeros_like(images.x)), walls) > INSIDE).any())
