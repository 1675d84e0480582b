"""Pictures of a run, finished or not, drawn from what it left in its folder."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fsci.curves import DOTS, plot_convergence, plot_history
from fsci.history import read_history
from fsci.movie import plot_movie
from fsci.output import Series, read_collection
from fsci.render_flow import is_flow, load_state
from fsci.scene import compose, draw

STRUCTURE_FIELDS = ("displacement",)  #: what is drawn if nothing is asked for
FLUID_FIELDS = ("velocity", "pressure")


@dataclass(frozen=True)
class Labels:
    """What the case file of a run says about the texts in its pictures."""

    title: str
    units: Mapping[str, str] = field(default_factory=lambda: {"length": "m", "mass": "kg", "time": "s"})
    quantities: Mapping[str, str] = field(default_factory=dict)  #: probe -> what it measures


def plot_run(out: Path, *, movie: bool = False, field: str | None = None) -> list[Path]:
    """Draws the last state, the probes and the convergence of the run in folder `out` into out/pictures.

    `field` is what colours show: a point field (a vector's magnitude) or a component such as velocity.x; by default the
    displacement, of a flow velocity and pressure. `movie` adds an animation of all output times. Returns the files;
    raises ValueError if no body has the field.
    """
    out = Path(out)
    labels = read_labels(out)
    folder = out / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    drawn = []
    bodies = read_series(out / "fields")
    if bodies:
        names = (field,) if field else FLUID_FIELDS if is_flow(bodies[0][-1][1]) else STRUCTURE_FIELDS
        drawn += [plot_state(folder / f"final_{name}.png", bodies, name, labels) for name in names]
        if movie:
            drawn.append(plot_movie(folder / "movie.gif", bodies, names[0], labels.title, labels.units))
    if (out / "history.csv").exists():
        drawn += plot_history(folder, read_history(out / "history.csv"), labels.quantities, labels.units)
    if (out / "summary.json").exists():
        residuals = json.loads((out / "summary.json").read_text(encoding="utf-8"))["newton"]["residuals"]
        if residuals:
            drawn.append(plot_convergence(folder / "convergence.png", residuals))
    return drawn


def read_series(folder: Path) -> list[Series]:
    """The files of all parts; those of a flow come first, so that bodies are drawn on top of it."""
    found = [series for path in sorted(folder.glob("*.pvd")) if (series := read_collection(path))]
    return sorted(found, key=lambda series: not is_flow(series[-1][1]))


def plot_state(path: Path, bodies: list[Series], name: str, labels: Labels) -> Path:
    """Draws the last state of all bodies coloured by the field `name`."""
    state = load_state([series[-1][1] for series in bodies], name)
    scene = compose([state], name, labels.title, labels.units, crop=1.0)
    draw(scene, state, bodies[0][-1][0], dots=DOTS).savefig(path)
    return path


def read_labels(out: Path) -> Labels:
    """Reads title, units and probes from the copy of the case that a run keeps."""
    from ruamel.yaml import YAML

    path = out / "case.yaml"
    case = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8")) if path.exists() else {}
    quantities = {name: probe["quantity"] for name, probe in (case.get("probes") or {}).items()}
    default = Labels(case.get("title") or out.resolve().name)
    return Labels(default.title, {**default.units, **(case.get("units") or {})}, quantities)
