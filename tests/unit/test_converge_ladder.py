"""Levels of a case: settings that are cases, with real ratios of sizes."""

import json
from pathlib import Path

import meshio  # noqa: TID253
import numpy as np
import pytest
from pydantic import TypeAdapter

from fsci import shapes
from fsci.case import load_case
from fsci.case.shapes import AnyShape
from fsci.converge.ladder import scaled, sources
from fsci.converge.plan import Plan, Refused
from fsci.twin.grids import resized_count

CASES = sorted(path.parent for path in (Path(__file__).parents[2] / "cases").glob("*/case.yaml"))
FLOW = """
time: {step: 0.1, end: 1}
fluid:
  density: 1
  viscosity: 1
  element: q1q1
  grid:
    from: [0, -1]
    to: [4, 1]
    cells: [40, null]
    y: [{to: 0, cells: 20, ratio: 2}, {to: 1, cells: 16}]
    refine: [{around: disc, layers: 8}, {around: box, layers: 8}]
  patches: {all: {on: [x-, x+, y-, y+], no_slip: true}}
  bodies:
    disc: {mesh: {shape: disc, radius: 0.3, cells: [24, 2], translate: [1, 0]}}
    box: {mesh: {shape: rectangle, origin: [2, 0], size: [0.3, 0.3], cells: [2, 2]}}
"""


@pytest.mark.parametrize("folder", CASES, ids=lambda folder: folder.name)
@pytest.mark.parametrize(
    "factor", [pytest.param(2.0**0.5, marks=pytest.mark.slow), 2.0, pytest.param(2.0**-0.5, marks=pytest.mark.slow)]
)
def test_levels_are_cases(folder, factor):
    """Two steps stay two, if they are 1.41 times as long."""
    case = load_case(folder)
    found = sources(case)
    assert found
    for name in found:
        other = load_case(folder, scaled(found, {name: factor}))
        changed = json.dumps(other.settings) != json.dumps(case.settings)
        assert changed or factor == 2.0**0.5, name
    load_case(folder, scaled(found, dict.fromkeys(found, factor)))


@pytest.mark.parametrize("factor", [2.0**0.5, 2.0, 3.0, 2.0**-0.5, 0.5])
@pytest.mark.parametrize("count", range(1, 60))
def test_counts_have_the_nearest_ratio(count, factor):
    found = resized_count(count, factor)
    off = [max(n * factor / count, count / (n * factor)) for n in (found - 1, found, found + 1) if n > 0]
    assert found >= 1
    assert min(off) == pytest.approx(max(found * factor / count, count / (found * factor)))


@pytest.fixture
def plan(tmp_path):
    def make(text, **files):
        for name, content in files.items():
            (tmp_path / f"{name}.geo").write_text(content)
        path = tmp_path / "case.yaml"
        path.write_text(text)
        return Plan(load_case(path), lambda changes: load_case(path, changes))

    return make


def test_levels_of_a_flow(plan):
    """Cells, facets and steps go together; ratios are those of counts."""
    made = plan(FLOW)
    assert list(made.sources) == ["cells", "facets", "step"]
    near, far = made.coarser()
    assert far.ratios == pytest.approx({"cells": 2.0, "facets": 2.0, "step": 2.0})
    assert near.ratios == pytest.approx(
        {"cells": (40 * 36 / (28 * (14 + 11))) ** 0.5, "facets": 24 / 16, "step": 10 / 7}
    )
    settings = dict(near.twin.settings)
    assert settings["fluid.bodies.disc.mesh.cells"] == "[16, 2]"
    assert settings["time.step"] == repr(1 / 7)
    assert "fluid.bodies.box.mesh.cells" not in settings  # its facets are exact
    assert near.size == pytest.approx((near.ratios["cells"] * 1.5 * 10 / 7) ** (1 / 3))
    assert made.base().seconds > near.seconds > far.seconds
    assert [run.name for run in made.alone()] == ["cells_2", "facets_2", "step_2"]
    assert [run.name for run in made.twins()] == ["element", "scheme"]
    shifts = list(made.shifts())
    assert [run.size for run in shifts] == [near.size] * 3


def test_refused_levels(plan):
    """With so few layers, coarse cells come too close: that is no case, and its message is kept."""
    made = plan(
        FLOW.replace("around: disc, layers: 8", "box: [[0.5, -0.65], [1.5, 0.65]]").replace(
            "0.3, cells: [24", "0.4, cells: [24"
        )
    )
    refused = [one for one in [*made.coarser(), *made.alone()] if isinstance(one, Refused)]
    assert "not of the finest level" in refused[0].message


BODY = """
time: {step: 1, end: 1}
structure:
  bodies:
    part:
      mesh: {file: part.geo}
      material: {law: neo_hooke, E: 1, nu: 0.3}
      supports: [{on: side, displacement: [0, 0]}]
probes: {energy: {quantity: energy}}
"""
SQUARE = """
Point(1) = {0, 0, 0, 0.03}; Point(2) = {1, 0, 0, 0.03}; Point(3) = {1, 1, 0, 0.03}; Point(4) = {0, 1, 0, 0.03};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Physical Surface("body") = {1}; Physical Curve("side") = {4};
"""


@pytest.mark.parametrize("more", ["", "Transfinite Curve{:} = 41; Transfinite Surface{1}; Recombine Surface{1};\n"])
def test_levels_of_a_script(plan, more):
    made = plan(BODY, part=SQUARE + more)
    near, far = made.coarser()
    assert list(made.sources) == ["bodies"]  # one step is no source
    assert dict(far.twin.settings) == {"structure.bodies.part.mesh.size_factor": "2.0"}
    assert far.size == pytest.approx(2.0, rel=0.07)
    assert near.size == pytest.approx(2.0**0.5, rel=0.07)
    assert list(made.alone()) == []
    assert made.unchanged([near, far]) == []


def test_counts_that_are_one(plan):
    """Nothing can be coarser: no level, and that is said."""
    text = BODY.replace("file: part.geo", "shape: rectangle, size: [1, 1], cells: [1, 1]").replace(
        "on: side", "on: left"
    )
    made = plan(text)
    assert made.coarser() == []
    assert made.unchanged([made.base()]) == ["cells of elastic bodies"]


def write(mesh, path):
    """A mesh file of its cells, without names."""
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
    meshio.write(path, meshio.Mesh(points, [(mesh.cell_type, mesh.cells)]))


IN_FILE = BODY.replace("part.geo", "part.vtu").replace("on: side", "at: [0, 0]")


def test_levels_of_a_mesh_file(plan, tmp_path):
    """Its cells are halved; where the case has halved them before, there are coarser levels."""
    write(shapes.rectangle(size=(1.0, 1.0), cells=(20, 20)), tmp_path / "part.vtu")
    made = plan(IN_FILE)
    assert list(made.sources) == ["files"]
    assert made.fixed == []
    assert made.coarser() == []
    near, far = made.in_place_of_coarser()
    assert dict(near.twin.settings) == {"structure.bodies.part.mesh.refine": "1"}
    assert (near.name, near.size, near.twin.words) == ("finer_2", 0.5, "cells of mesh files 2 times as fine")
    assert (far.name, far.size) == ("finer_4", 0.25)
    assert [run.name for run in made.finer()] == ["finer_2", "finer_4"]
    assert far.seconds > near.seconds > made.base().seconds
    assert made.unchanged([near]) == []
    made = plan(IN_FILE.replace("part.vtu", "part.vtu, refine: 1"))
    assert [run.size for run in [*made.coarser(), *made.in_place_of_coarser()]] == [2.0, 0.5]
    made = plan(IN_FILE.replace("part.vtu", "part.vtu, refine: 2"))
    assert [run.size for run in [*made.coarser(), *made.in_place_of_coarser()]] == [2.0, 4.0]


def test_levels_of_a_mesh_file_in_space(plan, tmp_path):
    """Three levels would cost a hundred times as much as the case."""
    write(shapes.box(size=(1.0, 1.0, 1.0), cells=(2, 1, 1), cell="tet"), tmp_path / "part.vtu")
    made = plan(IN_FILE.replace("[0, 0]", "[0, 0, 0]"))
    assert [run.size for run in made.in_place_of_coarser()] == [0.5]


def test_a_mesh_file_beside_other_sources(plan, tmp_path):
    """Levels are those of the other sources, and of the file there is one alone with half the size."""
    write(shapes.rectangle(size=(1.0, 1.0), cells=(2, 2)), tmp_path / "part.vtu")
    shape = "{shape: rectangle, size: [1, 1], cells: [8, 8]}"
    other = f"    other: {{mesh: {shape}, material: {{law: neo_hooke, E: 1, nu: 0.3}}}}\n"
    made = plan(IN_FILE.replace("probes:", f"{other}probes:"))
    assert list(made.sources) == ["bodies", "files"]
    assert made.in_place_of_coarser() == []
    near, far = made.coarser()
    assert far.ratios == {"bodies": 2.0, "files": 1.0}
    assert far.twin.words == "cells of elastic bodies 2 times as large"
    alone = list(made.alone())
    assert [(run.name, run.size) for run in alone] == [("bodies_2", 2.0), ("files_0.5", 0.5)]
    assert alone[1].twin.words == "cells of mesh files alone half as large"
    assert made.unchanged([*alone, near, far]) == []


def test_curved_surfaces_in_files_stay_polygons(plan, tmp_path):
    write(shapes.disc(radius=1.0, cells=(16, 2)), tmp_path / "part.vtu")
    assert plan(IN_FILE).fixed == ["part (part.vtu)"]


def test_multiples():
    """Numbers that shapes cannot have are not asked for."""
    found = {
        name: TypeAdapter(AnyShape).validate_python({"shape": name, **settings}).multiples
        for name, settings in {
            "disc": {"radius": 1, "cells": [8, 1]},
            "solid_torus": {"major_radius": 2, "minor_radius": 1, "cells": [5, 8]},
            "ring": {"inner_radius": 1, "outer_radius": 2, "cells": [5, 1]},
        }.items()
    }
    assert found == {"disc": (4, 1), "solid_torus": (1, 4), "ring": (1, 1)}


@pytest.mark.parametrize(
    ("scheme", "rho_inf", "expected"),
    [
        ("bdf2", None, {"fluid.scheme": "bdf2_optimized"}),
        ("backward_euler", 0.8, {"fluid.scheme": "bdf2", "structure.dynamics.rho_inf": "0.9"}),
        ("bdf2_optimized", 1.0, {}),
        ("steady", None, {}),
    ],
)
def test_other_schemes_are_better(plan, scheme, rho_inf, expected):
    """A worse one would say its own error."""
    body = BODY.replace("file: part.geo", "shape: rectangle, size: [0.3, 0.3], cells: [4, 4], origin: [2, 0]")
    body = (
        body.split("structure:")[1]
        .split("probes:")[0]
        .replace("nu: 0.3", "nu: 0.3, density: 1")
        .replace("side", "left")
    )
    text = FLOW.replace("viscosity: 1", f"viscosity: 1\n  scheme: {scheme}")
    if rho_inf is not None:
        text += f"structure:\n  dynamics: {{rho_inf: {rho_inf}}}{body}coupling: {{scheme: monolithic}}\n"
        text = text.replace(
            "    box: {mesh: {shape: rectangle, origin: [2, 0], size: [0.3, 0.3], cells: [2, 2]}}\n", ""
        )
        text = text.replace("around: box", "around: part")
    found = [dict(run.twin.settings) for run in plan(text).twins() if run.name == "scheme"]
    assert found == ([expected] if expected else [])
