"""An elastic flap that stands in a channel and bends in the flow."""

import numpy as np

from coupling import Monolithic, couple
from fsci.shapes import rectangle
from solvers.fluid import FlowSettings, Patch, uniform
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.march import march
from solvers.structure import Body, Dynamics, Structure, StVenantKirchhoff, Support, lame

mesh = rectangle([0.2, 0.5], [2, 8], origin=[0.9, 0.0])
material = StVenantKirchhoff(*lame(E=1000.0, nu=0.3), density=2.0)
flap = Body("flap", mesh, material, supports=[Support("bottom")])
structure = Structure([flap], Dynamics(GeneralisedAlpha.from_rho_inf(0.8)))

inflow = [lambda x, t: 4.0 * x[1] * (1.0 - x[1]) * min(t / 0.2, 1.0), 0.0]
patches = [
    Patch("inlet", ["x-"], "velocity", inflow),
    Patch("outlet", ["x+"], "outflow"),
    Patch("walls", ["y-", "y+"], "no_slip"),
]
grid, flow = uniform([0.0, 0.0], [3.0, 1.0], [30, 12]), FlowSettings(density=1.0, viscosity=0.02)
coupled = couple(structure, grid, flow, patches)

tip = np.argmax(flap.points[1] + flap.points[0])
for t, info in march(Monolithic(coupled), end=0.4, steps=20):
    print(f"t = {t:.2f}: {info.iterations} Newton steps, tip at {structure.now.u.reshape(-1, 2)[tip]}")
