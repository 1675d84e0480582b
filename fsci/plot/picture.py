"""Pictures of a run, finished or not, from the files in its results folder."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fsci.plot.along import plot_line, plot_surface
from fsci.plot.curves import CURVE_DOTS, plot_convergence, plot_history, save_figure
from fsci.plot.frames import Moment
from fsci.plot.mirror import Mirror, read_plane
from fsci.plot.movie import plot_movie
from fsci.plot.render import ISOMETRIC, Array, import_pyvista, load_body
from fsci.plot.render_flow import is_dry, is_flat, is_flow, load_meshes, load_state
from fsci.plot.scene import compose, draw
from fsci.plot.storyboard import choose, plot_story
from fsci.plot.units import unit_of
from fsci.running.files import make_folder, require_own
from fsci.running.history import read_history
from fsci.running.output import Series, read_collection
from fsci.running.results_folder import list_pictures
from fsci.running.vtkhdf import VTKHDF_FILE, unpack

STRUCTURE_FIELDS = ("displacement",)  #: default field of structures
FLUID_FIELDS = ("velocity", "pressure")
CONTACT_PRESSURE = "contact_pressure"
SIDEWAYS = 0.8  #: sideways component of the view of a contact surface, relative to its normal
FLOW_CROP = 1.0  #: percent of the points of a flow in space whose values may lie above the colour bar


@dataclass(frozen=True)
class Labels:
    """Texts in the pictures of a run, from its case file."""

    title: str
    units: Mapping[str, str] = field(default_factory=lambda: {"length": "m", "mass": "kg", "time": "s"})
    quantities: Mapping[str, str] = field(default_factory=dict)  #: probe -> its quantity


def plot_run(
    out: Path,
    *,
    movie: bool = False,
    field: str | None = None,
    times: Sequence[float] = (),
    scale: float = 1.0,
    mirrors: Sequence[str] = (),
    lines: Sequence[str] = (),
    surfaces: Sequence[str] = (),
) -> list[Path]:
    """Draws the states, the probes and the convergence of the run in folder `out` into out/pictures.

    `field` is what colours show: a point field (a vector's magnitude) or a component such as velocity.x; by default the
    displacement, of a flow velocity and pressure. `movie` adds an animation of all output times. With `times` only the
    states nearest to them are drawn, without a flow displacements times `scale`. `mirrors` are planes of symmetry such
    as y=0, of which one side was computed: both are drawn. With `lines`, such as 0,0.2:2.5,0.2, or `surfaces` of bodies
    only fields along them are written as tables and drawn. Returns the files; raises ValueError if no body has the
    field, or a body is on both sides of a plane, or what is along lines or beside a flow has a scale.
    """
    require_own(out)
    if scale != 1.0 and (lines or surfaces):
        raise ValueError("fields along lines and surfaces have no scale: leave --scale out")
    planes = [read_plane(text) for text in mirrors]
    with tempfile.TemporaryDirectory() as folder:
        mirror = Mirror(planes, Path(folder), scale)
        if lines or surfaces:
            drawn = _along(Path(out), field, times, mirror, lines, surfaces)
        else:
            drawn = _plot(Path(out), movie, field, times, mirror)
    list_pictures(Path(out) / "pictures", drawn)
    return drawn


def _along(
    out: Path, field: str | None, times: Sequence[float], mirror: Mirror, lines: Sequence[str], surfaces: Sequence[str]
) -> list[Path]:
    """Tables and curves along lines and surfaces of bodies, at all output times or those nearest to `times`."""
    units, folder = read_labels(out).units, out / "pictures"
    moments = chosen_moments(out, mirror, times)
    flow = is_flow(moments[-1][0][1])
    names = (field,) if field else FLUID_FIELDS if flow else STRUCTURE_FIELDS
    of_body = (field,) if field else ("traction", "wall_shear_stress") if flow else STRUCTURE_FIELDS
    make_folder(folder)
    drawn = []
    for number, text in enumerate(lines, 1):
        drawn += plot_line(folder, number, moments, text, names, units)
    for body in surfaces:
        drawn += plot_surface(folder, body, moments, of_body, units)
    return drawn


def chosen_moments(out: Path, mirror: Mirror, times: Sequence[float]) -> list[Moment]:
    """The output times, or of them those nearest to the given times. Raises ValueError without any."""
    moments: list[Moment] = list(zip(*read_series(out / "fields", mirror), strict=False))
    if not moments:
        raise ValueError(f"there are no fields in '{out}'")
    return [min(moments, key=lambda moment: abs(moment[0][0] - time)) for time in times] or moments


def _plot(out: Path, movie: bool, field: str | None, times: Sequence[float], mirror: Mirror) -> list[Path]:
    labels = read_labels(out)
    if mirror.factor != 1.0:
        labels = replace(labels, title=f"{labels.title}, displacements times {mirror.factor:g}")
    folder = out / "pictures"
    make_folder(folder)
    moments: list[Moment] = list(zip(*read_series(out / "fields", mirror), strict=False))
    flow = bool(moments) and is_flow(moments[-1][0][1])
    names = (field,) if field else FLUID_FIELDS if flow else STRUCTURE_FIELDS
    if times:
        return [
            plot_state(folder / f"{name}_{moment[0][0]:.6g}.png", moment, name, labels)
            for moment in chosen_moments(out, mirror, times)
            for name in names
        ]
    drawn, flat = [], bool(moments) and is_flat(import_pyvista().read(moments[-1][0][1]))
    if moments:
        failed = [] if field else plot_failed(out, folder, names, labels, mirror)
        shown = [name for name in names if not (failed and at_rest(moments[-1], name))]
        drawn += [plot_state(folder / f"final_{name}.png", moments[-1], name, labels) for name in shown] + failed
        if not field:
            drawn += plot_more(folder, moments, labels, flow=flow)
        if movie:
            drawn += plot_movie(folder, moments, names[0], labels.title, labels.units)
    if (out / "history.csv").exists():
        drawn += plot_history(folder, read_history(out / "history.csv"), labels.quantities, labels.units, flat=flat)
    if (out / "summary.json").exists():
        residuals = json.loads((out / "summary.json").read_text(encoding="utf-8"))["newton"]["residuals"]
        if residuals:
            drawn.append(plot_convergence(folder / "convergence.png", residuals))
    return drawn


def plot_more(folder: Path, moments: Sequence[Moment], labels: Labels, *, flow: bool) -> list[Path]:
    """Further pictures of a run: mesh, flow over time, the state before contact, and contact pressure."""
    drawn = [plot_mesh(folder / "mesh.png", moments[0], labels)]
    peaks = [largest_pressure(moment[flow:]) for moment in moments]
    touching = [index for index, peak in enumerate(peaks) if peak > 0]
    if flow and len(moments[0]) > 1 and len(moments) > 2:  # start and end of a steady flow are no story
        shown = [moments[index] for index in choose(len(moments), touching[:1])]
        drawn.append(plot_story(folder / "story_velocity.png", shown, labels.title, labels.units))
        if touching and touching[0] > 0:
            before = moments[touching[0] - 1]
            drawn.append(plot_state(folder / "before_contact_velocity.png", before, "velocity", labels))
    if touching:
        name = "final" if touching[-1] == len(moments) - 1 else "last"
        peak = int(np.argmax(peaks))
        unit = unit_of(CONTACT_PRESSURE, labels.units, peaks[peak])
        at = f"{moments[peak][0][0]:.4g} {labels.units['time']}"
        title = f"{labels.title}, largest {peaks[peak] * unit.factor:.3g} {unit.text} at {at}"
        named = replace(labels, title=title)
        drawn.append(plot_pressure(folder / f"{name}_contact_pressure.png", moments[touching[-1]], named))
    return drawn


def plot_failed(out: Path, folder: Path, names: Sequence[str], labels: Labels, mirror: Mirror) -> list[Path]:
    """Pictures of the iterate that failed, of a run that ended with a failed step."""
    series = read_series(out / "failure" / "fields", mirror)
    if not series:
        return []
    moment = tuple(part[-1] for part in series)
    labels = replace(labels, title=f"{labels.title}: iterate that failed")
    shown = [name for name in names if not at_rest(moment, name)]
    return [plot_state(folder / f"failed_{name}.png", moment, name, labels) for name in shown]


def at_rest(moment: Moment, name: str) -> bool:
    """Whether a field is zero everywhere, or not a number: its colours would show nothing."""
    values = [body.values for body in load_state([file for _, file in moment], name) if body.values is not None]
    return not any(np.nan_to_num(each).any() for each in values)


def read_series(folder: Path, mirror: Mirror) -> list[Series]:
    """The files of all whole parts: a flow, dry sides, then bodies, which are drawn on top of what is before them."""
    packed = folder / VTKHDF_FILE
    if packed.is_file():
        parts = unpack(packed, Path(tempfile.mkdtemp(dir=mirror.folder)))
    else:
        parts = [series for path in sorted(folder.glob("*.pvd")) if (series := read_collection(path))]
    return sorted(mirror.whole(parts), key=_layer)


def _layer(series: Series) -> tuple[bool, bool]:
    kinds = import_pyvista().read(series[-1][1]).cell_data
    return "fluid_fraction" not in kinds, "dry" not in kinds


def plot_state(path: Path, moment: Moment, name: str, labels: Labels) -> Path:
    """Draws the state of all bodies at one time, coloured by the field `name`."""
    time, first = moment[0]
    state = load_state([file for _, file in moment], name)
    crop = FLOW_CROP if is_flow(first) else 0.0
    scene = compose([state], name, labels.title, labels.units, crop=crop)
    save_figure(draw(scene, state, time, dots=CURVE_DOTS), path)
    return path


def plot_mesh(path: Path, moment: Moment, labels: Labels) -> Path:
    """Draws the elements of all bodies and the cells of a flow."""
    state = load_meshes([file for _, file in moment])
    save_figure(draw(compose([state], None, labels.title, labels.units), state, moment[0][0], dots=CURVE_DOTS), path)
    return path


def plot_pressure(path: Path, moment: Moment, labels: Labels) -> Path:
    """Draw the contact pressure on the bodies that have one, viewed from the side on which it acts."""
    loaded = [load_body(file, CONTACT_PRESSURE) for time, file in moment if largest_pressure(((time, file),)) > 0]
    # between the nodes of second-order cells the interpolated pressure may be negative
    bodies = [replace(body, values=np.maximum(body.values, 0.0)) for body in loaded if body.values is not None]
    others = [file for _, file in moment if not (is_flow(file) or is_dry(file))]
    flat = is_flat(bodies[0].surface)  # in space what touches a body would hide it
    rigid = [part for file in others for part in load_state([file], CONTACT_PRESSURE) if part.rigid] if flat else []
    towards = np.sum([np.sum(body.surface.point_data["contact_traction"], axis=0) for body in bodies], axis=0)
    away = look_at(-towards)
    parts = [*(replace(part, aside=True) for part in rigid), *bodies]
    scene = compose([parts], CONTACT_PRESSURE, labels.title, labels.units, away=away, colours="Reds")
    save_figure(draw(scene, parts, moment[0][0], dots=CURVE_DOTS), path)
    return path


def look_at(normal: Array) -> Array:
    """The direction of view onto a surface with this outward normal, slightly from the side."""
    length = np.linalg.norm(normal)
    if length == 0.0:
        return ISOMETRIC
    normal = normal / length
    away = normal + SIDEWAYS * (ISOMETRIC - (ISOMETRIC @ normal) * normal)
    return np.asarray(away / np.linalg.norm(away))


def largest_pressure(moment: Moment) -> float:
    """The largest contact pressure of all bodies; zero without contact."""
    data = [import_pyvista().read(file).point_data for _, file in moment]
    return max((float(fields[CONTACT_PRESSURE].max()) for fields in data if CONTACT_PRESSURE in fields), default=0.0)


def read_labels(out: Path) -> Labels:
    """Reads title, units and probes from the copy of the case that a run keeps."""
    from ruamel.yaml import YAML, YAMLError

    path = out / "case.yaml"
    try:
        case = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8")) if path.exists() else {}
        quantities = {name: str(probe["quantity"]) for name, probe in (case.get("probes") or {}).items()}
        units = {name: str(unit) for name, unit in {**Labels("").units, **(case.get("units") or {})}.items()}
        title = str(case.get("title") or out.resolve().name)
    except (YAMLError, ValueError, AttributeError, KeyError, TypeError):
        raise ValueError(f"{path} is not the case of a run: fsci check {path} says what is wrong with it") from None
    return Labels(title, units, quantities)
