"""The families of runs of error against time: cases with their options, grids and steps."""

from __future__ import annotations

from typing import Any

from fsci.bench import hertz, studies
from fsci.bench.family import Family, Study
from fsci.bench.scenes import BAR, CANTILEVER


def _grid_2d1(scale: float) -> dict[str, Any]:
    """Cells of cylinder_2d1, this many times as many along each direction as on its own grid."""
    return {
        f"fluid.grid.{axis}.{i}.cells": max(4, round(scale * cells))
        for axis, counts in {"x": (24, 80, 90), "y": (36, 80, 38)}.items()
        for i, cells in enumerate(counts)
    }


def grid_fsi1(scale: float) -> dict[str, Any]:
    """Cells of fsi1, this many times as many."""
    return {
        f"fluid.grid.{axis}.{i}.cells": max(2, round(scale * cells))
        for axis, counts in {"x": (8, 43, 4, 10, 4, 30), "y": (8, 3, 2, 16, 2, 3, 8)}.items()
        for i, cells in enumerate(counts)
    }


def _grid_2d2(scale: float) -> dict[str, Any]:
    """Cells of cylinder_2d2, 12 along the diameter, this many times as many."""
    return {
        f"fluid.grid.{axis}.{i}.cells": max(2, round(scale * cells))
        for axis, counts in {"x": (11, 17, 22, 39), "y": (11, 17, 12)}.items()
        for i, cells in enumerate(counts)
    }


def _grid_fsi3(scale: float) -> dict[str, Any]:
    """Cells of fsi3, this many times as many."""
    return {
        f"fluid.grid.{axis}.{i}.cells": round(scale * cells)
        for axis, counts in {"x": (9, 24, 27, 20, 42), "y": (10, 35, 11)}.items()
        for i, cells in enumerate(counts)
    }


def _grid_falling(cells: int) -> dict[str, Any]:
    """Cells of falling_sphere with this many across the sphere; 10 on its own grid."""
    near, outside = round(0.8 * cells), max(4, round(0.7 * cells))
    counts = {"x": (near, outside), "y": (near, outside), "z": (outside, round(6.5 * cells), max(3, cells // 2))}
    return {f"fluid.grid.{axis}.{i}.cells": n for axis, parts in counts.items() for i, n in enumerate(parts)}


def _grid_nested(scale: int) -> dict[str, Any]:
    """Large cells of cylinder_nested, this many times as many along each direction."""
    return {
        "fluid.grid.cells.1": 21 * scale,
        **{f"fluid.grid.x.{i}.cells": scale * cells for i, cells in enumerate((25, 12))},
    }


def _refined(level: int, **more: str) -> dict[str, Any]:
    """Cells around the cylinder halved this many times."""
    refine = [{"around": "cylinder", "layers": 4, "level": level}] if level else []
    return {"fluid.grid.refine": refine, **{f"fluid.{name}": value for name, value in more.items()}}


def _torus(cells: int, around: int, step: float) -> dict[str, Any]:
    """Cells across the channel and around the torus."""
    return {
        "fluid.grid.cells": [cells, cells, round(5 / 3 * cells)],
        "structure.bodies.torus.mesh.cells": [2 * around, around],
        "time.step": step,
    }


#: Turek and Hron (2006), two periods of fsi3. The flag flaps fully from 2.3 s on; the first peaks are a sixth higher.
FSI3_VERIFY = [
    {"value": value, "statistic": statistic, "from": 3.05, "reference": reference, "relative": 1.0}
    for value, statistic, reference in (
        ("tip.y", "amplitude", 0.03499),
        ("tip.y", "frequency", 5.46),
        ("force.x", "mean", 460.5),
        ("force.y", "amplitude", 153.91),
    )
]

#: Run torus_wall_fine: 24 x 24 x 40 cells, steps of 0.0025 s. Times and forces from the first contact to 0.56 s.
TORUS_VERIFY = [
    {"value": "arrival", "reference": 0.4125, "relative": 1.0},
    {"value": "contact.wall.z", "statistic": "max", "reference": 14.9, "relative": 1.0},
]


def _partitioned(accelerator: str, **wetted: list[str]) -> dict[str, Any]:
    return {"coupling": {"scheme": "partitioned", "accelerator": accelerator, "wetted": wetted}}


def _steps(*steps: float) -> dict[str, dict[str, Any]]:
    return {f"{step:g} s": {"time.step": step} for step in steps}


def _tori(around: int, energy: float) -> dict[str, Any]:
    """Cells around both tori, and the energy [J] at their start: that of polygons, less than that of circles."""
    return {
        **{f"structure.bodies.{body}.mesh.cells": [around, around // 2, 1] for body in ("lower", "upper")},
        "verify": [
            {"value": "energy.total", "statistic": statistic, "reference": energy, "relative": 1.0}
            for statistic in ("min", "max")
        ],
    }


FALLS = ((5, 0.1), (8, 0.1), (8, 0.05))  #: cells across the sphere, steps [s]

FLAG, BEAM, BAR_MESH = (f"structure.bodies.{name}.mesh" for name in ("flag", "beam", "bar"))

FAMILIES: dict[str, Family | Study] = {
    "cantilever": Family(
        CANTILEVER,
        "a beam bent by a force on its end, neo-Hookean, 3D",
        {
            "hex8": {},
            "hex27": {f"{BEAM}.order": 2},
            "tet10": {f"{BEAM}.order": 2, f"{BEAM}.cell": "tet"},
        },
        {f"{n} x {n // 10} x {n // 10}": {f"{BEAM}.cells": [n, n // 10, n // 10]} for n in (10, 20, 40)},
    ),
    "csm1": Family(
        "csm1",
        "Turek-Hron CSM1, a flag under its weight",
        {"quad9": {f"{FLAG}.order": 2}, "quad4": {f"{FLAG}.order": 1}},
        {f"{35 * n} x {2 * n}": {f"{FLAG}.parameters.refine": n} for n in (1, 2, 4, 8)},
    ),
    "csm3": Family(
        "csm3",
        "Turek-Hron CSM3, a flag that swings",
        {f"quad9, {35 * n} x {2 * n}": {f"{FLAG}.parameters.refine": n} for n in (1, 2)},
        _steps(0.02, 0.01, 0.005),
    ),
    "2d1": Family(
        "cylinder_2d1",
        "Schaefer-Turek 2D-1, steady flow past a cylinder",
        {element: {"fluid.element": element} for element in ("q1q1", "q2q1")},
        {f"{round(66.7 * n)} cells per diameter": _grid_2d1(n) for n in (0.15, 0.3, 0.6, 1.0)},
        values=("drag", "dp"),
    ),
    "2d2": Family(
        "cylinder_2d2",
        "Schaefer-Turek 2D-2, vortices behind a cylinder",
        {
            f"{element}, {scheme}": {"fluid.element": element, "fluid.scheme": scheme}
            for element in ("q1q1", "q2q1")
            for scheme in ("backward_euler", "bdf2")
        },
        {
            f"{round(12 * n)} cells per diameter, {step:g} s": {**_grid_2d2(n), "time.step": step}
            for n, step in ((2 / 3, 0.02), (1.0, 0.01), (1.0, 0.005))
        },
    ),
    "fsi1": Family(
        "fsi1",
        "Turek-Hron FSI1, a flag bent by a steady flow",
        {
            "q2q1, monolithic": {},
            "q2q1, Aitken": _partitioned("aitken"),
            "q2q1, IQN-ILS": _partitioned("iqn"),
            "q1q1, monolithic": {"fluid.element": "q1q1"},
        },
        {f"{n:g} x": grid_fsi1(n) for n in (0.5, 1.0, 1.5)},
    ),
    "fsi3": Family(
        "fsi3",
        "Turek-Hron FSI3, a flag that flaps in vortices",
        {scheme: {"fluid.scheme": scheme} for scheme in ("bdf2_optimized", "bdf2")},
        {f"{n:g} x, {step:g} s": {**_grid_fsi3(n), "time.step": step} for n, step in ((0.5, 0.01), (0.7, 0.0075))},
        all={"time.end": 3.45, "verify": FSI3_VERIFY},
    ),
    "bar_column": Family(
        "elastic_bar_column",
        "an elastic bar that moves a column of fluid of its own mass",
        {
            "monolithic": {"coupling.scheme": "monolithic"},
            "Aitken": _partitioned("aitken", bar=["right"]),
            "IQN-ILS": _partitioned("iqn", bar=["right"]),
        },
        _steps(0.24, 0.12, 0.06),
    ),
    "falling_sphere": Family(
        "falling_sphere",
        "an elastic sphere falls in oil, experiment of ten Cate et al., Re 4.1",
        {scheme: {"fluid.scheme": scheme} for scheme in ("bdf2", "backward_euler")},
        {f"{n} cells across, {step:g} s": {**_grid_falling(n), "time.step": step} for n, step in FALLS},
    ),
    "torus_wall": Family(
        "torus_wall",
        "a flow drives an elastic torus to a wall: first contact, largest force",
        {scheme: {"fluid.scheme": scheme} for scheme in ("bdf2", "backward_euler")},
        {f"{n} x {n} x {round(5 / 3 * n)}, {step:g} s": _torus(n, n, step) for n, step in ((8, 0.01), (12, 0.005))},
        all={"time.end": 0.56, "verify": TORUS_VERIFY},
    ),
    "nested": Family(
        "cylinder_nested",
        "Schaefer-Turek 2D-1, equal cells against cells halved around the cylinder",
        {
            "q2q1, equal": _refined(0),
            "q2q1, halved": _refined(1),
            "q2q1, halved twice": _refined(2),
            "q1q1, equal": _refined(0, element="q1q1"),
            "q1q1, halved twice": _refined(2, element="q1q1"),
        },
        {f"{5 * n} cells per diameter outside": _grid_nested(n) for n in (1, 2, 4)},
        values=("drag", "dp"),
    ),
    "bar_impact": Family(
        BAR,
        "an elastic bar hits a wall: exact momentum and depth",
        {f"rho_inf {r:g}": {"structure.dynamics.rho_inf": r} for r in (1.0, 0.8, 0.0)},
        {f"{n} cells": {f"{BAR_MESH}.cells": [n, 1], "time.step": 1.0 / n} for n in (10, 40, 160)},
    ),
    "two_tori": Family(
        "two_tori",
        "two tori collide: energy that is lost or gained",
        {f"steps of {step:g}": {"time.step": step} for step in (0.1, 0.05)},
        {f"{n} x {n // 2}": _tori(n, energy) for n, energy in ((20, 1.930717e7), (40, 2.0554e7))},
    ),
    "hertz_front": Study("a ball pressed onto a plane: error of the pressure", hertz.measure),
    "film": Study("a cylinder that approaches a wall, gap of 0.02 radii: error of the drag", studies.film),
    "sphere": Study("a sphere that approaches a wall, gap of 0.1 radii: error of the drag", studies.sphere),
    "beltrami": Study("Ethier and Steinman's flow around a cut sphere: error of the velocity", studies.beltrami),
}
