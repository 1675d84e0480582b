"""Error against time, unknowns and memory of a family of runs, on logarithmic axes; the front is ringed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fsci.bench.table import ERROR, FRONT, MEMORY, TIME, UNKNOWNS, Row


def plot_front(rows: Sequence[Row], title: str, path: Path) -> None:
    """Writes a picture with a panel for each cost and a curve for each option."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

    from fsci.plot.curves import COLOURS, CURVE_DOTS, CURVE_STYLE

    with plt.rc_context(CURVE_STYLE):
        costs = [cost for cost in (TIME, UNKNOWNS, MEMORY) if cost in rows[0]]
        size = (4.0 * len(costs), 4.2)
        figure, panels = plt.subplots(1, len(costs), figsize=size, sharey=True, layout="constrained")
        options = list(dict.fromkeys(str(row.get("option", "")) for row in rows))
        for panel, cost in zip(panels, costs, strict=True):
            for number, option in enumerate(options):
                points = [(float(row[cost]), float(row[ERROR])) for row in rows if str(row.get("option", "")) == option]
                panel.loglog(*zip(*points, strict=True), "o-", color=COLOURS[number % len(COLOURS)], label=option)
            best = [(float(row[cost]), float(row[ERROR])) for row in rows if row[FRONT]]
            panel.loglog(*zip(*best, strict=True), "o", ms=12, mfc="none", mec="black", label="front of time and error")
            panel.set_xlabel(cost)
            panel.xaxis.set_minor_formatter(NullFormatter())
            spent = [float(row[cost]) for row in rows]
            ratio = max(spent) / min(spent)
            subs = (1.0, 2.0, 5.0) if ratio < 10.0 else (1.0, 3.0)  # more labels would overlap
            panel.xaxis.set_major_locator(MaxNLocator(4) if ratio < 5.0 else LogLocator(subs=subs))
            panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        panels[0].set_ylabel("largest error of all values [%]")
        panels[0].legend()
        figure.suptitle(title)
        figure.savefig(path, dpi=CURVE_DOTS)
        plt.close(figure)
