"""Everything together: a flow drives an elastic torus against a wall (a coarse version of the case torus_wall)."""

import numpy as np

from coupling import Monolithic, contact_surface, couple
from fsci.shapes import solid_torus
from solvers.contact import Contact, Pair, Surface
from solvers.fluid import FlowSettings, Patch, uniform
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.march import march
from solvers.structure import Body, Dynamics, NeoHooke, Structure, lame

mesh = solid_torus(0.5, 0.2, [16, 8])
mesh.points[:, 2] -= 0.45
torus = Body("torus", mesh, NeoHooke(*lame(E=4000.0, nu=0.4), density=1.0))

corners = np.array([[-1.0, -1.0, -1.2], [1.0, -1.0, -1.2], [1.0, 1.0, -1.2], [-1.0, 1.0, -1.2]])
wall = Surface("wall", corners, np.array([[0, 1, 2, 3]]), "quad", dofs=None)
contact = Contact([Pair(contact_surface([torus], "torus", "outer"), wall)], keep_overlap=True)
structure = Structure([torus], Dynamics(GeneralisedAlpha.from_rho_inf(0.8)), contact=contact)

inflow = [0.0, 0.0, lambda x, t: -10.0 * (1.0 - x[0] ** 2) * (1.0 - x[1] ** 2) * min(t / 0.05, 1.0)]
patches = [
    Patch("inlet", ["z+"], "velocity", inflow),
    Patch("walls", ["x-", "x+", "y-", "y+", "z-"], "no_slip"),
    Patch("outlet", ["y-", "y+"], "outflow", where=lambda x, t: -0.7 - x[2]),
]
flow = FlowSettings(density=1.0, viscosity=0.1, scheme="backward_euler")
coupled = couple(structure, uniform([-1.0, -1.0, -1.2], [1.0, 1.0, 0.8], [8, 8, 8]), flow, patches)

slave = contact.nodes.of_surface[0]
for t, info in march(Monolithic(coupled), end=0.1, steps=10):
    lowest = contact.x[slave, 2].min() + 1.2
    push = coupled.force()[:, 2].sum()
    print(f"t = {t:.2f}: {info.iterations} Newton steps, gap {lowest:.4f} m, fluid pushes with {push:.1f} N")
