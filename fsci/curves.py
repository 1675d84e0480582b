"""Curves of a run for print: probes over time and the convergence of Newton's method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fsci.history import COLUMNS, History

SIZE = (8.0, 5.0)  #: of a picture in inches; 1600 x 1000 pixels
DOTS = 200  #: per inch
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  #: told apart by colour-blind readers
STYLE: Any = {
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

#: exponents of length, mass and time; in 2D forces, energies and masses are those of a unit thickness
DIMENSIONS = {
    "time": (0, 0, 1),
    "displacement": (1, 0, 0),
    "centre": (1, 0, 0),
    "velocity": (1, 0, -1),
    "acceleration": (1, 0, -2),
    "area": (2, 0, 0),
    "volume": (3, 0, 0),
    "mass": (0, 1, 0),
    "flow_rate": (3, 0, -1),
    "force": (1, 1, -2),
    "moment": (2, 1, -2),
    "dissipation": (2, 1, -3),
    "kinetic_energy": (2, 1, -2),
    "momentum": (1, 1, -1),
    "angular_momentum": (2, 1, -1),
    "reaction": (1, 1, -2),
    "traction": (1, 1, -2),
    "energy": (2, 1, -2),
    "pressure": (-1, 1, -2),
    "von_mises": (-1, 1, -2),
}

#: (length, mass, time) -> the names of the units of force, energy and stress
DERIVED = {
    ("m", "kg", "s"): ("N", "J", "Pa"),
    ("mm", "t", "s"): ("N", "mJ", "MPa"),
    ("mm", "g", "ms"): ("N", "mJ", "MPa"),
    ("mm", "kg", "ms"): ("kN", "J", "GPa"),
}


def label(text: str, quantity: str, units: Mapping[str, str]) -> str:
    """A text with the unit of a quantity in brackets; without them if the quantity is not known."""
    text = text.replace("von_mises", "von Mises stress").replace("_", " ")
    if quantity not in DIMENSIONS:
        return text
    powers = DIMENSIONS[quantity]
    base = (units["length"], units["mass"], units["time"])
    for named, derived in zip(((1, 1, -2), (2, 1, -2), (-1, 1, -2)), DERIVED.get(base, ()), strict=False):
        if powers == named:
            return f"{text} [{derived}]"
    factors = [(base[1], powers[1]), (base[0], powers[0]), (base[2], powers[2])]
    above = " ".join(raised(name, power) for name, power in factors if power > 0)
    below = " ".join(raised(name, -power) for name, power in factors if power < 0)
    return f"{text} [{above or 1}/{below}]" if below else f"{text} [{above}]"


def raised(name: str, power: int) -> str:
    """A unit to a positive power."""
    return name if power == 1 else f"{name}$^{power}$"


def plot_history(folder: Path, history: History, quantities: Mapping[str, str], units: Mapping[str, str]) -> list[Path]:
    """Draws folder/history_<family>.png, one for all columns of a probe (A.x, A.y), and returns the files.

    `quantities` maps probes to what they measure, `units` are those of length, mass and time.
    """
    families: dict[str, list[str]] = {}
    for name in history:
        if name not in (*COLUMNS, "residual"):
            families.setdefault(name.rpartition(".")[0] or name, []).append(name)
    drawn = []
    for family, columns in families.items():
        quantity = quantities.get(family, family)
        text = quantity if quantity == family else f"{quantity} of {family}"
        if len(columns) == 1 and family not in quantities:
            text = columns[0].replace(".", " ")
        path = folder / f"history_{family}.png"
        curves = {name.rpartition(".")[2]: history[name] for name in columns}
        plot_curves(path, history["time"], curves, label("time", "time", units), label(text, quantity, units))
        drawn.append(path)
    return drawn


def plot_curves(path: Path, time: Any, curves: Mapping[str, Any], below: str, beside: str) -> None:
    """Draws curves over time; those of very different ranges get an axis each."""
    import matplotlib
    from matplotlib.figure import Figure

    finite = [values[np.isfinite(values)] for values in curves.values()]
    ranges = [spread for values in finite if len(values) and (spread := float(np.ptp(values))) > 0]
    apart = len(ranges) > 1 and min(ranges) < 0.05 * max(ranges)
    with matplotlib.rc_context(STYLE):
        figure = Figure(SIZE, dpi=DOTS, layout="constrained")
        panels = figure.subplots(len(curves) if apart else 1, 1, sharex=True, squeeze=False)[:, 0]
        marker = "o" if len(time) < 30 else ""
        for index, (name, values) in enumerate(curves.items()):
            axes = panels[index if apart else 0]
            axes.plot(time, values, color=COLOURS[index % len(COLOURS)], marker=marker, label=name)
        panels[-1].set_xlabel(below)
        figure.supylabel(beside, fontsize=STYLE["font.size"])
        if len(curves) > 1:
            for axes in panels:
                axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, borderaxespad=0.2)
        figure.savefig(path)


def plot_convergence(path: Path, residuals: Mapping[str, Sequence[float]]) -> Path:
    """Draws the residual norms of Newton's method over its iterations, one line per time step."""
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    with matplotlib.rc_context(STYLE):
        figure = Figure(SIZE, dpi=DOTS, layout="constrained")
        axes = figure.subplots()
        for index, (step, norms) in enumerate(residuals.items()):
            colour = COLOURS[index % len(COLOURS)]
            axes.semilogy(range(len(norms)), norms, marker="o", color=colour, label=f"step {step}")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("Newton iteration")
        axes.set_ylabel("residual norm")
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, borderaxespad=0.2)
        figure.savefig(path)
    return path
