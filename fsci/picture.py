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
from fsci.render import load_body
from fsci.scene import compose, draw

DEFAULT_FIELD = "displacement"


@dataclass(frozen=True)
class Labels:
    """What the case file of a run says about the texts in its pictures."""

    title: str
    units: Mapping[str, str] = field(default_factory=lambda: {"length": "m", "mass": "kg", "time": "s"})
    quantities: Mapping[str, str] = field(default_factory=dict)  #: probe -> what it measures


def plot_run(out: Path, *, movie: bool = False, field: str | None = None) -> list[Path]:
    """Draws the last state, the probes and the convergence of the run in folder `out` into out/pictures.

    `field` colours the bodies: a point field (a vector's magnitude) or a component such as velocity.x; the
    displacement by default. `movie` adds an animation of all output times. Returns the files; raises ValueError
    if no body has the field.
    """
    out = Path(out)
    labels = read_labels(out)
    folder = out / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    drawn = []
    bodies = [series for path in sorted((out / "fields").glob("*.pvd")) if (series := read_collection(path))]
    if bodies:
        name = field or DEFAULT_FIELD
        drawn.append(plot_state(folder / f"final_{name}.png", bodies, name, labels))
        if movie:
            drawn.append(plot_movie(folder / "movie.gif", bodies, name, labels.title, labels.units))
    if (out / "history.csv").exists():
        drawn += plot_history(folder, read_history(out / "history.csv"), labels.quantities, labels.units)
    if (out / "summary.json").exists():
        residuals = json.loads((out / "summary.json").read_text(encoding="utf-8"))["newton"]["residuals"]
        if residuals:
            drawn.append(plot_convergence(folder / "convergence.png", residuals))
    return drawn


def plot_state(path: Path, bodies: list[Series], name: str, labels: Labels) -> Path:
    """Draws the last state of all bodies coloured by the field `name`."""
    state = [load_body(series[-1][1], name) for series in bodies]
    scene = compose([state], name, labels.title, labels.units)
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
