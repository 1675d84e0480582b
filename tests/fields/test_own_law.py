"""Laws of materials in Python files of the user."""

import json
import time

import numpy as np
import pytest
import ufl
from programs import fsci

import fsci as program
from fsci.builder.own_law import own_law_at_rest
from fsci.case import CaseError, load_case
from fsci.check.meshes import check_meshes
from fsci.running.history import read_history
from fsci.twin.changes import twins
from solvers.structure.materials.own_energy import at_small_strains

CODE = """
import ufl

def Gent(F, mu, limit, bulk=1e7):
    J = ufl.det(F)
    I = ufl.exp(-2 / 3 * ufl.ln(J)) * ufl.tr(F.T * F)
    return -mu / 2 * limit * ufl.ln(1 - (I - 3) / limit) + bulk / 2 * (J - 1) ** 2

def Yeoh(F, c10, c20, bulk):
    J = ufl.det(F)
    x = J ** (-2 / 3) * ufl.tr(F.T * F) - 3
    return c10 * x + c20 * x**2 + bulk / 2 * (J - 1) ** 2

def Soft(F, mu):
    return -mu * ufl.tr(F.T * F - ufl.Identity(3))

def Tensor(F):
    return F.T * F

def Divided(F):
    return ufl.det(F) / 0

def Shear(F, mu):
    return mu / 2 * (ufl.tr(F.T * F) - 3) - mu * ufl.ln(ufl.det(F)) - mu * (ufl.det(F) - 1) ** 2

def Pressed(F, mu):
    return mu / 2 * ufl.tr(F.T * F)

"""

CUBE = """
time: {{step: 0.25, end: {end}}}
structure:
  bodies:
    cube:
      mesh: {{shape: box, size: [1, 1, 1], cells: [2, 1, 1]}}
      element: {element}
      material: {material}
      supports:
        - {{on: left, displacement: [0, null, null]}}
        - {{on: front, displacement: [null, 0, null]}}
        - {{on: bottom, displacement: [null, null, 0]}}
        - {{on: right, displacement: [2*t, null, null]}}
probes:
  right: {{body: cube, quantity: reaction, on: right}}
"""

#: in plane strain
SQUARE = """
time: {{step: 0.25, end: {end}}}
structure:
  bodies:
    square:
      mesh: {{shape: rectangle, size: [1, 1], cells: [2, 1]}}
      element: {element}
      material: {material}
      supports:
        - {{on: left, displacement: [0, null]}}
        - {{on: bottom, displacement: [null, 0]}}
        - {{on: right, displacement: [2*t, null]}}
probes:
  right: {{body: square, quantity: reaction, on: right}}
"""


def folder_of(path, material, element="displacement", code=CODE, end=0.5, text=CUBE):
    path.mkdir(exist_ok=True)
    (path / "laws.py").write_text(code)
    (path / "case.yaml").write_text(text.format(material=material, element=element, end=end))
    return path


def run(folder, *words, processes=1):
    out = folder / "out"
    ended = fsci("run", folder, "--trust", "-o", out, *words, processes=processes)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return read_history(out / "history.csv")


def test_gent_reaches_its_limit(tmp_path):
    """Nominal stress of an incompressible bar, mu limit / (limit - (I - 3)) (s - 1/s^2); J - 1 is some 1e-6."""
    material = "{law: 'laws.py:Gent', parameters: {mu: 1, limit: 9}}"
    found = run(folder_of(tmp_path, material, "mixed", end=1))
    s = 1 + 2 * found["time"]
    excess = s**2 + 2 / s - 3
    np.testing.assert_allclose(found["right.x"], 9 / (9 - excess) * (s - 1 / s**2), rtol=1e-5)


@pytest.mark.parametrize(
    ("element", "text"),
    [
        ("displacement", CUBE),
        ("mixed", SQUARE),
        pytest.param("displacement", SQUARE, marks=pytest.mark.slow),
        pytest.param("mixed", CUBE, marks=pytest.mark.slow),
    ],
    ids=["displacement-space", "mixed-plane", "displacement-plane", "mixed-space"],
)
def test_own_law_equals_that_of_the_program(tmp_path, element, text):
    """With a parameter that varies in space; the mixed element splits the energy by itself."""
    values = "c10: 2 + x, c20: 0.1, bulk: 50"
    own = run(folder_of(tmp_path / "own", f"{{law: 'laws.py:Yeoh', parameters: {{{values}}}}}", element, text=text))
    known = run(folder_of(tmp_path / "known", f"{{law: yeoh, {values}}}", element, text=text))
    np.testing.assert_allclose(own["right.x"], known["right.x"], rtol=1e-10)


@pytest.mark.slow
def test_two_processes_and_a_resumed_run(tmp_path):
    material = "{law: 'laws.py:Yeoh', parameters: {c10: 2, c20: 0.1, bulk: 50}}"
    one = run(folder_of(tmp_path / "one", material, end=1))
    two = run(folder_of(tmp_path / "two", material), processes=2)
    np.testing.assert_allclose(two["right.x"], one["right.x"][:2], rtol=1e-10)
    half = folder_of(tmp_path / "half", material)
    run(half)
    (half / "laws.py").unlink()  # the results have their copy
    assert fsci("resume", half / "out", "--set", "time.end=1").returncode == 2
    ended = fsci("resume", half / "out", "--trust", "--set", "time.end=1")
    assert ended.returncode == 0, ended.stderr
    assert read_history(half / "out" / "history.csv")["right.x"].tolist() == one["right.x"].tolist()


def test_law_from_another_folder_is_kept_with_the_results(tmp_path):
    folder = folder_of(tmp_path / "case", "{law: '../laws.py:Yeoh', parameters: {c10: 2, c20: 0.1, bulk: 50}}")
    (folder / "laws.py").rename(tmp_path / "laws.py")
    run(folder)
    assert load_case(folder / "out").elastic_bodies["cube"].material.law == "laws/cube/laws.py:Yeoh"
    assert (folder / "out" / "laws" / "cube" / "laws.py").read_text() == CODE


def test_twins_trust_what_their_case_trusts(tmp_path):
    folder = folder_of(tmp_path, "{law: 'laws.py:Yeoh', parameters: {c10: 2, c20: 0.1, bulk: 50}}")
    ended = fsci("twin", folder, "--trust", "--only", "step", "-o", tmp_path / "twins")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "trust" not in (tmp_path / "twins" / "twin.json").read_text()
    assert json.loads((tmp_path / "twins" / "step" / "summary.json").read_text())["status"] == "finished"


def test_twins_leave_the_axes_of_a_law_alone(tmp_path):
    """Its code cannot be turned with the rest of the case."""
    folder = folder_of(tmp_path, "{law: 'laws.py:Yeoh', parameters: {c10: 2, c20: 0.1, bulk: 50}}")
    names = [one.name for one in twins(load_case(folder / "case.yaml", trust=True))]
    assert "step" in names
    assert not {"mirrored", "turned"} & set(names)


def test_python_runs_trusted_code(tmp_path):
    folder = folder_of(tmp_path, "{law: 'laws.py:Yeoh', parameters: {c10: 2, c20: 0.1, bulk: 50}}")
    with pytest.raises(CaseError, match="--trust"):
        program.build(program.load(folder))
    steps = program.build(program.load(folder, trust=True))
    steps.take()
    assert steps.probes()["right.x"] > 1.0


#: (law, parameters, message)
MISTAKES = {
    "unknown": ("laws.py:gent", "", "8:23: 'laws.py' has no function 'gent'; did you mean 'Gent'?"),
    "parameter": (
        "laws.py:Gent", "mu: 1, limits: 3", "8:67: 'Gent' has no parameter 'limits'; did you mean 'limit'?",
    ),
    "missing": ("laws.py:Gent", "mu: 1", "8:23: 'Gent' needs the parameter 'limit' in 'parameters'"),
    "no file": ("law.py:Gent", "", "8:23: the file 'law.py' cannot be read: No such file or directory"),
    "negative": (
        "laws.py:Soft", "mu: 1", "8:23: the shear modulus of 'Soft' at small strains must be greater than 0, not -2",
    ),
    "bulk": (
        "laws.py:Shear", "mu: 3", "8:23: the bulk modulus of 'Shear' at small strains must be greater than 0, not -4",
    ),
    "shape": (
        "laws.py:Tensor", "",
        "8:23: the energy of 'Tensor' fails: TypeError: has the shape (3, 3), not that of a number",
    ),
    "exception": (
        "laws.py:Divided", "", "8:23: the energy of 'Divided' fails in line 21: UFLException: Division by zero!",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_have_messages(tmp_path, name):
    law, values, message = MISTAKES[name]
    folder = folder_of(tmp_path, f"{{law: '{law}', parameters: {{{values}}}}}")
    [problem] = check_meshes(load_case(folder, trust=True)).problems
    assert str(problem).startswith(f"{folder}/case.yaml:{message}\n")


def test_a_run_refuses_what_is_no_energy(tmp_path):
    ended = fsci("run", folder_of(tmp_path, "{law: 'laws.py:Tensor'}"), "--trust", "-o", tmp_path / "out")
    assert ended.returncode == 2
    assert "8:23: the energy of 'Tensor' fails: TypeError: has the shape (3, 3), not that of a number" in ended.stderr


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("def Gent(F)\n", "the code of 'laws.py' fails in line 1: SyntaxError: expected ':'"),
        ("import ufl\nimport no_such_module\n", "fails in line 2: ModuleNotFoundError: No module named"),
    ],
)
def test_mistakes_in_the_code(tmp_path, code, message):
    folder = folder_of(tmp_path, "{law: 'laws.py:Gent'}", code=code)
    [problem] = check_meshes(load_case(folder, trust=True)).problems
    assert message in problem.message


@pytest.mark.parametrize(
    ("material", "message"),
    [
        ("{law: 'laws.py'}", "8:23: 'law' must be FILE.py:NAME, not 'laws.py'"),
        ("{law: blatz}", "8:23: unknown law 'blatz' (available: st_venant_kirchhoff, neo_hooke, coup_neo_hooke, "),
        ("{law: 'laws.py:Gent', mu: 1}", "8:39: unknown setting 'mu' (available: law, parameters, density, viscous)"),
    ],
)
def test_mistakes_in_the_setting(tmp_path, material, message):
    with pytest.raises(CaseError) as raised:
        load_case(folder_of(tmp_path, material))
    assert f"case.yaml:{message}" in str(raised.value)


def test_check_warns_of_a_stress_without_strain(tmp_path):
    folder = folder_of(tmp_path, "{law: 'laws.py:Pressed', parameters: {mu: 3}}")
    found = check_meshes(load_case(folder, trust=True))
    [warning] = found.warnings
    assert warning.endswith("'Pressed' gives a stress of 3 Pa in the undeformed body 'cube'")
    text = (folder / "case.yaml").read_text()
    (folder / "case.yaml").write_text(f"units: {{length: mm, mass: t}}\n{text}")
    assert (
        check_meshes(load_case(folder, trust=True))
        .warnings[0]
        .endswith("a stress of 3 MPa in the undeformed body 'cube'")
    )
    found = check_meshes(
        load_case(
            folder_of(tmp_path, "{law: 'laws.py:Yeoh', parameters: {c10: 1, c20: 1, bulk: 1e6}}", "auto"), trust=True
        )
    )
    assert found.warnings == []


def test_constants_at_small_strains():
    """Of a law with mu and lambda; the bulk modulus is lambda + 2/3 mu."""

    def energy(F, mu, lmbda):
        E = (F.T * F - ufl.Identity(3)) / 2
        return mu * ufl.inner(E, E) + lmbda / 2 * ufl.tr(E) ** 2

    assert at_small_strains(energy, {"mu": 3.0, "lmbda": 5.0}) == pytest.approx((3.0, 7.0, 0.0), rel=1e-14, abs=1e-14)


def test_constants_of_a_law_with_many_products():
    """Fung's energy of both invariants; its 81 second derivatives, each with all its products, took a minute."""

    def energy(F, mu, stiffening, bulk):
        J = ufl.det(F)
        b = J ** (-2 / 3) * F * F.T
        x = ufl.tr(b) - 3 + (ufl.tr(b) ** 2 - ufl.tr(b * b)) / 2 - 3
        return mu / 4 / stiffening * (ufl.exp(stiffening * x) - 1) + bulk / 2 * (J - 1) ** 2

    start = time.process_time()
    found = at_small_strains(energy, {"mu": 3.0, "stiffening": 7.0, "bulk": 50.0})
    assert found == pytest.approx((3.0, 50.0, 0.0), rel=1e-13, abs=1e-13)
    assert time.process_time() - start < 5.0


def test_contact_knows_the_stiffness(tmp_path):
    """The mean over the cells, by which contact chooses the softer body as slave."""
    folder = folder_of(tmp_path, "{law: 'laws.py:Yeoh', parameters: {c10: 1 + x, c20: 0, bulk: 50}}")
    points = np.array([[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    assert own_law_at_rest(load_case(folder, trust=True), "cube", points).mu == pytest.approx(3.0, rel=1e-6)
