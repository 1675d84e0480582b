"""The stiffness that a gap acts against: that of both sides in series, per area.

A body resists the motion of a node of its surface with k, the mean diagonal entry of its tangent there without what a
surface does not feel of changes of volume, over the area A of the node: a compliance A / k [m/Pa]. Those of a slave
node and of the masters opposite of it add up, so that the stiffness of a pair does not depend on which side is the
slave, and a rigid side adds nothing.
"""

from __future__ import annotations

import numpy as np

from solvers.algebra.sparse import Sparse
from solvers.api import Array
from solvers.contact.interface import ContactInterface
from solvers.contact.surface import nodal_areas


class ContactStiffness:
    """Compliances of the surfaces of an interface at the start of a run."""

    def __init__(self, interface: ContactInterface, stiffness: Array):
        """stiffness: k by direction [N/m], shape (N, dim), zero at rigid nodes."""
        k = stiffness.mean(axis=1)
        areas = np.zeros(len(k))
        for surface, nodes in zip(interface.surfaces, interface.nodes.of_surface, strict=True):
            areas[nodes] = np.maximum(areas[nodes], nodal_areas(surface.points, surface.facets, surface.facet_type))
        at_slaves = k[interface.multipliers.node]
        self._of_masters = np.divide(areas, k, out=np.zeros_like(k), where=k > 0.0)
        self._of_slaves = np.divide(
            interface.multipliers.areas, at_slaves, out=np.zeros_like(at_slaves), where=at_slaves > 0.0
        )
        self._values = np.zeros(len(at_slaves))
        self._found = np.zeros(len(at_slaves), dtype=bool)  #: multipliers that have had masters in this step

    def begin_step(self) -> None:
        """Find the masters of each multiplier anew."""
        self._found[:] = False

    def per_area(self, M: Sparse) -> Array:
        """Stiffness [Pa/m] of each multiplier and its masters, (C,); M: mortar integrals with all nodes, (C, N).

        The masters count that a multiplier has when it first has any in a step: a factor that changed with the iterate
        would change the residual.
        """
        rows, weights, count = M.row_numbers(), np.abs(M.data), len(self._of_slaves)
        total = np.bincount(rows, weights, count)
        sums = np.bincount(rows, weights * self._of_masters[M.indices], count)
        new = (total > 0.0) & ~self._found
        compliance = self._of_slaves[new] + sums[new] / total[new]
        self._values[new] = np.divide(1.0, compliance, out=np.zeros_like(compliance), where=compliance > 0.0)
        self._found |= new
        return self._values
