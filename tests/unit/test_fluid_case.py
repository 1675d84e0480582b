"""The section `fluid` of a case: each mistake with its message, the text it points at, and warnings."""

import subprocess
import sys
from pathlib import Path

import pytest
from case_mistakes import assert_located, load, refused
from case_text import with_section, without
from channel_case import ALONE, CASE, RESTING

from fsci.case import load_case
from fsci.check.check import summary

ROUGH = Path(__file__).parents[2] / "cases/torus_rough/case.yaml"

KINDS = (
    "'velocity', 'no_slip', 'slip', 'symmetry', 'slip_length', 'traction', 'pressure', 'outflow', 'resistance', "
    "'windkessel' or 'periodic'"
)
FACES = "'x-', 'x+', 'y-', 'y+', 'z-' or 'z+'"

#: what is replaced, by what, the message with line and column, the text that stands there
MISTAKES = [
    # sections
    ("fluid:", "flux:", "3:1: unknown setting 'flux'; did you mean 'fluid'?", "flux"),
    (
        "probes:",
        "structure: {bodies: {a: {mesh: {shape: disc, radius: 1, cells: [4, 1]}, "
        "material: {law: neo_hooke, E: 1, nu: 0}}}}\nprobes:",
        "3:1: 'fluid' and 'structure' together need the section 'coupling'; 'coupling: {}' for its defaults",
        "fluid",
    ),
    ("probes:", "contact: {pairs: {}}\nprobes:", "15:10: 'contact' needs the section 'structure'", "{pairs"),
    ("  density: 1.2\n", "", "3:1: missing setting 'density' in 'fluid'", "fluid"),
    ("density: 1.2", "density: -1", "4:12: 'density' must be greater than 0, not -1", "-1"),
    (
        "density: 1.2",
        "density: 1\n  narrow_gaps: true\n  shear: {law: carreau, infinite: 0, time: 1, exponent: 0.5}",
        "5:16: 'narrow_gaps' is for a constant viscosity",
        "true",
    ),
    (
        "density: 1.2",
        "density: 1\n  shear: {law: cross}",
        "5:16: unknown law 'cross' (available: carreau, power_law)",
        "cross",
    ),
    (
        "density: 1.2",
        "density: 1\n  shear: {law: power_law, exponent: 0.5}",
        "5:3: missing setting 'least_rate' in 'shear'",
        "shear",
    ),
    ("density: 1.2", "density: 1\n  scheme: bdf3", "5:11: 'scheme' must be", "bdf3"),
    (
        "density: 1.2",
        "density: 1\n  gravity: [0, 0, -9.81]",
        "5:12: 'gravity' must have 2 entries in 2D, not 3",
        "[0, 0",
    ),
    # patches
    ("on: x-", "on: left", f"8:17: 'on' must be {FACES}, not 'left'", "left"),
    ("on: x-", "on: [x-, z-]", "8:22: a box in 2D has no face 'z-'", "z-"),
    (", outflow: true", "", f"9:13: a patch needs one of {KINDS}", "{on"),
    ("outflow: true", "outflow: true, slip: true", f"9:31: give only one of {KINDS}", "true"),
    ("outflow: true", "slip_length: 0", "9:35: 'slip_length' must be greater than 0, not 0", "0"),
    ("[y-, y+]", "y-", "7:3: no patch is on the face 'y+' of the box", "patches"),
    ('["4*y*(1 - y)", 0]', "[1, 0, 0]", "8:31: 'velocity' must have 2 entries in 2D, not 3", "[1"),
    ("outflow: true", "resistance: -1", "9:34: 'resistance' must be at least 0, not -1", "-1"),
    (
        "outflow: true",
        "windkessel: {proximal: 1, capacitance: 2}",
        "9:22: missing setting 'distal' in 'windkessel'",
        "windkessel",
    ),
    (
        "outflow: true",
        "windkessel: {proximal: 1, compliance: 2, distal: 3}",
        "9:48: unknown setting 'compliance'",
        "compliance",
    ),
    ("outflow: true", "resistance: 0, pressure: 1", f"9:34: give only one of {KINDS}", "0"),
    (
        "quantity: flow_rate",
        "quantity: outlet_pressure",
        "19:45: the patch 'outlet' is neither a 'resistance' nor a 'windkessel'",
        "outlet",
    ),
    ("on: x-", "on: x-, where: y - t", "8:28: 'where' must not depend on t", "y - t"),
    ("outflow: true", "pressure: [1, 0]", "9:32: 'pressure' must be a number or an expression", "[1"),
    ("outflow: true", "periodic: true", "9:18: 'x+' is periodic with 'x-': put both into 'on'", "x+"),
    (
        "on: [y-, y+], no_slip: true",
        "on: [y-, y+], where: x, periodic: true",
        "10:34: a periodic patch has all of its faces: remove 'where'",
        "x, p",
    ),
    (
        "on: [y-, y+], no_slip: true",
        "on: [y-, y+], no_slip: true}\n    ends: {on: [x-, x+], periodic: true",
        "8:17: the patch 'ends' makes the face 'x-' periodic, which allows no other patch on it",
        "x-",
    ),
    ("outflow: true", "outflow: true, rate: 1", "9:43: 'rate' is for a periodic patch, not for 'outflow'", "1}"),
    ("no_slip: true", "periodic: true, rate: y", "10:49: 'rate' must not depend on y", "y}"),
    (
        "on: [y-, y+], no_slip: true",
        "on: [x-, x+, y-, y+], periodic: true, rate: 1",
        "10:57: a rate is along one period: give each direction a patch of its own",
        "1}",
    ),
    (
        "quantity: flow_rate",
        "quantity: driving_force",
        "19:43: the patch 'outlet' is not periodic with a 'rate'",
        "outlet",
    ),
    # bodies
    (
        "    cylinder:",
        "    fluid:",
        "12:5: a body cannot be called 'fluid', which is the name of the files of the flow",
        "fluid",
    ),
    (
        "{shape: disc, radius: 0.2, cells: [40, 1], translate: [1, 0.5]}",
        "{shape: sphere, radius: 0.2, cells: [4, 1]}",
        "13:21: this shape is 3D, but the grid is 2D",
        "sphere",
    ),
    (
        "      motion",
        "      on: inner\n      motion",
        "14:11: 'disc' has no surface 'inner' (available: outer)",
        "inner",
    ),
    ("      motion", "      slip_length: -1\n      motion", "14:20: 'slip_length' must be at least 0, not -1", "-1"),
    ('[0, "0.1*sin(t)"]', "[x, 0]", "14:31: entry 1 of 'displacement' must not depend on x", "x"),
    ('[0, "0.1*sin(t)"]', "[t, 0, 0]", "14:30: 'displacement' must have 2 entries in 2D, not 3", "[t"),
    ("angle: 90*t}", "}", "14:59: a rotation needs 'angle' or 'angular_velocity'", "{centre"),
    (
        "angle: 90*t",
        "angle: 90*t, angular_velocity: 90",
        "14:109: give either 'angle' or 'angular_velocity', not both",
        "90",
    ),
    (
        "displacement: [",
        "velocity: [0, t], displacement: [",
        "14:26: give either 'displacement' or 'velocity', not both",
        "[0, t]",
    ),
    ("displacement: [0", "velocity: [0, 0", "14:26: 'velocity' must have 2 entries in 2D, not 3", "[0"),
    ('displacement: [0, "0.1*sin(t)"]', "velocity: [x, 0]", "14:27: entry 1 of 'velocity' must not depend on x", "x"),
    ("angle: 90*t", "axis: [0, 0, 1], angle: 1", "14:59: a rotation in 2D has no 'axis'", "{centre"),
    ("{centre: [1, 0.5]", "{centre: [1]", "14:68: 'centre' must have 2 or 3 entries, not 1", "[1]"),
    # probes
    ("{quantity: force}", "{quantity: force, body: box}", "16:34: unknown body 'box' (available: cylinder)", "box"),
    (
        "{quantity: force}",
        "{quantity: force, at: [1, 1]}",
        "16:32: quantity 'force' needs 'on: SURFACE' or a 'body'",
        "[1, 1]",
    ),
    (
        "{quantity: force}",
        "{quantity: drag_coefficient}",
        "16:10: quantity 'drag_coefficient' needs the setting 'reference'",
        "{quantity",
    ),
    (
        "{quantity: force}",
        "{quantity: lift_coefficient, reference: {velocity: 1}}",
        "16:50: coefficients in 2D need the setting 'length'",
        "{vel",
    ),
    (
        "{quantity: force}",
        "{quantity: lift_coefficient, reference: {velocity: 1, area: 1}}",
        "16:70: coefficients in 2D refer to 'length', not 'area'",
        "1}}",
    ),
    (
        "{quantity: force}",
        "{quantity: lift_coefficient, reference: {velocity: 1, length: 1, drag: [0, 0]}}",
        "16:81: the direction of the drag must not be zero",
        "[0, 0]",
    ),
    (
        "{quantity: force}",
        "{quantity: lift_coefficient, reference: {velocity: 1, length: 1, lift: [1, 1]}}",
        "16:81: the direction of the lift must be at a right angle to that of the drag",
        "[1, 1]",
    ),
    (
        "{quantity: force}",
        "{quantity: force, reference: {velocity: 1, length: 1}}",
        "16:39: 'reference' is for coefficients of drag and lift, not for 'force'",
        "{velocity",
    ),
    (
        "{quantity: force}",
        "{quantity: force, extreme: least}",
        "16:37: 'extreme' applies to the nodes of a contact pair, or to pressure and speed of all fluid or of that "
        "in a box",
        "least",
    ),
    ("{quantity: force}", "{quantity: mass}", "16:21: quantity 'mass' needs the section 'structure'", "mass"),
    ("at: [2, 0.5]", "at: [2, 1.5]", "17:34: the point (2, 1.5) is outside of the fluid's box", "[2, 1.5]"),
    ("at: [2, 0.5]", "at: [2, 0.5, 0]", "17:34: 'at' must have 2 entries in 2D, not 3", "[2"),
    ("minus: [4, 0.5]", "minus: [5, 0.5]", "18:49: the point (5, 0.5) is outside of the fluid's box", "[5"),
    (
        "at: [0, 0.5], minus",
        "on: inlet, minus",
        "18:46: 'minus' is the second point of a difference: give the first one as 'at'",
        "[4",
    ),
    ("through: outlet", "through: outled", "19:39: unknown patch 'outled'; did you mean 'outlet'?", "outled"),
    (
        ", through: outlet",
        "",
        "19:19: quantity 'flow_rate' needs 'through: PATCH' or 'plane: {point: [..], normal: [..]}'",
        "flow_rate",
    ),
    (
        "through: outlet",
        "plane: {point: [1, 0.5], normal: [0, 0]}",
        "19:63: the normal of a plane must not be zero",
        "[0, 0",
    ),
    (
        "through: outlet",
        "plane: {point: [1, 0.5], normal: [1, 0, 0]}",
        "19:63: 'normal' must have 2 entries in 2D, not 3",
        "[1, 0, 0",
    ),
    (
        "through: outlet",
        "plane: {pont: [1, 0.5], normal: [1, 0]}",
        "19:38: unknown setting 'pont'; did you mean 'point'?",
        "pont",
    ),
    (
        "through: outlet",
        "plane: {point: [4, 0.5], normal: [1, 0]}",
        "19:37: the plane does not pass through the inside of the fluid's box; on its faces are patches: 'through'",
        "{point",
    ),
    (
        "quantity: flow_rate, through: outlet",
        "quantity: pressure, box: [[1, 0.5], [2, 0.5]]",
        "19:34: give the lowest corner first: along y 0.5 is not below 0.5",
        "[[1, 0.5]",
    ),
    (
        "quantity: flow_rate, through: outlet",
        "quantity: pressure, box: [[4, 0.5], [5, 0.7]]",
        "19:34: this box is outside of that of the fluid",
        "[[4",
    ),
    (
        "quantity: flow_rate, through: outlet",
        "quantity: pressure, box: [[1, 0.5], [2, 0.7, 1]]",
        "19:45: a corner must have 2 entries in 2D, not 3",
        "[2, 0.7",
    ),
    (
        "through: outlet",
        "box: [[1, 0.5], [2, 0.7]]",
        "19:35: quantity 'flow_rate' needs 'through: PATCH' or 'plane: {point: [..], normal: [..]}'",
        "[[1",
    ),
    (
        "through: outlet",
        "through: outlet, plane: {point: [1, 0.5], normal: [1, 0]}",
        "19:54: give either 'through' or 'plane', not both",
        "{point",
    ),
    (
        "{quantity: flow_rate",
        "{field: structure, quantity: flow_rate",
        "19:16: the structure has no such quantity 'flow_rate'",
        "structure",
    ),
    (
        "viscosity: 1e-3",
        "viscosity: 1e-3\n  element: q2q1\n  narrow_gaps: true",
        "7:16: 'narrow_gaps' is for q1q1; q2q1 has the flow through narrow gaps without it",
        "true",
    ),
    ("{quantity: force}", "{quantity: force, about: [1, 1]}", "16:35: 'about' is for the quantity 'moment'", "[1, 1]"),
    ("force.x", "structure.energy", "21:13: there is no value 'structure.energy'", "structure"),
]


pytestmark = pytest.mark.usefixtures("in_new_folder")


@pytest.mark.parametrize(("old", "new", "message", "at"), MISTAKES, ids=[m[2] for m in MISTAKES])
def test_message(old, new, message, at):
    assert CASE.count(old) >= 1
    text = CASE.replace(old, new, 1)
    assert_located(text, refused(text), message, at)


def test_a_case_without_any_field():
    assert str(refused("title: a\ntime: {step: 1, end: 2}\n").problems[0]).startswith(
        "case.yaml:1:1: a case needs a section 'structure', 'fluid' or 'rigid'"
    )


def test_the_case_without_mistakes_loads():
    case = load(CASE)
    assert case.warnings == ()
    assert case.dimension == 2
    assert {probe.field for probe in case.probes.values()} == {"fluid"}
    assert case.fluid.dofs(2) == 2 * 81 * 21 + 41 * 11
    text = summary(case)
    for words in ("Navier-Stokes, bdf2, q2q1", "40 x 10 cells", "inlet (velocity)", "disc, rigid, moved", "3,853"):
        assert words in text


@pytest.mark.parametrize(
    ("old", "new", "warning"),
    [
        (
            "step: 0.01, end: 1",
            "step: 2, end: 4",
            "8:12: the flow crosses 20 cells in a time step here; take a smaller 'step'",
        ),
        (
            "radius: 0.2",
            "radius: 0.04",
            "13:13: the body is 0.08 thick, 0.8 of the smallest cells: where it has fluid on both sides, fluid passes "
            "through a body that moves with less than 4 cells across; refine the grid",
        ),
        ("density: 1.2", "density: 1e6", "4:12: implausible density: 1e+06 kg/m^3; check 'units'"),
    ],
)
def test_warnings(old, new, warning):
    found = load(CASE.replace(old, new)).warnings
    assert found == (f"case.yaml:{warning}",)


def test_a_flow_that_nothing_drives():
    still = RESTING.replace('velocity: ["4*y*(1 - y)", 0]', "outflow: true")
    assert load(still).warnings == (
        "case.yaml:7:3: nothing drives the flow: no velocity, traction, pressure, force or moving body",
    )


def test_a_steady_flow_without_a_velocity_of_its_own():
    patches = "  patches:\n    all: {on: [x-, x+, y-, y+], periodic: true}\n  scheme: steady\n"
    periodic = without(with_section(ALONE, patches, "fluid", "patches"), "fluid", "bodies")
    assert str(refused(periodic).problems[0]).startswith(
        "case.yaml:9:11: a steady flow that is periodic in all directions does not determine its mean velocity"
    )


def test_check_of_a_fluid_needs_no_finite_elements():
    load(CASE)
    code = (
        "import sys; from fsci.cli import execute; assert execute(['check', 'case.yaml']) == 0; "
        "assert not {'dolfinx', 'petsc4py', 'mpi4py', 'pyvista', 'gmsh'} & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_layer_without_slip():
    """Fine grids of this case failed without the slip length."""
    no_slip = ("structure.bodies.torus.slip_length", "0")
    expected = (
        "the shear of a film that closes jumps to zero without slip, and Newton's method may fail in contact; "
        "give the bodies a 'slip_length' as large as the roughness"
    )
    assert f"{ROUGH}:31:9: {expected}" in load_case(ROUGH, [no_slip]).warnings
    for cure in ((), (no_slip, ("fluid.narrow_gaps", "false")), (no_slip, ("contact.film.roughness", "0"))):
        assert not any("slip_length" in warning for warning in load_case(ROUGH, cure).warnings)
