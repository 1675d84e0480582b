"""Run benchmarks, print their tables, and write them as JSON: `python -m fsci.bench [NAME ...] [-o FILE]`."""

from __future__ import annotations

import argparse
import json
import os
import platform
from collections.abc import Callable
from pathlib import Path

from fsci.bench import contact, cook, flag, fluid, hertz, linear, moments, small, static
from fsci.bench.table import Row, show
from fsci.run.summary import plain, versions

#: Name -> (what it measures, how). One column of a row is one number or word.
BENCHMARKS: dict[str, tuple[str, Callable[[], list[Row]]]] = {
    "small": ("one time step of small problems: milliseconds of the processor", small.run),
    "static": ("one load step of a neo-Hookean cube, 25 x 25 x 25 hex8, as `fsci run` computes it", static.run),
    "linear": ("one linear system of a body under load: direct against iterative, by size", linear.run),
    "cook": ("Cook's membrane, nearly incompressible: error against time, by element and mesh", cook.run),
    "flag": ("CSM3: milliseconds of one time step, by mesh", flag.run_steps),
    "flag_accuracy": ("CSM3, 2 s: error against wall time, by mesh and time step", flag.run_accuracy),
    "kernel": ("mortar integrals of a pair of facets, by their types", contact.run_kernel),
    "search": ("contact search on two wavy sheets of quads, 3D", contact.run_search),
    "moments": ("moments of a torus in the cells of a box, 3D", moments.run),
    "hertz": ("a ball pressed onto a plane in one load step, by cells per radius of contact", hertz.run),
    "tori": ("two tori collide, 200 steps: seconds by part", contact.run_tori),
    "cylinder_2d1": ("Schaefer-Turek 2D-1: error against time, four meshes of both elements", fluid.run_steady),
    "cut_stokes": ("Stokes flow around a disc by the direct solver: seconds by size", fluid.run_stokes),
    "channel": ("a ring moves through a channel in 3D: seconds of one time step by part", fluid.run_channel),
}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m fsci.bench", description="Measure time and memory.")
    parser.add_argument("names", metavar="NAME", nargs="*", help=f"which: {', '.join(BENCHMARKS)} (default: all)")
    parser.add_argument("-o", "--out", metavar="FILE", type=Path, help="write the results as JSON")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in BENCHMARKS]
    if unknown:
        parser.error(f"unknown benchmark '{unknown[0]}' (available: {', '.join(BENCHMARKS)})")

    results: dict[str, list[Row]] = {}
    for name in options.names or BENCHMARKS:
        words, function = BENCHMARKS[name]
        print(f"\n{name}: {words}", flush=True)
        results[name] = function()
        print(show(results[name]), flush=True)
    if options.out is not None:
        machine = {"cores": os.cpu_count(), "machine": platform.machine(), "processor": processor()}
        data = {"machine": machine, "versions": versions(), "results": results}
        options.out.write_text(json.dumps(plain(data), indent=2) + "\n")


def processor() -> str:
    """What Linux calls the processor."""
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.exists() else []
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown")


if __name__ == "__main__":
    main()
