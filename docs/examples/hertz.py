"""Hertz: a rigid cylinder on an elastic block. p(x) = p0 sqrt(1 - (x/b)^2), b^2 = 4 F R / (pi E*), p0 = 2 F / (pi b).

With a file name as argument it draws both pressures into that.
"""

import sys

import numpy as np

from coupling import contact_surface
from fsci.shapes import rectangle
from solvers.contact import Contact, Pair, Surface
from solvers.march import march
from solvers.structure import Body, NeoHooke, Structure, Support, lame

R, E, nu, depth = 1.0, 1.0, 0.3, 0.008
block = Body(
    "block", rectangle([2.0, 1.0], [80, 40], origin=[-1.0, -1.0]), NeoHooke(*lame(E, nu)), supports=[Support("bottom")]
)

angles = np.linspace(-0.3, 0.3, 301)  # the lower side of the cylinder, from left to right
arc = R * np.stack([np.sin(angles), 1.0 - np.cos(angles)], axis=1)
segments = np.stack([np.arange(300), np.arange(1, 301)], axis=1)
cylinder = Surface("cylinder", arc, segments, "line", dofs=None, motion=lambda t: arc - [0.0, depth * t])
contact = Contact([Pair(contact_surface([block], "block", "top"), cylinder)])
structure = Structure([block], contact=contact)

for _ in march(structure, steps=4):
    force = structure.residual_force.reshape(-1, 2)[block.points[1, : block.owned] < -0.999, 1].sum()
    slave = contact.nodes.of_surface[0]
    x, p = contact.x[slave, 0], contact.z[slave, 1]
    b = np.sqrt(4.0 * force * R * (1.0 - nu**2) / (np.pi * E))
    hertz = 2.0 * force / (np.pi * b)
    print(f"force {force:.6f}: largest pressure {p.max():.5f}, Hertz {hertz:.5f}")

if sys.argv[1:]:
    import matplotlib.pyplot as plt

    order, fine = np.argsort(x), np.linspace(-b, b, 201)
    plt.plot(fine, hertz * np.sqrt(1.0 - (fine / b) ** 2), "k-", label="Hertz")
    plt.plot(x[order], p[order], "o", label="computed")
    plt.xlim(-2.0 * b, 2.0 * b)
    plt.xlabel("x [m]")
    plt.ylabel("p [Pa]")
    plt.legend()
    plt.savefig(sys.argv[1])
