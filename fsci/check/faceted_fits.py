"""Press fits of straight facets: these lie within convex surfaces, and the interference is so much smaller."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from fsci.case import Case
from fsci.case.contact import PairSection, Side
from fsci.meshes.curved import facet_offset
from fsci.meshes.of_case import read_rigid_side
from solvers.mesh.mesh import Mesh

#: Share of the interference that is lost in facets from which on this is said; the pressure is wrong by the same.
LOST_IN_FACETS = 0.05


def faceted_fits(case: Case, meshes: Mapping[str, Mesh], pairs: Mapping[str, PairSection]) -> Iterator[tuple[str, str]]:
    """Warnings about pairs with an interference, with the name of the pair; meshes: of the elastic bodies."""
    for name, pair in pairs.items():
        if pair.interference is None:
            continue
        times = np.linspace(case.time.start, case.time.end, case.time.steps + 1)
        largest = max(pair.overlap(t) for t in times)
        lost = sum(_offset(case, side, meshes) for _, side in pair.sides)
        if largest > 0.0 and abs(lost) > LOST_IN_FACETS * largest:
            share, word = 100.0 * abs(lost) / largest, "smaller" if lost > 0.0 else "larger"
            what = f"the interference of {largest:.3g} {case.units.length} about {share:.2g} % {word}"
            yield name, f"straight facets make {what}: take 'order: 2', or smaller cells"


def _offset(case: Case, side: Side, meshes: Mapping[str, Mesh]) -> float:
    if side.body is not None:
        return facet_offset(meshes[side.body], side.on)
    return facet_offset(*read_rigid_side(case, str(side.obstacle)))
