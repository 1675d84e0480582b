"""Damping that a step does not resolve: with `rho_inf: 1` it turns the finest motions round in every step.

Damping beta K ends a motion of the frequency w by itself at the rate beta w^2. The midpoint rule, which `rho_inf: 1`
is, multiplies it in a step dt by

    (1 - x) / (1 + x),   x = beta w^2 dt / 2

which is negative for x > 1, and -1 + 2 / x for a large x: such a motion alternates, and falls to a third in x / 2
steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np

from fsci.builder.elements import lame_at_cells
from fsci.case import Case
from solvers.mesh.mesh import Mesh
from solvers.values import evaluate


def alternating(case: Case, meshes: Mapping[str, Mesh]) -> Iterator[str]:
    """Notes on bodies with these meshes whose finest motions alternate."""
    dynamics = None if case.structure is None else case.structure.dynamics
    if dynamics is None or dynamics.damping.stiffness == 0.0 or dynamics.rho_inf != 1.0:
        return
    for name, mesh in meshes.items():
        x = 0.5 * dynamics.damping.stiffness * largest_square(case, name, mesh) * case.time.shared_step
        if x > 1.0:
            yield (
                f"{case.place('structure', 'dynamics')}: 'damping' ends the finest motions of body '{name}' within a "
                "step, and 'rho_inf: 1' turns them round in each: after a jump of a support or load, reactions "
                f"alternate for about {max(1.0, x / 2.0):.2g} steps; take 'rho_inf: 0.9', or let it begin smoothly"
            )


def largest_square(case: Case, name: str, mesh: Mesh) -> float:
    """Estimate of the largest w^2 [1/s^2] of a body: 12 (lambda + 2 mu) / (density h^2), that of a linear bar.

    h: the least distance between nodes of a cell [m]. Zero without a density.
    """
    mu, lmbda = lame_at_cells(case, name, mesh)
    middles = mesh.points[mesh.cells].mean(axis=1).T
    given = case.elastic_bodies[name].material.density
    x = mesh.points[mesh.cells]
    density = np.broadcast_to(0.0 if given is None else evaluate(given, middles, 0.0), len(x))
    h = np.min([np.linalg.norm(x[:, i] - x[:, j], axis=1) for i, j in combinations(range(x.shape[1]), 2)], axis=0)
    squares = np.divide(12.0 * (lmbda + 2.0 * mu), density * h**2, out=np.zeros(len(x)), where=density * h > 0.0)
    return float(squares.max())
