"""Press fits whose master has straight facets: a slave that slides over their corners is pressed by them one by one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from fsci.builder.fits import height_of_side
from fsci.case import Case
from fsci.case.contact import PairSection
from solvers.mesh.mesh import Mesh

#: Height of facets over the interference from which on this is said; pressures vary by about as much.
HIGH_FACETS = 0.05


def faceted_fits(case: Case, meshes: Mapping[str, Mesh], pairs: Mapping[str, PairSection]) -> Iterator[tuple[str, str]]:
    """Warnings about pairs with an interference, with the name of the pair; meshes: of the elastic bodies."""
    for name, pair in pairs.items():
        if pair.interference is None:
            continue
        times = np.linspace(case.time.start, case.time.end, case.time.steps + 1)
        largest, master = max(pair.overlap(t) for t in times), pair.sides[1][1]
        height, unit = height_of_side(case, master, meshes), case.units.length
        if largest > 0.0 and height > HIGH_FACETS * largest:
            what = f"straight facets of '{master.body or master.obstacle}' are {height:.3g} {unit} high"
            why = f"for an interference of {largest:.3g} {unit}: pressures are right until the slave slides over them"
            yield name, f"{what} {why}; take 'order: 2', or smaller cells"
