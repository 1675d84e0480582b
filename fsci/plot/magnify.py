"""Displacements drawn times a factor: of small ones nothing is seen at true scale."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fsci.plot.render import import_pyvista
from fsci.running.output import Series


def magnified(parts: Sequence[Series], factor: float, folder: Path) -> list[Series]:
    """The VTU files of all parts, which have x = X + u, with x = X + `factor` u, written into `folder`.

    Parts without a displacement stay where they are. Raises ValueError beside a flow, whose box does not move.
    """
    if factor == 1.0 or not parts:
        return list(parts)
    if any("fluid_fraction" in import_pyvista().read(series[0][1]).cell_data for series in parts):
        raise ValueError("displacements beside a flow are drawn at true scale: leave --scale out")
    return [_magnified(series, factor, Path(tempfile.mkdtemp(dir=folder))) for series in parts]


def _magnified(series: Series, factor: float, folder: Path) -> Series:
    for _, file in series:
        mesh = import_pyvista().read(file)
        if "displacement" in mesh.point_data:
            mesh.points = np.asarray(mesh.points) + (factor - 1.0) * np.asarray(mesh.point_data["displacement"])
        mesh.save(folder / file.name)
    return [(time, folder / file.name) for time, file in series]
