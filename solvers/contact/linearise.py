"""Linearisation of the multipliers in contact and their laws at an iterate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, nothing, stack
from solvers.api import Array
from solvers.contact.blocks import block_diagonal, components, expand
from solvers.contact.condense import Linearised
from solvers.contact.directions import find_directions
from solvers.contact.interface import ContactInterface
from solvers.contact.law.law import Law, Point, Slopes, Statuses


@dataclass(frozen=True)
class ActiveMultipliers:
    """Multipliers of one law that are in contact."""

    law: Law
    which: NDArray[np.int64]  #: shape (m,)
    point: Point
    status: Statuses


def linearise(
    interface: ContactInterface,
    spans: NDArray[np.str_],
    parts: Sequence[ActiveMultipliers],
    slopes: Slopes,
    force: Sparse,
    dforce: Sparse,
    w: float,
) -> Linearised:
    """Linearised force and laws of the multipliers in contact, for the condensation.

    spans: admissible directions of all multipliers, (C,); slopes: derivatives for all multipliers; force: on the nodes
    per unit multiplier [m^(dim-1)], (N, C); dforce: derivative of the contact force at fixed multipliers; w: weight of
    the contact force in the balance.
    """
    N, dim = interface.nodes.points.shape
    which = np.concatenate([part.which for part in parts] or [np.empty(0, dtype=np.int64)])
    z = np.concatenate([part.point.z for part in parts] or [np.empty((0, dim))])
    normals = np.concatenate([part.point.normals for part in parts] or [np.empty((0, dim))])
    node, held = interface.multipliers.node[which], interface.nodes.held
    directions = find_directions(z, normals, node, held, spans[which])
    turning = directions.turning @ slopes.normals[components(which, dim)]
    by_z, by_u, residual = _law_rows(parts, slopes, w, dim * N)
    P, across = directions.basis, directions.basis.T
    return Linearised(
        weight=w,
        force=expand(force.columns(which), dim),
        dforce=dforce,
        basis=P,
        turning=turning,
        node_basis=directions.node_basis,
        by_multiplier=across @ by_z @ P,
        by_displacement=across @ (by_u + by_z @ turning),
        residual=across @ (residual - by_z @ z.ravel()),
        transformation=None if interface.basis is None else expand(interface.basis[0], dim),
    )


def _law_rows(
    parts: Sequence[ActiveMultipliers], slopes: Slopes, weight: float, columns: int
) -> tuple[Sparse, Sparse, Array]:
    """(derivative by z, derivative by u, residual) of all multipliers in contact, law by law."""
    by_z, by_u, residual = [], [], []
    for part in parts:
        rows_of = components(part.which, part.point.z.shape[1])
        mine = Slopes(gap=slopes.gap[part.which], normals=slopes.normals[rows_of], slip=slopes.slip[rows_of])
        rows = part.law.rows(part.point, mine, part.status, weight)
        by_z.append(rows.by_z)
        by_u.append(rows.by_u)
        residual.append(rows.residual.ravel())
    if not by_z:
        return nothing((0, 0)), nothing((0, columns)), np.zeros(0)
    return block_diagonal(np.concatenate(by_z)), stack(by_u), np.concatenate(residual)
