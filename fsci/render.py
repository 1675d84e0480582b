"""Bodies drawn off screen: curved second-order cells, thin element edges, a camera that frames them exactly."""

from __future__ import annotations

import ctypes.util
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SUBDIVISION = 3  #: times the faces of second-order cells are halved to look curved
EDGES_UP_TO = 20_000  #: faces of a body; beyond that its element edges would cover everything
SUPERSAMPLING = 2  #: pixels rendered per pixel shown, along each side
ISOMETRIC = np.array([1.0, -1.0, 0.8]) / np.sqrt(2.64)  #: from the bodies to the camera
CORNERS = {5: 3, 9: 4, 22: 3, 23: 4, 28: 4}  #: VTK type of a face -> its corners; second-order edges have a midnode


@dataclass(frozen=True)
class Body:
    """What is drawn of one body."""

    surface: Any  #: pyvista surface, curved cells subdivided, with the point data
    edges: Array  #: polylines, shape (edges, points per edge, 3)
    outline: Array  #: polylines of the edges that only one face has
    values: Array | None  #: colour of each surface point; None: the body does not have the field


@dataclass(frozen=True)
class View:
    """A parallel projection: the rectangle of the image in the plane through `centre`."""

    centre: Array  #: shape (3,)
    right: Array  #: unit vector, shape (3,)
    up: Array  #: unit vector, shape (3,)
    half_width: float
    half_height: float


def import_pyvista() -> Any:
    """pyvista, told to render without a display: by OSMesa where it is installed, else by EGL."""
    if ctypes.util.find_library("OSMesa"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkOSOpenGLRenderWindow")
    elif ctypes.util.find_library("EGL"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    else:
        raise RuntimeError("pictures need a library that renders without a display: apt-get install libosmesa6")
    import pyvista

    return pyvista


def load_body(path: Path, field: str) -> Body:
    """Reads a VTU file and what colours it: `field` is a point field (a vector's magnitude) or a component, name.x."""
    pyvista = import_pyvista()
    from vtkmodules.vtkFiltersGeometry import vtkUnstructuredGridGeometryFilter

    outer = vtkUnstructuredGridGeometryFilter()
    outer.SetInputData(pyvista.read(path))
    outer.Update()
    faces = pyvista.wrap(outer.GetOutput())
    surface = faces.extract_surface(nonlinear_subdivision=SUBDIVISION, algorithm="dataset_surface")
    edges, shared = face_edges(faces)
    return Body(surface, edges, edges[~shared], field_values(surface.point_data, field))


def field_values(data: Any, field: str) -> Array | None:
    """The scalar that `field` names, shape (points,), or None if the body has no such field."""
    name, _, component = field.rpartition(".")
    if name in data and component in ("x", "y", "z"):
        return np.asarray(data[name], dtype=np.float64)[:, "xyz".index(component)]
    if field not in data:
        return None
    values = np.asarray(data[field], dtype=np.float64)
    return values if values.ndim == 1 else np.linalg.norm(values, axis=1)


def face_edges(faces: Any) -> tuple[Array, NDArray[np.bool_]]:
    """The edges of faces, each once, as polylines, shape (edges, points, 3), and whether two faces share them.

    A second-order edge is x(s) = s(s-1)/2 a + (1-s^2) m + s(s+1)/2 b with the midnode m, -1 <= s <= 1.
    """
    found = []
    for kind, cells in faces.cells_dict.items():
        corners = CORNERS[kind]
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


def frame(points: Array, *, flat: bool, aspect: float) -> View:
    """The view that shows all points, shape (n, 3), with a margin of 4 %; `aspect` is width / height of the image.

    Flat bodies are seen from the front, others isometrically with z upwards.
    """
    away = np.array([0.0, 0.0, 1.0]) if flat else ISOMETRIC
    right = np.cross([0.0, 1.0, 0.0] if flat else [0.0, 0.0, 1.0], away)
    right /= np.linalg.norm(right)
    up = np.cross(away, right)
    seen = points @ np.column_stack([right, up, away])
    low, high = seen.min(axis=0), seen.max(axis=0)
    width, height = 1.08 * np.maximum(high - low, 1e-12 * max(np.abs(seen).max(), 1e-300))[:2]
    half_height = max(height, width / aspect) / 2
    centre = np.column_stack([right, up, away]) @ ((low + high) / 2)
    return View(centre, right, up, half_height * aspect, half_height)


def render(
    bodies: list[Body], view: View, *, size: tuple[int, int], limits: tuple[float, float], colours: str
) -> NDArray[np.uint8]:
    """The picture of the bodies without any text, shape (height, width, 3), for `size` = (width, height)."""
    pyvista = import_pyvista()
    from PIL import Image

    pixels = [SUPERSAMPLING * length for length in size]
    plotter = pyvista.Plotter(off_screen=True, window_size=pixels, lighting="light kit")
    plotter.set_background("white")
    away = np.cross(view.right, view.up)
    flat = np.allclose(away, [0, 0, 1])
    for body in bodies:
        shading = (
            {"lighting": False}
            if flat
            else {"smooth_shading": True, "split_sharp_edges": True, "feature_angle": 40.0, "ambient": 0.2}
        )
        surface = body.surface.copy(deep=False)
        if body.values is None:
            plotter.add_mesh(surface, color="lightgray", **shading)
        else:
            surface.point_data["colour"] = body.values
            plotter.add_mesh(
                surface, scalars="colour", clim=limits, cmap=colours, show_scalar_bar=False, **shading
            )
        if len(body.edges) <= 2 * EDGES_UP_TO:
            plotter.add_mesh(polylines(body.edges), color="black", line_width=SUPERSAMPLING, opacity=0.5)
        if flat:
            plotter.add_mesh(polylines(body.outline), color="black", line_width=2 * SUPERSAMPLING)
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
