"""Elastic walls full of fluid between a floor and a lid, with contact: they keep their volume."""

import numpy as np
import pytest

from fsci.case import load_case
from fsci.meshes.of_case import degree_of_cells, read_body
from fsci.running.history import read_history
from fsci.running.run import run_case
from solvers.mesh.tessellation import tessellate

CASE = """\
time: {{step: 0.02, end: {end}}}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  scheme: backward_euler
  grid: {{from: [-1, 0], to: [1, 1], cells: [36, 18]}}
  patches:
    sides: {{on: [x-, x+], outflow: true}}
    walls: {{on: [y-, y+], no_slip: true}}
  bodies:
    lid:
      mesh: {{shape: rectangle, size: [1.2, 0.25], cells: [1, 1], origin: [-0.6, 0.7]}}
      motion: {{displacement: ["0", "-0.6*t"]}}
structure:
  dynamics: {{rho_inf: 0.5, damping: {{stiffness: 0.002}}}}
  bodies:
    ring:
      mesh: {{shape: ring, inner_radius: {inner}, outer_radius: 0.32, cells: [32, 2], translate: [{x}, 0.35]}}
      material: {{law: neo_hooke, E: 2000, nu: 0.3, density: 2}}
contact:
  obstacles:
    floor: {{mesh: {{shape: rectangle, size: [4, 0.1], cells: [1, 1], origin: [-2, -0.1]}}, on: top}}
  pairs:
    floor: {{slave: {{body: ring, on: outer}}, master: {{obstacle: floor}}}}
    lid: {{slave: {{body: ring, on: outer}}, master: {{obstacle: lid}}}}
    self: {{self: {{body: ring, on: inner}}}}
coupling: {{scheme: monolithic}}
"""


def squeezed(folder, inner, end, x=0.0):
    """(history, volume of the fluid in the ring over that of its polygon of 32 sides, of second order 64)."""
    (folder / "case.yaml").write_text(CASE.format(inner=inner, end=end, x=x))
    assert run_case(load_case(folder), folder / "out") == 0
    history = read_history(folder / "out" / "history.csv")
    half = 16 * degree_of_cells(load_case(folder), "ring")
    return history, history["fluid.pocket_1"] / (half * inner**2 * np.sin(np.pi / half))


@pytest.mark.parametrize(
    ("inner", "x"),
    [
        pytest.param(0.045, 0.0, marks=pytest.mark.slow),
        (0.045, 0.0185),
        (0.12, 0.0),
        pytest.param(0.24, 0.0, marks=pytest.mark.slow),
    ],
)
def test_walls_of_any_thickness_are_tight(tmp_path, inner, x):
    """5, 3.6 and 1.4 cells; before contact. With shared unknowns the middle one loses 0.3 %.

    No cell is full in the first ring, also moved by a third of a cell: it lost 8 % by 0.24 s, and nothing was said.
    """
    _, volume = squeezed(tmp_path, inner, 0.1, x)
    np.testing.assert_allclose(volume, 1.0, rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("x", "end"), [(0.0, 0.3), (0.0185, 0.24)])
def test_closed_contact_squeezes_nothing_out(tmp_path, x, end):
    """A wall of 3.6 cells, onto floor and lid, also moved by a third of a cell. Shared unknowns lose 16 %."""
    history, volume = squeezed(tmp_path, 0.12, end, x)
    assert history["contact.active"].max() > 3
    np.testing.assert_allclose(volume, 1.0, rtol=1e-9)


BALL = """\
time: {step: 0.02, end: 0.3}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  scheme: backward_euler
  grid: {from: [-0.5, -0.5, 0], to: [0.5, 0.5, 0.8], cells: [10, 10, 8]}
  patches:
    sides: {on: [x-, x+], outflow: true}
    walls: {on: [y-, y+, z-, z+], no_slip: true}
  bodies:
    lid:
      mesh: {shape: box, size: [0.7, 0.7, 0.2], cells: [1, 1, 1], origin: [-0.35, -0.35, 0.62]}
      motion: {displacement: ["0", "0", "-0.6*t"]}
structure:
  dynamics: {rho_inf: 0.5, damping: {stiffness: 0.002}}
  bodies:
    ball:
      mesh: {shape: hollow_sphere, inner_radius: 0.17, outer_radius: 0.27, cells: [3, 1], translate: [0.011, 0.02, 0.3]}
      material: {law: neo_hooke, E: 2000, nu: 0.3, density: 2}
contact:
  pairs:
    lid: {slave: {body: ball, on: outer}, master: {obstacle: lid}}
coupling: {scheme: monolithic}
"""


@pytest.mark.slow
def test_a_hollow_ball_in_contact_is_tight(tmp_path):
    """Its wall is a cell thick; the mesh of its inner surface has the volume."""
    (tmp_path / "case.yaml").write_text(BALL)
    assert run_case(load_case(tmp_path), tmp_path / "out") == 0
    history = read_history(tmp_path / "out" / "history.csv")
    mesh = read_body(load_case(tmp_path), "ball")
    facets, nodes = tessellate(mesh, ["inner"])
    exact = -np.linalg.det(mesh.points[nodes][facets]).sum() / 6.0
    assert history["contact.active"].max() > 0
    np.testing.assert_allclose(history["fluid.pocket_1"], exact, rtol=1e-9)
