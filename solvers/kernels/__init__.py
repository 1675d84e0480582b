"""Compiled kernels: numpy arrays in, numpy arrays out."""

from ._kernels import (
    BlockFactors,
    BlockProduct,
    CellCutter,
    CutCells,
    KdopTree2,
    KdopTree3,
    Moments,
    MortarResult,
    basis_transformation,
    changed_rows,
    coarse_pattern,
    coarse_product,
    moments,
    mortar,
    nodal_normals,
    node_blocks,
    row_squares,
    seen_angles,
    spread_blocks,
    surface_rows,
)
