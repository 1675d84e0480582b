"""A probe of one's own: the largest von Mises stress in a bar that hangs under its own weight, rho g L at its top."""

import numpy as np

from fsci.shapes import rectangle
from solvers.march import march
from solvers.structure import Body, Structure, StVenantKirchhoff, Support, lame

length, density, g = 2.0, 3.0, 10.0
material = StVenantKirchhoff(*lame(E=1e6, nu=0.0), density=density)
bar = Body(
    "bar",
    rectangle([0.5, length], [2, 8], order=2, cell="quad"),
    material,
    supports=[Support("top")],
    gravity=[0.0, lambda x, t: 0.0 * x[0] - g * t],
)


def largest_von_mises(body):
    """sqrt(3/2 s : s) [Pa] of the deviator s of the Cauchy stress, at the nodes."""
    stress = body.stress().reshape(-1, 3, 3)
    deviator = stress - np.trace(stress, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    return float(np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2))).max())


for t, _ in march(Structure([bar]), steps=2):
    print(f"t = {t:.1f}: largest stress {largest_von_mises(bar):.4f} Pa, rho g L = {density * g * length * t:.4f} Pa")
