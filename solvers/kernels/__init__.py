"""Compiled kernels: numpy arrays in, numpy arrays out."""

from ._kernels import KdopTree2, KdopTree3

__all__ = ["KdopTree2", "KdopTree3"]
