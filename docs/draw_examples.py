"""Pictures of the examples on the library page: python docs/draw_examples.py [NAME ...], about two minutes for all.

Runs docs/examples/NAME.py as it stands and draws what it has in the end, or what it prints, into docs/pictures.
"""

from __future__ import annotations

import re
import runpy
import sys
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from make_pictures import draw

from fsci.plot.curves import COLOURS
from fsci.plot.picture import Labels, plot_state
from fsci.running.output import write_vtu
from solvers.fluid.flow import snapshot as flow
from solvers.structure import snapshot as solid

DOCS = Path(__file__).parent
SIZE = (5, 3.4)

#: What an example has in the end, by name, and the numbers of each line that it prints.
Names = dict[str, Any]
Lines = list[list[float]]


def run(name: str) -> tuple[Names, Lines]:
    printed = StringIO()
    with redirect_stdout(printed):
        found = runpy.run_path(str(DOCS / "examples" / f"{name}.py"))
    lines = printed.getvalue().splitlines()
    return found, [[float(text) for text in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", line)] for line in lines]


def picture(name: str) -> str:
    return f"{name}_example.png"


def draw_state(name: str, title: str, field: str, snapshots: list[Any], time: float) -> None:
    """All parts at the end, a flow first, as `fsci plot` draws them."""
    with TemporaryDirectory() as folder:
        moment = []
        for snapshot in snapshots:
            write_vtu(path := Path(folder) / f"{snapshot.name}.vtu", snapshot)
            moment.append((time, path))
        plot_state(DOCS / "pictures" / picture(name), tuple(moment), field, Labels(title))
    print(f"pictures/{picture(name)}", flush=True)


def two_blocks(found: Names, lines: Lines) -> None:
    draw_state("two_blocks", "Two blocks", "von_mises", solid.snapshots(found["structure"]), lines[-1][0])


def cylinder(found: Names, lines: Lines) -> None:
    draw_state("cylinder", "Flow around a cylinder, Re = 20", "velocity", flow.snapshots(found["fluid"]), 1.0)


def flap(found: Names, lines: Lines) -> None:
    parts = flow.snapshots(found["coupled"].flow)[:1] + solid.snapshots(found["structure"])
    draw_state("flap", "Flap in a channel", "velocity", parts, lines[-1][0])


def torus_and_wall(found: Names, lines: Lines) -> None:
    parts = flow.snapshots(found["coupled"].flow)[:1] + solid.snapshots(found["structure"])
    draw_state("torus_and_wall", "Torus, wall and flow", "velocity", parts, lines[-1][0])


def own_probe(found: Names, lines: Lines) -> None:
    parts = solid.snapshots(found["Structure"]([found["bar"]]))
    draw_state("own_probe", "Bar under its own weight", "von_mises", parts, lines[-1][0])


def own_material(found: Names, lines: Lines) -> None:
    def content(figure: Any) -> None:
        axes = figure.subplots()
        s = np.linspace(1.0, 2.0, 100)
        exact = 2.0 * (s - s**-2) * (1.0 + 0.2 * (s**2 + 2.0 / s - 3.0))
        axes.plot(s, exact, color="black", label="incompressible bar")
        stretch, stress, _ = np.array(lines).T
        axes.plot(stretch, stress, "o", color=COLOURS[0], label="cube of Yeoh's rubber")
        axes.set_xlabel("stretch")
        axes.set_ylabel("stress [Pa]")
        axes.legend()

    draw(picture("own_material"), content, SIZE)


def hertz(found: Names, lines: Lines) -> None:
    def content(figure: Any) -> None:
        axes = figure.subplots()
        b, p0, x, p = (found[name] for name in ("b", "hertz", "x", "p"))
        fine, order = np.linspace(-b, b, 201), np.argsort(x)
        axes.plot(fine, p0 * np.sqrt(1.0 - (fine / b) ** 2), color="black", label="Hertz")
        axes.plot(x[order], p[order], "o", color=COLOURS[0], label="computed")
        axes.set_xlim(-2.0 * b, 2.0 * b)
        axes.set_xlabel("x [m]")
        axes.set_ylabel("contact pressure [Pa]")
        axes.legend()

    draw(picture("hertz"), content, SIZE)


PICTURES: Mapping[str, Callable[[Names, Lines], None]] = {
    function.__name__: function
    for function in (two_blocks, hertz, cylinder, own_material, own_probe, flap, torus_and_wall)
}


def main(names: list[str]) -> None:
    for name in names or PICTURES:
        PICTURES[name](*run(name))


if __name__ == "__main__":
    main(sys.argv[1:])
