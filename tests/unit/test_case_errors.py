"""Broken case files, one for each kind of mistake: the exact message, and the text it points at."""

import pickle

import pytest
from case_mistakes import assert_located, first_lines, load, refused

from fsci.case import CaseError, load_case

CASE = """\
title: beam
units: {length: m, mass: kg, time: s}
time: {step: 0.1, end: 1}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    beam:
      mesh: {shape: rectangle, size: [2, 1], cells: [4, 2]}
      material: {law: neo_hooke, E: 1e6, nu: 0.3, density: 1000}
      supports:
        - {on: left, displacement: [0, 0]}
      gravity: [0, -9.81]
      tractions:
        - {on: right, value: [0, "1e3*min(t, 1)"]}
probes:
  tip: {quantity: displacement, at: [2, 0.5]}
  energy: {quantity: energy}
verify:
  - {value: tip.y, statistic: min, reference: -0.1, relative: 0.1}
solver:
  newton:
    max_iterations: 20
"""
MESH = "mesh: {shape: rectangle, size: [2, 1], cells: [4, 2]}"
SECTIONS = "title, units, time, curves, structure, fluid, rigid, coupling, contact, probes, output, verify, solver"
SHAPES = "rectangle, disc, ring, box, beam, cylinder, tube, annulus, solid_torus, hollow_torus, hollow_sphere, "
SHAPES += "sphere, leaflet"
CONSTANTS = "needs two constants, either E and nu, or lambda and mu, or mu and nu"

#: what is replaced, by what, the message with line and column, the text that stands there
MISTAKES = [
    # names
    (
        "max_iterations",
        "max_iteration",
        "22:5: unknown setting 'max_iteration'; did you mean 'max_iterations'?",
        "max_",
    ),
    ("solver:", "colour: red\nsolver:", f"20:1: unknown setting 'colour' (available: {SECTIONS})", "colour"),
    ("solver:", "coupling: {}\nsolver:", "20:11: 'coupling' needs the section 'fluid'", "{}"),
    (", end: 1}", "}", "3:1: missing setting 'end' in 'time'", "time"),
    ("time: {step: 0.1, end: 1}\n", "", "1:1: missing setting 'time'", "title"),
    ("{on: left, d", "{d", "11:11: entry 1 of 'supports' needs 'on: NAME' or 'at: [..]'", "{displacement"),
    (
        "  energy:",
        "  my energy:",
        "17:3: 'my energy' must be a name of letters, digits, '_' and '-' that begins with a letter, not 'my energy'",
        "my energy",
    ),
    (
        "      gravity",
        "      slip_length: 0.1\n      gravity",
        "12:20: 'slip_length' is a property of the flow around the body and needs the section 'fluid'",
        "0.1",
    ),
    # types
    ("{step: 0.1, end: 1}", "3", "3:7: 'time' must be a section of settings, not 3", "3"),
    (" {step: 0.1, end: 1}", "", "3:1: 'time' is empty: give it a value", "time"),
    ("probes:\n", "probes: 3\nunits2:\n", "15:9: 'probes' must be a section of names, not 3", "3"),
    ("- {value", "  {value", "18:1: 'verify' must be a list, not a section: begin each entry with '- '", "verify"),
    ("title: beam", "title: 3", "1:8: 'title' must be a text, not 3 (put it in quotes)", "3"),
    ("step: 0.1", "step: true", "3:14: 'step' must be a number, not true", "true"),
    ("step: 0.1", "step: [1]", "3:14: 'step' must be a number, not a list", "[1]"),
    ("step: 0.1", "step: .inf", "3:14: 'step' must be a finite number", ".inf"),
    ("max_iterations: 20", "line_search: 1", "22:18: 'line_search' must be true or false, not 1", "1"),
    ("[4, 2]", "[4, 2.5]", "8:57: entry 2 of 'cells' must be a whole number, not 2.5", "2.5"),
    ("[0, -9.81]", "-9.81", "12:16: 'gravity' must be a list of 2 or 3 entries, not -9.81", "-9.81"),
    ("[0, -9.81]", "[0, null]", "12:20: entry 2 of 'gravity' is empty: give it a value", "null"),
    (
        " {rho_inf: 0.8}",
        "",
        "5:3: 'dynamics' is empty: write 'dynamics: {}' for its defaults, or remove the line for a static case",
        "dynamics",
    ),
    # values
    ("step: 0.1", "step: -0.1", "3:14: 'step' must be greater than 0, not -0.1", "-0.1"),
    ("end: 1", "end: -1", "3:24: 'end' must be later than 'start', 0, not -1", "-1"),
    ("rho_inf: 0.8", "rho_inf: 1.8", "5:23: 'rho_inf' must be from 0 to 1, not 1.8", "1.8"),
    ("[4, 2]", "[4, 0]", "8:57: entry 2 of 'cells' must be at least 1, not 0", "0"),
    ("[4, 2]", "[4, 2, 1]", "8:53: 'cells' must have 2 entries, not 3", "[4, 2, 1]"),
    ("[4, 2]", "[4, 2], order: 3", "8:68: 'order' must be 1, 2 or auto, not 3", "3"),
    ("length: m,", "length: inch,", "2:17: 'length' must be 'km', 'm', 'dm', 'cm', 'mm' or 'um', not 'inch'", "inch"),
    (
        "statistic: min,",
        "statistic: minimum,",
        "19:31: 'statistic' must be 'final', 'min', 'max', 'max_abs', 'time_of_max', 'mean', 'amplitude' "
        "or 'frequency', not 'minimum'; "
        "did you mean 'min'?",
        "minimum",
    ),
    (
        "statistic: min,",
        "statistic: min, from: 2, to: 1,",
        "19:49: 'to' must not be before 'from', 2, not 1",
        "1,",
    ),
    ("nu: 0.3", "nu: 0.5", "9:46: 'nu' must be above -1 and below 0.5, not 0.5", "0.5"),
    ("  bodies:\n", "  bodies: {}\n  bodies2:\n", "6:11: 'bodies' needs at least one body", "{}"),
    # expressions
    ("step: 0.1", "step: fast", "3:14: 'step': unknown name 'fast' (known: x, y, z, t, pi, e)", "fast"),
    ("step: 0.1", "step: t/2", "3:14: 'step' must not depend on t (it must be a constant)", "t/2"),
    ("min(t, 1)", "mim(t, 1)", "14:39: entry 2 of 'value': unknown function 'mim'; did you mean 'min'?", "mim("),
    ("min(t, 1)", "min(t 1)", "14:45: entry 2 of 'value': found '1' where ')' is expected", "1)"),
    ("nu: 0.3", "nu: 0.3*t", "9:46: 'nu' must not depend on t", "0.3*t"),
    # choices
    ("neo_hooke", "neohooke", "9:23: unknown law 'neohooke'; did you mean 'neo_hooke'?", "neohooke"),
    (
        "law: neo_hooke, ",
        "",
        "9:17: 'material' needs the setting 'law' (available: st_venant_kirchhoff, neo_hooke, coup_neo_hooke, "
        "mooney_rivlin, yeoh, ogden, holzapfel_gasser_ogden, FILE.py:NAME)",
        "{E",
    ),
    ("rectangle", "blob", f"8:21: unknown shape 'blob' (available: {SHAPES})", "blob"),
    ("[4, 2]", "[4, 2], cell: hex", "8:67: 'cell' must be 'quad' or 'tri', not 'hex'", "hex"),
    ("mesh: {", "mesh: {file: a.msh, ", "8:34: give either 'file' or 'shape', not both", "rectangle"),
    ("shape: rectangle, ", "", "8:13: 'mesh' needs the setting 'file' or 'shape'", "{size"),
    (MESH, "mesh: beam.geo", "8:13: 'mesh' must be a section with 'file' or 'shape', not 'beam.geo'", "beam.geo"),
    ("E: 1e6, ", "", f"9:17: law 'neo_hooke' {CONSTANTS}; given: nu", "{law"),
    ("E: 1e6", "E: 1e6, mu: 3", f"9:17: law 'neo_hooke' {CONSTANTS}; given: E, nu, mu", "{law"),
    (
        "law: neo_hooke, E: 1e6, nu: 0.3",
        "law: coup_neo_hooke, E: 1, nu: -0.1",
        "9:49: 'nu' must be at least 0 for the law 'coup_neo_hooke'",
        "-0.1",
    ),
    ("E: 1e6, nu: 0.3", "lambda: -3, mu: 3", "9:42: 'lambda' must be greater than -2/3 mu, -2, not -3", "-3"),
    (
        "cells: [4, 2]}",
        "cells: [4, 2], cell: tri}\n      element: mixed",
        "9:16: 'mixed' is for quadrilaterals and hexahedra; take 'displacement' and second order for triangles and "
        "tetrahedra",
        "mixed",
    ),
    (
        MESH,
        MESH + "\n      element: bbar",
        "9:16: 'element' must be 'auto', 'displacement' or 'mixed', not 'bbar'",
        "bbar",
    ),
    (
        MESH,
        MESH + "\n      kinematics: small",
        "9:19: 'kinematics' must be 'finite' or 'linear', not 'small'",
        "small",
    ),
    (
        "rho_inf: 0.8",
        "rho_inf: 0.8, beta: 0.3",
        "5:34: give either 'rho_inf' or the four of alpha_m, alpha_f, beta and gamma",
        "0.3",
    ),
    (
        "rho_inf: 0.8",
        "beta: 0.3, gamma: 0.5",
        "5:20: alpha_m, alpha_f, beta and gamma belong together; missing: alpha_m, alpha_f",
        "0.3",
    ),
    ("[0, 0]}", "[0, 0], symmetry: true}", "11:54: give either 'displacement' or 'symmetry: true', not both", "true"),
    (
        ", displacement: [0, 0]",
        "",
        "11:11: a support needs 'displacement', 'direction', 'normal: true' or 'symmetry: true'",
        "{on: left}",
    ),
    ("at: [2, 0.5]", "at: [2, 0], on: top", "16:49: give either 'at' or 'on', not both", "top"),
    (", at: [2, 0.5]", "", "16:19: quantity 'displacement' needs 'at: [..]' or 'on: SURFACE'", "displacement"),
    ("quantity: energy", "quantity: reaction, at: [0, 0]", "17:36: quantity 'reaction' needs 'on: SURFACE'", "[0, 0]"),
    (
        "quantity: energy",
        "quantity: energy, on: top",
        "17:34: quantity 'energy' is measured on the whole body: remove 'at' and 'on'",
        "top",
    ),
    ("relative: 0.1", "relative: 0.1, absolute: 1", "19:78: give either 'relative' or 'absolute', not both", "1}"),
    (", relative: 0.1", "", "19:5: a check needs a tolerance: 'relative' or 'absolute'", "{value"),
    ("reference: -0.1", "reference: 0", "19:60: a reference of 0 needs an 'absolute' tolerance", "0.1"),
    # shapes
    (
        MESH,
        "mesh: {shape: ring, inner_radius: 2, outer_radius: 1, cells: [8, 2]}",
        "8:58: 'outer_radius' must be greater than 'inner_radius', 2, not 1",
        "1",
    ),
    (
        MESH,
        "mesh: {shape: disc, radius: 2, cells: [6, 2]}",
        "8:46: the number of cells around must be a multiple of 4, not 6",
        "6",
    ),
    (
        MESH,
        "mesh: {shape: ring, inner_radius: 1, outer_radius: 2, cells: [2, 2]}",
        "8:69: at least 3 cells are needed all the way around, not 2",
        "2",
    ),
    (
        MESH,
        "mesh: {shape: ring, inner_radius: 1, outer_radius: 2, cells: [8, 2], angle: 400}",
        "8:83: 'angle' must be at most 360 degrees, not 400",
        "400",
    ),
    (MESH, MESH[:-1] + ", rotate: {axis: [0, 0, 1], angle: 90}}", "8:69: a rotation in 2D has no 'axis'", "{axis"),
    (MESH, MESH[:-1] + ", mirror: z}", "8:69: 'mirror' must be x or y in 2D", "z}"),
    (MESH, MESH[:-1] + ", rotate: [{angel: 90}]}", "8:71: unknown setting 'angel'; did you mean 'angle'?", "angel"),
    (MESH, MESH[:-1] + ", translate: [1, 2, 3]}", "8:72: 'translate' must have 2 entries in 2D, not 3", "[1"),
    (
        MESH,
        MESH + "\n      region: rubber",
        "9:15: 'region' is for mesh files; a built-in shape is one region",
        "rubber",
    ),
    # between sections
    (
        "on: left",
        "on: [left, botom]",
        "11:23: 'rectangle' has no surface 'botom'; did you mean 'bottom'? (available: left, right, bottom, top)",
        "botom",
    ),
    (
        "on: right",
        "on: outer",
        "14:16: 'rectangle' has no surface 'outer' (available: left, right, bottom, top)",
        "outer",
    ),
    ("[0, 0]", "[0, 0, 0]", "11:36: 'displacement' must have 2 entries in 2D, not 3", "[0, 0, 0]"),
    ("[0, -9.81]", "[0, -9.81, 0]", "12:16: 'gravity' must have 2 entries in 2D, not 3", "[0, -9.81, 0]"),
    ("at: [2, 0.5]", "at: [2, 0.5, 0]", "16:37: 'at' must have 2 entries in 2D, not 3", "[2, 0.5, 0]"),
    (", density: 1000", "", "9:17: missing setting 'density' in 'material': gravity needs it", "{law"),
    ("density: 1000", "density: 0", "9:60: 'density' must be greater than 0: gravity needs it", "0}"),
    ("density: 1000", "density: -1", "9:60: 'density' must be at least 0, not -1", "-1"),
    (
        "dynamics: {rho_inf: 0.8}",
        "plane: stress",
        "9:23: plane stress needs the law 'st_venant_kirchhoff', not 'neo_hooke'",
        "neo_hooke",
    ),
    (
        "dynamics: {rho_inf: 0.8}",
        "plane: strain",
        "16:19: quantity 'velocity' needs 'dynamics' in 'structure'",
        "velocity",
    ),
    ("{quantity: energy", "{body: bem, quantity: energy", "17:18: unknown body 'bem'; did you mean 'beam'?", "bem"),
    (
        "  energy: {quantity: energy",
        "  wall: {quantity: mass",
        "17:9: a probe cannot be called 'wall': history.csv has a column of this name",
        "{quantity: mass",
    ),
    ("tip.y", "top.y", "19:13: there is no value 'top.y'; did you mean 'tip.y'?", "top.y"),
    ("relative", "from: 3, relative", "19:59: 'from' must be a time of the run, 0 to 1, not 3", "3"),
    # files
    (MESH, "mesh: {file: nope.msh}", "8:20: mesh file 'nope.msh' not found in {folder}", "nope.msh"),
    (MESH, "mesh: {file: there.msh, order: 2}", "8:38: 'order' is for .geo files; 'there.msh' has its own", "2"),
    # YAML
    ("    max_iter", "\tmax_iter", "22:1: a tab cannot stand here; indent with spaces", "\t"),
    ("solver:\n", "time: 3\nsolver:\n", "20:1: 'time' is set twice, first in line 3", "time"),
    (", end: 1}", ", end: 1", "3:7: this section needs ',' or '}'", "{step"),
    ("[4, 2]", "[4, 2", "8:53: this list needs ',' or ']'", "[4, 2"),
    ("title: beam", "title: 'beam", "1:8: this quote is not closed", "'beam"),
    (
        "title: beam",
        "title: a: b",
        "1:9: unexpected ':'; check the indentation, and quote a text with ': ' in it",
        ": b",
    ),
    ("  bodies:\n", "   bodies:\n", "6:4: the indentation does not match the lines above", "bodies"),
    ("[0, -9.81]", "[0, ramp(t, 0, 1)]", "12:20: 'ramp(t' ends at ',': put a formula with ',' in quotes", "ramp"),
    ("[0, -9.81]", "{x: min(t, 1)}", "12:20: 'min(t' ends at ',': put a formula with ',' in quotes", "min"),
    ("title: beam", "title: @beam", "1:8: a value cannot begin with this character; put it in quotes", "@"),
    ("title: beam", "title: !!python/object 3", "1:8: the tag '!!python/object' is not allowed in a case file", "!!"),
    ("title: beam", "title: *other", "1:8: there is no section marked with '&' and this name", "*other"),
    ("title: beam", "title: beam\n---", "2:1: a case file has only one document; remove the line '---'", "---"),
    ("title: beam", "? [a]\n: b", "1:3: the name of a setting must be a plain word", "[a]"),
    ("title: beam", "loop: &a {b: *a}", "1:7: this section contains itself", "&a"),
    ("title: beam", "title: \x07", "1:8: this character is not allowed in YAML", "\x07"),
    (CASE, "", "1:1: the case is empty", ""),
    (CASE, "- 1", "1:1: the case must be a section of settings such as 'time:' and 'structure:', not a list", "- 1"),
    (CASE, "a: " + "[" * 500, "1:1: the settings are nested too deeply", "a"),
]


@pytest.fixture(autouse=True)
def _folder(tmp_path, in_new_folder):
    (tmp_path / "there.msh").touch()


@pytest.mark.parametrize(("old", "new", "message", "at"), MISTAKES, ids=[m[2] for m in MISTAKES])
def test_message(old, new, message, at, tmp_path):
    assert CASE.count(old) >= 1
    text = CASE.replace(old, new, 1)
    if "velocity" in message:
        text = text.replace("quantity: displacement", "quantity: velocity").replace("reference: -0.1", "reference: 1")
    error, message = refused(text), message.replace("{folder}", str(tmp_path))
    assert f"case.yaml:{message}" in first_lines(error)
    assert_located(text, error, message, at)


def test_the_case_without_mistakes_loads():
    assert load(CASE).warnings == ()


def test_no_message_is_the_validators_own():
    text = CASE.replace("0.1", "[]").replace("[4, 2]", "{}").replace("1000", "[1]").replace("beam:", "beam: 3\n    b:")
    message = str(refused(text))
    for word in ("pydantic", "value_error", "Input should", "Field required", "validation error", "dict", "NoneType"):
        assert word not in message


def test_all_mistakes_at_once_in_the_order_of_lines():
    text = CASE.replace("max_iterations", "max_iteration").replace("step: 0.1", "step: 0").replace("law:", "lw:")
    assert str(refused(text)) == (
        "case.yaml:3:14: 'step' must be greater than 0, not 0\n"
        "  time: {step: 0, end: 1}\n"
        "               ^\n"
        "case.yaml:9:17: 'material' needs the setting 'law' (available: st_venant_kirchhoff, neo_hooke, "
        "coup_neo_hooke, mooney_rivlin, yeoh, ogden, holzapfel_gasser_ogden, FILE.py:NAME)\n"
        "        material: {lw: neo_hooke, E: 1e6, nu: 0.3, density: 1000}\n"
        "                  ^\n"
        "case.yaml:22:5: unknown setting 'max_iteration'; did you mean 'max_iterations'?\n"
        "      max_iteration: 20\n"
        "      ^"
    )


def test_the_column_inside_a_text_is_not_guessed():
    folded = CASE.replace('"1e3*min(t, 1)"', '"1e3*\n          mim(t, 1)"')
    assert str(refused(folded)).startswith("case.yaml:14:34: entry 2 of 'value': unknown function 'mim'")


def test_several_bodies_need_names_in_probes():
    twins = CASE.replace("    beam:\n", "    other: &other\n").replace("probes:", "    beam: {<<: *other}\nprobes:")
    assert str(refused(twins)).split("\n")[0] == (
        "case.yaml:17:8: missing setting 'body' in 'tip': there are several bodies (other, beam)"
    )


def test_bodies_of_different_dimensions():
    rubber = "material: {law: neo_hooke, E: 1, nu: 0, density: 1}"
    box = f"    box: {{mesh: {{shape: box, size: [1, 1, 1], cells: [1, 1, 1]}}, {rubber}}}"
    text = CASE.replace("probes:", f"{box}\nprobes:").replace("{quantity: disp", "{body: beam, quantity: disp")
    assert str(refused(text)).split("\n")[0] == "case.yaml:15:25: this shape is 3D, but another body is 2D"


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("structure.bodies.beam.material.nu=0.7", "'nu' must be above -1 and below 0.5, not 0.7"),
        ("structure.bodies.beam.supports.0.on=lfet",
         "'rectangle' has no surface 'lfet'; did you mean 'left'? (available: left, right, bottom, top)"),
        ("structure.bodies.beam.supports.3.on=left",
         "'structure.bodies.beam.supports' is a list with entries 0 to 0 and has no entry '3'"),
        ("structure.bodies.beam.gravity=[0, 1*]",
         "entry 2 of 'gravity': the expression ends where a number, a name or '(' is expected"),
        ("solver.newton.max_iteration=3", "unknown setting 'max_iteration'; did you mean 'max_iterations'?"),
        ("solver.linear.tolerance=-1", "'tolerance' must be greater than 0, not -1"),
        ("title.x=3", "'title' is not a section, it has no setting 'x'"),
        ("time..end=3", "write names separated by single dots"),
        ("verify=[1,", "the text ends before the value is complete"),
        ("time.end=", "'end' is empty: give it a value"),
        ("coupling.scheme=monolithic", "'coupling' needs the section 'fluid'"),
    ],
)  # fmt: skip
def test_override(override, message):
    name, _, value = override.partition("=")
    assert str(refused(CASE, overrides=((name, value),))) == f"--set {override}: {message}"


def test_mistakes_in_file_and_override_together():
    text = str(refused(CASE.replace("step: 0.1", "step: 0"), overrides=(("time.end", "x"),)))
    assert text.startswith(
        "--set time.end=x: 'end' must not depend on x (it must be a constant)\ncase.yaml:3:14: 'step'"
    )


def test_files_that_cannot_be_read(tmp_path):
    for path, message in (("nope.yaml", "No such file or directory"), (".", "No such file or directory")):
        with pytest.raises(CaseError, match=message):
            load_case(path)
    (tmp_path / "case.yaml").write_bytes(b"title: x\ntime: \xff")
    with pytest.raises(CaseError, match=r"^case\.yaml:2:7: the file is not UTF-8 text"):
        load_case(tmp_path.relative_to(tmp_path))


def test_an_error_survives_sending_it_to_another_process():
    error = refused(CASE.replace("step: 0.1", "step: 0"))
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
