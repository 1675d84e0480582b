"""Ogden's law: stresses by hand at large stretches, its tangent, the laws that it contains, and case files."""

import numpy as np
import pytest
from programs import fsci
from structure_setup import block, distort, make_structure
from test_soft_tissue import BULK, CUBE, forces
from test_structure_tangent import deformed, tangent_error

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from solvers.structure.materials import MooneyRivlin, Ogden
from solvers.structure.materials.ogden import at_gradients, tangent
from solvers.structure.relaxation import Branch

#: Of Treloar's rubber at small and large stretches [Pa]: Ogden (1972), in units of 10^5 Pa.
TRELOAR = ((6.3, 1.3), (0.012, 5.0), (-0.1, -2.0))
LAW = Ogden(((2.0, 1.3), (0.4, 5.0), (-1.2, -2.0)), 7.0, 2.0)


def law_at(F, terms=TRELOAR):
    """Energy, P and dP/dF at one F."""
    at = [(np.array([modulus]), exponent) for modulus, exponent in terms]
    found = at_gradients(np.asarray(F, dtype=float)[None], at)
    return found.energy[0], found.stress[0], tangent(found, at)[0]


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


@pytest.mark.parametrize("stretches", [(7.0, 0.3, 0.9), (1.0, 1.0, 1.0), (2.0, 2.0, 0.25), (1.1, 1.1 + 1e-9, 0.7)])
def test_derivatives(stretches):
    """Of energy and stress, by complex steps that equal stretches do not hurt: central differences to 1e-8."""
    F = rotation(1) @ np.diag(stretches) @ rotation(2).T
    _, P, slope = law_at(F)
    step, scale = 1e-5, np.abs(slope).max()
    for k in range(9):
        change = np.zeros(9)
        change[k] = step
        (above, P_above, _), (below, P_below, _) = (law_at(F + s * change.reshape(3, 3)) for s in (1, -1))
        assert P.ravel()[k] == pytest.approx((above - below) / (2 * step), abs=1e-8 * scale)
        assert slope[:, k] == pytest.approx((P_above - P_below).ravel() / (2 * step), abs=2e-8 * scale)
    assert slope == pytest.approx(slope.T, abs=1e-12 * scale)


def test_turned_bodies_have_turned_stresses():
    """P(Q F R^T) = Q P(F) R^T: objective and isotropic."""
    F, Q, R = np.diag([1.7, 0.6, 1.2]) + 0.2, rotation(3), rotation(4)
    (energy, P, _), (turned, Q_P_R, _) = law_at(F), law_at(Q @ F @ R.T)
    assert turned == pytest.approx(energy, rel=1e-12)
    assert Q_P_R == pytest.approx(Q @ P @ R.T, abs=1e-12 * np.abs(P).max())


@pytest.mark.parametrize("stretch", [0.2, 0.7, 1.0, 3.0, 7.6])
def test_known_curves(stretch):
    """Nominal stresses of incompressible rubber under known stretches, Ogden (1984), section 7.2."""
    modes = {
        "uniaxial": (1.0, stretch**-0.5, stretch**-0.5),
        "equibiaxial": (1.0, stretch, stretch**-2.0),
        "pure shear": (1.0, 1.0, 1.0 / stretch),
    }
    for _, second, third in modes.values():
        _, P, _ = law_at(np.diag([stretch, second, third]))
        exact = sum(mu * (stretch ** (a - 1.0) - third**a / stretch) for mu, a in TRELOAR)
        assert P[0, 0] - P[2, 2] * third / stretch == pytest.approx(exact, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("shear", [1e-7, 0.3, 4.0])
def test_simple_shear(shear):
    """sigma_12 = sum mu (l^a - l^-a) / (l + 1/l) with l - 1/l = shear."""
    _, P, _ = law_at([[1.0, shear, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    stretch = np.exp(np.arcsinh(shear / 2.0))
    exact = sum(mu * 2.0 * np.sinh(a * np.log(stretch)) for mu, a in TRELOAR) / (stretch + 1.0 / stretch)
    assert P[0, 1] == pytest.approx(exact, rel=1e-8)


def test_no_stress_where_there_is_no_volume():
    assert not np.isfinite(law_at(np.diag([1.0, 1.0, -1.0]))[1]).any()
    assert not np.isfinite(law_at(np.full((3, 3), np.nan))[1]).any()


RELAXING = (Branch(0.4, 0.05),)


@pytest.mark.parametrize(
    ("cell_type", "element", "relaxing"),
    [
        ("quad", "mixed", RELAXING),
        pytest.param("quad9", "mixed", RELAXING, marks=pytest.mark.slow),
        pytest.param("hexahedron", "displacement", RELAXING, marks=pytest.mark.slow),
        pytest.param("quad9", "displacement", (), marks=pytest.mark.slow),
        pytest.param("quad9", "displacement", RELAXING, marks=pytest.mark.slow),
        pytest.param("quad9", "mixed", (), marks=pytest.mark.slow),
        pytest.param("hexahedron", "displacement", (), marks=pytest.mark.slow),
        pytest.param("hexahedron", "mixed", (), marks=pytest.mark.slow),
        pytest.param("hexahedron", "mixed", RELAXING, marks=pytest.mark.slow),
    ],
)
def test_it_contains_mooney_rivlin(element, cell_type, relaxing):
    """With exponents 2 and -2: mu_1 = 2 c10, mu_2 = -2 c01. Forces, tangent, energy and stress are the same."""
    mesh = distort(block(cell_type, 2), 0.05)
    pair = Ogden(((2.0, 2.0), (-1.0, -2.0)), 7.0, 2.0), MooneyRivlin(1.0, 0.5, 7.0, 2.0)
    structures = [make_structure(mesh, law, element=element, relaxing=relaxing) for law in pair]
    found = []
    for structure in structures:
        rng = deformed(structure)
        structure.residual()
        x, y = structure.layout.vector(), structure.layout.vector()
        x.array[:] = rng.uniform(-1.0, 1.0, len(x.array))
        structure.tangent().mult(x, y)
        body = structure.bodies[0]
        structure.end_step()
        found.append((structure.now.internal.copy(), y.array.copy(), body.internal_energy(), body.stress()))
    for ours, exact in zip(*found, strict=True):
        assert ours == pytest.approx(exact, abs=1e-10 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("cell_type", "element", "relaxing"),
    [
        ("quad", "displacement", RELAXING),
        ("quad", "mixed", RELAXING),
        ("hexahedron", "mixed", ()),
        pytest.param("hexahedron", "displacement", RELAXING, marks=pytest.mark.slow),
        pytest.param("hexahedron", "mixed", RELAXING, marks=pytest.mark.slow),
    ],
)
def test_tangent_of_a_body(element, cell_type, relaxing):
    """Also of moduli that vary over the body, with a stress that relaxes."""
    varying = Ogden(((lambda x, t: 2.0 + x[0], 1.3), (0.4, 5.0), (-1.2, -2.0)), 7.0, 2.0)
    structure = make_structure(distort(block(cell_type, 2), 0.05), varying, element=element, relaxing=relaxing)
    assert tangent_error(structure) < 1e-6


def test_rubber_in_two_directions(tmp_path):
    """A case file with Treloar's rubber: nominal stress sum mu (l^a - h^a) / l with the height h = 1/(l m)."""
    terms = ", ".join(f"{{mu: {mu}, alpha: {alpha}}}" for mu, alpha in TRELOAR)
    x, y, length, width = forces(tmp_path, f"{{law: ogden, terms: [{terms}], bulk: {BULK}}}", 5.0, 1.5)
    height = 1.0 / (length * width)
    for force, one in ((x, length), (y, width)):
        exact = sum(mu * (one**a - height**a) / one for mu, a in TRELOAR)
        assert force == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ("[{mu: 1, alpha: 0}]", "'alpha' must not be 0"),
        ("[{mu: 1, alpha: 2}, {mu: 1, alpha: -2}]", "'mu' must have the sign of alpha = -2, or the law is unstable"),
        ("[]", "must have 1 or more entries, not 0"),
    ],
)
def test_mistakes_in_terms(tmp_path, terms, message):
    material = f"{{law: ogden, terms: {terms}, bulk: 1e3}}"
    (tmp_path / "case.yaml").write_text(CUBE.format(material=material, step=1, across=0, along=0))
    with pytest.raises(CaseError) as error:
        load_case(tmp_path)
    assert message in str(error.value)


PRESSED = """
time: {{step: 0.1, end: 0.4}}
structure:
  dynamics: {{rho_inf: 0.8}}
  bodies:
    pad:
      mesh: {{shape: rectangle, size: [1.0, 0.5], cells: [6, 3], translate: [0.033, 0]}}
      element: mixed
      material: {{{law}, density: 0.01, viscous: [{{share: 0.3, time: 0.2}}]}}
      active: [{{direction: [1, 0.3], stress: 0.1*t}}]
      pre_stretch: [{{direction: [1, 0], stretch: 1.05}}]
      supports: [{{on: top, displacement: ["0.1*t", "-0.3*t"]}}]
contact:
  friction: {{coefficient: 0.3}}
  obstacles: {{floor: {{mesh: {{shape: rectangle, size: [4, 0.1], cells: [1, 1], origin: [-2, -0.11]}}, on: top}}}}
  pairs: {{floor: {{slave: {{body: pad, on: bottom}}, master: {{obstacle: floor}}}}}}
solver: {{newton: {{residual: 1e-11}}}}
probes:
  top: {{body: pad, quantity: reaction, on: top}}
  left: {{body: pad, quantity: traction, on: left}}
  energy: {{quantity: energy}}
"""


TERMS = "[{mu: 2, alpha: 2}, {mu: -1, alpha: -2}]"
OURS = f"law: ogden, terms: {TERMS}, bulk: 70"


def pressed(folder, law, *, processes=1, ends=(0.4,)):
    """History of a run in as many parts as it has ends."""
    folder.mkdir()
    (folder / "case.yaml").write_text(PRESSED.format(law=law))
    for number, end in enumerate(ends):
        words = ("run", folder, "-o", folder / "out") if number == 0 else ("resume", folder / "out")
        ended = fsci(*words, "--set", f"time.end={end}", processes=processes)
        assert ended.returncode == 0, ended.stdout + ended.stderr
    return read_history(folder / "out" / "history.csv")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return pressed(tmp_path_factory.mktemp("ogden") / "whole", OURS)


COLUMNS = ("top.x", "top.y", "left.x", "energy.internal", "contact.floor.x")


def test_pressed_and_dragged(tmp_path, whole):
    """In contact with friction, in motion: as the law that it contains; resumed bit for bit."""
    mooney = pressed(tmp_path / "mooney", "law: mooney_rivlin, c10: 1, c01: 0.5, bulk: 70")
    half = pressed(tmp_path / "half", OURS, ends=(0.2, 0.4))
    assert whole["top.y"][-1] < -0.1
    for column in COLUMNS:
        assert np.array_equal(half[column], whole[column])
        if column != "left.x":  # on a facet Ogden's stress is interpolated from nodes
            assert mooney[column] == pytest.approx(whole[column], abs=1e-8 * np.abs(whole[column]).max())


@pytest.mark.slow
def test_pressed_and_dragged_on_two_processes(tmp_path, whole):
    two = pressed(tmp_path / "two", OURS, processes=2)
    for column in COLUMNS:
        assert two[column] == pytest.approx(whole[column], abs=1e-8 * np.abs(whole[column]).max())
