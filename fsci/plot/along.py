"""Fields along straight lines and along surfaces of bodies, as tables and as curves.

A line is sampled where it is in a flow or in an elastic body, in its present shape: exact for fields that are linear in
cells; a flow is written at the corners of its cells. Elsewhere values are nan. In 2D the surface of a body is followed
from its first point on, in 3D its table has the points of the surface.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.plot.derived import FIELD_COMPONENTS, component_of, with_derived
from fsci.plot.frames import Moment
from fsci.plot.lines import plot_lines
from fsci.plot.outline import surface_points
from fsci.plot.render import import_pyvista
from fsci.plot.render_flow import LINE, TRIANGLE, fill_lines, inside_surface
from fsci.plot.scene import field_unit
from fsci.plot.storyboard import choose
from fsci.plot.units import unit_of
from fsci.running.files import write_text

POINTS = 201  #: of a line by default
SHEAR = "wall_shear_stress"
Array = NDArray[np.float64]
Table = dict[str, Array]  #: name of a column -> values


def read_line(text: str) -> tuple[Array, Array, int]:
    """(begin, end, number of points) of a text such as 0,0.2:2.5,0.2 or 0,0,0:1,0,0:51. Raises ValueError."""
    parts = text.split(":")
    try:
        begin, end = ([float(x) for x in part.split(",")] for part in parts[:2])
        count = int(parts[2]) if len(parts) == 3 else POINTS
        fits = len(parts) <= 3 and len(begin) == len(end) in (2, 3) and begin != end and count >= 2
    except (ValueError, IndexError):
        fits = False
    if not fits or not np.all(np.isfinite([*begin, *end])):
        raise ValueError(f"a line is BEGIN:END or BEGIN:END:POINTS, such as 0,0.2:2.5,0.2, not '{text}'")
    first, last = (np.pad(x, (0, 3 - len(x))) for x in (begin, end))
    return first, last, count


def plot_line(
    folder: Path, number: int, moments: Sequence[Moment], text: str, fields: Sequence[str], units: Mapping[str, str]
) -> list[Path]:
    """Writes line_<number>.csv with all fields at all times, and draws the given ones. Returns the files."""
    begin, end, count = read_line(text)
    x = begin + np.linspace(0.0, 1.0, count)[:, None] * (end - begin)
    s = np.linalg.norm(x - begin, axis=1)
    tables = []
    for moment in moments:
        meshes = [_derived(import_pyvista().read(file), fields) for _, file in moment]
        tables.append({"s": s, **_coordinates(x), **_joined(meshes, x)})
    return _write(folder, f"line_{number}", moments, tables, fields, units)


def plot_surface(
    folder: Path, body: str, moments: Sequence[Moment], fields: Sequence[str], units: Mapping[str, str]
) -> list[Path]:
    """Writes surface_<body>.csv with all fields at all times; in 2D draws the given ones. Returns the files.

    Raises ValueError if there is no such body.
    """
    tables = []
    for moment in moments:
        files = {name_of(file): file for _, file in moment}
        if body not in files:
            raise ValueError(f"there is no body '{body}'; there are {', '.join(sorted(files))}")
        mesh = _derived(import_pyvista().read(files[body]), fields)
        points, s = surface_points(mesh)
        x = np.asarray(mesh.points)[points]
        columns = _columns(mesh.point_data, points)
        if s is not None:
            columns = {"s": s, **columns, **_along(columns, points, x)}
        tables.append({**_coordinates(x), **columns})
    return _write(folder, f"surface_{body}", moments, tables, fields, units)


def _along(columns: Table, points: NDArray[np.int64], x: Array) -> Table:
    """The shear stress along outlines, as column wall_shear_stress.s: it changes its sign where a flow separates."""
    if f"{SHEAR}.x" not in columns:
        return {}
    directions = np.concatenate([tangents(x[loop]) for loop in loops_of(points)])
    return {f"{SHEAR}.s": sum(columns[f"{SHEAR}.{axis}"] * directions[:, k] for k, axis in enumerate("xy"))}


def loops_of(points: NDArray[np.int64]) -> list[slice]:
    """Parts of a sequence of outlines, each of which ends with its first point."""
    found, start = [], 0
    for end in range(1, len(points)):
        if end > start and points[end] == points[start]:
            found.append(slice(start, end + 1))
            start = end + 1
    return found + ([slice(start, len(points))] if start < len(points) else [])


def tangents(x: Array) -> Array:
    """Unit vectors along a closed line at its points, from the one before to the one after, shape (n, 3)."""
    around = np.concatenate([x[-2:-1], x, x[1:2]])
    across = around[2:] - around[:-2]
    return np.asarray(across / np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None])


def name_of(file: Path) -> str:
    """The part whose output a file is."""
    return file.stem.rpartition("_")[0]


def sampled(mesh: Any, x: Array) -> Table:
    """The columns of all fields of a mesh at points, nan outside of it."""
    found = import_pyvista().PolyData(x).sample(mesh)
    outside = ~found.point_data["vtkValidPointMask"].astype(bool)
    columns = _columns({name: found.point_data[name] for name in mesh.point_data}, np.arange(len(x)))
    return {name: np.where(outside, np.nan, values) for name, values in columns.items()}


def inside_of(mesh: Any, x: Array) -> NDArray[np.bool_]:
    """Mask of the points inside of a body: of its cells, or of its closed surface."""
    if not is_solid(mesh) and LINE not in mesh.celltypes:
        return inside_surface(x, mesh.extract_surface(algorithm="dataset_surface"))
    filled = mesh if is_solid(mesh) else fill_lines(mesh.points, mesh.cells.reshape(-1, 3)[:, 1:]).surface
    return np.asarray(import_pyvista().PolyData(x).sample(filled).point_data["vtkValidPointMask"], dtype=bool)


def is_solid(mesh: Any) -> bool:
    """Whether a mesh has cells of the dimension of its space, and is not the surface of a rigid body."""
    return mesh.celltypes.min() > (TRIANGLE if np.ptp(np.asarray(mesh.points)[:, 2]) > 0.0 else LINE)


def _derived(mesh: Any, fields: Sequence[str]) -> Any:
    for field in fields:
        mesh = with_derived(mesh, field)
    return mesh


def _coordinates(x: Array) -> Table:
    return dict(zip("xyz", x.T, strict=True))


def _columns(data: Any, points: NDArray[np.int64]) -> Table:
    """The fields as columns NAME, or NAME.x for each component."""
    found: Table = {}
    for name in data:
        values = np.asarray(data[name], dtype=np.float64)[points]
        if values.ndim == 1:
            found[name] = values
        else:
            parts = FIELD_COMPONENTS.get(name, ("x", "y", "z"))
            found |= {f"{name}.{part}": column for part, column in zip(parts, values.T, strict=True)}
    return found


def _joined(meshes: Sequence[Any], x: Array) -> Table:
    """The columns of all parts, each with its values where it is; what bodies cover is no flow."""
    found: Table = {}
    covered = np.zeros(len(x), dtype=bool)
    for mesh in sorted(meshes, key=lambda mesh: "fluid_fraction" in mesh.cell_data):  # the flow is the last one
        flow = "fluid_fraction" in mesh.cell_data
        mine = ~covered if flow else inside_of(mesh, x)
        covered |= mine & (not flow)
        for name, values in (sampled(mesh, x) if is_solid(mesh) else {}).items():
            found[name] = np.where(mine, values, found.get(name, np.nan))
    return found


def _write(
    folder: Path,
    stem: str,
    moments: Sequence[Moment],
    tables: Sequence[Table],
    fields: Sequence[str],
    units: Mapping[str, str],
) -> list[Path]:
    times = [moment[0][0] for moment in moments]
    columns = list(dict.fromkeys(name for table in tables for name in table))
    lines = [",".join(["time", *columns])]
    for time, table in zip(times, tables, strict=True):
        missing = np.full(len(table["x"]), np.nan)
        rows = np.stack([table.get(name, missing) for name in columns], axis=1)
        lines += [",".join(repr(float(value)) for value in (time, *row)) for row in rows]
    path = folder / f"{stem}.csv"
    write_text(path, "\n".join(lines) + "\n")
    return [path, *_draw(folder, stem, times, tables, fields, units)]


def _draw(
    folder: Path, stem: str, times: Sequence[float], tables: Sequence[Table], fields: Sequence[str],
    units: Mapping[str, str],
) -> list[Path]:  # fmt: skip
    """One picture for each field, with curves at up to six times."""
    if any("s" not in table for table in tables):
        return []
    drawn = []
    shown = choose(len(times))
    length = unit_of("displacement", units, float(max(tables[i]["s"].max() for i in shown)))
    for field in fields:
        curves = {times[i]: values for i in shown if (values := _values(tables[i], field)) is not None}
        if not curves:
            known = sorted({name for table in tables for name in table} - {"s", "x", "y", "z"})
            raise ValueError(f"no part has a field '{field}' there; there are {', '.join(known)}")
        sizes = [float(np.abs(values[np.isfinite(values)]).max(initial=0.0)) for values in curves.values()]
        unit = field_unit(field, (0.0, max(sizes)), units)
        s = {times[i]: tables[i]["s"] * length.factor for i in shown}
        named = {f"t = {time:.4g} {units['time']}": (s[time], values * unit.factor) for time, values in curves.items()}
        along = f"{field}.s" in tables[0]
        text = unit.beside(f"{field} along s" if along else field if field in tables[0] else f"|{field}|")
        drawn.append(plot_lines(folder / f"{stem}_{field}.png", {text: named}, length.beside("s")))
    return drawn


def _values(table: Table, field: str) -> Array | None:
    """A column, along s where there is one, or the size of a field from its components."""
    for column in (f"{field}.s", field):
        if column in table:
            return table[column]
    parts = {name.rpartition(".")[2]: values for name, values in table.items() if name.rpartition(".")[0] == field}
    return component_of({field: np.stack(list(parts.values()), axis=1)}, field) if parts else None
