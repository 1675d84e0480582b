"""Scenes with planes of symmetry, of which one side is computed, drawn whole: each part with its reflection.

The reflection in the plane x_a = c has x_a' = 2 c - x_a. Component a of a vector changes its sign, and so does
a component ab of a tensor with b other than a.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fsci.plot.derived import TENSOR
from fsci.plot.magnify import magnified
from fsci.plot.render import import_pyvista
from fsci.plot.render_flow import is_flat
from fsci.running.output import Series

AXES = "xyz"
JOINED = 1e-9  #: distance relative to the size of a mesh within which nodes are one
BEYOND_PLANE = 1e-6  #: part of a mesh, relative to its size, that may be beyond the plane


@dataclass(frozen=True)
class Plane:
    """The plane x_axis = at."""

    axis: int
    at: float  #: [length]

    @property
    def name(self) -> str:
        return f"{AXES[self.axis]}={self.at:g}"


@dataclass(frozen=True)
class Mirror:
    """Planes of symmetry, and the folder into which whole parts are written; displacements are drawn times `factor`."""

    planes: Sequence[Plane]
    folder: Path
    factor: float = 1.0

    def whole(self, parts: Sequence[Series]) -> list[Series]:
        """The VTU files of all parts with their reflections; raises ValueError if a part is on both sides of a plane.

        Surfaces of rigid bodies and obstacles may be: what of them is on the side that was computed counts.
        """
        parts = magnified(parts, self.factor, self.folder)
        if not self.planes or not parts:
            return parts
        meshes = [import_pyvista().read(series[0][1]) for series in parts]
        sides = [computed_side(meshes, plane) for plane in self.planes]
        return [self._whole(series, sides) for series in parts]

    def _whole(self, series: Series, sides: Sequence[float]) -> Series:
        folder = Path(tempfile.mkdtemp(dir=self.folder))
        for _, file in series:
            mesh = import_pyvista().read(file)
            for plane, side in zip(self.planes, sides, strict=True):
                if is_surface(mesh) and crosses(mesh, plane):
                    mesh = one_side(mesh, plane, side)
                mesh = with_reflection(mesh, plane)
            mesh.save(folder / file.name)
        return [(time, folder / file.name) for time, file in series]


def read_plane(text: str) -> Plane:
    """The plane that a text like y=0 names; raises ValueError for any other."""
    axis, equals, at = text.partition("=")
    try:
        if len(axis.strip()) == 1 and equals and np.isfinite(float(at)):
            return Plane(AXES.index(axis.strip()), float(at))
    except ValueError:
        pass
    raise ValueError(f"a plane is an axis and a coordinate, such as y=0, not '{text}'")


def with_reflection(mesh: Any, plane: Plane) -> Any:
    """A mesh and its reflection as one mesh, joined at the nodes in the plane."""
    if crosses(mesh, plane):
        low, high = mesh.bounds[2 * plane.axis : 2 * plane.axis + 2]
        raise ValueError(f"a part lies on both sides of {plane.name}, from {low:.6g} to {high:.6g}")
    return mesh.merge(reflection(mesh, plane), merge_points=True, tolerance=JOINED * mesh.length)


def crosses(mesh: Any, plane: Plane) -> bool:
    """Whether a mesh is on both sides of a plane."""
    low, high = mesh.bounds[2 * plane.axis : 2 * plane.axis + 2]
    return bool(min(high - plane.at, plane.at - low) > BEYOND_PLANE * mesh.length)


def computed_side(meshes: Sequence[Any], plane: Plane) -> float:
    """1 if the largest part that is not across a plane, or of all if each is, reaches further above it; else -1."""
    there = [mesh for mesh in meshes if not crosses(mesh, plane)] or meshes
    low, high = max(there, key=lambda mesh: mesh.length).bounds[2 * plane.axis : 2 * plane.axis + 2]
    return 1.0 if high - plane.at >= plane.at - low else -1.0


def is_surface(mesh: Any) -> bool:
    """Whether a mesh is the surface of a rigid body or obstacle: triangles in space, or lines."""
    return bool(mesh.get_cell(0).dimension < 3 - is_flat(mesh))


def one_side(mesh: Any, plane: Plane, side: float) -> Any:
    """The part of a surface above a plane, or below it if `side` is -1; of lines, or of triangles."""
    origin = np.where(np.arange(3) == plane.axis, plane.at, 0.0)
    found = mesh.clip(AXES[plane.axis], origin=origin, invert=side < 0.0).triangulate()
    sizes = found.compute_cell_sizes(length=True, area=True, volume=False).cell_data
    extended = sizes["Length"] + np.sqrt(sizes["Area"]) > JOINED * mesh.length
    found = found.extract_cells(extended)  # those that a cut through a corner leaves are points
    for data in (found.point_data, found.cell_data):
        for name in [name for name in data.keys() if name.startswith("vtkOriginal")]:
            del data[name]
    return found


def reflection(mesh: Any, plane: Plane) -> Any:
    """The mesh on the other side of the plane."""
    from vtkmodules.vtkFiltersGeneral import vtkReflectionFilter

    reflect = vtkReflectionFilter()
    reflect.SetInputData(mesh)
    reflect.SetPlane(vtkReflectionFilter.USE_X + plane.axis)
    reflect.SetCenter(plane.at)
    reflect.CopyInputOff()
    reflect.FlipAllInputArraysOff()
    reflect.Update()
    found = import_pyvista().wrap(reflect.GetOutput())
    points = np.array(mesh.points, dtype=float)  # those of the filter are in single precision
    points[:, plane.axis] = 2.0 * plane.at - points[:, plane.axis]
    found.points = points
    for data in (found.point_data, found.cell_data):
        for name in data.keys():
            values, component = data[name], name.rpartition("_")[2]
            if values.ndim == 2 and values.shape[1] == 3:
                data[name] = np.where(np.arange(3) == plane.axis, -values, values)
            elif values.ndim == 2 and values.shape[1] == 6:  # of a symmetric tensor
                odd = [pair.count(AXES[plane.axis]) == 1 for pair in TENSOR]
                data[name] = np.where(odd, -values, values)
            elif len(component) == 2 and set(component) <= set(AXES) and component.count(AXES[plane.axis]) == 1:
                data[name] = -values
    return found
