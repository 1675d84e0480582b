"""Curves of a run for print: probes over time and the convergence of Newton's method."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fsci.plot.tidy import tidy
from fsci.plot.units import Unit, label, literal, measured, unit_of
from fsci.running.files import replacing
from fsci.running.history import COLUMNS, History

CURVE_SIZE = (8.0, 5.0)  #: of a picture in inches; 1600 x 1000 pixels
PANEL = 2.2  #: height of each of several panels [inch]
MOST_ROWS = 6  #: panels above each other; more stand in columns
CURVE_DOTS = 200  #: per inch
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  #: told apart by colour-blind readers
CURVE_STYLE: Any = {
    "font.size": 12,
    "axes.linewidth": 0.8,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "lines.markersize": 5,
    "legend.frameon": False,
    "figure.constrained_layout.h_pad": 0.1,
    "figure.constrained_layout.w_pad": 0.1,
    "mathtext.default": "regular",
}

#: Balances in the history -> their titles; all vanish without errors of solvers and time steps.
BALANCES = {
    "structure.energy": ("error of the structure's energy", "energy"),
    "fluid.mass": ("error of the fluid's volume", "flow_rate"),
    "fluid.leak": ("volume through surfaces of bodies", "flow_rate"),
    "interface.momentum": ("error of the fluid's momentum", "force"),
    "fluid.loss": ("numerical dissipation of the fluid", "dissipation"),
    "interface.work": ("error of the work at the interface", "energy"),
    "interface.force": ("relative error of the forces at the interface", ""),
}
#: other columns of the program's own -> what they are
OWN_COLUMNS = {
    "interface.power": ("power of the fluid on the bodies", "power"),
    "coupling.linear": ("linear iterations in a step", ""),
    "fluid.linear": ("linear iterations in a step", ""),
    "coupling.newton": ("Newton iterations of the fields in a step", ""),
}
NODES = "contact nodes"  #: a panel
WORKS = {"friction": "work of friction"}  #: numbers of all pairs that are energies -> their titles
CONTACT_PREFIX = "contact."  #: prefix of the columns of contact
NEGLIGIBLE, SMALL = (
    1e-3,
    0.05,
)  #: ranges of components in parts of the largest one that get no axis, an axis of their own


def save_figure(figure: Any, path: Path) -> None:
    """Write a figure as PNG, with texts that fit; a file that is there is replaced."""
    tidy(figure)
    with replacing(path) as unfinished:
        figure.savefig(unfinished, format="png")


def plot_history(
    folder: Path, history: History, quantities: Mapping[str, str], units: Mapping[str, str], *, flat: bool = False
) -> list[Path]:
    """Draws folder/history_<family>.png, one for all columns of a probe (A.x, A.y), and returns the files.

    `quantities` maps probes to what they measure, `units` are those of length, mass and time; flat: in 2D.
    """
    if len(history.get("time", ())) < 2:  # no curve: no step was accepted, or the run is one steady state
        return []
    families: dict[str, list[str]] = {}
    for name in history:
        if name in OWN_COLUMNS and not np.any(history[name]):  # no count of what the solver of this run has not
            continue
        if name not in (*COLUMNS, *BALANCES, "residual") and not name.startswith(CONTACT_PREFIX):
            families.setdefault(name.rpartition(".")[0] or name, []).append(name)
    time, below = history["time"], label("time", "time", units)
    drawn = []
    for family, columns in families.items():
        quantity = measured(family, quantities, family)
        text = quantity if quantity == family else f"{quantity} of {family}"
        if len(columns) == 1 and family not in quantities:
            text, quantity = OWN_COLUMNS.get(columns[0], (columns[0].replace(".", " "), quantity))
        curves = {name.rpartition(".")[2]: history[name] for name in columns}
        unit, curves = scaled(curves, quantity, units, flat=flat)
        drawn.append(plot_curves(folder / f"history_{family}.png", time, curves, below, unit.beside(text)))
    if any(name.startswith(CONTACT_PREFIX) for name in history):
        drawn.append(
            plot_panels(folder / "history_contact.png", time, contact_panels(history, units, flat=flat), below)
        )
    balances = {
        unit_of(quantity, units, flat=flat).beside(text): {"": np.abs(history[name])}
        for name, (text, quantity) in BALANCES.items()
        if name in history
    }
    if balances:
        drawn.append(plot_panels(folder / "history_balances.png", time, balances, below, logarithmic=True))
    return drawn


def scaled(
    curves: Mapping[str, Any], quantity: str, units: Mapping[str, str], *, flat: bool, beside: Sequence[Any] = ()
) -> tuple[Unit, dict[str, Any]]:
    """The unit of curves by the largest value of them and of those `beside` them, and the curves in it."""
    sizes = [np.abs(values[np.isfinite(values)]).max(initial=0.0) for values in (*curves.values(), *beside)]
    unit = unit_of(quantity, units, float(max(sizes)), flat=flat)
    return unit, {name: values * unit.factor for name, values in curves.items()}


def contact_panels(history: History, units: Mapping[str, str], *, flat: bool = False) -> dict[str, dict[str, Any]]:
    """Label -> curves: the force of each pair of surfaces, then other numbers of theirs, then counts of nodes.

    Pairs that never touch have none, unless nothing touches.
    """
    panels: dict[tuple[str, str], dict[str, Any]] = {}
    for name, values in history.items():
        pair, _, number = name.removeprefix(CONTACT_PREFIX).rpartition(".")
        if not name.startswith(CONTACT_PREFIX):
            continue
        if number in ("x", "y", "z"):
            where = pair.replace("on_", "on ", 1) if pair.startswith("on_") else f"of {pair}"
            panels.setdefault((f"contact force {where}", "force"), {})[number] = values
        elif number in WORKS:
            panels[WORKS[number], "energy"] = {"": values}
        elif pair:
            panels[f"contact {number} of {pair}", f"contact_{number}"] = {"": values}
        else:
            panels.setdefault((NODES, ""), {})[number] = values
    still = {panel for panel, curves in panels.items() if panel[1] == "force" and not any(map(np.any, curves.values()))}
    if len(still) < sum(quantity == "force" for _, quantity in panels):
        panels = {panel: curves for panel, curves in panels.items() if panel not in still}
    found = {}
    forces = [curve for (_, quantity), curves in panels.items() if quantity == "force" for curve in curves.values()]
    for (text, quantity), curves in sorted(panels.items(), key=lambda panel: panel[0][0] == NODES):
        unit, curves = scaled(curves, quantity, units, flat=flat, beside=forces if quantity == "force" else ())
        found[unit.beside(text)] = curves
    return found


def plot_panels(
    path: Path, time: Any, panels: Mapping[str, Mapping[str, Any]], below: str, *, logarithmic: bool = False
) -> Path:
    """Draws curves over time in columns of panels, label -> name -> values; counts of nodes as steps."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(CURVE_STYLE):
        columns = math.ceil(len(panels) / MOST_ROWS)
        rows = math.ceil(len(panels) / columns)
        size = columns * CURVE_SIZE[0], max(CURVE_SIZE[1], PANEL * rows)
        figure = Figure(size, dpi=CURVE_DOTS, layout="constrained")
        places = figure.subplots(rows, columns, sharex=True, squeeze=False).T.ravel()
        marker = "o" if len(time) < 30 else ""
        for axes in places[len(panels) :]:
            axes.remove()
        for number, (axes, (beside, curves)) in enumerate(zip(places, panels.items(), strict=False), 1):
            scaled = logarithmic and any(np.any(values > 0) for values in curves.values())
            for index, (name, values) in enumerate(curves.items()):
                style = {"color": COLOURS[index % len(COLOURS)], "marker": marker, "label": literal(name)}
                steps = {"drawstyle": "steps-post"} if beside == NODES else {}
                axes.plot(time, np.where(values > 0, values, np.nan) if scaled else values, **style, **steps)
            if scaled:
                axes.set_yscale("log")
            axes.set_title(beside, loc="left", fontsize=CURVE_STYLE["font.size"])
            if len(curves) > 1:
                add_legend(axes)
            if number % rows == 0 or number == len(panels):
                axes.set_xlabel(below)
                axes.tick_params(labelbottom=True)
        save_figure(figure, path)
    return path


def add_legend(axes: Any) -> None:
    """Names of curves above the right end of a panel, which is free of titles and powers of ten."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=6, borderaxespad=0.2)


def plot_curves(path: Path, time: Any, curves: Mapping[str, Any], below: str, beside: str) -> Path:
    """Draws curves over time; those of very different ranges get an axis each."""
    import matplotlib
    from matplotlib.figure import Figure

    finite = [values[np.isfinite(values)] for values in curves.values()]
    ranges = [spread for values in finite if len(values) and (spread := float(np.ptp(values))) > 0]
    ranges = [spread for spread in ranges if spread > NEGLIGIBLE * max(ranges)]
    apart = len(ranges) > 1 and min(ranges) < SMALL * max(ranges)
    with matplotlib.rc_context(CURVE_STYLE):
        height = max(CURVE_SIZE[1], PANEL * len(curves)) if apart else CURVE_SIZE[1]
        figure = Figure((CURVE_SIZE[0], height), dpi=CURVE_DOTS, layout="constrained")
        panels = figure.subplots(len(curves) if apart else 1, 1, sharex=True, squeeze=False)[:, 0]
        marker = "o" if len(time) < 30 else ""
        for index, (name, values) in enumerate(curves.items()):
            axes = panels[index if apart else 0]
            axes.plot(time, values, color=COLOURS[index % len(COLOURS)], marker=marker, label=literal(name))
        panels[-1].set_xlabel(below)
        figure.supylabel(beside, fontsize=CURVE_STYLE["font.size"])
        if len(curves) > 1:
            for axes in panels:
                add_legend(axes)
        save_figure(figure, path)
    return path


def plot_convergence(path: Path, residuals: Mapping[str, Sequence[float]]) -> Path:
    """Draws the residual norms of Newton's method over its iterations, one line per time step."""
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    with matplotlib.rc_context(CURVE_STYLE):
        figure = Figure(CURVE_SIZE, dpi=CURVE_DOTS, layout="constrained")
        axes = figure.subplots()
        for index, (step, norms) in enumerate(residuals.items()):
            colour = COLOURS[index % len(COLOURS)]
            axes.semilogy(range(len(norms)), norms, marker="o", color=colour, label=f"step {step}")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("Newton iteration")
        axes.set_ylabel("residual norm")
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, borderaxespad=0.2)
        save_figure(figure, path)
    return path
