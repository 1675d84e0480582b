"""Curves and fields of a run: python docs/examples/post_process.py OUT."""

import sys
from pathlib import Path

import numpy as np


def read_curves(out: Path) -> np.ndarray:
    """The history as an array with named columns."""
    return np.genfromtxt(out / "history.csv", delimiter=",", names=True, deletechars="")


def read_last_fields(out: Path) -> dict:
    """Name -> pyvista mesh of the flow and of each body at the last output time."""
    import pyvista

    meshes = {}
    for collection in sorted((out / "fields").glob("*.pvd")):
        reader = pyvista.get_reader(collection)
        reader.set_active_time_value(reader.time_values[-1])
        meshes[collection.stem] = reader.read()[0]
    return meshes


if __name__ == "__main__":
    out = Path(sys.argv[1])
    curves = read_curves(out)
    print("columns:", *curves.dtype.names)
    print("steps, last time:", curves.size, curves["time"].max())
    for name, mesh in read_last_fields(out).items():
        print(name, mesh.n_cells, "cells;", *mesh.point_data)
