"""Steady flow around a cylinder in a channel at Re = 20 (Schafer & Turek 2D-1): drag 5.579535, lift 0.010619."""

import numpy as np

from solvers.fluid import FlowSettings, Fluid, Patch, rigid_body, uniform
from solvers.march import march

height, centre, diameter = 0.41, np.array([0.2, 0.2]), 0.1
count = 100
angles = 2.0 * np.pi * np.arange(count) / count
# the polygon has the area of the circle
radius = diameter / 2.0 * np.sqrt(2.0 * np.pi / count / np.sin(2.0 * np.pi / count))
corners = centre + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
segments = np.stack([np.arange(count), np.roll(np.arange(count), -1)], axis=1)

inflow = [lambda x, t: 1.2 * x[1] * (height - x[1]) / height**2, 0.0]
patches = [
    Patch("inlet", ["x-"], "velocity", inflow),
    Patch("outlet", ["x+"], "outflow"),
    Patch("walls", ["y-", "y+"], "no_slip"),
]
flow = FlowSettings(density=1.0, viscosity=1e-3, element="q2q1", scheme="steady")
fluid = Fluid(uniform([0.0, 0.0], [2.2, height], [220, 41]), flow, patches, [rigid_body("cylinder", corners, segments)])

for _, info in march(fluid):
    drag, lift = 2.0 * fluid.force()["cylinder"].sum(axis=0) / (0.2**2 * diameter)
    print(f"{fluid.dofs()} unknowns, {info.iterations} iterations: drag {drag:.4f}, lift {lift:.4f}")
