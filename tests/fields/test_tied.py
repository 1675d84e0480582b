"""Tied surfaces in the structure: patch tests, rotation, dynamics, and through a case."""

import numpy as np
import pytest
from contact_setup import brick, displacement_error, make_body, make_contact, solve_step
from programs import fsci
from structure_setup import constant

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from solvers.contact import ties
from solvers.contact.law.tied import Tied
from solvers.structure.body import Support

ZERO = constant(0)
PAIRS = [
    ("quad", "triangle"),
    ("triangle6", "quad"),
    ("quad9", "triangle6"),
    ("hexahedron", "tetra"),
    ("tetra", "hexahedron27"),
    ("tetra10", "hexahedron"),
    ("hexahedron27", "tetra10"),
]


def affine(dim):
    """Displacement of a homogeneous deformation with shear: every component is held on the far sides."""
    H = np.array([[0.05, 0.1, 0.02], [0.03, -0.08, 0.04], [0.06, 0.02, -0.1]])[:dim, :dim]
    return tuple(lambda x, t, row=row: sum(row[i] * x[i] for i in range(dim)) * t for row in H)


@pytest.mark.parametrize(("slave", "master"), PAIRS)
def test_patch(slave, master):
    """Two irregular meshes under a homogeneous deformation with shear: exact, with a constant traction between them."""
    dim = 2 if slave[:4] in ("quad", "tria") else 3
    exact = affine(dim)
    sides = ["left", "right"] + ["front", "back"] * (dim == 3)
    bodies = []
    for name, cell_type, n, low, far in (("lower", slave, 3, 0.0, "bottom"), ("upper", master, 2, 0.5, "top")):
        mesh = brick(cell_type, n, [1.0] * (dim - 1) + [0.5], [0.0] * (dim - 1) + [low])
        bodies.append(make_body(name, mesh, supports=[Support(on, exact) for on in (far, *sides)]))
    structure, _ = make_contact(bodies, [(("lower", "top"), ("upper", "bottom"))], law=Tied())
    info = solve_step(structure)
    # integrands on irregular quadrilaterals are no polynomials: the rule for segments is exact to 3e-10
    assert displacement_error(structure, exact) < (1e-9 if slave == "hexahedron" else 1e-10)
    assert info.iterations <= 6


def test_integrals_of_a_tie_are_made_once(monkeypatch):
    """They change with the redistribution only: one product for all evaluations of all steps."""
    made, expand = [], ties.expand
    monkeypatch.setattr(ties, "expand", lambda matrix, dim: made.append(1) or expand(matrix, dim))
    exact = affine(2)
    bodies = [
        make_body(
            name, brick("quad", n, [1.0, 0.5], [0.0, low]), supports=[Support(far, exact), Support("left", exact)]
        )
        for name, n, low, far in (("lower", 3, 0.0, "bottom"), ("upper", 2, 0.5, "top"))
    ]
    structure, _ = make_contact(bodies, [(("lower", "top"), ("upper", "bottom"))], law=Tied())
    structure.initialise(0.0, 1.0)
    iterations = [solve_step(structure, float(step), first=False).iterations for step in range(2)]
    assert sum(iterations) >= 4
    assert len(made) == 1


#: Two rings, one around the other, in meshes that do not match, turn together.
RINGS = """\
title: tied rings
time: {step: 0.1, end: 1.0}
structure:
  dynamics: {rho_inf: 1.0}
  bodies:
    inner:
      mesh: {shape: ring, inner_radius: 1.0, outer_radius: 1.5, cells: [24, 2], order: 1}
      material: {law: st_venant_kirchhoff, E: 100, nu: 0.3, density: 1}
      initial_velocity: [-y, x]
    outer:
      mesh: {shape: ring, inner_radius: 1.5, outer_radius: 2.0, cells: [31, 2], order: 1}
      material: {law: st_venant_kirchhoff, E: 50, nu: 0.3, density: 1}
      initial_velocity: [-y, x]
contact:
  pairs:
    tie: {slave: {body: outer, on: inner}, master: {body: inner, on: outer}, tied: true}
probes:
  energy: {quantity: energy}
  momentum: {quantity: angular_momentum}
"""

#: Its ends turn by 90 degrees as one rigid body: nothing else happens.
TURNED = """\
title: two sectors of a ring, turned
time: {step: 1, end: 3}
structure:
  bodies:
    inner:
      mesh: {shape: ring, inner_radius: 1.0, outer_radius: 1.5, angle: 90, cells: [6, 2], order: ORDER}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports:
        - on: inner
          displacement: [x * (cos(0.5 * t) - 1) - y * sin(0.5 * t), x * sin(0.5 * t) + y * (cos(0.5 * t) - 1)]
    outer:
      mesh: {shape: ring, inner_radius: 1.5, outer_radius: 2.0, angle: 90, cells: [8, 2], order: ORDER}
      material: {law: neo_hooke, E: 500, nu: 0.3}
contact:
  pairs:
    tie: {slave: {body: outer, on: inner}, master: {body: inner, on: outer}, tied: true}
probes:
  energy: {quantity: energy}
  corner: {body: outer, quantity: displacement, at: [2, 0]}
"""


def run(text, folder):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


@pytest.mark.parametrize("order", [1, 2])
def test_a_bent_tie_turns_without_force(order, tmp_path):
    found = run(TURNED.replace("ORDER", str(order)), tmp_path)
    assert np.abs(found["energy.internal"]).max() < 1e-16 * 1000
    assert found["corner.x"][-1] == pytest.approx(2 * (np.cos(1.5) - 1), abs=1e-9)
    assert found["corner.y"][-1] == pytest.approx(2 * np.sin(1.5), abs=1e-9)


def test_tied_bodies_in_motion(tmp_path):
    """Mass stays where it is, and what ties does no work: the error of the energy is that of one ring, 0.102 J."""
    found = run(RINGS, tmp_path)
    assert found["momentum"] == pytest.approx(23.25, rel=5e-3)
    assert np.abs(found["structure.energy"]).max() < 0.11
    assert found["contact.active"].max() == 0


MISTAKES = {
    "friction": (("tied: true", "tied: true, friction: {coefficient: 0.1}"), "tied surfaces do not slide"),
    "apart": (
        ("inner_radius: 1.5", "inner_radius: 1.8"),
        "the surfaces do not touch at the start: there is nothing to tie",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_named(name, tmp_path):
    (old, new), message = MISTAKES[name]
    (tmp_path / "case.yaml").write_text(TURNED.replace("ORDER", "1").replace(old, new))
    with pytest.raises(CaseError) as caught:
        run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out")
    assert message in str(caught.value)
    checked = fsci("check", tmp_path / "case.yaml")
    assert checked.returncode == 2
    assert message in checked.stderr
