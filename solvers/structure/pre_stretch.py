"""Pre-stretch: a body that is stretched already where its displacement is zero.

Its stress is that of the elastic deformation F_e = F G, where G stretches the free, unstressed body to the mesh:

    W(F) = W_law(F G) / det G,    sigma = 1/det(F_e) dW_law/dF_e F_e^T.

With small displacements the strain is sym(F + G) - 2 I.
Source: Maas, Erdemir, Halloran & Weiss, J. Mech. Behav. Biomed. Mater. 61 (2016) 499-510, section 2.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import ufl

from solvers import fem
from solvers.structure.materials import Material, Tensor, in_space
from solvers.values import Value, evaluate, evaluate_components


@dataclass(frozen=True)
class PreStretch:
    """A stretch along a direction of the mesh, or along all its axes."""

    stretch: Value  #: length in the mesh by free length
    direction: Sequence[Value] | None = None  #: of any length; None: all directions


def pre_stretch_tensor(domain: fem.Domain, stretches: Sequence[PreStretch]) -> Tensor:
    """G, the product of the stretches, a number for each entry and cell from its middle, shape (dim, dim)."""
    space, points = fem.cellwise_space(domain), fem.cell_midpoints(domain)
    G: Any = ufl.Identity(domain.dim)
    for one in stretches:
        more = evaluate(one.stretch, points, 0.0) - 1.0
        if one.direction is None:
            factor = ufl.Identity(domain.dim) * (1.0 + _cellwise(space, more))
        else:
            a = evaluate_components(one.direction, points, 0.0)
            products = more * a[:, None] * a / (a**2).sum(axis=0)
            factor = ufl.Identity(domain.dim) + ufl.as_tensor([[_cellwise(space, p) for p in row] for row in products])
        G = G * factor
    return G


def _cellwise(space: Any, values: Any) -> Any:
    function = fem.function(space)
    function.x.array[:] = values
    return function


class PreStretched:
    """A law of a body with pre-stretch; the interface is that of laws."""

    def __init__(self, law: Material, G: Tensor):
        self.law, self._G = law, G
        self.plane_stress, self.linear, self.density = law.plane_stress, law.linear, law.density
        #: by which volumes of the free body are larger in the mesh
        self._larger = ufl.as_ufl(1.0) if law.linear else ufl.det(G)

    def elastic(self, F: Tensor) -> Tensor:
        """F_e, of the shape of F."""
        G = self._G if F.ufl_shape == self._G.ufl_shape else in_space(self._G)
        return F + G - ufl.Identity(G.ufl_shape[0]) if self.linear else F * G

    def energy(self, F: Tensor, **constants: Tensor) -> Tensor:
        return self.law.energy(self.elastic(F), **constants) / self._larger

    def volume_ratio(self, F: Tensor) -> Tensor:
        return self.law.volume_ratio(self.elastic(F))

    def volumetric(self, J: Tensor, **constants: Tensor) -> Tensor:
        return self.law.volumetric(J, **constants) / self._larger

    def distortional(self, F: Tensor, **constants: Tensor) -> Tensor:
        return self.law.distortional(self.elastic(F), **constants) / self._larger
