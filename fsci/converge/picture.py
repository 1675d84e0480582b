"""Error against time of all runs, on logarithmic axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from fsci.converge.results import BandedValue, Done
from fsci.running.files import replacing

#: What roles are drawn as.
MARKERS = {"level": ("o-", "levels"), "source": ("s", "one source alone"), "twin": ("D", "other methods")}


def error_of(one: Done, found: Mapping[str, BandedValue]) -> float | None:
    """The largest relative difference of its values from those of the finest level; of that its band."""
    errors = []
    for name, finding in found.items():
        told = finding.estimate
        if told.value is None or told.band is None or not finding.scale or name not in one.values:
            continue
        change = abs(one.values[name].value - told.value)
        errors.append((told.band if change == 0.0 and one.run.role == "level" else change) / finding.scale)
    return max((error for error in errors if error > 0.0), default=None)


def draw(path: Path, found: Mapping[str, BandedValue], runs: Sequence[Done]) -> bool:
    """Writes a picture; returns whether there was anything to draw."""
    points = {
        role: [
            (one.seconds, 100.0 * error, one.run.name)
            for one in sorted(runs, key=lambda one: one.run.size)
            if one.run.role == role and one.seconds and (error := error_of(one, found)) is not None
        ]
        for role in MARKERS
    }
    if not any(points.values()):
        return False
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from fsci.plot.curves import COLOURS, CURVE_DOTS, CURVE_SIZE, CURVE_STYLE

    with plt.rc_context(CURVE_STYLE):
        figure, panel = plt.subplots(figsize=CURVE_SIZE, layout="constrained")
        errors = [y for some in points.values() for _, y, _ in some]
        panel.set_ylim(0.5 * min(errors), 2.0 * max(errors))  # they may be one number
        for number, (role, some) in enumerate(points.items()):
            marker, label = MARKERS[role]
            if some:
                panel.loglog([x for x, *_ in some], [y for _, y, _ in some], marker, color=COLOURS[number], label=label)
            for x, y, name in some:
                panel.annotate(name.replace("_", " "), (x, y), xytext=(5, 5), textcoords="offset points", fontsize=9)
        panel.set_xlabel("time of the run [s]")
        panel.set_ylabel("difference from the finest level; of that its band [%]")
        panel.legend()
        with replacing(path) as unfinished:
            figure.savefig(unfinished, format="png", dpi=CURVE_DOTS)
        plt.close(figure)
    return True
