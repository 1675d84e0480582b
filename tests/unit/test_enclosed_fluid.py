"""Boxes without fluid, and enclosed fluid whose volume would have to change, are refused by check and run alike."""

import pytest
from case_mistakes import first_lines, load, refused
from programs import fsci

from fsci.check.meshes import check_meshes
from fsci.running.history import read_history
from fsci.running.run import run_case

pytestmark = pytest.mark.usefixtures("in_new_folder")

CHANNEL = """\
time: {step: 0.1, end: 0.5}
fluid:
  density: 1
  viscosity: 0.05
  grid: {from: [0, 0], to: [2, 1], cells: [16, 8]}
  patches:
    inlet: {on: x-, velocity: ["y*(1 - y)*ramp(t, 0, 0.3)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
  bodies:
    a: {mesh: {shape: rectangle, size: [0.4, 1.3], cells: [2, 4], origin: [0.93, 0.5]}}
"""
CLOSED = CHANNEL.replace("outflow: true", "no_slip: true")
ALONE = CLOSED[: CLOSED.index("  bodies:")]
ACROSS = CHANNEL.replace("0.93, 0.5]", "0.93, -0.15]")
MOVED = "motion: {displacement: [0.5*t, 0]}}"
PISTON = CLOSED.replace('velocity: ["y*(1 - y)*ramp(t, 0, 0.3)", 0]', "no_slip: true").replace(
    "size: [0.4, 1.3], cells: [2, 4], origin: [0.93, 0.5]}}",
    f"size: [1, 2], cells: [1, 1], origin: [-0.9, -0.5]}}, {MOVED}",
)
ELASTIC = """\
structure:
  dynamics: {}
  bodies:
    wall:
      mesh: {shape: rectangle, size: [0.4, 1], cells: [4, 8], origin: [0.93, 0]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      supports: [{on: top, displacement: [0, 0]}]
coupling: {}
"""
COVER = "shape: rectangle, size: [3, 3], cells: [4, 1], origin: [-0.5, -1]}}"
#: middles of facets are outside of the box, and what the wall displaces there is rounding
LARGE = """\
time: {step: 0.1, end: 0.2}
fluid:
  density: 1
  viscosity: 0.05
  grid: {from: [0, 0, 0], to: [1.5, 0.75, 0.75], cells: [12, 6, 6]}
  patches:
    ends: {on: [x-, x+], periodic: true}
    walls: {on: [y-, y+, z-, z+], slip: true}
  bodies:
    half:
      mesh:
        shape: box
        size: [0.03, 1.4, 3]
        cells: [1, 1, 1]
        origin: [-0.015, -0.08, -1]
        rotate: {angle: 7, axis: [0, 0, 1]}
        translate: [0.59, 0.36, 0]
      motion: {displacement: [0.3*t, 0, 0]}
"""

NO_OUTLET = "and cannot leave: give an outlet (a patch with outflow, pressure or traction)"
REFUSED = {
    "no outlet": (ALONE, f"7:12: 0.167 m^2/s flow into the enclosed fluid at t = 0.3, {NO_OUTLET}"),
    "steady": (ALONE.replace("viscosity", "scheme: steady\n  viscosity"), "8:12: 0.167 m^2/s flow into the enclosed"),
    "no inlet": (
        ALONE.replace("y*(1 - y)", "-1"),
        "7:12: 1 m^2/s flow out of the enclosed fluid at t = 0.3, and nothing",
    ),
    "in mm": ("units: {length: mm, time: ms}\n" + ALONE, "8:12: 0.167 mm^2/ms flow into the enclosed fluid at t = 0.3"),
    "a wall across": (ACROSS, f"7:12: 0.167 m^2/s flow into the enclosed fluid at t = 0.3, {NO_OUTLET}"),
    "a piston": (PISTON, f"11:94: 0.5 m^2/s of the enclosed fluid are displaced at t = 0.1, {NO_OUTLET}"),
    "a piston that leaves": (PISTON.replace("0.5*t", "-0.2*t"), "11:94: 0.2 m^2/s are withdrawn from the enclosed"),
    "different flows": (ALONE.replace("walls:", "out: {on: x+, velocity: [0.1, 0]}\n    walls:"), "7:12: 0.0"),
    "covered": (
        CHANNEL.replace(CHANNEL[CHANNEL.index("shape: rect") :], COVER),
        "10:3: the bodies leave no fluid in the box",
    ),
    "covered by two": (
        CHANNEL[: CHANNEL.index("    a:")]
        + "    a: {mesh: {shape: rectangle, size: [1, 1], cells: [1, 1]}}\n"
        + "    b: {mesh: {shape: rectangle, size: [1.2, 1.1], cells: [1, 1], origin: [1, 0]}}\n",
        "10:3: the bodies leave no fluid in the box: check their sizes, positions and units",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name):
    text, message = REFUSED[name]
    error = refused(text, lambda loaded: run_case(loaded, loaded.folder / "out"))
    assert first_lines(error)[0].startswith(f"case.yaml:{message}")
    assert [str(problem) for problem in check_meshes(load(text)).problems] == [str(error)]


RIGHT = {
    "an outlet": CHANNEL,
    "the same flow in and out": ALONE.replace(
        "walls:", 'out: {on: x+, velocity: ["y*(1 - y)*ramp(t, 0, 0.3)", 0]}\n    walls:'
    ),
    "another profile out": ALONE.replace("walls:", 'out: {on: x+, velocity: ["ramp(t, 0, 0.3)/6", 0]}\n    walls:'),
    "a lid": ALONE.replace('["y*(1 - y)*ramp(t, 0, 0.3)", 0]', "[0, 1]"),
    "an elastic wall across": CHANNEL[: CHANNEL.index("  bodies:")] + ELASTIC,
    "a wall with facets larger than a periodic box": LARGE,
    "elastic bodies in a closed box": ALONE.replace("ramp(t, 0, 0.3)", "0.01*t") + ELASTIC,
    "a free wall across": ACROSS.replace("0.15]}}", "0.15]}, free: {density: 1}}") + "coupling: {}\n",
    "a wall that opens": ACROSS.replace("0.15]}}", "0.15]}, motion: {displacement: [0, 2*t]}}").replace(
        "t, 0, 0.3", "t, 0.2, 0.3"
    ),
    "a turning disc in a closed box": PISTON.replace(
        "rectangle, size: [1, 2], cells: [1, 1], origin: [-0.9, -0.5]",
        "disc, radius: 0.3, cells: [24, 1], translate: [1, 0.5]",
    ).replace("displacement: [0.5*t, 0]", "rotation: {centre: [1, 0.5], angle: 90*t}"),
    "half of a turning disc": PISTON.replace(
        "rectangle, size: [1, 2], cells: [1, 1], origin: [-0.9, -0.5]",
        "disc, radius: 0.3, cells: [24, 1], translate: [1, 0]",
    ).replace("displacement: [0.5*t, 0]", "rotation: {centre: [1, 0], angle: 90*t}"),
    "a disc that moves along the wall": PISTON.replace(
        "rectangle, size: [1, 2], cells: [1, 1], origin: [-0.9, -0.5]",
        "disc, radius: 0.3, cells: [24, 1], translate: [0.7, 0]",
    ),
    "nearly covered": CHANNEL.replace(
        CHANNEL[CHANNEL.index("shape: rect") :], "shape: rectangle, size: [1.9, 3], cells: [4, 1], origin: [0.1, -1]}}"
    ).replace("y*(1 - y)*", "0*"),
}


@pytest.mark.parametrize("name", RIGHT)
def test_accepted(name):
    assert [str(problem) for problem in check_meshes(load(RIGHT[name])).problems] == []


@pytest.mark.parametrize(("processes", "width"), [(2, 2.63), pytest.param(4, 1.63, marks=pytest.mark.slow)])
def test_a_body_that_covers_the_cells_of_a_process(tmp_path, processes, width):
    """A block is lowered into a channel, in front of all cells of one of the processes: as on one."""
    lowered = f"""\
time: {{step: 0.05, end: 0.5}}
fluid:
  density: 1
  viscosity: 0.05
  scheme: backward_euler
  grid: {{from: [0, 0], to: [4, 0.5], cells: [32, 4]}}
  patches: {{o: {{on: [x-, x+, y+], outflow: true}}, w: {{on: y-, slip: true}}}}
  bodies:
    a:
      mesh: {{shape: rectangle, size: [{width}, 2], cells: [4, 4], origin: [-0.3, 0.41]}}
      motion: {{displacement: [0, -1.1*t]}}
probes: {{v: {{field: fluid, quantity: volume}}}}
output: {{fields_every: 0}}
"""
    (tmp_path / "case.yaml").write_text(lowered)
    run = fsci("run", tmp_path, "-o", tmp_path / "out", processes=processes)
    assert run.returncode == 0, run.stdout + run.stderr
    assert read_history(tmp_path / "out" / "history.csv")["v"][-1] == pytest.approx(
        2.0 - 0.5 * (width - 0.3), rel=1e-12
    )
