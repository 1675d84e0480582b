"""The multipliers in contact with their laws, linearised at an iterate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.blocks import block_diagonal, components, expand, vstack
from solvers.contact.condense import Linearised
from solvers.contact.directions import find_directions
from solvers.contact.interface import Interface
from solvers.contact.law.law import Law, Point, Slopes, Statuses


@dataclass(frozen=True)
class Part:
    """Multipliers of one law that are in contact."""

    law: Law
    which: NDArray[np.int64]  #: shape (m,)
    point: Point
    status: Statuses


def linearise(
    interface: Interface, parts: Sequence[Part], slopes: Slopes, force: sp.csr_matrix, dforce: sp.csr_matrix, w: float
) -> Linearised:
    """What they add to a Newton step.

    slopes: of all multipliers; force: on the nodes per unit multiplier [m^(dim-1)], shape (N, C); dforce: derivative of
    the contact force at fixed multipliers; w: weight of the contact force in the balance.
    """
    N, dim = interface.nodes.points.shape
    which = np.concatenate([part.which for part in parts] or [np.empty(0, dtype=np.int64)])
    z = np.concatenate([part.point.z for part in parts] or [np.empty((0, dim))])
    normals = np.concatenate([part.point.normals for part in parts] or [np.empty((0, dim))])
    node, held = interface.multipliers.node[which], interface.nodes.held
    directions = find_directions(z, normals, node, held, interface.spans[which])
    turning = directions.turning @ slopes.normals[components(which, dim)]
    by_z, by_u, residual = _law_rows(parts, slopes, w, dim * N)
    P = directions.basis
    return Linearised(
        weight=w,
        force=expand(force[:, which], dim),
        dforce=dforce,
        basis=P,
        turning=turning,
        felt=directions.felt,
        by_multiplier=(P.T @ by_z @ P).tocsr(),
        by_displacement=(P.T @ (by_u + by_z @ turning)).tocsr(),
        residual=P.T @ (residual - by_z @ z.ravel()),
        transformation=None if interface.basis is None else expand(interface.basis[0], dim),
    )


def _law_rows(
    parts: Sequence[Part], slopes: Slopes, weight: float, columns: int
) -> tuple[sp.csr_matrix, sp.csr_matrix, Array]:
    """(by z, by u, residual) of all multipliers in contact, law by law."""
    by_z, by_u, residual = [], [], []
    for part in parts:
        rows_of = components(part.which, part.point.z.shape[1])
        mine = Slopes(gap=slopes.gap[part.which], normals=slopes.normals[rows_of], slip=slopes.slip[rows_of])
        rows = part.law.rows(part.point, mine, part.status, weight)
        by_z.append(rows.by_z)
        by_u.append(rows.by_u)
        residual.append(rows.residual.ravel())
    if not by_z:
        return sp.csr_matrix((0, 0)), sp.csr_matrix((0, columns)), np.zeros(0)
    return block_diagonal(np.concatenate(by_z)), vstack(by_u), np.concatenate(residual)
