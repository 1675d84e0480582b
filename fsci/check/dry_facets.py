"""Facets in the fluid that `wetted` does not name: what flows against them vanishes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fsci.builder.skin import find_skin
from fsci.case import Case
from fsci.check.scene import Placed, Said

#: Facets nearer to a face of the box than this, in extents of the body, lie in it.
IN_FACE = 1e-6


def dry_facets(case: Case, bodies: list[Placed]) -> Iterator[Said]:
    """A warning for each body with dry facets in the box and away from other bodies, at the start."""
    if case.coupling is None or case.fluid is None:
        return
    low, high = np.array(case.fluid.grid.start), np.array(case.fluid.grid.to)
    for body in bodies:
        if body.name not in case.coupling.wetted or body.name in case.coupling.dry_side:
            continue
        skin, _ = find_skin(case, body.name, body.mesh)
        assert skin.wet is not None  # `wetted` names surfaces
        middles = skin.points[skin.facets[~skin.wet]].mean(axis=1)
        margin = IN_FACE * body.extent
        there = ((middles > low + margin) & (middles < high - margin)).all(axis=1)
        for other in bodies:
            if other.name != body.name:
                first, last = other.box
                there &= ~((middles >= first - margin) & (middles <= last + margin)).all(axis=1)
        if there.any():
            inside = middles[there]
            nearest = inside[np.linalg.norm(inside - inside.mean(axis=0), axis=1).argmin()]
            place = ", ".join(f"{x:.4g}" for x in nearest)
            what = f"{len(inside)} facets of '{body.name}', such as that around ({place}), are in the fluid but not wet"
            remedy = "name their surfaces, too, or say with 'dry_side' where there is no fluid"
            yield ("coupling", "wetted", body.name), f"{what}, so that fluid vanishes in them: {remedy}"
