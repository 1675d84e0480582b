"""Bodies that just touch, at rest and without force: nothing happens, with and without friction, tied or not."""

import numpy as np
import pytest
from contact_cases import run
from contact_setup import brick, make_body, make_contact, solve_step
from structure_setup import constant

from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.law.tied import Tied
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.body import Support
from solvers.structure.dynamics import Dynamics
from solvers.structure.time_scheme import Statics

ZERO = constant(0)
LAWS = {"frictionless": Frictionless(), "coulomb": Coulomb(0.3), "tied": Tied()}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("moves", [False, True], ids=["static", "dynamic"])
@pytest.mark.parametrize(("lower", "upper"), [("quad", "triangle6"), ("hexahedron", "tetra")])
def test_nothing_happens(lower, upper, moves, law):
    """Heights that have no exact sum: the gap is rounding. Three steps at rest, no force; then it bears a load."""
    dim = 2 if lower == "quad" else 3
    none = (ZERO,) * dim

    def pushed(x, t):
        return -1e-3 * max(t - 3.0, 0.0) + ZERO(x, t)

    sizes = [1.0] * (dim - 1)
    bodies = [
        make_body("lower", brick(lower, 3, [*sizes, 0.1], [0.0] * dim), supports=[Support("bottom", none)]),
        make_body(
            "upper",
            brick(upper, 2, [*sizes, 0.2], [0.0] * (dim - 1) + [0.30000000000000004 - 0.2]),
            supports=[Support("top", (*none[:-1], pushed))],
        ),
    ]
    time = Dynamics(GeneralisedAlpha.from_rho_inf(1.0)) if moves else Statics()
    structure, contact = make_contact(bodies, [(("lower", "top"), ("upper", "bottom"))], law=LAWS[law], time=time)
    for step in range(3):
        info = solve_step(structure, float(step), first=step == 0)
        assert info.iterations <= 2
        assert np.abs(structure.now.u).max() < 1e-15
        assert np.abs(contact.z).max() < 1e-10
        assert np.abs(contact.force()).max() < 1e-12
    solve_step(structure, 3.0, first=False)
    pressed = contact.resultant(0)[-1]
    assert pressed < -1e-1
    assert np.nanmax(np.abs(contact.mean_gap())) < 1e-12


LAID = """\
time: {{step: 0.5, end: 1}}
units: {{length: m, mass: kg, time: s}}
structure:
  bodies:
    a:
      mesh: {{shape: rectangle, size: [{one}, {one}], order: 1, cells: [2, 2], origin: [{far}, 0]}}
      material: {{law: st_venant_kirchhoff, E: 1e6, nu: 0}}
      supports: [{{on: bottom, displacement: [0, 0]}}]
    b:
      mesh: {{shape: rectangle, size: [{wide}, {half}], order: 1, cells: [3, 2], origin: [{far}, {height!r}]}}
      material: {{law: st_venant_kirchhoff, E: 1e6, nu: 0}}
      supports: [{{on: left, symmetry: true}}]
      tractions: [{{on: top, value: [0, "-1e3*t"]}}]
contact:
  pairs:
    p: {{slave: {{body: {slave}}}, master: {{body: {master}}}{friction}}}
"""

SIDES = {"upper": ("b, on: bottom", "a, on: top"), "lower": ("a, on: top", "b, on: bottom")}


@pytest.mark.parametrize("gap", [1e-14, 1e-12, 1e-11, 7e-11])
@pytest.mark.parametrize(
    ("one", "far", "slave", "friction"),
    [
        (1.0, 0.0, "upper", ""),
        (1.0, 0.0, "lower", ""),
        (1e-3, 0.0, "upper", ""),
        (1.0, 1e3, "upper", ""),
        (1.0, 0.0, "upper", ", friction: {coefficient: 0.3}"),
    ],
)
def test_gap_of_rounding_is_none(gap, one, far, slave, friction, tmp_path):
    """A block that only contact supports lies on another one but for the rounding of its mesh: it bears its load."""
    found = []
    for height in (one, one * (1.0 + gap)):
        sizes = {"one": one, "wide": 0.8 * one, "half": 0.5 * one, "far": far, "height": height}
        text = LAID.format(**sizes, slave=SIDES[slave][0], master=SIDES[slave][1], friction=friction)
        found.append(run(text, tmp_path / str(len(found))))
    flat, close = found
    force = abs(close["contact.p.y"])
    np.testing.assert_allclose(force, [400 * one, 800 * one], rtol=1e-9)
    np.testing.assert_allclose(close["contact.p.y"], flat["contact.p.y"], rtol=1e-9)
    assert close["iterations"].sum() <= flat["iterations"].sum() + 2


def test_what_nearly_touches_does_not_pull(tmp_path):
    """Blocks at a gap of rounding that are drawn apart part at once, and it is no contact."""
    text = LAID.format(
        one=1.0, wide=0.8, half=0.5, far=0.0, height=1.0 + 5e-11, slave=SIDES["upper"][0], master=SIDES["upper"][1],
        friction="",
    ).replace('tractions: [{on: top, value: [0, "-1e3*t"]}]', "").replace(
        "{on: left, symmetry: true}", '{on: left, symmetry: true}, {on: top, displacement: [null, "1e-12*t"]}'
    )  # fmt: skip
    history = run(text, tmp_path)
    assert not history["contact.p.y"].any()
    assert not history["contact.active"].any()
