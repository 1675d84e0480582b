"""A material of one's own: Yeoh's rubber, W = c1 (I - 3) + c2 (I - 3)^2 + K/2 (J - 1)^2 with I = J^(-2/3) tr(F^T F).

A cube is stretched to twice its length; its stress is compared with that of an incompressible bar,
P = 2 (s - 1/s^2) (c1 + 2 c2 (s^2 + 2/s - 3)).
"""

from dataclasses import dataclass
from typing import ClassVar

import ufl

from fsci.shapes import box
from solvers.march import march
from solvers.structure import Body, Structure, Support
from solvers.structure.materials import in_space


@dataclass(frozen=True)
class Yeoh:
    c1: float
    c2: float
    bulk: float
    density: float = 0.0
    plane_stress: ClassVar[bool] = False
    linear: ClassVar[bool] = False

    def energy(self, F, c1, c2, bulk):
        F = in_space(F)
        J = ufl.det(F)
        stretch = J ** (-2 / 3) * ufl.tr(F.T * F) - 3
        return c1 * stretch + c2 * stretch**2 + bulk / 2 * (J - 1) ** 2


supports = [
    Support("left", (0.0, None, None)),
    Support("front", (None, 0.0, None)),
    Support("bottom", (None, None, 0.0)),
    Support("right", (lambda x, t: 0.0 * x[0] + t, None, None)),
]
cube = Body("cube", box([1.0, 1.0, 1.0], [2, 2, 2]), Yeoh(c1=1.0, c2=0.1, bulk=1e4), supports=supports)
structure = Structure([cube])

for t, _ in march(structure, steps=5):
    right = cube.points[0, : cube.owned] > 1.0 - 1e-9
    force = structure.residual_force.reshape(-1, 3)[right, 0].sum()
    s = 1.0 + t
    exact = 2.0 * (s - 1.0 / s**2) * (1.0 + 0.2 * (s**2 + 2.0 / s - 3.0))
    print(f"stretch {s:.1f}: stress {force:.4f}, incompressible {exact:.4f}")
