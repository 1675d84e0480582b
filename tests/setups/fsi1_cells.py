"""The grid of the case fsi1 with fewer cells."""


def grid_fsi1(scale: float) -> dict[str, int]:
    """Settings of its cells, this many times as many."""
    return {
        f"fluid.grid.{axis}.{i}.cells": max(2, round(scale * cells))
        for axis, counts in {"x": (8, 43, 4, 10, 4, 30), "y": (8, 3, 2, 16, 2, 3, 8)}.items()
        for i, cells in enumerate(counts)
    }
