"""Slaves that are stiffer and finer than their master: it has fewer nodes than conditions that they would follow.

The stiff side then has to bend where the soft one cannot: pressures alternate from node to node, some nodes open, and
Newton's method takes more iterations to find out which. Resultants and displacements are right.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fsci.builder.automatic_pairs import EQUAL_SIZES, mean_stiffness
from fsci.builder.facing import face
from fsci.case import Case
from fsci.case.contact import PairSection
from solvers.mesh.mesh import Mesh

#: Ratio of Young's moduli above which this is said. In a press fit with 35 conditions for 25 nodes pressures are off by
#: 5 % at a ratio of 10, 36 % at 100, and up to three times too large at 1e4.
STIFFER = 30.0


def stiff_slaves(case: Case, meshes: Mapping[str, Mesh], pairs: Mapping[str, PairSection]) -> Iterator[tuple[str, str]]:
    """Warnings about pairs of elastic bodies with these meshes, with the name of the pair."""
    for name, pair in pairs.items():
        sides = [side for _, side in pair.sides]
        slave, master = (side.body for side in sides)
        if pair.tied or slave is None or master is None or slave == master:
            continue
        one, other = (mean_stiffness(case, body, meshes[body]) for body in (slave, master))
        if one <= STIFFER * other:
            continue
        fine, coarse = (face(meshes[str(side.body)], side.on).size for side in sides)
        if fine < coarse * (1.0 - EQUAL_SIZES):
            yield (
                name,
                f"the slave '{slave}' is {one / other:.3g} times stiffer than '{master}' and has smaller facets: "
                "pressures will alternate from node to node; exchange 'slave' and 'master'",
            )
