"""Thin plates in ducts in 3D."""

from __future__ import annotations

import numpy as np
from fluid_setup import block, body, field, make_fluid

from solvers.fluid.flow.field import Fluid
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.terms.boundary.patches import Patch

SIZE = 0.25  #: of a cell


def turn(about_z: float, about_y: float) -> np.ndarray:
    """The matrix of a rotation about z after one about y."""
    (c, d), (s, t) = np.cos([about_z, about_y]), np.sin([about_z, about_y])
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[d, 0, t], [0, 1, 0], [-t, 0, d]])


def plate(thickness: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(points, facets, unit normal downstream) of a plate across a duct at a random place and angle.

    thickness: in cells.
    """
    matrix = turn(*rng.uniform(-0.45, 0.45, 2))
    half = thickness * SIZE / 2
    points, facets = block([-half, -1.6, -1.6], [half, 1.6, 1.6])
    middle = np.array([0.875, 0.375, 0.375]) + rng.uniform(-0.1, 0.1, 3)
    return points @ matrix.T + middle, facets, matrix[:, 0]


def duct(bodies: list[ImmersedBody], element: str, pressures, cells=(7, 3, 3), grid=None, **settings) -> Fluid:
    """A duct with slip walls and given pressures at its ends; grid: None: equal cells."""
    patches = [
        Patch("in", ("x-",), "traction", field(pressures[0], 0.0, 0.0)),
        Patch("out", ("x+",), "traction", field(-pressures[1], 0.0, 0.0)),
        Patch("w", ("y-", "y+", "z-", "z+"), "slip"),
    ]
    grid = grid or uniform([0, 0, 0], SIZE * np.array(cells), cells)
    return make_fluid(grid, patches, bodies, element=element, convection=False, **settings)


def sealing(thickness: float, element: str, draw: int, pressures=(2.0, 0.7)) -> tuple[Fluid, np.ndarray]:
    """A plate that closes a duct at rest, and the force on it."""
    points, facets, normal = plate(thickness, np.random.default_rng(draw))
    area = (3 * SIZE) ** 2 / normal[0]
    fluid = duct([body("plate", points, facets)], element, pressures, scheme="steady")
    return fluid, (pressures[0] - pressures[1]) * area * normal
