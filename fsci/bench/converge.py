"""Whether bands of `fsci converge` hold exact values: the scenes of converge_scenes.yaml."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from itertools import groupby
from pathlib import Path
from shutil import copyfile
from statistics import median
from typing import Any

from ruamel.yaml import YAML

from fsci.bench.family import CASES
from fsci.bench.table import Row
from fsci.converge.converge import CONVERGE_RESULTS, converge
from fsci.running.files import write_text

SCENES = Path(__file__).with_name("converge_scenes.yaml")
#: Runs stay here, and what has been run is not run again.
OUT = Path("results") / "bench_converge"
TABLE = "table.md"
#: Below this relative size errors and bands are those of solvers.
ROUNDING = 1e-6


def run() -> list[Row]:
    """A row for each value, then what all have in common."""
    scenes = YAML(typ="safe", pure=True).load(SCENES.read_text())
    rows = [row for name, scene in scenes.items() for row in measure(name, scene)]
    write_text(OUT / TABLE, markdown(rows))
    return [*rows, summary(rows)]


def measure(name: str, scene: Mapping[str, Any], out: Path = OUT) -> Iterator[Row]:
    """Rows of one scene."""
    folder = out / name
    path = case_of(name, scene, folder)
    settings = tuple((key, str(value)) for key, value in scene.get("set", {}).items())
    said: list[str] = []
    converge(path, settings, folder / "runs", say=said.append)
    (folder / "log.txt").write_text("\n".join(said) + "\n")
    found = json.loads((folder / "runs" / CONVERGE_RESULTS).read_text())
    seconds = sum(one["seconds"] or 0.0 for one in found["runs"].values())
    for value, exact in scene["exact"].items():
        yield row(name, value, float(exact), found["values"][value], seconds)


def case_of(name: str, scene: Mapping[str, Any], folder: Path) -> Path:
    """The case of a scene: one of the repository, or written into the folder with its mesh files."""
    folder.mkdir(parents=True, exist_ok=True)
    case = scene["case"]
    if isinstance(case, str):
        return CASES / case
    for file in scene.get("meshes", ()):
        copyfile(CASES / file, folder / Path(file).name)
    path = folder / "case.yaml"
    path.write_text(json.dumps({"title": name, **case}))
    return path


def row(scene: str, value: str, exact: float, found: Mapping[str, Any], seconds: float) -> Row:
    """Error and band of a value, both relative to the exact one."""
    error = abs(found["value"] - exact) / abs(exact)
    band = float("inf") if found["band"] is None else found["band"] / abs(exact)
    held = error <= max(band, ROUNDING)
    return {
        "scene": scene,
        "value": value,
        "error [%]": 100.0 * error,
        "band [%]": 100.0 * band,
        "band / error": max(band, ROUNDING) / max(error, ROUNDING),
        "order": "" if found["order"] is None else f"{found['order']:.2g}",
        "verdict": found["verdict"],
        "held": "yes" if held else "no",
        "all runs [s]": seconds,
    }


def markdown(rows: list[Row]) -> str:
    """The table of docs/converge.md: a line for each scene, errors and bands of its values [%]."""
    lines = ["| scene | value: error/band [%] |", "|---|---|"]
    for scene, group in groupby(rows, key=lambda one: one["scene"]):
        of_scene = list(group)
        numbers = [f"{one['value']}: {_digits(one['error [%]'])}/{_digits(one['band [%]'])}" for one in of_scene]
        lines.append(f"| {scene} | {'; '.join(filter(None, (', '.join(numbers), _verdicts(of_scene))))} |")
    return "\n".join([*lines, ""])


def _digits(percent: float | int | str) -> str:
    """Two digits; 0 for what solvers explain."""
    share = float(percent)
    return "0" if share < 99.0 * ROUNDING else f"{share:.2g}" if share < 100.0 else f"{share:.0f}"


def _verdicts(rows: list[Row]) -> str:
    """Those other than resolved: one for all, or each with its value."""
    if len({one["verdict"] for one in rows}) == 1:
        return "" if rows[0]["verdict"] == "resolved" else str(rows[0]["verdict"])
    return ", ".join(f"{one['value']} {one['verdict']}" for one in rows if one["verdict"] != "resolved")


def summary(rows: list[Row]) -> Row:
    """How many bands hold the exact value, and the median of their widths."""
    held = sum(one["held"] == "yes" for one in rows)
    resolved = sum(one["verdict"] == "resolved" for one in rows)
    silent = sum(one["held"] == "no" and one["verdict"] == "resolved" for one in rows)
    return {
        "scene": "all",
        "value": f"{len(rows)} values",
        "error [%]": median(float(one["error [%]"]) for one in rows),
        "band [%]": median(float(one["band [%]"]) for one in rows),
        "band / error": median(float(one["band / error"]) for one in rows),
        "order": "",
        "verdict": f"{resolved} resolved, {silent} of them missed",
        "held": f"{held} of {len(rows)}",
        "all runs [s]": sum({one["scene"]: float(one["all runs [s]"]) for one in rows}.values()),
    }
