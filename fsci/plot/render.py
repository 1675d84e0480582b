"""Bodies drawn off screen: curved second-order cells, thin element edges, a camera that frames them exactly."""

from __future__ import annotations

import ctypes.util
import os
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.plot.derived import component_of, with_derived

Array = NDArray[np.float64]
Pixels = NDArray[np.uint8]  #: shape (height, width, 3)

SUBDIVISION = 3  #: times the faces of second-order cells are halved to look curved
EDGES_UP_TO = 20_000  #: faces of a body; beyond that its element edges would cover everything
SUPERSAMPLING = 2  #: pixels rendered per pixel shown, along each side
BARE = "lightgray"  #: colour of bodies that do not have the field
DRY = "whitesmoke"  #: colour of the dry side of a surface
ISOMETRIC = np.array([1.0, -1.0, 0.8]) / np.sqrt(2.64)  #: from the bodies to the camera
#: VTK type of a face -> its corners; second-order edges have a midnode.
CORNERS_OF_FACE = {5: 3, 9: 4, 22: 3, 23: 4, 28: 4}

FLAT_SHADING: Any = {"lighting": False}
ROUND: Any = {"smooth_shading": True, "split_sharp_edges": True, "feature_angle": 40.0, "ambient": 0.4, "diffuse": 0.65}


@dataclass(frozen=True)
class DrawnBody:
    """The drawn parts of one body."""

    surface: Any  #: pyvista surface, curved cells subdivided, with the point data
    edges: Array  #: polylines, shape (edges, points per edge, 3)
    outline: Array  #: polylines of the edges that only one face has
    values: Array | None  #: colour of each surface point; None: the body does not have the field
    line_colour: str = "black"  #: of the edges
    shaded: bool = True  #: in 3D with shading; else its colours are exactly those of the colour bar
    opacity: float = 1.0  #: of the surface
    rigid: bool = False  #: no field colours it
    aside: bool = False  #: an obstacle, which may be much larger than what is shown
    colour: str = BARE  #: where it has no values


@dataclass(frozen=True)
class View:
    """A parallel projection: the rectangle of the image in the plane through `centre`."""

    centre: Array  #: shape (3,)
    right: Array  #: unit vector, shape (3,)
    up: Array  #: unit vector, shape (3,)
    half_width: float
    half_height: float


@cache
def import_pyvista() -> Any:
    """pyvista, set to render without a display: by OSMesa if it is installed, else by EGL."""
    if ctypes.util.find_library("OSMesa"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkOSOpenGLRenderWindow")
    elif ctypes.util.find_library("EGL"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    else:
        raise RuntimeError("pictures need a library that renders without a display: apt-get install libosmesa6")
    import pyvista

    return pyvista


def is_obstacle(mesh: Any) -> bool:
    """Whether a mesh is that of an obstacle: it has no fields."""
    return not mesh.point_data.keys() and not mesh.cell_data.keys()


def load_body(mesh: Any, field: str) -> DrawnBody:
    """An elastic body from its mesh or VTU file.

    `field` is what colours it: a point field (a vector's magnitude) or a component, name.x.
    """
    pyvista = import_pyvista()
    from vtkmodules.vtkFiltersGeometry import vtkUnstructuredGridGeometryFilter

    outer = vtkUnstructuredGridGeometryFilter()
    outer.SetInputData(with_derived(pyvista.read(mesh) if isinstance(mesh, Path) else mesh, field))
    outer.Update()
    faces = pyvista.wrap(outer.GetOutput())
    surface = faces.extract_surface(nonlinear_subdivision=SUBDIVISION, algorithm="dataset_surface")
    edges, shared = face_edges(faces)
    return DrawnBody(surface, edges, edges[~shared], component_of(surface.point_data, field))


def face_edges(faces: Any) -> tuple[Array, NDArray[np.bool_]]:
    """The edges of faces, each once, as polylines, shape (edges, points, 3), and whether two faces share them.

    A second-order edge is x(s) = s(s-1)/2 a + (1-s^2) m + s(s+1)/2 b with the midnode m, -1 <= s <= 1.
    """
    found = []
    for kind, cells in faces.cells_dict.items():
        corners = CORNERS_OF_FACE[kind]
        for first in range(corners):
            a, b = cells[:, first], cells[:, (first + 1) % corners]
            middle = cells[:, corners + first] if cells.shape[1] > corners else np.full_like(a, -1)
            found.append(np.column_stack([np.minimum(a, b), np.maximum(a, b), middle]))
    nodes, counts = np.unique(np.vstack(found), axis=0, return_counts=True)
    points = np.asarray(faces.points, dtype=np.float64)
    a, b, middle = points[nodes[:, 0]], points[nodes[:, 1]], points[nodes[:, 2]]
    middle[nodes[:, 2] < 0] = (a + b)[nodes[:, 2] < 0] / 2
    curved = bool(np.any(nodes[:, 2] >= 0))
    s = np.linspace(-1, 1, 9 if curved else 2)[:, None]
    lines = s * (s - 1) / 2 * a[:, None] + (1 - s**2) * middle[:, None] + s * (s + 1) / 2 * b[:, None]
    return lines, counts > 1


def axes_of_view(flat: bool, away: Array = ISOMETRIC) -> Array:
    """The unit vectors right, up and away (towards the camera) as columns, shape (3, 3).

    Flat bodies are seen from the front, others from the direction `away`, isometrically by default, with z upwards.
    """
    if flat:
        return np.eye(3)
    right = np.cross([0.0, 0.0, 1.0], away)
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(away, right), away])


def frame(axes: Array, low: Array, high: Array, *, aspect: float) -> View:
    """The view of the box from `low` to `high`, given along the axes of the view, with a margin of 4 %.

    `aspect` is width / height of the image.
    """
    width, height = 1.08 * (high - low)[:2]
    half_height = max(height, width / aspect, 1e-300) / 2
    return View(axes @ (low + high) / 2, axes[:, 0], axes[:, 1], half_height * aspect, half_height)


def render(
    bodies: list[DrawnBody], view: View, *, size: tuple[int, int], limits: tuple[float, float], colours: str
) -> Pixels:
    """The picture of the bodies without any text; `size` is (width, height)."""
    pyvista = import_pyvista()

    pixels = [SUPERSAMPLING * length for length in size]
    plotter = pyvista.Plotter(off_screen=True, window_size=pixels, lighting="light kit")
    plotter.set_background("white")
    away = np.cross(view.right, view.up)
    flat = np.allclose(away, [0, 0, 1])
    lift = 0.005 * view.half_height * away  # keeps edges clear of the surface they lie in
    for index, body in enumerate(bodies):
        surface = body.surface.copy(deep=False)
        shading = {**(ROUND if body.shaded and not flat else FLAT_SHADING), "opacity": body.opacity}
        if flat:  # a later body covers an earlier one
            surface = surface.translate(2 * index * lift, inplace=False)
        if body.values is None:
            plotter.add_mesh(surface, color=body.colour, **shading)
        else:
            surface.point_data["colour"] = body.values
            plotter.add_mesh(surface, scalars="colour", clim=limits, cmap=colours, show_scalar_bar=False, **shading)
        if 0 < len(body.edges) <= 2 * EDGES_UP_TO:
            lines = polylines(body.edges + (2 * index * flat + 1) * lift)
            plotter.add_mesh(lines, color=body.line_colour, line_width=SUPERSAMPLING, opacity=0.5, lighting=False)
        if flat and len(body.outline):
            lines = polylines(body.outline + (2 * index + 1) * lift)
            plotter.add_mesh(lines, color="black", line_width=2 * SUPERSAMPLING, lighting=False)
    return photograph(plotter, view, away, size)


def photograph(plotter: Any, view: View, away: Array, size: tuple[int, int]) -> Any:
    """The scene of a plotter as an image, viewed along `away` to the centre of the view; closes the plotter."""
    from PIL import Image

    distance = 10 * np.hypot(view.half_width, view.half_height)
    plotter.camera.focal_point = view.centre
    plotter.camera.position = view.centre + distance * away
    plotter.camera.up = view.up
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = view.half_height
    plotter.reset_camera_clipping_range()
    image = plotter.screenshot(return_img=True)
    plotter.close()
    return np.asarray(Image.fromarray(image).resize(size, Image.Resampling.LANCZOS))


def polylines(lines: Array) -> Any:
    """Polylines, shape (n, points, 3), as pyvista draws them."""
    pyvista = import_pyvista()

    count, length = lines.shape[:2]
    connectivity = np.arange(count * length).reshape(count, length)
    cells = np.column_stack([np.full(count, length), connectivity])
    return pyvista.PolyData(lines.reshape(-1, 3), lines=cells.ravel())
