"""Rubber and tissue under known stretches: stresses of incompressible bodies by hand, in a case file."""

import numpy as np
import pytest
from programs import fsci

from fsci.case import CaseError, load_case
from fsci.running.history import read_history

BULK = 1e7  #: 1e7 times the shear modulus: J differs from 1 by some 1e-6

CUBE = """
time: {{step: {step}, end: 1}}
structure:
  bodies:
    cube:
      mesh: {{shape: box, size: [1, 1, 1], cells: [1, 1, 1], cell: hex}}
      element: mixed
      material: {material}
      supports:
        - {{on: left, displacement: [0, null, null]}}
        - {{on: front, displacement: [null, 0, null]}}
        - {{on: bottom, displacement: [null, null, 0]}}
        - {{on: right, displacement: [{across}, null, null]}}
        - {{on: back, displacement: [null, {along}, null]}}
probes:
  right: {{body: cube, quantity: reaction, on: right}}
  back: {{body: cube, quantity: reaction, on: back}}
"""


def forces(folder, material, stretch_x, stretch_y):
    """On the faces of a cube of 1 m that is stretched to these lengths and free in z, and lengths, step by step."""
    text = CUBE.format(material=material, step=0.25, across=f"{stretch_x - 1}*t", along=f"{stretch_y - 1}*t")
    (folder / "case.yaml").write_text(text)
    ended = fsci("run", folder, "-o", folder / "out")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    found = read_history(folder / "out" / "history.csv")
    lengths = [1.0 + (stretch - 1.0) * found["time"] for stretch in (stretch_x, stretch_y)]
    return found["right.x"], found["back.y"], *lengths


def test_yeoh_in_two_directions(tmp_path):
    """Nominal stress 2 (l - 1/(l^3 m^2)) W'(I) in x; softening, then stiffening, as rubber does."""
    c10, c20, c30 = 0.5, -0.02, 0.003
    material = f"{{law: yeoh, c10: {c10}, c20: {c20}, c30: {c30}, bulk: {BULK}}}"
    x, y, length, width = forces(tmp_path, material, 3.0, 1.5)
    excess = length**2 + width**2 + 1.0 / (length * width) ** 2 - 3.0
    slope = c10 + 2 * c20 * excess + 3 * c30 * excess**2
    assert x == pytest.approx(2.0 * slope * (length - 1.0 / (length**3 * width**2)), rel=1e-5)
    assert y == pytest.approx(2.0 * slope * (width - 1.0 / (width**3 * length**2)), rel=1e-5)
    assert slope.min() < 0.47
    assert slope[-1] > 0.6


@pytest.mark.parametrize("dispersion", [0.0, 0.226, 1 / 3])
def test_two_families_of_fibres(tmp_path, dispersion):
    """At 40 degrees to x on both sides, stretched by 1.2 and 1.05: E = kappa (I - 3) + (1 - 3 kappa) (l_f^2 - 1)."""
    mu, k1, k2, angle = 1.0, 3.0, 2.0, np.radians(40.0)
    c, s = np.cos(angle), np.sin(angle)
    material = (
        f"{{law: holzapfel_gasser_ogden, mu: {mu}, k1: {k1}, k2: {k2}, dispersion: {dispersion}, "
        f"fibres: [[{3 * c}, {3 * s}, 0], [{c}, {-s}, 0]], bulk: {BULK}}}"
    )
    x, y, length, width = forces(tmp_path, material, 1.2, 1.05)
    height = 1.0 / (length * width)
    strain = dispersion * (length**2 + width**2 + height**2 - 3.0)
    strain += (1.0 - 3.0 * dispersion) * ((length * c) ** 2 + (width * s) ** 2 - 1.0)
    tension = 2.0 * k1 * strain * np.exp(k2 * strain**2)  # of two families, by E
    for force, one, other, share in ((x, length, width, c**2), (y, width, length, s**2)):
        thinner = one - 1.0 / (one**3 * other**2)  # half of dI/d one
        fibres = tension * 2.0 * (dispersion * thinner + (1.0 - 3.0 * dispersion) * one * share)
        assert force == pytest.approx(mu * thinner + fibres, rel=1e-5)


def test_one_family_and_none_that_is_pressed(tmp_path):
    """Fibres along y only: pressed in y they carry nothing, stretched they do."""
    material = f"{{law: holzapfel_gasser_ogden, mu: 1, k1: 3, k2: 2, fibres: [[0, 0.1, 0]], bulk: {BULK}}}"
    pressed, *_ = _, side, length, width = forces(tmp_path, material, 1.2, 0.95)
    assert pressed == pytest.approx(length - 1.0 / (length**3 * width**2), rel=1e-5)
    assert side == pytest.approx(width - 1.0 / (width**3 * length**2), rel=1e-5)
    _, side, length, width = forces(tmp_path, material, 1.05, 1.1)
    strain = width**2 - 1.0
    fibres = 3.0 * strain * np.exp(2.0 * strain**2) * 2.0 * width
    assert side == pytest.approx(width - 1.0 / (width**3 * length**2) + fibres, rel=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("fibres: [[0, 0, 0]]", "a direction in 'fibres' must not be zero"),
        ("fibres: [[1, 0]]", "must have 3 entries in 3D, not 2"),
        ("fibres: []", "must have 1 or 2 entries, not 0"),
        ("fibres: [[1, 0, 0]], dispersion: 0.34", "'dispersion' must be from 0 to 1/3, not 0.34"),
    ],
)
def test_mistakes(tmp_path, change, message):
    material = f"{{law: holzapfel_gasser_ogden, mu: 1, k1: 3, k2: 2, {change}, bulk: 1e3}}"
    (tmp_path / "case.yaml").write_text(CUBE.format(material=material, step=1, across=0, along=0))
    with pytest.raises(CaseError) as error:
        load_case(tmp_path)
    assert message in str(error.value)


def test_fibres_are_not_linear(tmp_path):
    material = "{law: holzapfel_gasser_ogden, mu: 1, k1: 3, k2: 2, fibres: [[1, 0, 0]], bulk: 1e3}"
    text = CUBE.format(material=material, step=1, across=0, along=0).replace("element: mixed", "kinematics: linear")
    (tmp_path / "case.yaml").write_text(text)
    with pytest.raises(CaseError, match="'kinematics: linear' needs an isotropic law"):
        load_case(tmp_path)
