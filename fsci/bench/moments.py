"""Benchmark of the cut: moments of a torus in the cells of a box."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from fsci.bench.table import Row
from solvers.kernels import Moments, moments


def measure(around: int, across: int, cells: int, points: int) -> Row:
    """Microseconds per pair of a triangle of the torus and a cell that meet, outputs included; best of five calls."""
    vertices, facets = torus(around, across)
    lines = [np.linspace(-1.0, 1.0, cells + 1)] * 3
    gauss = (np.polynomial.legendre.leggauss(points)[0] + 1) / 2
    seconds = []
    found: Moments
    for _ in range(5):
        begin = perf_counter()
        found = moments(lines, gauss, vertices, facets)
        seconds.append(perf_counter() - begin)
    pairs = len(found.piece_cell)
    return {
        "triangles": len(facets),
        "cells": cells**3,
        "points": points,
        "pairs": pairs,
        "cut cells": len(found.cells),
        "time [ms]": 1e3 * min(seconds),
        "per pair [us]": 1e6 * min(seconds) / pairs,
    }


def torus(around: int, across: int, major: float = 0.5, minor: float = 0.2) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a torus that lies askew in the grid."""
    u, v = np.meshgrid(*(2 * np.pi * np.arange(n) / n for n in (around, across)), indexing="ij")
    ring = major + minor * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), minor * np.sin(v)], axis=-1).reshape(-1, 3)
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    turn[:, 0] *= np.sign(np.linalg.det(turn))
    i, j = (k.ravel() for k in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    next_i, next_j = (i + 1) % around, (j + 1) % across
    a, b, c, d = i * across + j, next_i * across + j, next_i * across + next_j, i * across + next_j
    return vertices @ turn.T + 0.01, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
