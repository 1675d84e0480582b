"""Patch test: a homogeneous finite deformation imposed on the boundary of a distorted mesh holds inside exactly."""

import numpy as np
import pytest
from structure_setup import CELL_TYPES, block, distort, held_everywhere, load_step, make_structure

from solvers.structure.materials import NeoHooke

GRADIENT = np.array([[0.10, 0.15, 0.03], [-0.08, 0.12, 0.05], [0.04, -0.06, -0.10]])


@pytest.mark.parametrize("cell_type", CELL_TYPES)
def test_homogeneous_deformation(cell_type):
    mesh = distort(block(cell_type, 3), 0.08)
    dim = mesh.points.shape[1]
    gradient = GRADIENT[:dim, :dim]

    def displacement(i):
        return lambda x, t: t * (0.3 + gradient[i] @ x[:dim])

    structure = make_structure(mesh, NeoHooke(mu=80.0, lmbda=120.0), supports=held_everywhere(mesh, displacement))
    load_step(structure)
    body = structure.bodies[0]
    exact = 0.3 + body.points[:dim].T @ gradient.T
    error = body.u.x.array.reshape(-1, dim) - exact
    assert np.abs(error).max() < 1e-11
    stress = body.stress()
    assert np.abs(stress - stress[0]).max() < 1e-11 * np.abs(stress).max()
