"""Pictures and tables of the structure's verification: python docs/make_pictures.py [RESULTS_FOLDER]

Runs what is not yet in RESULTS_FOLDER (default: results/verification; some minutes in all), draws into docs/pictures
and writes the tables of docs/verification_structure.md.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.bench.program import run_case
from fsci.plot.curves import COLOURS, CURVE_STYLE
from fsci.running.history import read_history
from fsci.running.output import read_collection
from fsci.running.verify import amplitude, frequency, mean, window

DOCS = Path(__file__).parent
PAGE = DOCS / "verification_structure.md"
CASES = DOCS.parent / "cases"
DOTS = 110  #: per inch

REFINE = "structure.bodies.flag.mesh.parameters.refine"
STATIC_MESHES = (1, 2, 4, 8)
#: (mesh, step [s]) of CSM3; the first three are the mesh family of the benchmark's step
SWINGS = ((1, 0.005), (2, 0.005), (4, 0.005), (1, 0.01), (1, 0.0025), (1, 0.00125))
#: u(A) [mm]: Turek and Hron 2006
STATIC_REFERENCE = {"csm1": ("-7.187", "-66.10"), "csm2": ("-0.4690", "-16.97")}

Array = NDArray[np.float64]
History = dict[str, Array]


def main(results: Path) -> None:
    sys.path[:0] = [str(DOCS.parent / "tests" / folder) for folder in ("setups", "fields")]
    static = {(name, refine): flag(results, name, refine) for name in STATIC_REFERENCE for refine in STATIC_MESHES}
    swings = {(refine, dt): flag(results, "csm3", refine, dt) for refine, dt in SWINGS}
    for name in STATIC_REFERENCE:
        draw_bent(f"{name}.png", last_state(folder_of(results, name, 4)))
    draw_swing("csm3.png", folder_of(results, "csm3", 1, 0.005))
    draw_curve("csm3_curve.png", swings[1, 0.005])
    draw_static("csm_meshes.png", static)
    write_table("static", static_rows(static))
    write_table("swing", swing_rows(swings))
    write_table("orders", orders("structure_orders.png"))
    write_table("time", time_orders("structure_time.png"))


# ------------------------------------------------------------------------------------------------------------ runs


def folder_of(results: Path, name: str, refine: int, dt: float | None = None) -> Path:
    return results / f"{name}_{refine}{'' if dt is None else f'_{dt:g}'}"


def flag(results: Path, name: str, refine: int, dt: float | None = None) -> History:
    """The history of a run of a case, from its folder if it was run before."""
    out = folder_of(results, name, refine, dt)
    summary = out / "summary.json"
    if not summary.exists() or json.loads(summary.read_text())["status"] != "finished":
        print(f"running {out.name}", flush=True)
        every = 10 if (refine, dt) == SWINGS[0] or dt is None else 0
        settings = {REFINE: refine, "output.fields_every": every, **({} if dt is None else {"time.step": dt})}
        run_case(CASES / name, out, settings)
    return read_history(out / "history.csv")


# ---------------------------------------------------------------------------------------------------------- tables


def write_table(name: str, rows: Sequence[Sequence[str]]) -> None:
    """Replace what stands between the marks of a table in the page; the first row is its head."""
    head, *body = rows
    lines = [head, ["---"] * len(head), *body]
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    begin, end = f"<!-- {name}: written by make_pictures.py -->", f"<!-- end of {name} -->"
    text = PAGE.read_text()
    before, rest = text.split(begin)
    after = rest.split(end)[1]
    PAGE.write_text(f"{before}{begin}\n\n{table}\n\n{end}{after}")


def cells(refine: int) -> str:
    return f"{35 * refine} x {2 * refine}"


def static_rows(runs: dict[tuple[str, int], History]) -> list[list[str]]:
    words = ("u_x [mm]", "u_y [mm]", "error of u_y")
    rows = [["cells", *(f"{name.upper()} {word}" for name in STATIC_REFERENCE for word in words)]]
    rows += [[cells(refine)] for refine in STATIC_MESHES] + [["extrapolated"], ["Turek and Hron"]]
    for name, reference in STATIC_REFERENCE.items():
        found = [[1e3 * runs[name, refine][column][-1] for refine in STATIC_MESHES] for column in ("A.x", "A.y")]
        x, y = ([*values, extrapolated(np.array(values))] for values in found)
        for row, ux, uy in zip(rows[1:-1], x, y, strict=True):
            row += [f"{ux:#.5g}", f"{uy:#.5g}", f"{100 * abs(uy / float(reference[1]) - 1):.2g} %"]
        rows[-1] += [*reference, ""]
    return rows


def swing_rows(runs: dict[tuple[int, float], History]) -> list[list[str]]:
    rows = [["cells", "step [s]", "u_x [mm]", "u_y [mm]", "frequency of u_y [Hz]"]]
    for (refine, dt), history in runs.items():
        late = {column: window(history["time"], history[column], 8.0) for column in ("A.x", "A.y")}
        x, y = (f"{1e3 * mean(*late[c]):.3f} +- {1e3 * amplitude(*late[c]):.3f}" for c in ("A.x", "A.y"))
        rows.append([cells(refine), f"{dt:g}", x, y, f"{frequency(history['time'], history['A.y']):.4f}"])
    return [*rows, ["Turek and Hron", "0.005", "-14.305 +- 14.305", "-63.607 +- 65.160", "1.0995"]]


# ------------------------------------------------------------------------------------------------ orders in space


def orders(picture: str) -> list[list[str]]:
    """Errors of the manufactured solution of the tests on the finest meshes, and a picture of all."""
    from structure_setup import CELL_TYPES
    from test_structure_orders import errors

    names = {
        "triangle": "tri3",
        "triangle6": "tri6",
        "quad": "quad4",
        "quad9": "quad9",
        "tetra": "tet4",
        "tetra10": "tet10",
        "hexahedron": "hex8",
        "hexahedron27": "hex27",
    }
    plane = ("triangle", "triangle6", "quad", "quad9")
    linear = ("triangle", "quad", "tetra", "hexahedron")
    rows = [["cell", "cells along an edge", "L2 error", "order in L2", "H1 error", "order in H1"]]
    curves: dict[str, tuple[Array, Array]] = {}
    for cell_type in CELL_TYPES:
        counts = ((4, 8, 16, 32) if cell_type in plane else (2, 4, 8, 12)) if cell_type in linear else (2, 4, 8)
        counts = counts if cell_type in linear or cell_type in plane else (1, 2, 4, 6)
        found = np.array([errors(cell_type, count) for count in counts])
        rates = np.diff(np.log(found), axis=0) / -np.diff(np.log(counts))[:, None]
        l2, h1 = (f"{error:.2e}" for error in found[-1])
        order_l2, order_h1 = (f"{rate:.2f}" for rate in rates[-1])
        rows.append([names[cell_type], str(counts[-1]), l2, order_l2, h1, order_h1])
        curves[names[cell_type]] = 1.0 / np.array(counts), found
    draw(picture, lambda figure: draw_orders(figure, curves), (8, 3.6))
    return rows


def draw_orders(figure: Any, curves: dict[str, tuple[Array, Array]]) -> None:
    panels = figure.subplots(1, 2)
    for column, (axes, norm) in enumerate(zip(panels, ("L2", "H1"), strict=True)):
        for index, (name, (h, errors)) in enumerate(curves.items()):
            style = "-" if name in ("tri3", "quad4", "tet4", "hex8") else "--"
            colour = COLOURS[index // 2]
            axes.loglog(h, errors[:, column], style, marker="o", color=colour, label=name)
        axes.set_xlabel("length of an edge")
        axes.set_ylabel(f"error in {norm}")
        for order, start, below in ((1, 0.045, "quad4"), (2, 0.17, "quad9")):
            h, errors = curves[below]
            error = np.exp(np.interp(np.log(start), np.log(h[::-1]), np.log(errors[::-1, column])))
            slope(axes, order + 1 - column, start, 0.5 * error)
    panels[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def slope(axes: Any, order: int, x: float, y: float) -> None:
    """A short line of the given order in a panel with logarithmic axes, and the number beside it."""
    axes.loglog((x, 2 * x), (y, y * 2.0**order), color="0.5", linewidth=1)
    axes.annotate(f" {order}", (1.5 * x, 0.8 * y * 1.5**order), color="0.4", fontsize=9, ha="left", va="top")


# ------------------------------------------------------------------------------------------------- orders in time


def time_orders(picture: str) -> list[list[str]]:
    """The thrown beam of the tests: error at the end against the step, for three amounts of damping."""
    from test_structure_time import swing

    steps = 0.02 / 2.0 ** np.arange(6)
    finest = steps[-1] / 4
    reference = swing(1.0, finest)
    rows = [["step [s]", *(f"rho_inf = {rho:g}" for rho in (1.0, 0.8, 0.0))]]
    found = {}
    for rho in (1.0, 0.8, 0.0):
        size = np.linalg.norm(reference)
        found[rho] = np.array([np.linalg.norm(swing(rho, dt) - reference) / size for dt in steps])
    for index, dt in enumerate(steps):
        row = [f"{dt:g}"]
        for error in found.values():
            rate = "" if index == 0 else f" ({np.log2(error[index - 1] / error[index]):.2f})"
            row.append(f"{error[index]:.2e}{rate}")
        rows.append(row)

    def picture_of(figure: Any) -> None:
        axes = figure.subplots()
        for colour, (rho, error) in zip(COLOURS, found.items(), strict=False):
            axes.loglog(steps, error, marker="o", color=colour, label=f"rho_inf = {rho:g}")
        axes.set_xlabel("step [s]")
        axes.set_ylabel("error of the position at 0.4 s")
        slope(axes, 2, 2e-3, 8e-5)
        axes.legend()

    draw(picture, picture_of, (5, 3.4))
    return rows


# -------------------------------------------------------------------------------------------------------- pictures


def draw(name: str, content: Callable[[Any], None], size: tuple[float, float]) -> None:
    """One picture: `content` fills a figure of `size` inches."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context({**CURVE_STYLE, "font.size": 10}):
        figure = Figure(size, dpi=DOTS, layout="constrained")
        content(figure)
        figure.savefig(DOCS / "pictures" / name)
    print(f"pictures/{name}", flush=True)


def draw_static(name: str, runs: dict[tuple[str, int], History]) -> None:
    def content(figure: Any) -> None:
        axes = figure.subplots()
        for colour, case in zip(COLOURS, STATIC_REFERENCE, strict=False):
            for column, style in (("A.x", "--"), ("A.y", "-")):
                values = np.array([runs[case, refine][column][-1] for refine in STATIC_MESHES])
                axes.loglog(
                    STATIC_MESHES[:-1],
                    np.abs(values[:-1] / extrapolated(values) - 1),
                    style,
                    marker="o",
                    color=colour,
                    label=f"{case.upper()} u_{column[-1]}",
                )
        axes.axhline(1e-3, color="0.5", linewidth=1)
        axes.annotate("0.1 %", (1.0, 1.05e-3), color="0.4", fontsize=9, va="bottom")
        axes.set_ylim(2e-4, 1e-2)
        axes.set_xticks(STATIC_MESHES[:-1], [cells(refine) for refine in STATIC_MESHES[:-1]])
        axes.minorticks_off()
        axes.set_xlabel("cells")
        axes.set_ylabel("error of u(A), relative")
        axes.legend()

    draw(name, content, (5, 3.4))


def extrapolated(values: Array) -> float:
    """The limit of a sequence whose last two differences have a constant ratio (Aitken)."""
    a, b, c = values[-3:]
    return float(c - (c - b) ** 2 / (c - 2 * b + a))


def draw_curve(name: str, history: History) -> None:
    def content(figure: Any) -> None:
        axes = figure.subplots()
        for colour, column, (middle, size) in zip(
            COLOURS, ("A.y", "A.x"), ((-63.607, 65.160), (-14.305, 14.305)), strict=False
        ):
            axes.plot(history["time"], 1e3 * history[column], color=colour, label=f"u_{column[-1]}")
            for level in (middle - size, middle + size):
                axes.axhline(level, color=colour, linewidth=0.7, linestyle=":")
        axes.set_xlabel("time [s]")
        axes.set_ylabel("displacement of A [mm]")
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)

    draw(name, content, (8, 3.2))


def last_state(folder: Path) -> Path:
    return read_collection(folder / "fields" / "flag.pvd")[-1][1]


def draw_bent(name: str, path: Path) -> None:
    """The bent flag and its outline before."""

    def content(figure: Any) -> None:
        axes = figure.subplots()
        outline(axes, path)
        colours = paint(axes, [path])
        dress(figure, axes, colours, low=0.105)

    draw(name, content, (8, 2.9))


def draw_swing(name: str, folder: Path) -> None:
    """The flag at four times of its first way down, and the way of its tip."""
    series = read_collection(folder / "fields" / "flag.pvd")
    states = [path for time, path in series if min(abs(time - chosen) for chosen in (0.0, 0.15, 0.25, 0.45)) < 1e-6]
    history = read_history(folder / "history.csv")

    def content(figure: Any) -> None:
        axes = figure.subplots()
        colours = paint(axes, states)
        axes.plot(0.6 + history["A.x"], 0.2 + history["A.y"], color=COLOURS[0], linewidth=1.0, zorder=-1)
        axes.plot(0.6 + history["A.x"][0], 0.2, "o", color=COLOURS[0], markersize=4)
        axes.annotate("A", (0.605, 0.2), color=COLOURS[0], va="center")
        dress(figure, axes, colours, low=0.045)

    draw(name, content, (8, 3.8))


def dress(figure: Any, axes: Any, colours: Any, *, low: float) -> None:
    """Cylinder, scale and frame around a flag."""
    from matplotlib.patches import Circle

    axes.add_patch(Circle((0.2, 0.2), 0.05, color="0.75", linewidth=0))
    axes.set_aspect("equal")
    axes.set_xlim(0.14, 0.62)
    axes.set_ylim(low, 0.26)
    axes.axis("off")
    figure.colorbar(colours, ax=axes, label="von Mises stress [kPa]", shrink=0.75, pad=0.01)


def paint(axes: Any, states: Sequence[Path]) -> Any:
    """Flags coloured by their stress on one scale, and their outlines."""
    import meshio

    meshes = [meshio.read(path) for path in states]
    stresses = [mesh.point_data["von_mises"] / 1e3 for mesh in meshes]
    high = max(float(np.percentile(stress, 99.0)) for stress in stresses)
    colours = None
    for mesh, stress in zip(meshes, stresses, strict=True):
        points, nine = mesh.points[:, :2], mesh.cells_dict["quad9"]
        ring = nine[:, [0, 4, 1, 5, 2, 6, 3, 7]]
        triangles = np.concatenate([np.stack([ring[:, i], ring[:, (i + 1) % 8], nine[:, 8]], axis=1) for i in range(8)])
        colours = axes.tripcolor(
            points[:, 0], points[:, 1], triangles, stress, shading="gouraud", cmap="YlOrRd", vmin=0, vmax=high
        )
        for line in edge_lines(mesh):
            axes.plot(*points[line].T, color="black", linewidth=0.5)
    return colours


def outline(axes: Any, path: Path) -> None:
    """The flag before it was loaded."""
    import meshio

    mesh = meshio.read(path)
    before = (mesh.points - mesh.point_data["displacement"])[:, :2]
    for line in edge_lines(mesh):
        axes.plot(*before[line].T, color="0.5", linewidth=0.8, linestyle="--")


def edge_lines(mesh: Any) -> list[Array]:
    """Nodes along the edges that belong to one cell only, three each."""
    nine = mesh.cells_dict["quad9"]
    edges = np.concatenate([nine[:, [i, 4 + i, (i + 1) % 4]] for i in range(4)])
    _, first, count = np.unique(edges[:, 1], return_index=True, return_counts=True)
    return list(edges[first[count == 1]])


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS.parent / "results" / "verification")
