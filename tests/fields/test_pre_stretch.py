"""Pre-stretch: free bodies shrink to their free length, held ones have the stress of their stretch."""

import numpy as np
import pytest
from programs import fsci
from structure_setup import block, constant, distort, make_structure
from test_structure_tangent import tangent_error

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from solvers.structure.active import Active
from solvers.structure.materials import LinearElastic, NeoHooke, Ogden, PlaneStressStVenantKirchhoff
from solvers.structure.pre_stretch import PreStretch
from solvers.structure.relaxation import Branch

MU, LAMBDA = 3.0, 5.0
LAWS = {
    "neo_hooke": NeoHooke(MU, LAMBDA, 2.0),
    "ogden": Ogden(((2.0, 1.3), (0.4, 5.0), (-1.2, -2.0)), 7.0, 2.0),
}

BAR = """
time: {{step: 0.5, end: 1}}
solver: {{newton: {{residual: 1e-12}}}}
structure:
  bodies:
    bar:
      mesh: {{shape: rectangle, size: [2, 1], cells: [3, 2], rotate: [{{angle: {angle}}}]}}
      material: {material}
      {more}
      pre_stretch: [{{direction: [{c}, {s}], stretch: {stretch}}}]
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

NEO_HOOKE = "{law: neo_hooke, mu: 3, lambda: 5}"
OGDEN = "{law: ogden, terms: [{mu: 2, alpha: 1.3}, {mu: 0.4, alpha: 5}, {mu: -1.2, alpha: -2}], bulk: 7}"


def stretched_bar(
    folder, *words, material=NEO_HOOKE, stretch=1.2, angle=0.0, held=False, supports="", more="", processes=1
):
    """A bar of 2 m by 1 m in its mesh."""
    folder.mkdir(exist_ok=True)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    support = f"- {{on: right, direction: [{c}, {s}]}}" if held else ""
    text = BAR.format(
        material=material, stretch=stretch, angle=angle, c=c, s=s, ms=-s, held=support + supports, more=more
    )
    (folder / "case.yaml").write_text(text)
    ended = fsci("run", folder, "-o", folder / "out", *words, processes=processes)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return read_history(folder / "out" / "history.csv")


@pytest.mark.parametrize("material", [NEO_HOOKE, OGDEN])
@pytest.mark.parametrize(
    ("element", "angle"), [("displacement", 0.0), pytest.param("mixed", 33.0, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("stretch", [1.2, 0.8])
def test_free_bar_returns_to_its_free_length(tmp_path, material, element, angle, stretch):
    found = stretched_bar(tmp_path, material=material, stretch=stretch, angle=angle, more=f"element: {element}")
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    along = c * found["right.x"] + s * found["right.y"]
    assert along[1:] == pytest.approx(2.0 / stretch - 2.0, rel=1e-8)
    assert -s * found["right.x"] + c * found["right.y"] == pytest.approx(0.0, abs=1e-8)
    assert found["energy.internal"][-1] == pytest.approx(0.0, abs=1e-12)
    assert found["cut.x"][-1] == pytest.approx(0.0, abs=1e-8)


def held_stress(stretch, lmbda):
    """Force per mesh area of a neo-Hookean bar in plane strain whose width is free.

    Cauchy stresses by the stretches s and w, J = s w: along (mu (s^2 - 1) + lambda ln J) / J, across
    mu (w^2 - 1) + lambda ln J = 0.
    """
    low, high = 0.3, 3.0
    for _ in range(200):
        width = 0.5 * (low + high)
        low, high = (low, width) if MU * (width**2 - 1.0) + lmbda * np.log(stretch * width) > 0.0 else (width, high)
    return (MU * (stretch**2 - 1.0) + lmbda * np.log(stretch * width)) / stretch


@pytest.mark.parametrize(
    ("element", "lmbda", "angle"), [("displacement", 5.0, 0.0), ("mixed", 5.0, 33.0), ("mixed", 5e4, 0.0)]
)
def test_held_bar_pulls(tmp_path, element, lmbda, angle):
    """With the stress of a bar that is drawn to the length of the mesh, on the mesh's area; on two processes, too."""
    material = NEO_HOOKE.replace("5", str(lmbda))
    more = f"element: {element}"
    found = stretched_bar(tmp_path, material=material, angle=angle, held=True, more=more, processes=2)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    for column in ("held", "cut"):
        pulled = c * found[f"{column}.x"] + s * found[f"{column}.y"]
        assert pulled == pytest.approx(held_stress(1.2, lmbda), rel=1e-8)


def test_with_active_and_relaxing_stress(tmp_path):
    """A bar that is held all around: what relaxes is at rest at the start, and active stress adds. Then it is drawn.

    Along it (mu (s^2 - 1) + lambda ln s)/s + T. Resumed bit for bit.
    """
    slow = NEO_HOOKE.replace("}", ", viscous: [{share: 0.5, time: 0.5}]}")
    more = 'active: [{direction: [1, 0], stress: "0.3*t"}]'
    top = '\n        - {on: top, displacement: [null, "0.1*max(t - 0.5, 0)"]}'
    words = {"material": slow, "held": True, "supports": top, "more": more}
    found = stretched_bar(tmp_path / "whole", **words)
    exact = (MU * (1.2**2 - 1.0) + LAMBDA * np.log(1.2)) / 1.2 + 0.3 * 0.5
    assert found["held.x"][0] == pytest.approx(exact, rel=1e-10)
    stretched_bar(tmp_path / "half", "--set", "time.end=0.5", **words)
    ended = fsci("resume", tmp_path / "half" / "out", "--set", "time.end=1")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert np.array_equal(read_history(tmp_path / "half" / "out" / "history.csv")["held.x"], found["held.x"])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(
    ("cell_type", "element"),
    [("quad", "displacement"), ("quad", "mixed"), pytest.param("hexahedron", "mixed", marks=pytest.mark.slow)],
)
def test_tangent_with_pre_stretch(law, cell_type, element):
    """That varies from cell to cell, in an oblique direction and all, with active and relaxing stress."""
    mesh = distort(block(cell_type, 2), 0.05)
    dim = mesh.points.shape[1]
    direction = [lambda x, t: 1.0 + x[1], constant(2.0), constant(-1.0)][:dim]
    pre_stretch = [PreStretch(lambda x, t: 1.1 + 0.2 * x[0], direction), PreStretch(0.9)]
    active = [Active(direction, constant(2.0))]
    more = {"relaxing": [Branch(0.3, 0.1)], "active": active, "pre_stretch": pre_stretch}
    assert tangent_error(make_structure(mesh, LAWS[law], element=element, **more)) < 1e-6


def test_stress_of_small_displacements():
    """2 mu (s - 1) a a + lambda (s - 1) I at rest."""
    body = make_structure(
        block("hexahedron", 1), LinearElastic(MU, LAMBDA), pre_stretch=[PreStretch(1.01, (3.0, 0.0, 4.0))]
    ).bodies[0]
    exact = 0.01 * (2.0 * MU * np.outer([0.6, 0, 0.8], [0.6, 0, 0.8]) + LAMBDA * np.eye(3))
    assert body.stress()[0].reshape(3, 3) == pytest.approx(exact, abs=1e-12)


def test_plane_stress():
    """Held at rest: S = (lambda' + 2 mu) (s^2 - 1)/2, sigma = s S."""
    law = PlaneStressStVenantKirchhoff(MU, LAMBDA)
    body = make_structure(block("quad", 1), law, pre_stretch=[PreStretch(1.2, (1.0, 0.0))]).bodies[0]
    exact = (LAMBDA + 2.0 * MU) * (1.2**2 - 1.0) / 2.0 * 1.2
    assert body.stress()[0][0] == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("direction: [1.0, 0.0]", "direction: [0, 0]"), "'direction' must not be zero"),
        (("direction: [1.0, 0.0], stretch", "direction: [1, 0, 0], stretch"), "must have 2 entries in 2D, not 3"),
        (("stretch: 1.2", "stretch: 0"), "'stretch' must be greater than 0, not 0"),
    ],
)
def test_mistakes_in_pre_stretch(tmp_path, change, message):
    text = BAR.format(material=NEO_HOOKE, stretch=1.2, angle=0, c=1.0, s=0.0, ms=0.0, held="", more="")
    head, section, rest = text.partition("pre_stretch")
    assert change[0] in section + rest
    (tmp_path / "case.yaml").write_text(head + section + rest.replace(*change, 1))
    with pytest.raises(CaseError) as error:
        load_case(tmp_path)
    assert message in str(error.value)
