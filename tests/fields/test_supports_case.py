"""Supports, springs and loads of case files: named lines and points, positions, messages, resultants, processes."""

from pathlib import Path

import numpy as np
import pytest
from case_mistakes import first_lines, refused
from docs_pages import yaml_blocks
from programs import fsci

from fsci.case import CaseError, load_case
from fsci.meshes.mesh import build_mesh, extract_region
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from solvers.structure.elastic_constants import lame

ROOT = Path(__file__).parents[2]

#: A block with a named edge y = z = 0 and two named corners of x = 2.
GEO = """\
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 2, 1, 1};
Physical Volume("block") = {1};
Physical Surface("left") = {1};
Physical Surface("right") = {2};
Physical Curve("edge") = {9};
Physical Point("corners") = {5, 6};
Mesh.MeshSizeMin = 1;
Mesh.MeshSizeMax = 1;
"""
CASE = """\
time: {step: 1, end: 1}
curves:
  load: {table: [[0, 0], [2, 1]]}
structure:
  bodies:
    block:
      mesh: {file: block.geo, order: 2}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports:
        - {on: left, direction: [1, 2, 0]}
        - {on: edge, displacement: [null, null, 0]}
        - {at: [0, 1, 1], displacement: [0, 0, 0]}
        - {on: corners, direction: [0, 1, 1], displacement: "0.01*load(t)"}
      springs:
        - {on: right, stiffness: 30, normal: true}
        - {at: [2, 1, 1], stiffness: 20}
      tractions: [{on: [left, right], value: [0, 0, "load(t)*y"]}]
      line_forces: [{on: edge, value: [0, "4*load(t)*x", 0]}]
      point_forces:
        - {on: corners, value: ["2*load(t)", 0, 0]}
        - {at: [0, 0, 1], value: [0, 0, -3]}
probes:
  left: {quantity: reaction, on: left}
  tip: {quantity: displacement, at: [2, 1, 0]}
solver: {newton: {residual: 1.0e-12}}
"""


@pytest.fixture
def case(tmp_path, monkeypatch):
    (tmp_path / "block.geo").write_text(GEO)
    (tmp_path / "case.yaml").write_text(CASE)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "case.yaml"


def build(case):
    from mpi4py import MPI

    from fsci.builder.structure import build_bodies, build_structure
    from solvers.timing import Timer

    bodies = build_bodies(case, MPI.COMM_SELF)
    return build_structure(case, MPI.COMM_SELF, bodies, None, Timer())


def test_groups_of_a_mesh_file(case):
    mesh = build_mesh(load_case(case).structure.bodies["block"].mesh, case.parent)
    edge = mesh.points[mesh.lines["edge"]]
    assert edge.shape[1:] == (3, 3)
    assert np.abs(edge[..., 1:]).max() == 0.0
    assert edge[:, 2] == pytest.approx(edge[:, :2].mean(axis=1))
    assert np.linalg.norm(edge[:, 1] - edge[:, 0], axis=1).sum() == pytest.approx(2.0)
    assert mesh.points[mesh.nodes["corners"], 0] == pytest.approx(2.0)
    assert len(mesh.nodes["corners"]) == 2
    part = extract_region(mesh, "block")
    assert part.lines["edge"].shape == mesh.lines["edge"].shape
    assert np.allclose(part.points[part.nodes["corners"]], mesh.points[mesh.nodes["corners"]])


def test_resultants_and_reactions(case):
    """Loads sum up to what they say; reactions and springs carry them to 1e-10."""
    structure = build(load_case(case))
    structure.initialise(0.0, 1.0)
    structure.begin_step(0.0, 1.0)
    structure.solve()
    external = structure.now.external.reshape(-1, 3).sum(axis=0)
    assert external == pytest.approx([2.0, 4.0, 0.5 - 3.0], abs=1e-12)
    body = structure.bodies[0]
    body.set_displacement(structure.now.u)
    springs = np.asarray(body.spring_force()).reshape(-1, 3).sum(axis=0)
    reaction = structure.time.reaction(structure).reshape(-1, 3).sum(axis=0)
    assert reaction - springs + external == pytest.approx(0.0, abs=1e-10)
    held = structure.held.part(structure.time.reaction(structure))
    assert np.abs(structure.time.reaction(structure) - held).max() < 1e-10
    u = structure.now.u.reshape(-1, 3)
    x = body.points[:, : body.owned].T
    left, edge = x[:, 0] < 1e-9, np.abs(x[:, 1:]).max(axis=1) < 1e-9
    corners = (x[:, 0] > 2 - 1e-9) & np.isin(body.nodes[: body.owned], body.domain.source.nodes["corners"])
    assert np.abs(u[left] @ [1.0, 2.0, 0.0]).max() < 1e-13
    assert np.abs(u[edge & ~corners, 2]).max() < 1e-13
    assert u[corners] @ [0.0, 1.0, 1.0] == pytest.approx(np.sqrt(2.0) * 0.005)
    assert np.abs(u).max() > 1e-3


@pytest.mark.slow
def test_processes_agree(case, tmp_path):
    histories = []
    for processes in (1, 2):
        out = tmp_path / f"out{processes}"
        done = fsci("run", case, "-o", out, "--set", "structure.bodies.block.mesh.order=1", processes=processes)
        assert done.returncode == FINISHED, done.stderr
        histories.append(read_history(out / "history.csv"))
    for name in ("left.x", "left.y", "left.z", "tip.x", "tip.y", "tip.z"):
        assert histories[0][name] == pytest.approx(histories[1][name], rel=1e-9)


def test_contact_between_turned_planes_of_symmetry(tmp_path):
    """A plate presses a block in a channel, all turned by 30 degrees: the pressure is that of uniaxial strain."""
    (tmp_path / "case.yaml").write_text("""\
time: {step: 0.25, end: 1}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [3, 3], rotate: {angle: 30}}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: [bottom, left, right], symmetry: true}]
contact:
  obstacles:
    plate:
      mesh: {shape: rectangle, size: [3, 1], cells: [1, 1], origin: [-1, 1.01], rotate: {angle: 30}}
      on: bottom
      motion: ["0.2*t*sin(pi/6)", "-0.2*t*cos(pi/6)"]
  pairs: {press: {slave: {body: block, on: top}, master: {obstacle: plate}}}
solver: {newton: {residual: 1.0e-12}}
""")
    assert run_case(load_case(tmp_path), tmp_path / "out") == FINISHED
    history = read_history(tmp_path / "out" / "history.csv")
    mu, lmbda = lame(1000, 0.3)
    stretch = 1 - 0.19
    stress = (mu * (stretch**2 - 1) + lmbda * np.log(stretch)) / stretch
    assert history["contact.press.x"][-1] == pytest.approx(-0.5 * stress, rel=1e-9)
    assert history["contact.press.y"][-1] == pytest.approx(np.sqrt(0.75) * stress, rel=1e-9)


#: what is replaced, by what, the message with line and column
MISTAKES = [
    ("on: left, direction", "direction", "10:11: entry 1 of 'supports' needs 'on: NAME' or 'at: [..]'"),
    ("{on: left, d", "{on: left, at: [0, 0, 0], d", "10:26: give either 'on' or 'at', not both"),
    ("[1, 2, 0]}", "[0, 0, 0]}", "10:33: 'direction' must not be zero"),
    ("[1, 2, 0]}", "[1, 2, 0], normal: true}", "10:52: give either 'direction' or 'normal: true', not both"),
    ("[1, 2, 0]}", "[1, 2, 0], symmetry: true}", "10:54: give either 'direction' or 'symmetry: true', not both"),
    (
        "[1, 2, 0]}",
        "[1, 2, 0], displacement: [0, 0, 0]}",
        "10:58: 'displacement' must be one expression, the displacement along the direction, not a list",
    ),
    (
        "direction: [1, 2, 0]",
        "displacement: 0",
        "10:36: 'displacement' must be a list of components; one expression goes with 'direction' or 'normal'",
    ),
    (
        ", direction: [1, 2, 0]",
        "",
        "10:11: a support needs 'displacement', 'direction', 'normal: true' or 'symmetry: true'",
    ),
    ("direction: [1, 2, 0]", "drection: [1, 2, 0]", "10:22: unknown setting 'drection'; did you mean 'direction'?"),
    (
        "{at: [2, 1, 1], s",
        "{at: [2, 1, 1], normal: true, s",
        "16:35: a node has no normal; name a surface with 'on', or give a 'direction'",
    ),
    ("stiffness: 20", "stiffness: -20", "16:38: 'stiffness' must be at least 0, not -20"),
    (", stiffness: 20", "", "16:11: missing setting 'stiffness' in entry 2 of 'springs'"),
    ("stiffness: 20", "stiffness: t", "16:38: 'stiffness' must not depend on t"),
]  # fmt: skip

#: the same for what only the mesh tells
MESH_MISTAKES = [
    (
        "on: edge, d",
        "on: egde, d",
        "11:16: unknown surface, line or points 'egde'; did you mean 'edge'? (available: corners, edge, left, right)",
    ),
    ("on: right, stiffness: 30", "on: edge, stiffness: 30", "15:16: unknown surface 'edge' (available: left, right)"),
    ("on: edge, value", "on: corners, value", "18:26: unknown line 'corners' (available: edge)"),
    ("on: corners, value", "on: left, value", "20:16: unknown points 'left' (available: corners)"),
    ("at: [0, 0, 1], v", "at: [0, 0, 1.01], v", "21:16: no node is at (0, 0, 1.01); the nearest one is at (0, 0, 1)"),
    ("at: [0, 1, 1], d", "at: [0, 1], d", "12:16: 'at' has 2 entries, but the mesh is of 3 dimensions"),
    ("direction: [1, 2, 0]", "direction: [1, 2]", "10:33: 'direction' has 2 entries, but the mesh is of 3 dimensions"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES, ids=[m[2] for m in MISTAKES])
def test_message(case, old, new, message):
    assert first_lines(refused(CASE.replace(old, new, 1))) == [f"case.yaml:{message}"]


@pytest.mark.parametrize(("old", "new", "message"), MESH_MISTAKES, ids=[m[2] for m in MESH_MISTAKES])
def test_message_about_the_mesh(case, old, new, message):
    assert first_lines(refused(CASE.replace(old, new, 1), build))[0] == f"case.yaml:{message}"


def test_example_of_the_docs(tmp_path):
    """The first YAML text of the page on structures reaches the exact solution that it names."""
    (tmp_path / "case.yaml").write_text(yaml_blocks(ROOT / "docs" / "structures.md")[0])
    assert run_case(load_case(tmp_path), tmp_path / "out") == FINISHED


def test_messages_about_built_in_shapes(case):
    shape = "mesh: {shape: box, size: [2, 1, 1], cells: [2, 2, 2]}"
    case.write_text(CASE.replace("mesh: {file: block.geo, order: 2}", shape))
    with pytest.raises(CaseError) as caught:
        load_case("case.yaml")
    text = [str(problem).split("\n")[0] for problem in caught.value.problems]
    there = "(available: left, right, front, back, bottom, top)"
    assert text == [
        f"case.yaml:11:16: 'box' has no surface 'edge' {there}",
        f"case.yaml:13:16: 'box' has no surface 'corners' {there}",
        "case.yaml:18:26: a built-in shape has no lines with names",
        "case.yaml:20:16: a built-in shape has no points with names; give its position with 'at'",
    ]
