"""Pictures and tables of the contact pages from finished runs: make_contact_pictures.py RESULTS_FOLDER...

Every folder gives what is in it. The pictures of this documentation come from

    fsci run cases/two_tori -o results/two_tori
    fsci run cases/two_tori -o results/tori_close --set output.fields_every=1 --set time.end=5.6 --set 'verify=[]'
    fsci run cases/sphere_tube -o results/sphere_tube
    python docs/make_contact_pictures.py results/two_tori results/tori_close results/sphere_tube

The second run is for two times 0.05 apart, at which the first one keeps no fields. Runs of the cases in PANELS, each in
a folder of the name of the case, give one picture each.
"""

from __future__ import annotations

import json
import sys
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.plot.curves import COLOURS, CURVE_STYLE
from fsci.plot.render import ROUND, SUPERSAMPLING, View, face_edges, frame, import_pyvista, photograph, polylines
from fsci.running.history import read_history
from fsci.running.output import read_collection

DOCS = Path(__file__).parent
PAGE = DOCS / "verification_contact.md"
LIGHT = ("#a9c9e8", "#f2c9a0", "#b9dfb5", "#d9c3e8")
#: colours of bodies, where they are not given in the order of their names
COLOUR = {"lower": LIGHT[1], "middle": LIGHT[2], "upper": LIGHT[0], "sphere": LIGHT[1], "tube": LIGHT[0]}
PAPER_TIMES = (3, 5, 7, 7.5, 8, 10)
CLOSE_TIMES = (5.5, 5.55)
#: name of a run -> (times, panels in a row, camera)
PANELS: dict[str, tuple[tuple[float, ...], int, tuple[float, float, float]]] = {
    "double_arch": ((0, 15, 35, 50, 60, 70), 3, (0.0, 0.0, 1.0)),
    "ironing": ((0, 1, 3, 5), 2, (0.0, 0.0, 1.0)),
    "two_tori_friction": (PAPER_TIMES, 3, (0.1, -1.0, 0.35)),
    "tied_cube": ((0, 1), 2, (0.5, -1.0, 0.4)),
    "self_contact_fold": ((0, 0.6, 0.8, 1), 2, (0.0, 0.0, 1.0)),
}
PIXELS = 1200  #: width of a picture

#: residuals per Newton step, and how many of the first steps changed the active set; Popp & Wall, tables 1 and 2
PAPER = {
    "two_tori": {
        "91": ("t = 4.5 to 4.55", (1.09e6, 2.16e4, 4.05e0, 1.53e-4, 2.46e-8), 2),
        "111": ("t = 5.5 to 5.55", (1.04e6, 3.60e4, 1.38e1, 2.11e-3, 2.77e-8), 3),
    },
    "sphere_tube": {
        "12": ("inflation, step 12", (3.08e0, 1.10e0, 6.82e-3, 6.74e-8, 5.04e-11), 1),
        "33": ("push, step 33", (3.39e1, 4.80e0, 3.35e-2, 5.62e-6, 4.87e-11), 3),
    },
}

Array = NDArray[np.float64]


def main(folders: list[Path]) -> None:
    """Draw and tabulate what the folders hold."""
    for folder in folders:
        states = {path.stem: dict(read_collection(path)) for path in sorted((folder / "fields").glob("*.pvd"))}
        if "lower" in states and folder.name not in PANELS:
            draw_tori(folder, states)
        elif folder.name == "cattaneo_mindlin":
            draw_shear(folder, states["cylinder"])
        elif "tube" in states:
            draw_tube(states)
            write_table(folder, "sphere_tube")
        elif folder.name in PANELS:
            times, columns, camera = PANELS[folder.name]
            flat = camera[:2] == (0.0, 0.0)
            axes = axes_towards(*camera, up=(0.0, 1.0, 0.0) if flat else (0.0, 0.0, 1.0))
            panel(folder.name, states, times, columns=columns, axes=axes)


def draw_tori(folder: Path, states: dict[str, dict[float, Path]]) -> None:
    if all(find(states["lower"], time) for time in PAPER_TIMES):
        panel("two_tori", states, PAPER_TIMES, columns=3, axes=axes_towards(0.1, -1.0, 0.35))
        draw_balances(folder)
        write_table(folder, "two_tori")
    if all(find(states["lower"], time) for time in CLOSE_TIMES):
        panel("two_tori_traction", states, CLOSE_TIMES, columns=2, axes=axes_towards(1.0, -0.7, 1.1), arrows="lower")


def draw_tube(states: dict[str, dict[float, Path]]) -> None:
    axes = axes_towards(-0.45, 1.0, -0.55, up=(1.0, 0.0, 0.0))
    panel("sphere_tube", states, (0.2, 0.32, 0.4), columns=3, axes=axes, halved="tube")


def find(series: dict[float, Path], time: float) -> Path | None:
    """The file of a time, times being sums of steps."""
    return next((path for t, path in series.items() if abs(t - time) < 1e-6), None)


def axes_towards(x: float, y: float, z: float, up: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> Array:
    """Unit vectors right, up and towards the camera as columns, for a camera in the direction (x, y, z)."""
    away = np.array([x, y, z]) / np.linalg.norm([x, y, z])
    right = np.cross(up, away)
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(away, right), away])


def panel(
    name: str,
    states: dict[str, dict[float, Path]],
    times: tuple[float, ...],
    *,
    columns: int,
    axes: Array,
    arrows: str | None = None,
    halved: str | None = None,
) -> None:
    """Deformed bodies at some times beside each other, all seen by the same camera.

    `arrows`: the only body shown, with its contact tractions; `halved`: body of which only the half y < 0 is shown.
    """
    pyvista = import_pyvista()
    shown = [arrows] if arrows else list(states)
    grids = [{body: pyvista.read(find(states[body], time)) for body in shown} for time in times]
    if halved:
        for grid in grids:
            back = grid[halved].cell_centers().points[:, 1] < 0
            grid[halved] = grid[halved].extract_cells(np.flatnonzero(back))
    seen = np.vstack([mesh.points @ axes for grid in grids for mesh in grid.values()])
    low, high = seen.min(axis=0), seen.max(axis=0)
    if arrows:
        low, high = low - 0.1 * (high - low), high + 0.1 * (high - low)
    aspect = float((high - low)[0] / (high - low)[1])
    view = frame(axes, low, high, aspect=aspect)
    rows = -(-len(times) // columns)
    width = PIXELS // columns
    pixels = (width, round(width / aspect))
    largest = max(float(norms(grid[arrows]).max()) for grid in grids) if arrows else 0.0

    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context({**CURVE_STYLE, "axes.grid": False}):
        figure = Figure((PIXELS / 150, rows * (pixels[1] + 45) / 150), dpi=150)
        for place, (time, grid) in enumerate(zip(times, grids, strict=True)):
            row, column = divmod(place, columns)
            height = pixels[1] / (pixels[1] + 45) / rows
            part = figure.add_axes((column / columns, 1 - (row + 1) / rows, 1 / columns, height))
            part.imshow(render(grid, view, pixels, arrows, largest), interpolation="none")
            part.set_axis_off()
            title = f"t = {time:g}"
            if arrows:
                title += f", largest traction {norms(grid[arrows]).max():.3g} Pa"
            part.set_title(title, pad=3)
        save(figure, name)


def norms(mesh: Any) -> Array:
    return np.linalg.norm(mesh.point_data["contact_traction"], axis=1)


def render(grid: dict[str, Any], view: View, size: tuple[int, int], arrows: str | None, largest: float) -> Any:
    """The picture of one time, shape (height, width, 3)."""
    pyvista = import_pyvista()

    plotter = pyvista.Plotter(
        off_screen=True, window_size=[SUPERSAMPLING * length for length in size], lighting="light kit"
    )
    plotter.set_background("white")
    away = np.cross(view.right, view.up)
    for index, (body, mesh) in enumerate(sorted(grid.items())):
        surface = mesh.extract_surface(algorithm="dataset_surface")
        plotter.add_mesh(surface, color=COLOUR.get(body, LIGHT[index % len(LIGHT)]), **ROUND)
        edges, _ = face_edges(surface.cast_to_unstructured_grid())
        lines = polylines(edges + 0.004 * view.half_height * away)
        plotter.add_mesh(lines, color="black", line_width=1, opacity=0.45, lighting=False)
        if body == arrows:
            pressed = norms(mesh) > 0
            where, traction = mesh.points[pressed], mesh.point_data["contact_traction"][pressed]
            length = 0.4 * view.half_height / largest
            for tip, pull in zip(where, traction, strict=True):  # tips on the surface, shafts outside
                plotter.add_mesh(
                    pyvista.Arrow(
                        start=tip - length * pull,
                        direction=pull,
                        scale=length * float(np.linalg.norm(pull)),
                        tip_radius=0.07,
                        shaft_radius=0.022,
                        tip_length=0.3,
                    ),
                    color=COLOURS[1],
                    lighting=False,
                )
    return photograph(plotter, view, away, size)


def draw_balances(folder: Path) -> None:
    """Energies, the relative error of their sum, and momentum over time."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    history = read_history(folder / "history.csv")
    time = history["time"]
    total, momentum = history["energy.total"], history["momentum.x"]
    with rc_context(CURVE_STYLE):
        figure = Figure((10, 4.2), dpi=150, layout="constrained")
        left, middle, right = figure.subplots(1, 3)
        for part, colour in zip(("total", "kinetic", "internal"), COLOURS, strict=False):
            left.plot(time, history[f"energy.{part}"], color=colour, label=part)
        left.set(title="energy [J]", xlabel="t [s]")
        left.legend()
        middle.plot(time, 100 * (total / total[0] - 1), color=COLOURS[0])
        middle.set(title="change of total [%]", xlabel="t [s]")
        for axis, colour in zip("xyz", COLOURS, strict=False):
            change = np.abs(history[f"momentum.{axis}"] - history[f"momentum.{axis}"][0]) / np.abs(momentum[0])
            right.semilogy(time, np.maximum(change, 1e-18), color=colour, label=axis)
        right.set(title="change of momentum", xlabel="t [s]")
        right.legend()
        save(figure, "two_tori_energy")


def draw_shear(folder: Path, cylinder: dict[float, Path]) -> None:
    """Pressure and shear under the cylinder beside the exact ones of the same forces."""
    import meshio
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    E, nu, radius, mu = 1000.0, 0.3, 200.0, 0.4  # of the case
    mesh = meshio.read(cylinder[max(cylinder)])
    history = read_history(folder / "history.csv")
    along, across = abs(history["contact.touch.x"][-1]), abs(history["contact.touch.y"][-1])
    a = np.sqrt(8.0 * across * radius * (1.0 - nu**2) / (np.pi * E))
    c = a * np.sqrt(1.0 - along / (mu * across))
    pressed = mesh.point_data["contact_pressure"] > 0
    x = mesh.points[pressed, 0]
    order = np.argsort(x)
    x, pressure = x[order], mesh.point_data["contact_pressure"][pressed][order]
    shear = np.linalg.norm(mesh.point_data["contact_friction"][pressed][order], axis=1)
    status = mesh.point_data["contact_status"][pressed][order]
    s = np.linspace(-a, a, 801)
    peak = 2.0 * across / (np.pi * a)
    exact = peak / a * np.sqrt(a**2 - s**2)
    inner = mu * peak / a * np.sqrt(np.maximum(c**2 - s**2, 0.0))
    with rc_context(CURVE_STYLE):
        figure = Figure((8, 4.5), dpi=150, layout="constrained")
        axes = figure.subplots()
        middle = x.mean()
        axes.plot(s, exact, color=COLOURS[0], label="pressure, exact")
        axes.plot(s, mu * exact - inner, color=COLOURS[1], label="shear, exact")
        axes.plot(x - middle, pressure, "o", color=COLOURS[0], markersize=3, label="pressure")
        axes.plot(x - middle, shear, "o", color=COLOURS[1], markersize=3, label="shear")
        axes.set(xlabel="x [m]", ylabel="[Pa]")
        axes.legend()
        save(figure, "cattaneo_mindlin")
    width = 0.5 * (np.ptp(x[status == 2]) + np.diff(x).min())
    largest = mu * peak * np.sqrt(1.0 - (c / a) ** 2)
    print(f"a {a:.4f}, stick {width:.4f} of {c:.4f}, shear {shear.max():.4f} of {largest:.4f}, ", end="")
    print(f"pressure {pressure.max():.4f} of {peak:.4f}")


def save(figure: Any, name: str) -> None:
    """Few colours are enough and keep the file small."""
    from io import BytesIO

    from PIL import Image

    buffer = BytesIO()
    figure.savefig(buffer, dpi=150)
    picture = Image.open(buffer).convert("RGB").quantize(128, dither=Image.Dither.NONE)
    path = DOCS / "pictures" / f"{name}.png"
    path.parent.mkdir(exist_ok=True)
    picture.save(path, optimize=True)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def write_table(folder: Path, case: str) -> None:
    """Residuals per Newton step beside the paper's, between the two marks of the page."""
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    history = read_history(folder / "history.csv")
    found, changes = summary["newton"]["residuals"], history["contact.changes"]
    heads, columns, last = [], [], ["changes of the set"]
    for step, (text, published, starred) in PAPER[case].items():
        heads += [f"{text}: paper", "fsci"]
        stars = [f"{value:.2e}{' *' if i < starred else ''}" for i, value in enumerate(published)]
        columns += [stars, [f"{value:.2e}" for value in found[step]]]
        last += [str(starred), f"{changes[np.asarray(history['step']) == int(step)][0]:g}"]
    lines = ["| Newton step | " + " | ".join(heads) + " |", "|---" * (len(heads) + 1) + "|"]
    for number, row in enumerate(zip_longest(*columns, fillvalue=""), start=1):
        lines.append(f"| {number} | " + " | ".join(row) + " |")
    lines.append("| " + " | ".join(last) + " |")
    newton, steps = summary["newton"], summary["steps"]
    lines += [
        "",
        f"{steps['accepted']} steps, {steps['retried']} retried; {newton['total']} Newton steps in all, "
        f"at most {newton['max']} in one time step.",
    ]
    begin, end = f"<!-- {case}: written by make_contact_pictures.py -->", f"<!-- end of {case} -->"
    before, rest = PAGE.read_text(encoding="utf-8").split(begin)
    PAGE.write_text(before + "\n".join([begin, "", *lines, "", end]) + rest.split(end)[1], encoding="utf-8")


if __name__ == "__main__":
    main([Path(name) for name in sys.argv[1:]])
