"""Active stress along fibres: bars that pull and shorten by hand, at any angle, with the energy that they take."""

import numpy as np
import pytest
from programs import fsci
from structure_setup import block, constant, distort, make_structure
from test_structure_tangent import tangent_error

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from solvers.structure.active import Active
from solvers.structure.materials import LinearElastic, NeoHooke

BAR = """
time: {{step: 0.25, end: 1}}
solver: {{newton: {{residual: 1e-12}}}}
structure:
  bodies:
    bar:
      mesh: {{shape: rectangle, size: [2, 1], cells: [3, 1], rotate: [{{angle: {angle}}}]}}
      {kinematics}
      material: {{law: st_venant_kirchhoff, E: 100, nu: 0{viscous}}}
      active: [{{direction: [{c}, {s}], stress: "20*t"}}]
      supports:
        - {{on: left, direction: [{c}, {s}]}}
        - {{on: bottom, direction: [{ms}, {c}]}}
        {held}
probes:
  right: {{body: bar, quantity: displacement, on: right}}
  held: {{body: bar, quantity: reaction, on: right}}
  cut: {{body: bar, quantity: traction, on: right}}
  energy: {{quantity: energy}}
"""


def bar(folder, *words, angle=0.0, held=False, kinematics="", viscous="", processes=1):
    """A bar of 2 m and an area of 1 m^2 whose fibres along it pull with 20 t Pa."""
    folder.mkdir(exist_ok=True)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    support = f"- {{on: right, direction: [{c}, {s}]}}" if held else ""
    text = BAR.format(angle=angle, c=c, s=s, ms=-s, held=support, kinematics=kinematics, viscous=viscous)
    (folder / "case.yaml").write_text(text)
    ended = fsci("run", folder, "-o", folder / "out", *words, processes=processes)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return read_history(folder / "out" / "history.csv")


@pytest.mark.parametrize("angle", [0.0, 33.0])
def test_free_bar_shortens(tmp_path, angle):
    """E (l^2 - 1)/2 + T = 0; the energy of the bar is the work of its fibres."""
    found = bar(tmp_path, angle=angle)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    length = np.sqrt(1.0 - 2.0 * 20.0 * found["time"] / 100.0)
    assert c * found["right.x"] + s * found["right.y"] == pytest.approx(2.0 * (length - 1.0), rel=1e-8)
    assert -s * found["right.x"] + c * found["right.y"] == pytest.approx(0.0, abs=1e-8)
    assert found["cut.x"] == pytest.approx(0.0, abs=1e-7)
    assert found["energy.internal"][-1] == pytest.approx(2.0 * 100.0 / 8.0 * (length[-1] ** 2 - 1.0) ** 2, rel=1e-8)
    assert found["energy.work"][-1] == pytest.approx(found["energy.internal"][-1], rel=0.02)


@pytest.mark.slow
def test_held_bar_pulls_on_two_processes(tmp_path):
    """With T on its support, which is also the traction there; to rounding on two processes."""
    one = bar(tmp_path / "one", held=True)
    assert one["held.x"] == pytest.approx(20.0 * one["time"], rel=1e-10)
    assert one["cut.x"] == pytest.approx(20.0 * one["time"], rel=1e-10)
    two = bar(tmp_path / "two", held=True, processes=2)
    assert two["held.x"] == pytest.approx(one["held.x"], rel=1e-10)


def test_small_displacements_and_stresses_that_relax(tmp_path):
    """u = -T L / E; with a part of the stress that relaxes the bar is stiffer for a while, and resumed bit for bit."""
    found = bar(tmp_path / "small", kinematics="kinematics: linear")
    assert found["right.x"] == pytest.approx(-2.0 * 20.0 * found["time"] / 100.0, rel=1e-10)
    viscous = ", viscous: [{share: 0.5, time: 0.5}]"
    slow = bar(tmp_path / "slow", viscous=viscous)
    assert slow["right.x"][-1] > 0.9 * bar(tmp_path / "fast")["right.x"][-1]
    bar(tmp_path / "half", "--set", "time.end=0.5", viscous=viscous)
    ended = fsci("resume", tmp_path / "half" / "out", "--set", "time.end=1")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert np.array_equal(read_history(tmp_path / "half" / "out" / "history.csv")["right.x"], slow["right.x"])


@pytest.mark.parametrize(("cell_type", "element"), [("quad", "displacement"), ("hexahedron", "mixed")])
def test_tangent_with_active_stress(cell_type, element):
    mesh = distort(block(cell_type, 2), 0.05)
    dim = mesh.points.shape[1]
    direction = [lambda x, t: 1.0 + x[1], constant(2.0), constant(-1.0)][:dim]
    active = [Active(direction, lambda x, t: 3.0 + x[0])]
    assert tangent_error(make_structure(mesh, NeoHooke(3.0, 5.0, 2.0), element=element, active=active)) < 1e-6


def test_stress_has_the_active_part():
    """Of small displacements, at rest: T a a."""
    body = make_structure(
        block("hexahedron", 1), LinearElastic(3.0, 5.0), active=[Active((3.0, 0.0, 4.0), constant(5.0))]
    ).bodies[0]
    body.external_force(0.0)
    assert body.stress()[0].reshape(3, 3) == pytest.approx(5.0 * np.outer([0.6, 0, 0.8], [0.6, 0, 0.8]), abs=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("direction: [1.0, 0.0], stress", "direction: [0, 0], stress"), "'direction' must not be zero"),
        (("direction: [1.0, 0.0], stress", "direction: [1, 0, 0], stress"), "must have 2 entries in 2D, not 3"),
    ],
)
def test_mistakes_in_active(tmp_path, change, message):
    text = BAR.format(angle=0, c=1.0, s=0.0, ms=0.0, held="", kinematics="", viscous="")
    assert change[0] in text
    (tmp_path / "case.yaml").write_text(text.replace(*change))
    with pytest.raises(CaseError) as error:
        load_case(tmp_path)
    assert message in str(error.value)
