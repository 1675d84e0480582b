"""The element of solids that the program chooses: mixed where cells would lock and can be mixed; it says so."""

import pytest
from programs import fsci

from fsci.builder.elements import choose_element
from fsci.case import load_case
from fsci.meshes.of_case import read_body
from fsci.running.history import read_history

BEAM = """
time: {step: 1, end: 1}
structure:
  bodies:
    beam:
      mesh: {shape: rectangle, size: [10, 1], cells: [20, 4], order: 1}
      material: {law: neo_hooke, E: 1000, nu: 0.4999}
      supports: [{on: left, displacement: [0, 0]}]
      tractions: [{on: right, value: [0, 0.01]}]
probes:
  tip: {body: beam, quantity: displacement, at: [10, 0.5]}
solver: {linear: {method: direct}}
"""

MIXED = "mixed element for nearly incompressible material (nu = 0.4999)"
LOCKS = "first-order cells lock for nearly incompressible material (nu = 0.4999); take "
BOX = "mesh={shape: box, size: [10, 1, 1], cells: [4, 1, 1], order: 1}"


def chosen(folder, *changes):
    """(element, note, warning) of the beam with changes of its settings, without that it is too stiff in bending."""
    (folder / "case.yaml").write_text(BEAM)
    settings = [change if "." in change.split("=")[0] else f"structure.bodies.beam.{change}" for change in changes]
    case = load_case(folder, [tuple(setting.split("=", 1)) for setting in settings])
    found = choose_element(case, "beam", read_body(case, "beam"))
    notes = [note for note in found.notes if "in bending" not in note]
    return found.element, "".join(notes), "".join(found.warnings)


def test_the_unit_of_stress_does_not_choose(tmp_path):
    stiffnesses = [5910.0 * 10.0**k for k in range(-6, 7)]
    found = {chosen(tmp_path, f"material={{law: neo_hooke, E: {E!r}, nu: 0.45}}")[0] for E in stiffnesses}
    assert found == {"mixed"}


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ((), ("mixed", MIXED, "")),
        (("mesh={shape: rectangle, size: [10, 1], cells: [4, 1], order: 2}",), ("mixed", MIXED, "")),
        (("material={law: neo_hooke, E: 1, nu: 0.45}",), ("mixed", MIXED.replace("0.4999", "0.45"), "")),
        (("material={law: neo_hooke, E: 1, nu: 0.449}",), ("displacement", "", "")),
        (("material={law: neo_hooke, mu: 1, lambda: 4999}",), ("mixed", MIXED, "")),
        (("material={law: mooney_rivlin, c10: 0.25, c01: 0.25, bulk: 4999.67}",), ("mixed", MIXED, "")),
        (("material={law: yeoh, c10: 0.5, bulk: 2}",), ("displacement", "", "")),
        (("kinematics=linear",), ("mixed", MIXED, "")),
        (("material={law: neo_hooke, E: 1, nu: 0.3 + 0.1999*(x > 9)}",), ("mixed", MIXED, "")),
        (("element=mixed",), ("mixed", "", "")),
        (("element=displacement",), ("displacement", "", LOCKS + "'element: auto'")),
        (
            ("mesh={shape: rectangle, size: [10, 1], cells: [4, 1], cell: tri, order: 1}",),
            ("displacement", "", LOCKS + "'order: 2'"),
        ),
        (
            ("mesh={shape: rectangle, size: [10, 1], cells: [4, 1], cell: tri, order: 2}",),
            ("displacement", "", ""),
        ),
        (
            ("structure.plane=stress", "material={law: st_venant_kirchhoff, E: 1, nu: 0.4999}"),
            ("displacement", "", ""),
        ),
        ((BOX, "supports=[]", "tractions=[]", "probes.tip.at=[10, 0.5, 0]"), ("mixed", MIXED, "")),
    ],
)
def test_choice(tmp_path, changes, expected):
    assert chosen(tmp_path, *changes) == expected


def test_cells_of_a_file(tmp_path):
    """Triangles of a file are known only once it is read."""
    import meshio

    points, cell = [[0.0, 0.0], [10.0, 0.0], [0.0, 1.0]], [[0, 1, 2]]
    meshio.write(tmp_path / "one.msh", meshio.Mesh([[*p, 0.0] for p in points], [("triangle", cell)]), "gmsh")
    changes = ("mesh={file: one.msh}", "supports=[]", "tractions=[]")
    assert chosen(tmp_path, *changes) == ("displacement", "", LOCKS + "'order: 2'")


OWN = """
def neo_hooke(F, mu, lmbda):
    import ufl
    J = ufl.det(F)
    return mu / 2 * (ufl.inner(F, F) - 3) - mu * ufl.ln(J) + lmbda / 2 * ufl.ln(J) ** 2
"""


def test_own_law(tmp_path):
    """A law of the user is judged by its moduli at small strains; the run takes it to the same end."""
    (tmp_path / "law.py").write_text(OWN)
    (tmp_path / "case.yaml").write_text(BEAM)
    own = "structure.bodies.beam.material={law: 'law.py:neo_hooke', parameters: {mu: 333.3555570, lmbda: 1666444.43}}"
    tips = []
    for name, words in (("built-in", ()), ("own", ("--trust", "--set", own))):
        done = fsci("run", tmp_path, "-o", tmp_path / name, *words)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "body 'beam': mixed element for nearly incompressible material (nu = 0.4999)" in done.stdout
        tips.append(read_history(tmp_path / name / "history.csv")["tip.y"][-1])
    assert tips[1] == pytest.approx(tips[0], rel=1e-6)


def test_beam_by_default_on_processes(tmp_path):
    """A beam whose case names no element bends as Euler and Bernoulli say, F l^3 / (3 E I) with E / (1 - nu^2).

    The displacement element gives 2 % of it."""
    (tmp_path / "case.yaml").write_text(BEAM)
    slender = 0.01 * 10**3 / (3 * 1000 / (1 - 0.4999**2) / 12)
    tips = []
    for processes in (1, 2):
        out = tmp_path / str(processes)
        done = fsci("run", tmp_path, "-o", out, processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        assert done.stdout.count(MIXED) == 1
        tips.append(read_history(out / "history.csv")["tip.y"][-1])
    assert tips[0] == pytest.approx(slender, rel=0.05)
    assert tips[1] == pytest.approx(tips[0], rel=1e-8)


def test_check_says_it(tmp_path):
    (tmp_path / "case.yaml").write_text(BEAM)
    done = fsci("check", tmp_path)
    assert done.returncode == 0
    assert (done.stdout + done.stderr).count(f":6:13: {MIXED}") == 1
    locking = fsci("check", tmp_path, "--set", "structure.bodies.beam.element=displacement")
    assert LOCKS + "'element: auto'" in locking.stdout + locking.stderr
