"""The mortar integrals of all pairs in one numbering of nodes and multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, nothing
from solvers.api import Array
from solvers.contact.blocks import add_up, components
from solvers.contact.mortar import Mortar, MortarTerms
from solvers.contact.patch import Multipliers, SlavePatch
from solvers.contact.share import Shares


@dataclass(frozen=True)
class Normals:
    """Averaged unit normals at the multipliers."""

    values: Array  #: shape (C, dim)
    slopes: Sparse  #: derivatives with respect to all nodes, shape (dim * C, dim * N)
    of_patch: tuple[tuple[Array, Sparse], ...]  #: values and derivatives by patch, in the numbers of the patch

    def at(self, multipliers: Multipliers, patch: SlavePatch) -> tuple[Array, Sparse]:
        """Normals and derivatives of a patch."""
        return self.of_patch[next(k for k, other in enumerate(multipliers.patches) if other is patch)]

    def fixed(self) -> Normals:
        """The same without derivatives."""
        of_patch = tuple((values, nothing(slopes.shape)) for values, slopes in self.of_patch)
        return Normals(self.values, nothing(self.slopes.shape), of_patch)


@dataclass(frozen=True)
class Terms:
    """Mortar integrals of all pairs at one iterate; columns: interface dofs dim * node + component."""

    D: Array  #: covered areas [m^(dim-1)], shape (C,)
    D_of_pair: Array  #: contribution of each pair to D, shape (pairs, C)
    M: Sparse  #: shape (C, N)
    gap: Array  #: weighted gap [m^dim], shape (C,)
    normals: Array  #: shape (C, dim)
    dgap: Sparse  #: shape (C, dim * N)
    dforce: Sparse  #: derivative of the contact force at fixed multipliers, shape (dim * N,) * 2
    dnormals: Sparse  #: shape (dim * C, dim * N)

    def normal_forces(self, z: Array) -> Array:
        """Integral of the pressure of each pair [N], shape (pairs,); z: multipliers [Pa], shape (C, dim)."""
        return self.D_of_pair @ np.einsum("nd,nd->n", z, self.normals)


def find_normals(multipliers: Multipliers, x: Array, near: Sequence[NDArray[np.bool_] | None] | None = None) -> Normals:
    """Normals of all patches at positions x [m] of all nodes, shape (N, dim).

    near: for each patch, mask of the nodes whose derivatives are computed; None: of all. Normals of patches without any
    such node are zero.
    """
    (N, dim), C = x.shape, len(multipliers.node)
    values, slopes, of_patch = np.zeros((C, dim)), [], []
    for patch, chosen in zip(multipliers.patches, near or [None] * len(multipliers.patches), strict=True):
        if chosen is not None and not chosen.any():
            normals, derivative = np.zeros((len(patch.nodes), dim)), nothing((dim * len(patch.nodes),) * 2)
        else:
            normals, derivative = patch.normals(x[patch.nodes], chosen)
        values[patch.multipliers] = normals
        slopes.append((derivative, components(patch.multipliers, dim), components(patch.nodes, dim)))
        of_patch.append((normals, derivative))
    return Normals(values, add_up(slopes, (dim * C, dim * N)), tuple(of_patch))


def total_terms(
    pieces: Sequence[tuple[Mortar, MortarTerms]],
    normals: Normals,
    shares: Shares,
    sizes: tuple[int, int, int],
) -> Terms:
    """Sum over mortars and processes; sizes: pairs, multipliers C and nodes N (collective)."""
    pairs, C, N = sizes
    dim = normals.values.shape[1]
    D, gap, D_of_pair = np.zeros(C), np.zeros(C), np.zeros((pairs, C))
    all_M, all_dgap, all_dforce = [], [], []
    for mortar, found in pieces:
        slave, multiplier, master = mortar.patch.nodes, mortar.patch.multipliers, mortar.masters.nodes
        columns = components(np.concatenate([slave, master]), dim)
        D[multiplier] += found.D
        gap[multiplier] += found.gap
        for pair in np.unique(mortar.masters.pair):
            D_of_pair[pair, multiplier] += found.M @ (mortar.masters.pair == pair).astype(float)
        all_M.append((found.M, multiplier, master))
        all_dgap.append((found.dgap, multiplier, columns))
        all_dforce.append((found.dforce, columns, columns))
    M, dgap = add_up(all_M, (C, N)), add_up(all_dgap, (C, dim * N))
    dforce = add_up(all_dforce, (dim * N, dim * N))
    D, gap, D_of_pair, M, dgap, dforce = shares.total_of(D, gap, D_of_pair, M, dgap, dforce)
    return Terms(D, D_of_pair, M, gap, normals.values, dgap, dforce, normals.slopes)


def renumber(matrix: Sparse, rows: NDArray, columns: NDArray, shape: tuple[int, int]) -> Sparse:
    """The entries of a matrix at other rows and columns."""
    return add_up([(matrix, rows, columns)], shape)
