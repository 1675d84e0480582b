"""Bodies that bend: the error of first-order cells is known beforehand, and slender bodies get second order."""

import json

import pytest
from programs import fsci

from fsci.builder.elements import choose_element
from fsci.case import load_case
from fsci.meshes.of_case import read_body
from fsci.meshes.slender import bending_error
from fsci.running.history import read_history

BEAM = """
time: {step: 1, end: 1}
structure:
  bodies:
    beam:
      mesh: {shape: rectangle, size: [1, 0.1], cells: [20, 2]}
      material: {law: neo_hooke, E: 1, nu: 0.3}
      kinematics: linear
      supports: [{on: left, displacement: [0, 0]}]
      tractions: [{on: right, value: [0, 1e-9]}]
probes:
  tip: {body: beam, quantity: displacement, at: [1, 0.05]}
"""
IN_SPACE = (
    "supports=[{on: left, displacement: [0, 0, 0]}]",
    "tractions=[{on: right, value: [0, 1e-9, 0]}]",
    "probes.tip.at=[1, 0.05, 0.05]",
)
#: Timoshenko: F L^3 / (3 E' I) + F L / (5/6 G A), E' = E / (1 - nu^2).
TIP = 1e-10 * (4 * (1 - 0.3**2) / 0.1**3 + 1 / (5 / 6 / 2.6 * 0.1))


def settings(changes):
    return [
        change
        if change.startswith(("probes", "structure", "contact", "fluid", "coupling"))
        else f"structure.bodies.beam.{change}"
        for change in changes
    ]


def load(folder, *changes):
    (folder / "case.yaml").write_text(BEAM)
    return load_case(folder, [tuple(setting.split("=", 1)) for setting in settings(changes)])


def chosen(folder, *changes):
    case = load(folder, *changes)
    return choose_element(case, "beam", read_body(case, "beam"))


def tip(folder, *changes):
    (folder / "case.yaml").write_text(BEAM)
    words = [word for setting in settings(changes) for word in ("--set", setting)]
    done = fsci("run", folder, "-o", folder / "out", *words)
    assert done.returncode == 0, done.stdout + done.stderr
    return float(read_history(folder / "out" / "history.csv")["tip.y"][-1]), done.stdout


@pytest.mark.parametrize(
    "mesh",
    [
        "{shape: rectangle, size: [1, 0.1], cells: [10, 1], order: 1}",
        "{shape: rectangle, size: [1, 0.1], cells: [20, 4], order: 1}",
        "{shape: rectangle, size: [1, 0.1], cells: [40, 2], order: 1}",
        "{shape: rectangle, size: [1, 0.1], cells: [20, 2], order: 1, cell: tri}",
        "{shape: rectangle, size: [1, 0.1], cells: [20, 4], order: 1, cell: tri}",
    ],
)
def test_error_of_first_order(tmp_path, mesh):
    """The end of a cantilever moves less than by Timoshenko's theory, by the share that is said beforehand."""
    case = load(tmp_path, f"mesh={mesh}")
    said = bending_error(read_body(case, "beam"), 0.3)
    assert TIP / tip(tmp_path, f"mesh={mesh}")[0] - 1.0 == pytest.approx(said, rel=0.12)


def test_a_beam_by_default(tmp_path):
    """One cell through the thickness, no numerical setting: 1 %, by the clamped end; the run says why."""
    moved, said = tip(tmp_path, "mesh={shape: rectangle, size: [1, 0.1], cells: [10, 1]}")
    assert moved == pytest.approx(TIP, rel=0.01)
    assert said.count("body 'beam': cells of second order, since it is slender") == 1


@pytest.mark.parametrize(
    ("mesh", "degree"),
    [
        ("{shape: rectangle, size: [1, 0.19], cells: [10, 2]}", 2),
        ("{shape: rectangle, size: [1, 0.21], cells: [10, 2]}", 1),
        ("{shape: rectangle, size: [0.1, 0.5], cells: [2, 10]}", 2),  # five times as long as thick, wherever it is
        ("{shape: rectangle, size: [0.1, 0.5], cells: [2, 10], origin: [1.53, 0]}", 2),
        ("{shape: rectangle, size: [1e-4, 5e-4], cells: [2, 10], rotate: {angle: 33}, origin: [-17.3, 91]}", 2),
        ("{shape: rectangle, size: [1e-3, 1e-4], cells: [10, 1], rotate: {angle: 33}, translate: [1e3, 0]}", 2),
        ("{shape: rectangle, size: [0.1, 1], cells: [1, 10], cell: tri}", 2),
        ("{shape: disc, radius: 1, cells: [32, 4]}", 1),
        ("{shape: ring, inner_radius: 0.9, outer_radius: 1, cells: [32, 2]}", 2),
        ("{shape: ring, inner_radius: 0.2, outer_radius: 1, cells: [32, 4]}", 1),
        ("{shape: box, size: [1, 0.1, 0.1], cells: [10, 1, 1]}", 2),
        ("{shape: box, size: [1, 1, 0.1], cells: [6, 6, 1]}", 2),
        ("{shape: box, size: [1, 0.5, 0.5], cells: [4, 2, 2]}", 1),
        ("{shape: tube, inner_radius: 0.9, outer_radius: 1, height: 1, cells: [24, 1, 6]}", 2),
        ("{shape: solid_torus, major_radius: 1, minor_radius: 0.4, cells: [24, 16]}", 1),
    ],
)
def test_order_that_is_chosen(tmp_path, mesh, degree):
    (tmp_path / "case.yaml").write_text(BEAM)
    case = load(tmp_path, f"mesh={mesh}", "supports=[]", "tractions=[]", "probes={}")
    body = read_body(case, "beam")
    assert body.cell_type in {1: ("quad", "triangle", "hexahedron"), 2: ("quad9", "triangle6", "hexahedron27")}[degree]
    notes = choose_element(case, "beam", body).notes
    assert notes == (("cells of second order, since it is slender",) if degree == 2 else ())


GEO = """SetFactory("OpenCASCADE");
Rectangle(1) = {0, 0, 0, 1, 0.1};
Rectangle(2) = {2, 0, 0, 1, 1};
MeshSize{:} = 0.1;
Physical Surface("beam") = {1};
Physical Surface("block") = {2};
Physical Curve("left") = {4};
Physical Curve("right") = {2};
"""


def test_order_of_scripts_and_files(tmp_path):
    """Scripts are meshed anew, each region by itself; files have their cells, and a warning."""
    import meshio

    (tmp_path / "two.geo").write_text(GEO)
    beam = chosen(tmp_path, "mesh={file: two.geo}", "region=beam")
    assert (beam.notes, beam.warnings) == (("cells of second order, since it is slender",), ())
    block = load(tmp_path, "mesh={file: two.geo}", "region=block", "supports=[]", "tractions=[]", "probes={}")
    assert read_body(block, "beam").cell_type == "triangle"
    first = load(tmp_path, "mesh={file: two.geo, order: 1}", "region=beam")
    mesh = read_body(first, "beam")
    assert mesh.cell_type == "triangle"
    meshio.write(tmp_path / "beam.vtu", meshio.Mesh([[*p, 0.0] for p in mesh.points], [("triangle", mesh.cells)]))
    bare = ("supports=[]", "tractions=[]", "probes={}")
    said = chosen(tmp_path, "mesh={file: beam.vtu}", *bare).warnings
    assert len(said) == 1
    assert said[0].startswith("first-order cells make it ")
    assert said[0].endswith(" times too stiff in bending; take cells of second order")


def test_an_order_that_is_given_is_a_note(tmp_path):
    given = chosen(tmp_path, "mesh={shape: rectangle, size: [1, 0.1], cells: [20, 2], order: 1}")
    assert given.notes == ("first-order cells make it about 15 % too stiff in bending; take 'order: 2'",)
    assert given.warnings == ()
    fine = chosen(tmp_path, "mesh={shape: rectangle, size: [1, 0.1], cells: [60, 4], order: 1}")
    assert (fine.notes, fine.warnings) == ((), ())


def test_order_in_contact(tmp_path):
    """Slender bodies have second order where they slide or are tied, too."""
    words = ("contact={obstacles: {wall: {mesh: {shape: disc, radius: 0.1, cells: [8, 2], translate: [0.5, -0.2]}}}}",)
    pair = "{slave: {body: beam, on: bottom}, master: {obstacle: wall}}"
    case = load(tmp_path, *words, f"contact.pairs.touch={pair}")
    body = read_body(case, "beam")
    found = choose_element(case, "beam", body)
    assert (body.cell_type, found.warnings) == ("quad9", ())
    assert found.notes == ("cells of second order, since it is slender",)
    assert read_body(load(tmp_path, "contact={bodies: all}"), "beam").cell_type == "quad9"
    other = "{mesh: {shape: rectangle, size: [1, 1], cells: [4, 4], origin: [0, -1]}"
    other += ", material: {law: neo_hooke, E: 1, nu: 0.3}}"
    tie = "{slave: {body: beam, on: bottom}, master: {body: block, on: top}, tied: true}"
    tied = load(tmp_path, f"structure.bodies.block={other}", f"contact.pairs.tie={tie}", "probes={}")
    assert read_body(tied, "beam").cell_type == "quad9"


FLOW = """{density: 1, viscosity: 1, scheme: bdf2, grid: {from: [0, -1], to: [3, 1], cells: [12, 8]},
 patches: {walls: {on: [x-, y-, y+], no_slip: true}, out: {on: x+, outflow: true}}}"""


def test_order_in_a_flow(tmp_path):
    """Slender bodies that are held have second order, as without a flow; those that may touch something first."""
    more = "structure.dynamics={}", "structure.bodies.beam.material.density=1", "coupling={}", "kinematics=finite"
    case = load(tmp_path, f"fluid={FLOW}", *more)
    assert read_body(case, "beam").cell_type == "quad9"
    assert choose_element(case, "beam", read_body(case, "beam")).warnings == ()
    touching = load(tmp_path, f"fluid={FLOW}", *more, "contact={bodies: all}")
    body = read_body(touching, "beam")
    assert body.cell_type == "quad"
    assert choose_element(touching, "beam", body).warnings != ()
    free = load(tmp_path, f"fluid={FLOW}", *more, "supports=[]")
    assert read_body(free, "beam").cell_type == "quad"
    alone = load(tmp_path, f"fluid={FLOW}", *more, "supports=[]", "contact=none")
    assert read_body(alone, "beam").cell_type == "quad9"


def test_order_in_check_and_messages(tmp_path):
    (tmp_path / "case.yaml").write_text(BEAM)
    done = fsci("check", tmp_path)
    assert "40 cells (order 2 quad)" in done.stdout
    assert f"{2 * 41 * 5:,}" in done.stdout
    assert fsci("check", tmp_path, "--set", "structure.bodies.beam.mesh.order=auto").returncode == 0
    for wrong in ("3", "high", "1.5", "0"):
        refused = fsci("check", tmp_path, "--set", f"structure.bodies.beam.mesh.order={wrong}")
        assert refused.returncode == 2
        assert "'order' must be 1, 2 or auto, not" in refused.stderr + refused.stdout


def test_twin_of_the_order(tmp_path):
    """Only bodies of first order have a twin of second order."""
    from fsci.twin.changes import twins

    assert "order" not in {twin.name for twin in twins(load(tmp_path))}
    block = load(tmp_path, "mesh={shape: rectangle, size: [1, 0.5], cells: [4, 2]}")
    assert json.dumps([twin.settings for twin in twins(block) if twin.name == "order"]).count("mesh.order") == 1
