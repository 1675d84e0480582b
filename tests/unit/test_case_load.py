"""Cases without mistakes: what the program reads from a file, overrides, places, warnings."""

from pathlib import Path

import numpy as np
import pytest

from fsci.case import load_case
from fsci.check.check import summary

ROOT = Path(__file__).parents[2]

MINIMAL = """\
time: {step: 1, end: 2}   # two load steps
structure:
  bodies:
    block:
      mesh: {shape: box, size: [1, 1, 1], cells: [2, 2, 2]}
      # stiff
      material: {law: neo_hooke, E: 210e9, nu: 0.3}
      supports:
        - {on: bottom, displacement: [null, 0, "0.1*t"]}
"""


@pytest.fixture
def case_of(tmp_path):
    """A case from its text, loaded with overrides such as "time.end=3"."""

    def load(text, *overrides):
        (tmp_path / "case.yaml").write_text(text, encoding="utf-8")
        return load_case(tmp_path, [tuple(item.split("=", 1)) for item in overrides])

    return load


def test_every_case_of_the_project_is_valid():
    folders = [path.parent for path in (ROOT / "cases").glob("*/case.yaml")]
    assert folders
    for folder in folders:
        assert load_case(folder).path == folder / "case.yaml"


def test_defaults(case_of):
    case = case_of(MINIMAL)
    assert (case.title, case.time.start, case.time.retry.halvings) == ("", 0.0, 8)
    assert case.structure.dynamics is None
    assert case.structure.bodies["block"].material.density is None
    assert (case.units.length, case.units.mass, case.units.time) == ("m", "kg", "s")
    assert case.probes == {}
    assert case.solver.newton.residual == 1e-8
    assert case.dimension == 3


def test_values(case_of):
    support = case_of(MINIMAL).structure.bodies["block"].supports[0]
    assert support.on == ("bottom",)
    free, zero, moved = support.displacement
    assert free is None
    assert zero.constant == 0.0
    np.testing.assert_allclose(moved(np.zeros((3, 2)), 3.0), [0.3, 0.3])


@pytest.mark.parametrize(
    ("text", "value"),
    [("1e-3", 0.001), ("1E5", 1e5), ("0x10", 16), ("0o17", 15), ("010", 10), ("1_000", 1000), ("2*pi", 2 * np.pi)],
)
def test_numbers_are_those_of_yaml_1_2(case_of, text, value):
    assert case_of(MINIMAL, f"time.end={text}", "time.step=1e-4").time.end == pytest.approx(value, rel=1e-15)


def test_dynamics_by_its_default_by_rho_inf_and_by_parameters(case_of):
    dynamic = MINIMAL.replace("nu: 0.3", "nu: 0.3, density: 1").replace("structure:\n", "structure:\n  dynamics: {}\n")
    assert case_of(dynamic).structure.dynamics.rho_inf == 1.0
    assert case_of(dynamic, "structure.dynamics.rho_inf=0.5").structure.dynamics.rho_inf == 0.5
    newmark = case_of(dynamic, "structure.dynamics={alpha_m: 0, alpha_f: 0, beta: 0.25, gamma: 0.5}").structure.dynamics
    assert (newmark.rho_inf, newmark.alpha_m, newmark.beta) == (None, 0.0, 0.25)


def test_empty_lists_and_sections_are_absent(case_of):
    case = case_of(MINIMAL + "probes:\nverify:\n#  - {value: a}\noutput:\nsolver:\n  newton:\n")
    assert (case.probes, case.verify, case.output.fields_every) == ({}, (), 1)


def test_one_rotation_is_a_list_of_one(case_of):
    case = case_of(MINIMAL, "structure.bodies.block.mesh.rotate={axis: [0, 0, 1], angle: 360/8}")
    (rotation,) = case.structure.bodies["block"].mesh.rotate
    assert (rotation.axis, rotation.angle) == ((0.0, 0.0, 1.0), 45.0)


def test_a_section_can_inherit_from_another(case_of):
    more = "    twin:\n      <<: *block\n      mesh: {shape: beam, length: 3, width: 1, height: 1, cells: [3, 1, 1]}\n"
    bodies = case_of(MINIMAL.replace("block:", "block: &block") + more).structure.bodies
    assert bodies["twin"].material == bodies["block"].material
    assert bodies["twin"].mesh.length == 3.0


def test_probes_belong_to_the_only_body(case_of):
    probes = "probes:\n  a: {quantity: displacement, at: [0, 0, 0]}\n  b: {quantity: volume}\n"
    assert {probe.body for probe in case_of(MINIMAL + probes).probes.values()} == {"block"}


def test_columns_of_probes(case_of):
    probes = "probes: {a: {quantity: displacement, on: top}, b: {quantity: volume}, c: {quantity: energy}}\n"
    case = case_of(MINIMAL + probes)
    columns = {name: probe.columns(name, 3) for name, probe in case.probes.items()}
    assert columns == {
        "a": ("a.x", "a.y", "a.z"),
        "b": ("b",),
        "c": ("c.kinetic", "c.internal", "c.work", "c.total"),
    }
    assert case.probes["a"].columns("a", 2) == ("a.x", "a.y")


def test_places(case_of):
    case = case_of(MINIMAL, "time.end=3")
    assert case.locate("structure", "bodies", "block", "material", "nu") == f"{case.path}:7:48"
    assert case.locate("structure", "bodies", "block", "supports", 0, "on") == f"{case.path}:9:16"
    assert case.locate("structure", "bodies", "block") == f"{case.path}:4:5"
    assert case.locate("structure", "bodies", "block", "gravity") == f"{case.path}:4:5"
    assert case.locate("solver", "newton") == f"{case.path}:1:1"
    assert case.locate("time", "end") == "--set time.end=3"
    error = case.error(("structure", "bodies", "block", "mesh"), "too coarse")
    assert str(error).split("\n")[0] == f"{case.path}:5:13: too coarse"


def test_folder(case_of, tmp_path):
    case = case_of(MINIMAL)
    assert (case.path, case.folder) == (tmp_path / "case.yaml", tmp_path)


def test_dump_is_the_file(case_of):
    assert case_of(MINIMAL).dump() == MINIMAL


def test_dump_has_the_overrides_and_keeps_the_comments(case_of):
    case = case_of(MINIMAL, "time.end=5", "structure.bodies.block.supports.0.on=top", "solver.newton.max_iterations=9")
    text = case.dump()
    assert "# two load steps" in text
    assert "# stiff" in text
    again = case_of(text)
    assert again.time.end == 5.0
    assert again.structure.bodies["block"].supports[0].on == ("top",)
    assert again.solver.newton.max_iterations == 9
    assert again.structure.bodies["block"].material == case.structure.bodies["block"].material


def test_windows_line_ends_and_byte_order_mark(tmp_path):
    (tmp_path / "case.yaml").write_bytes(b"\xef\xbb\xbf" + MINIMAL.replace("\n", "\r\n").encode())
    case = load_case(tmp_path)
    assert case.locate("structure", "bodies", "block", "mesh", "shape") == f"{case.path}:5:21"


@pytest.mark.parametrize(
    ("override", "place", "warning"),
    [
        ("time.step=3", "--set time.step=3", "the step 3 is longer than the run, 2"),
        (
            "units={length: mm, mass: t}",
            "{path}:7:37",
            "implausible stiffness: Young's modulus 2.1e+11 t/(mm s^2), which is 2.1e+17 Pa; check 'units'",
        ),
        (
            "structure.bodies.block.material.density=7.85e-9",
            "--set structure.bodies.block.material.density=7.85e-9",
            "implausible density: 7.85e-09 kg/m^3; check 'units'",
        ),
        (
            "structure.bodies.block.mesh.cells=[1, 1, 100]",
            "--set structure.bodies.block.mesh.cells=[1, 1, 100]",
            "the cells are 100 times longer than wide",
        ),
    ],
)
def test_warnings(case_of, override, place, warning):
    case = case_of(MINIMAL, override)
    assert case.warnings == (f"{place.replace('{path}', str(case.path))}: {warning}",)


def test_plausible_numbers_in_other_units(case_of):
    steel = "{law: neo_hooke, E: 210e3, nu: 0.3, density: 7.85e-9}"
    assert case_of(MINIMAL, "units={length: mm, mass: t}", f"structure.bodies.block.material={steel}").warnings == ()


def test_summary(case_of):
    case = case_of("title: Block\n" + MINIMAL, "structure.bodies.block.mesh.order=2")
    assert summary(case) == (
        "  title       Block\n"
        "  time        0 to 2 s, 2 steps of 1\n"
        "  structure   static\n"
        "  body block  box, neo_hooke, 8 cells (order 2 hex)\n"
        "  dofs        375\n"  # 5^3 nodes
        "  columns     structure.energy"
    )
