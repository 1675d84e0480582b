"""Bodies that bend: the error of first-order cells is known beforehand, and second order is the default."""

import json

import pytest
from programs import fsci

from fsci.builder.elements import choose_element
from fsci.case import load_case
from fsci.meshes.of_case import read_body
from fsci.meshes.slender import bending_error
from fsci.running.history import read_history
from solvers.mesh.cell_types import CELL_TYPES

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


def column(folder, name, *changes):
    (folder / "case.yaml").write_text(BEAM)
    words = [word for setting in settings(changes) for word in ("--set", setting)]
    done = fsci("run", folder, "-o", folder / "out", *words)
    assert done.returncode == 0, done.stdout + done.stderr
    return float(read_history(folder / "out" / "history.csv")[name][-1])


def tip(folder, *changes):
    return column(folder, "tip.y", *changes)


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
    assert TIP / tip(tmp_path, f"mesh={mesh}") - 1.0 == pytest.approx(said, rel=0.12)


def test_a_beam_by_default(tmp_path):
    """One cell through the thickness, no numerical setting: 1 %, by the clamped end."""
    moved = tip(tmp_path, "mesh={shape: rectangle, size: [1, 0.1], cells: [10, 1]}")
    assert moved == pytest.approx(TIP, rel=0.01)


@pytest.mark.parametrize("size", ["1", "1e-3"])
@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_a_thick_ring_by_default(tmp_path, size, cell):
    """Lame's ring in plane strain under a pressure p within, a = b/2, without numerical settings.

    u(a) = p a (1 + nu) / (E (b^2 - a^2)) ((1 - 2 nu) a^2 + b^2); first order is 0.8 % off, triangles 5.6 %."""
    radii = f"inner_radius: {size}/2, outer_radius: {size}, angle: 90, start: 0"
    moved = column(
        tmp_path,
        "tip.x",
        f"mesh={{shape: ring, {radii}, cells: [12, 5], cell: {cell}}}",
        "supports=[{on: [start, end], symmetry: true}]",
        "tractions=[]",
        "pressures=[{on: inner, value: 1e-9}]",
        f"probes.tip.at=[{size}/2, 0]",
    )
    exact = 1e-9 * 0.5 * 1.3 / 0.75 * (0.4 * 0.25 + 1.0) * float(size)
    assert moved == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize(
    ("mesh", "slender"),
    [
        ("{shape: rectangle, size: [1, 0.19], cells: [10, 2]}", True),
        ("{shape: rectangle, size: [1, 0.21], cells: [10, 2]}", False),
        ("{shape: rectangle, size: [0.1, 0.5], cells: [2, 10]}", True),  # five times as long as thick, wherever it is
        ("{shape: rectangle, size: [0.1, 0.5], cells: [2, 10], origin: [1.53, 0]}", True),
        ("{shape: rectangle, size: [1e-4, 5e-4], cells: [2, 10], rotate: {angle: 33}, origin: [-17.3, 91]}", True),
        ("{shape: rectangle, size: [1e-3, 1e-4], cells: [10, 1], rotate: {angle: 33}, translate: [1e3, 0]}", True),
        ("{shape: rectangle, size: [0.1, 1], cells: [1, 10], cell: tri}", True),
        ("{shape: disc, radius: 1, cells: [32, 4]}", False),
        ("{shape: ring, inner_radius: 0.9, outer_radius: 1, cells: [32, 2]}", True),
        ("{shape: ring, inner_radius: 0.2, outer_radius: 1, cells: [32, 4]}", False),
        ("{shape: box, size: [1, 0.1, 0.1], cells: [10, 1, 1]}", True),
        ("{shape: box, size: [1, 1, 0.1], cells: [6, 6, 1]}", True),
        ("{shape: box, size: [1, 0.5, 0.5], cells: [4, 2, 2]}", False),
        ("{shape: tube, inner_radius: 0.9, outer_radius: 1, height: 1, cells: [24, 1, 6]}", True),
        ("{shape: solid_torus, major_radius: 1, minor_radius: 0.4, cells: [24, 16]}", False),
    ],
)
def test_order_that_is_chosen(tmp_path, mesh, slender):
    """All bodies have second order; with first order the error in bending is said of slender ones."""
    bare = "supports=[]", "tractions=[]", "probes={}"
    case = load(tmp_path, f"mesh={mesh}", *bare)
    body = read_body(case, "beam")
    assert body.cell_type in ("quad9", "triangle6", "hexahedron27")
    assert choose_element(case, "beam", body).notes == ()
    first = read_body(load(tmp_path, f"mesh={mesh[:-1]}, order: 1}}", *bare), "beam")
    assert first.cell_type in ("quad", "triangle", "hexahedron")
    assert (bending_error(first, 0.3) > 0.0) == slender


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
    assert (beam.notes, beam.warnings) == ((), ())
    block = load(tmp_path, "mesh={file: two.geo}", "region=block", "supports=[]", "tractions=[]", "probes={}")
    assert read_body(block, "beam").cell_type == "triangle6"
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
    """Bodies have second order where they slide or are tied, too."""
    words = ("contact={obstacles: {wall: {mesh: {shape: disc, radius: 0.1, cells: [8, 2], translate: [0.5, -0.2]}}}}",)
    pair = "{slave: {body: beam, on: bottom}, master: {obstacle: wall}}"
    case = load(tmp_path, *words, f"contact.pairs.touch={pair}")
    body = read_body(case, "beam")
    found = choose_element(case, "beam", body)
    assert (body.cell_type, found.warnings) == ("quad9", ())
    assert found.notes == ()
    assert read_body(load(tmp_path, "contact={bodies: all}"), "beam").cell_type == "quad9"
    other = "{mesh: {shape: rectangle, size: [1, 1], cells: [4, 4], origin: [0, -1]}"
    other += ", material: {law: neo_hooke, E: 1, nu: 0.3}}"
    tie = "{slave: {body: beam, on: bottom}, master: {body: block, on: top}, tied: true}"
    tied = load(tmp_path, f"structure.bodies.block={other}", f"contact.pairs.tie={tie}", "probes={}")
    assert read_body(tied, "beam").cell_type == "quad9"


@pytest.mark.parametrize(
    ("friction", "where", "degree"),
    [
        ("{coefficient: 0.3}", "section", 1),
        ("{coefficient: 0.3}", "pair", 1),
        ("{bound: 0.3}", "pair", 1),
        ("none", "pair", 2),
        ("none", "section", 2),
    ],
)
def test_order_with_friction(tmp_path, friction, where, degree):
    """A thick body of second order may stick and slip in turn, so that it has first order; not so a slender one."""
    obstacles = "obstacles: {floor: {mesh: {shape: rectangle, size: [3, 1], cells: [1, 1], origin: [-1, -1]}, on: top}}"
    own = f", friction: {friction}" if where == "pair" else ""
    pair = f"{{slave: {{body: beam, on: bottom}}, master: {{obstacle: floor}}{own}}}"
    of_all = f", friction: {friction}" if where == "section" and friction != "none" else ""
    contact = f"contact={{{obstacles}, pairs: {{touch: {pair}}}{of_all}}}"
    found = []
    for height in ("0.5", "0.1"):
        mesh = f"mesh={{shape: rectangle, size: [1, {height}], cells: [4, 2]}}"
        case = load(tmp_path, mesh, "kinematics=finite", "probes={}", contact)
        found.append(CELL_TYPES[read_body(case, "beam").cell_type].degree)
    assert found == [degree, 2]
    both = load(tmp_path, "mesh={shape: rectangle, size: [1, 0.5], cells: [4, 2]}", "contact={bodies: all}")
    assert read_body(both, "beam").cell_type == "quad9"


PRESSED = """
time: {step: 1, end: 1}
structure:
  bodies:
    thick: {mesh: {shape: box, size: [1, 1, 0.5], cells: [2, 2, 1]}, material: {law: neo_hooke, E: 1, nu: 0.3}}
    thin:
      mesh: {shape: box, size: [1, 1, 0.1], cells: [2, 2, 1], origin: [0, 0, 0.5]}
      material: {law: neo_hooke, E: 1, nu: 0.3}
"""


def test_order_of_bodies_in_contact_in_space(tmp_path):
    """A thick one has first order there: a ball that presses a part of a quadratic facet may find no equilibrium."""
    found = []
    for contact in ("", "contact: {bodies: all}\n"):
        (tmp_path / "case.yaml").write_text(PRESSED + contact)
        case = load_case(tmp_path / "case.yaml")
        found.append([CELL_TYPES[read_body(case, name).cell_type].degree for name in ("thick", "thin")])
    assert found == [[2, 2], [1, 2]]


FLOW = """{density: 1, viscosity: 1, scheme: bdf2, grid: {from: [0, -1], to: [3, 1], cells: [12, 8]},
 patches: {walls: {on: [x-, y-, y+], no_slip: true}, out: {on: x+, outflow: true}}}"""


@pytest.mark.parametrize(("height", "touching"), [(0.1, "quad9"), (1, "quad")])
def test_order_in_a_flow(tmp_path, height, touching):
    """Slender bodies have second order, as without a flow; thick ones that may touch something first."""
    more = "structure.dynamics={}", "structure.bodies.beam.material.density=1", "coupling={}", "kinematics=finite"
    scene = f"fluid={FLOW}", *more, f"mesh.size=[1, {height}]"
    held = load(tmp_path, *scene)
    assert read_body(held, "beam").cell_type == "quad9"
    assert choose_element(held, "beam", read_body(held, "beam")).warnings == ()
    for changes in (("contact={bodies: all}",), ("supports=[]",)):
        case = load(tmp_path, *scene, *changes)
        body = read_body(case, "beam")
        assert body.cell_type == touching
        assert choose_element(case, "beam", body).warnings == ()
    alone = load(tmp_path, *scene, "supports=[]", "contact=none")
    assert read_body(alone, "beam").cell_type == "quad9"


@pytest.mark.parametrize("pulled", ["['0.1*ramp(t,0,1)', 0]", "[0.1, 0]"])
def test_order_of_what_a_support_draws_through_a_flow(tmp_path, pulled):
    """First order of thick bodies: elements at the edge of what leaves a wall invert. Slender ones keep second."""
    more = "structure.dynamics={}", "structure.bodies.beam.material.density=1", "coupling={}", "kinematics=finite"
    drawn = f"supports=[{{on: left, displacement: {pulled}}}]"
    thick = "mesh.size=[1, 1]", "mesh.cells=[10, 10]"
    cases = [
        (drawn, f"fluid={FLOW}", *more, *thick),
        (f"fluid={FLOW}", *more, *thick),
        (drawn, f"fluid={FLOW}", *more),
        (drawn, *thick),
    ]
    found = [read_body(load(tmp_path, *changes), "beam").cell_type for changes in cases]
    assert found == ["quad", "quad9", "quad9", "quad9"]


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
    block = load(tmp_path, "mesh={shape: rectangle, size: [1, 0.5], cells: [4, 2], order: 1}")
    assert json.dumps([twin.settings for twin in twins(block) if twin.name == "order"]).count("mesh.order") == 1
