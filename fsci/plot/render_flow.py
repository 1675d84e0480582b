"""A flow drawn: colours with streamlines in the plane, slices and stream tubes in space, and the bodies in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.plot.derived import component_of, with_derived
from fsci.plot.render import BARE, DRY, ISOMETRIC, Array, DrawnBody, import_pyvista, is_obstacle, load_body

STREAMLINES = "velocity"  #: the field that is drawn with streamlines, besides its components
SPACING = 0.035  #: distance of streamlines in the plane, as part of the edge of a square as large as the box
RESOLUTION = 400  #: points along the diagonal at which the plane flow is sampled for them
SHORTEST = 8  #: streamlines in the plane that extend over fewer of these points are left out
SEEDS = 5  #: streamlines in space start from so many points along each edge of the middle cross-section,
BODY_SEEDS = 6  #: and from so many along each edge of a rectangle
SEEDED_EXTENT = 1.2  #: that is so many times as large as a body
SLICE_WITH_TUBES, SLICE = 0.3, 0.8  #: opacity of the slice through a flow in space, with stream tubes and without
TUBES = 0.0025  #: their radius, as part of the box's diagonal
SIDES = 8  #: of tubes a few pixels wide
LINE, TRIANGLE = 3, 5  #: VTK's numbers of cell types

NO_LINES = np.empty((0, 2, 3))


def is_flow(path: Path) -> bool:
    """Whether a VTU file is that of a flow."""
    return "fluid_fraction" in import_pyvista().read(path).cell_data


def is_dry(path: Path) -> bool:
    """Whether a VTU file is the line around a dry side."""
    return "dry" in import_pyvista().read(path).cell_data


def load_state(files: Sequence[Path], field: str, *, lines: bool = True) -> list[DrawnBody]:
    """The drawn parts of the VTU files of one time, flow first; bodies in a flow that has the field are grey.

    lines: with streamlines in the plane, which change neither colours nor size.
    """
    meshes = [import_pyvista().read(path) for path in files]
    meshes[0] = with_derived(meshes[0], field)
    flow = meshes[0] if "fluid_fraction" in meshes[0].cell_data else None
    parts = [part for mesh in meshes if mesh is not flow for part in _load_body(mesh, field)]
    if flow is None:
        return parts
    if component_of(flow.point_data, field) is not None:
        parts = [replace(part, values=None) for part in parts]
    if is_flat(flow):
        return [plane_flow(flow, field, lines=lines), *parts]
    inside = [mesh for mesh in meshes[1:] if not (is_obstacle(mesh) or surrounds(mesh, flow))]
    # The edges of elements would hide the flow around a body.
    bodies = [replace(part, edges=NO_LINES) for part in _behind(_opened(parts, flow), flow, inside)]
    return _spatial_flow(flow, field, inside) + bodies


def load_meshes(files: Sequence[Path]) -> list[DrawnBody]:
    """The bodies with the edges of their elements, the cells of a flow: all of a plane one, the back faces of a box."""
    pyvista = import_pyvista()
    parts: list[DrawnBody] = []
    flow = None
    for path in files:
        mesh = pyvista.read(path)
        if "fluid_fraction" not in mesh.cell_data:
            loaded = [replace(part, values=None) for part in _load_body(mesh, "")]
            parts += loaded if flow is None else _opened(loaded, flow)
            continue
        flow = mesh
        faces = mesh.extract_surface(algorithm="dataset_surface")
        box = mesh.outline()
        if not is_flat(mesh):
            parts.append(DrawnBody(box, segments(box), NO_LINES, None))
            faces = faces.extract_cells(_on_back(faces)).extract_surface(algorithm="dataset_surface")
        edges = segments(faces.extract_all_edges())
        parts.append(DrawnBody(box, edges, NO_LINES, None, line_colour="gray"))
    return parts


def surrounds(body: Any, flow: Any) -> bool:
    """Whether a body reaches around the box of a flow, or around a plane of it, as the wall of a tube does."""
    (low, high), (first, last) = (np.array(mesh.bounds).reshape(3, 2).T for mesh in (flow, body))
    return bool(np.all(((first < low) & (high < last))[low < high]))


def _opened(parts: Sequence[DrawnBody], flow: Any) -> list[DrawnBody]:
    """Bodies in space, without the half in front of what surrounds the flow, and without what is outside of the box."""
    found = []
    for part in parts:
        if surrounds(part.surface, flow):
            axis = "xyz".index(lengthwise(flow))
            bounds = np.array(flow.bounds)
            bounds[2 * axis + (ISOMETRIC[axis] > 0)] = flow.center[axis]
            half = part.surface.clip_box(bounds, invert=False)
            part = replace(part, surface=half.extract_surface(algorithm="dataset_surface"))
        found.append(part)
    return found


def _behind(parts: Sequence[DrawnBody], flow: Any, bodies: Sequence[Any]) -> list[DrawnBody]:
    """Of obstacles that reach out of the box what is in it behind the slice: the rest would hide the flow."""
    normal, origin = slice_plane(flow, bodies)
    axis, box = "xyz".index(normal), np.array(flow.bounds)
    bounds = box.copy()
    bounds[2 * axis + (ISOMETRIC[axis] > 0)] = origin[axis]
    found = []
    for part in parts:
        low, high = np.array(part.surface.bounds).reshape(3, 2).T
        if part.aside and not (np.all(low >= box[::2]) and np.all(high <= box[1::2])):
            clipped = part.surface.clip_box(bounds, invert=False).extract_surface(algorithm="dataset_surface")
            if not clipped.n_points:
                continue
            part = replace(part, surface=clipped)
        found.append(part)
    return found


def _on_back(faces: Any) -> NDArray[np.int64]:
    """Mask of the faces on the three sides of the box that face away from the camera."""
    centres = np.asarray(faces.cell_centers().points)
    bounds, margin = np.array(faces.bounds), 1e-6 * faces.length
    back = np.where(ISOMETRIC > 0, bounds[::2], bounds[1::2])
    return np.flatnonzero(np.any(np.abs(centres - back) < margin, axis=1))


def _load_body(mesh: Any, field: str) -> list[DrawnBody]:
    """The surface of a rigid body, or an elastic body."""
    if set(np.unique(mesh.celltypes)) == {LINE}:
        filled = fill_lines(mesh.points, mesh.cells.reshape(-1, 3)[:, 1:])
        colour = DRY if "dry" in mesh.cell_data else BARE
        return [replace(filled, rigid=True, aside=is_obstacle(mesh), colour=colour)]
    if set(np.unique(mesh.celltypes)) == {TRIANGLE} and not is_flat(mesh):
        surface = mesh.extract_surface(algorithm="dataset_surface")
        return [DrawnBody(surface, NO_LINES, NO_LINES, None, rigid=True, aside=is_obstacle(mesh))]
    return [load_body(mesh, field)]


def is_flat(mesh: Any) -> bool:
    """Whether a mesh lies in a plane z = constant."""
    low, high = np.array(mesh.bounds[::2]), np.array(mesh.bounds[1::2])
    return bool(high[2] - low[2] <= 1e-9 * (high - low).max())


def plane_flow(mesh: Any, field: str, *, lines: bool = True) -> DrawnBody:
    """A 2D flow, with streamlines if the field is its velocity."""
    surface = mesh.extract_surface(algorithm="dataset_surface")
    streamlines = _plane_streamlines(mesh) if lines and field.partition(".")[0] == STREAMLINES else NO_LINES
    return DrawnBody(surface, streamlines, NO_LINES, component_of(surface.point_data, field), line_colour="white")


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
    return connect(drawn.lines.get_segments(), SHORTEST * step)


def connect(lines: Sequence[Array], least: float) -> Array:
    """Segments of polylines in the plane that extend over at least this length, shape (n, 2, 3)."""
    found = [np.stack([line[:-1], line[1:]], axis=1) for line in lines if np.ptp(line, axis=0).max() >= least]
    return np.pad(np.concatenate(found), ((0, 0), (0, 0), (0, 1))) if found else NO_LINES


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


def _spatial_flow(mesh: Any, field: str, bodies: Sequence[Any]) -> list[DrawnBody]:
    """A translucent slice through the bodies, the edges of the box, and tubes along streamlines."""
    parts = []
    moving = field.partition(".")[0] == STREAMLINES
    normal, origin = slice_plane(mesh, bodies)
    middle = mesh.slice(normal=normal, origin=origin)
    if middle.n_points:
        values = component_of(middle.point_data, field)
        parts.append(
            DrawnBody(middle, NO_LINES, NO_LINES, values, shaded=False, opacity=SLICE_WITH_TUBES if moving else SLICE)
        )
    box = mesh.outline()
    parts.append(DrawnBody(box, segments(box), NO_LINES, None))
    if moving and np.any(mesh.point_data[STREAMLINES]):
        tubes = _tubes(mesh, bodies)
        if tubes.n_points:
            parts.append(DrawnBody(tubes, NO_LINES, NO_LINES, component_of(tubes.point_data, field)))
    return parts


def lengthwise(mesh: Any) -> str:
    """The normal, x or y, of the upright plane through the middle that is longer; y if both are as long."""
    length = np.array(mesh.bounds[1::2]) - np.array(mesh.bounds[::2])
    return "x" if length[0] < (1 - 1e-9) * length[1] else "y"


def slice_plane(mesh: Any, bodies: Sequence[Any]) -> tuple[str, Array]:
    """(normal, point) of a lengthwise plane through a box, shape (3,): in its middle, if that cuts a body.

    Else it is the side of the box where bodies end, as parts of symmetric bodies do, or their middle.
    """
    normal = lengthwise(mesh)
    axis = "xyz".index(normal)
    low, high = mesh.bounds[2 * axis : 2 * axis + 2]
    inside = 1e-6 * (high - low)
    origin = np.array(mesh.center)
    # A plane in faces of cells cuts the cells of one side, or none, as rounding decides.
    origin[axis] += inside
    ends = np.array([body.bounds[2 * axis : 2 * axis + 2] for body in bodies]).reshape(-1, 2)
    if len(ends) and not np.any((ends[:, 0] < origin[axis]) & (origin[axis] < ends[:, 1])):
        first, last = ends[:, 0].min(), ends[:, 1].max()
        at_low, at_high = first <= low + inside, last >= high - inside
        origin[axis] = (first + last) / 2 if at_low == at_high else low + inside if at_low else high - inside
    return normal, origin


def _tubes(mesh: Any, bodies: Sequence[Any]) -> Any:
    """Streamlines through the middle of the box, across its longest edge, and through the middle of each body."""
    low, high = np.array(mesh.bounds[::2]), np.array(mesh.bounds[1::2])
    seeds = [_lattice((low + high) / 2, np.eye(3), np.where(np.arange(3) == np.argmax(high - low), 0, high - low))]
    for body in bodies:
        surface = body.extract_surface(algorithm="dataset_surface").triangulate()
        centre = surface.points.mean(axis=0)
        axes = np.linalg.svd(surface.points - centre, full_matrices=False)[2].T  # the last one is a torus's
        extent = np.ptp((surface.points - centre) @ axes, axis=0)
        around = _lattice(centre, axes, SEEDED_EXTENT * extent * [1, 1, 0], BODY_SEEDS)
        seeds.append(around[~inside_surface(around, surface)])
    lines = mesh.streamlines_from_source(
        import_pyvista().PolyData(np.concatenate(seeds)),
        vectors=STREAMLINES,
        integration_direction="both",
        max_step_length=0.2,
        max_steps=5000,
        max_length=mesh.length,  # a closed streamline would go round for ever
    )
    return lines.tube(radius=TUBES * mesh.length, n_sides=SIDES) if lines.n_points else lines


def inside_surface(points: Array, surface: Any) -> NDArray[np.bool_]:
    """Mask of the points inside of a closed surface."""
    from vtkmodules.vtkFiltersModeling import vtkSelectEnclosedPoints

    pyvista = import_pyvista()
    enclosed = vtkSelectEnclosedPoints()
    enclosed.SetInputData(pyvista.PolyData(points))
    enclosed.SetSurfaceData(surface)
    enclosed.Update()
    return np.asarray(pyvista.wrap(enclosed.GetOutput()).point_data["SelectedPoints"]).astype(bool)


def _lattice(centre: Array, axes: Array, extent: Array, count: int = SEEDS) -> Array:
    """count x count points in a rectangle, one of whose three extents is zero."""
    part = (np.arange(count) + 0.5) / count - 0.5
    steps = [part * length if length else np.zeros(1) for length in extent]
    return centre + np.stack([x.ravel() for x in np.meshgrid(*steps, indexing="ij")], axis=1) @ axes.T


def fill_lines(points: Any, ends: NDArray[np.int64]) -> DrawnBody:
    """The inside of closed lines in a plane, with its outline; `ends` are the points of each segment, shape (n, 2)."""
    from vtkmodules.vtkFiltersCore import vtkStripper
    from vtkmodules.vtkFiltersGeneral import vtkContourTriangulator

    pyvista = import_pyvista()
    loops = vtkStripper()
    loops.SetInputData(pyvista.PolyData(points, lines=np.column_stack([np.full(len(ends), 2), ends]).ravel()))
    loops.JoinContiguousSegmentsOn()
    filled = vtkContourTriangulator()
    filled.SetInputConnection(loops.GetOutputPort())
    filled.Update()
    return DrawnBody(pyvista.wrap(filled.GetOutput()), NO_LINES, np.asarray(points, dtype=np.float64)[ends], None)
