"""A flow drawn: colours with streamlines in the plane, slices and stream tubes in space, and the bodies in it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.render import Array, Body, field_values, import_pyvista, load_body

STREAMLINES = "velocity"  #: the field that is drawn with streamlines, besides its components
SPACING = 0.035  #: distance of streamlines in the plane, as part of the edge of a square as large as the box
RESOLUTION = 400  #: points along the diagonal at which the plane flow is sampled for them
SEEDS = 6  #: streamlines in space start from so many points along each edge of the middle cross-section
TUBES = 0.002  #: their radius, as part of the box's diagonal
LINE, TRIANGLE = 3, 5  #: VTK's numbers of cell types

NO_LINES = np.empty((0, 2, 3))


def is_flow(path: Path) -> bool:
    """Whether a VTU file is that of a flow."""
    return "fluid_fraction" in import_pyvista().read(path).cell_data


def load_parts(path: Path, field: str) -> list[Body]:
    """What is drawn of a VTU file: a flow, the surface of a rigid body, or an elastic body."""
    mesh = import_pyvista().read(path)
    if "fluid_fraction" in mesh.cell_data:
        return _plane_flow(mesh, field) if _is_flat(mesh) else _spatial_flow(mesh, field)
    if set(np.unique(mesh.celltypes)) == {LINE}:
        return [_section(mesh)]
    if set(np.unique(mesh.celltypes)) == {TRIANGLE} and not _is_flat(mesh):
        return [Body(mesh.extract_surface(algorithm="dataset_surface"), NO_LINES, NO_LINES, None)]
    return [load_body(path, field)]


def _is_flat(mesh: Any) -> bool:
    low, high = np.array(mesh.bounds[::2]), np.array(mesh.bounds[1::2])
    return bool(high[2] - low[2] <= 1e-9 * (high - low).max())


def _plane_flow(mesh: Any, field: str) -> list[Body]:
    surface = mesh.extract_surface(algorithm="dataset_surface")
    lines = _plane_streamlines(mesh) if field.partition(".")[0] == STREAMLINES else NO_LINES
    return [Body(surface, lines, NO_LINES, field_values(surface.point_data, field), line_colour="white")]


def _plane_streamlines(mesh: Any) -> Array:
    """Segments of streamlines at about equal distances, shape (n, 2, 3)."""
    from matplotlib.figure import Figure

    low, high = np.array(mesh.bounds[:4:2]), np.array(mesh.bounds[1:4:2])
    step = mesh.length / RESOLUTION
    count = np.maximum(np.round((high - low) / step).astype(int), 2) + 1
    x, y = (np.linspace(a, b, n) for a, b, n in zip(low, high, count, strict=True))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    places = import_pyvista().PolyData(np.pad(places, ((0, 0), (0, 1)), constant_values=mesh.bounds[4]))
    found = places.sample(mesh)
    velocity = np.array(found.point_data[STREAMLINES]).reshape(len(y), len(x), 3)
    covered = ~found.point_data["vtkValidPointMask"].astype(bool).reshape(len(y), len(x))
    u, v = (np.ma.array(velocity[..., i], mask=covered) for i in (0, 1))
    if not velocity.any():
        return NO_LINES
    density = (high - low) / (SPACING * np.sqrt(np.prod(high - low))) / 30.0  # streamplot's unit: 30 lines across
    drawn = Figure().add_subplot().streamplot(x, y, u, v, density=tuple(density))
    lines = [np.stack([line[:-1], line[1:]], axis=1) for line in drawn.lines.get_segments()]
    return np.pad(np.concatenate(lines), ((0, 0), (0, 0), (0, 1)))


def segments(lines: Any) -> Array:
    """Polylines of any lengths, cut into their segments, shape (n, 2, 3)."""
    if lines.n_points == 0:
        return NO_LINES
    found, at = [], 0
    connectivity = np.asarray(lines.lines)
    while at < len(connectivity):
        nodes = connectivity[at + 1 : at + 1 + connectivity[at]]
        found.append(np.stack([nodes[:-1], nodes[1:]], axis=1))
        at += 1 + connectivity[at]
    return np.asarray(lines.points, dtype=np.float64)[np.concatenate(found)]


def _spatial_flow(mesh: Any, field: str) -> list[Body]:
    """Slices through the middle, normal to the two shortest edges of the box, with tubes along streamlines."""
    extents = np.array(mesh.bounds[1::2]) - np.array(mesh.bounds[::2])
    axes = np.argsort(extents)[:2]
    slices = [mesh.slice(normal="xyz"[axis]) for axis in axes]
    parts = [Body(s, NO_LINES, NO_LINES, field_values(s.point_data, field), lit=False) for s in slices if s.n_points]
    box = mesh.outline()
    parts.append(Body(box, segments(box), NO_LINES, None))
    if field.partition(".")[0] == STREAMLINES and np.any(mesh.point_data[STREAMLINES]):
        tubes = _tubes(mesh, int(np.argmax(extents)))
        if tubes.n_points:
            parts.append(Body(tubes, NO_LINES, NO_LINES, field_values(tubes.point_data, field)))
    return parts


def _tubes(mesh: Any, along: int) -> Any:
    low, high = np.array(mesh.bounds[::2]), np.array(mesh.bounds[1::2])
    part = (np.arange(SEEDS) + 0.5) / SEEDS
    across = [low[i] + part * (high[i] - low[i]) if i != along else [0.5 * (low[i] + high[i])] for i in range(3)]
    seeds = np.stack([x.ravel() for x in np.meshgrid(*across, indexing="ij")], axis=1)
    lines = mesh.streamlines_from_source(
        import_pyvista().PolyData(seeds), vectors=STREAMLINES, integration_direction="both", max_steps=2000
    )
    return lines.tube(radius=TUBES * mesh.length) if lines.n_points else lines


def _section(mesh: Any) -> Body:
    """The inside of closed lines in the plane, with its outline."""
    from vtkmodules.vtkFiltersCore import vtkStripper
    from vtkmodules.vtkFiltersGeneral import vtkContourTriangulator

    pyvista = import_pyvista()
    ends: NDArray[np.int64] = mesh.cells.reshape(-1, 3)
    loops = vtkStripper()
    loops.SetInputData(pyvista.PolyData(mesh.points, lines=ends.ravel()))
    loops.JoinContiguousSegmentsOn()
    filled = vtkContourTriangulator()
    filled.SetInputConnection(loops.GetOutputPort())
    filled.Update()
    outline = np.asarray(mesh.points, dtype=np.float64)[ends[:, 1:]]
    return Body(pyvista.wrap(filled.GetOutput()), NO_LINES, outline, None)
