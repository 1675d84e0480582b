"""What `fsci check` says of bodies in the wrong place, of the wrong size, or that nothing holds."""

from pathlib import Path

import meshio  # noqa: TID253
import numpy as np
import pytest
from case_mistakes import load
from case_text import without

from fsci import shapes
from fsci.case import load_case
from fsci.check.check import summary
from fsci.check.meshes import check_meshes
from fsci.distinct import distinct
from solvers.mesh.penetration import depths, inside
from solvers.mesh.tessellation import tessellate

CASES = Path(__file__).parents[2] / "cases"


def warnings(text):
    """Warnings and notes, without the path of the case."""
    case = load(text)
    found = check_meshes(case)
    assert found.problems == []
    return [*case.warnings, *found.warnings], found.notes


# --- overlaps

TWO = """\
time: {step: 1, end: 1}
structure:
  bodies:
    lower:
      mesh: {shape: rectangle, size: [1, 1], cells: [4, 4]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: bottom, displacement: [0, 0]}]
    upper:
      mesh: {shape: rectangle, size: [1, 1], cells: [4, 4], origin: [0, 0.7]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: top, displacement: [0, 0]}]
"""
PAIR = "contact: {pairs: {p: {slave: {body: upper, on: bottom}, master: {body: lower, on: top}}}}\n"


SLAVE = "{shape: rectangle, size: [1, 1], cells: [%d, 4], origin: [0, 1]}\n      material: {law: neo_hooke, E: %g,"


@pytest.mark.usefixtures("in_new_folder")
@pytest.mark.parametrize(("stiffness", "cells", "says"), [(1e5, 5, True), (1e5, 4, False), (5e3, 5, False)])
def test_a_slave_that_is_stiffer_and_finer(stiffness, cells, says):
    """The other way round it is as it should be; ties, and pairs that the program finds, are left alone."""
    text = TWO.replace("0.7", "1").replace(SLAVE % (4, 1000), SLAVE % (cells, stiffness))
    said = (
        "case.yaml:12:22: 'upper' is 100 times stiffer than 'lower' and has smaller facets: "
        "the nodes of 'lower' carry the contact pressure"
    )
    assert warnings(text + PAIR) == ([], [said] if says else [])
    other = PAIR.replace("slave", "?").replace("master", "slave").replace("?", "master")
    for pair in (other, PAIR.replace("top}}", "top}, tied: true}"), "contact: {bodies: all}\n"):
        assert warnings(text + pair)[1] == []


@pytest.mark.usefixtures("in_new_folder")
def test_a_surface_that_is_tied_elsewhere_stays_the_master():
    text = TWO.replace("0.7", "1").replace(SLAVE % (4, 1000), SLAVE % (5, 1e5))
    mesh = "mesh: {shape: rectangle, size: [1, 1], cells: [4, 4], origin: [0, -1]}"
    held = "supports: [{on: left, displacement: [0, 0]}]"
    body = f"{{{mesh}, material: {{law: neo_hooke, E: 1000, nu: 0.3}}, {held}}}"
    tie = "glue: {slave: {body: lower, on: bottom}, master: {body: base, on: top}, tied: true}"
    text = text.replace("      supports: [{on: bottom, displacement: [0, 0]}]", f"      {held}\n    base: {body}")
    assert warnings(text + PAIR.replace("pairs: {", f"pairs: {{{tie}, "))[1] == []


FALLING = """\
time: {step: 0.02, end: 2}
structure:
  dynamics: {}
  bodies:
    a:
      mesh: {shape: rectangle, size: [1, 1], cells: [3, 3]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      gravity: [0, -1]
      FIXED
contact:
  bodies: all
  obstacles:
    floor: {on: top, mesh: {shape: rectangle, size: [6, 1], cells: [1, 1], origin: [-2, -3]}}
"""


@pytest.mark.usefixtures("in_new_folder")
def test_bodies_that_overlap():
    words = "move one of them, or make their surfaces a pair of contact"
    assert warnings(TWO) == ([f"case.yaml:8:5: bodies 'lower' and 'upper' overlap, 0.3 m deep: {words}"], [])
    words = "bodies 'lower' and 'upper' of pair 'p' overlap, 0.3 m deep, which contact has to push apart at once"
    assert warnings(TWO + PAIR) == ([], [f"case.yaml:8:5: {words}"])


ACROSS = """\
time: {step: 1, end: 1}
fluid:
  density: 1
  viscosity: 1
  grid: {from: [0, 0], to: [2, 1], cells: [16, 8]}
  patches: {ends: {on: [x-, x+], periodic: true}, walls: {on: [y-, y+], no_slip: true}}
  bodies:
    left: {mesh: {shape: rectangle, size: [0.5, 0.5], cells: [2, 2], origin: [-0.1, 0.2]}, free: {density: 2}}
    right: {mesh: {shape: rectangle, size: [0.5, 0.5], cells: [2, 2], origin: [X, 0.2]}, free: {density: 2}}
coupling: {}
"""


@pytest.mark.usefixtures("in_new_folder")
@pytest.mark.parametrize("x", [1.5, -2.5, 5.5])
def test_bodies_that_overlap_through_a_periodic_face(x):
    """In any period; a body that is beyond the end of the box is not outside of it."""
    words = "move one of them: they have no contact"
    said, _ = warnings(ACROSS.replace("X", str(x)))
    placed = [line for line in said if "overlap" in line or "outside" in line]
    assert placed == [f"case.yaml:9:12: bodies 'left' and 'right' overlap, 0.1 m deep: {words}"]
    said, _ = warnings(ACROSS.replace("X", str(x - 0.2)))
    assert not [line for line in said if "overlap" in line or "outside" in line]


@pytest.mark.usefixtures("in_new_folder")
def test_a_free_body_in_a_given_one():
    """Contact leaves them out, so that the case should not begin like this; two given bodies may overlap."""
    text = """\
time: {step: 0.1, end: 1}
fluid:
  density: 1
  viscosity: 1
  grid: {from: [0, 0], to: [4, 4], cells: [120, 120]}
  patches: {walls: {on: [x-, x+, y-, y+], no_slip: true}}
  bodies:
    post: {mesh: {shape: rectangle, size: [0.5, 1], cells: [1, 1], origin: [1, 1]}}
    beam: {mesh: {shape: rectangle, size: [1, 0.5], cells: [1, 1], origin: [1.25, 1.5]}}
    disc: {mesh: {shape: disc, radius: 0.5, cells: [32, 1], translate: [0.6, 1.5]}, free: {density: 2}}
coupling: {}
"""
    said = [line for line in warnings(text)[0] if "overlap" in line]
    assert said == [
        "case.yaml:10:11: bodies 'post' and 'disc' overlap, 0.1 m deep: move one of them: they have no contact"
    ]
    assert [line for line in warnings(text.replace("0.6, 1.5", "0.4, 1.5"))[0] if "overlap" in line] == []


@pytest.mark.usefixtures("in_new_folder")
@pytest.mark.parametrize("origin", ["1", "1.2", "1 - 1e-12"])
def test_bodies_side_by_side(origin):
    assert warnings(TWO.replace("0.7", origin)) == ([], [])


@pytest.mark.usefixtures("in_new_folder")
def test_curved_surfaces_that_touch():
    """Facets that do not match cross each other by a part of their length."""
    disc = TWO.replace("rectangle, size: [1, 1], cells: [4, 4]}", "disc, radius: 1, cells: [24, 3]}").replace(
        "bottom", "outer"
    )
    ring = "ring, inner_radius: 1, outer_radius: 1.2, cells: [36, 1]}"
    text = disc.replace("rectangle, size: [1, 1], cells: [4, 4], origin: [0, 0.7]}", ring).replace(
        "on: top", "on: outer"
    )
    assert warnings(text) == ([], [])
    assert "overlap, 0.05" in str(
        warnings(text.replace("inner_radius: 1,", "inner_radius: 0.95,").replace("[36, 1]", "[96, 4]"))[0]
    )


def test_depth():
    """Of points in discs, balls, boxes and rings, against formulas."""
    bodies = [
        (shapes.disc(1, (96, 4)), lambda p: 1 - np.linalg.norm(p, axis=1)),
        (shapes.sphere(1, (12, 2)), lambda p: 1 - np.linalg.norm(p, axis=1)),
        (
            shapes.ring(0.5, 1, (96, 4)),
            lambda p: np.minimum(1 - np.linalg.norm(p, axis=1), np.linalg.norm(p, axis=1) - 0.5),
        ),
        (shapes.box((1, 1, 1), (3, 3, 3)), lambda p: np.minimum(p, 1 - p).min(axis=1)),
        (shapes.rectangle((1, 1), (3, 3)), lambda p: np.minimum(p, 1 - p).min(axis=1)),
    ]
    rng = np.random.default_rng(3)
    for mesh, depth in bodies:
        facets, nodes = tessellate(mesh)
        x = mesh.points[nodes]
        for _ in range(20):
            points = rng.uniform(-1.1, 1.1, (5, x.shape[1]))
            exact = max(depth(points).max(), 0.0)
            found = points[inside(points, x[facets])]
            depth_found = depths(found, x[facets], np.zeros(len(found))).max(initial=0.0)
            assert depth_found == pytest.approx(exact, abs=0.01)
        on_surface = depths(x, x[facets], np.zeros(len(x)))
        assert on_surface.max() < 1e-9
        assert not inside(x - 3.0, x[facets]).any()


# --- bodies outside of the box

OUTSIDE = """\
time: {step: 0.1, end: 0.2}
fluid:
  density: 1
  viscosity: 0.1
  grid: {from: [0, 0], to: [2, 1], cells: [40, 20]}
  patches: {a: {on: [x-, x+], outflow: true}, w: {on: [y-, y+], no_slip: true}}
  bodies:
    rest: {mesh: {shape: disc, radius: 0.2, cells: [16, 1], translate: [5, 5]}}
    driven: {mesh: {shape: disc, radius: 0.2, cells: [16, 1], translate: [-0.5, 0.5]}, motion: {displacement: [t, 0]}}
    free: {mesh: {shape: disc, radius: 0.2, cells: [16, 1], translate: [1, 5]}, free: {density: 2}}
coupling: {}
"""


@pytest.mark.usefixtures("in_new_folder")
def test_bodies_outside_of_the_box():
    """One that is driven may come in."""
    found = [f"case.yaml:{line}:11: the body is outside of the fluid's box" for line in (8, 10)]
    assert warnings(OUTSIDE) == (found, [])
    inside_of_it = OUTSIDE.replace("[5, 5]", "[0.5, 0.5]").replace("[1, 5]", "[1.5, 0.5]")
    assert warnings(inside_of_it) == ([], [])


# --- bodies that nothing holds

LOOSE = """\
time: {step: 1, end: 1}
structure:
  bodies:
    a:
      mesh: {shape: rectangle, size: [2, 1], cells: [4, 2]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: []
"""
SOLID = LOOSE.replace("rectangle, size: [2, 1], cells: [4, 2]", "box, size: [2, 1, 1], cells: [4, 2, 2]")

HELD = [
    (LOOSE, "[]", "translation along x, translation along y and rotation"),
    (LOOSE, "[{on: left, displacement: [0, null]}]", "translation along y"),
    (LOOSE, "[{on: bottom, symmetry: true}]", "translation along x"),
    (LOOSE, "[{at: [0, 0], displacement: [0, 0]}]", "a combination of translation and rotation"),
    (LOOSE, "[{on: left, direction: [1, 0]}, {on: bottom, normal: true}]", None),
    (LOOSE, "[{on: left, displacement: [0, 0]}]", None),
    (LOOSE, "[{at: [0, 0], displacement: [0, 0]}, {at: [2, 0], displacement: [null, 0]}]", None),
    (SOLID, "[{on: left, symmetry: true}, {on: bottom, symmetry: true}]", "translation along {}"),
    (SOLID, "[{on: left, symmetry: true}, {on: bottom, symmetry: true}, {on: front, symmetry: true}]", None),
    (SOLID, "[{on: left, displacement: [0, 0, 0]}]", None),
]


@pytest.mark.usefixtures("in_new_folder")
@pytest.mark.parametrize(("text", "supports", "motions"), HELD, ids=[f"{m[1]} {m[2]}" for m in HELD])
def test_static_bodies(text, supports, motions):
    said, _ = warnings(text.replace("supports: []", f"supports: {supports}"))
    if motions is None:
        assert said == []
    else:
        start, _, _ = motions.partition("{}")
        assert len(said) == 1
        assert said[0].startswith(f"case.yaml:4:5: no support, spring or pair holds {start}")
        assert said[0].endswith("of the body, which static equilibrium does not determine")


@pytest.mark.usefixtures("in_new_folder")
def test_what_holds_besides_supports():
    assert warnings(LOOSE.replace("supports: []", "springs: [{on: left, stiffness: 5}]")) == ([], [])
    assert warnings(
        LOOSE.replace("nu: 0.3}", "nu: 0.3, density: 1}").replace("  bodies", "  dynamics: {}\n  bodies")
    ) == ([], [])
    contact = (
        "contact: {obstacles: {o: {mesh: {shape: rectangle, size: [4, 1], cells: [1, 1], origin: [-1, -1]}, on: top}}, "
    )
    assert warnings(LOOSE + contact + "pairs: {p: {slave: {body: a, on: bottom}, master: {obstacle: o}}}}\n") == (
        [],
        [],
    )


# --- the box, planes of symmetry, units

FREE = """\
time: {step: 0.1, end: 0.2}
fluid:
  density: 1
  viscosity: 0.1
  grid: {from: [0, 0], to: [1, 1], cells: [16, 16]}
  patches: {plane: {on: x-, symmetry: true}, walls: {on: [x+, y-], no_slip: true}, top: {on: y+, outflow: true}}
  bodies:
    a:
      mesh: {shape: disc, radius: 0.3, cells: [24, 1], translate: [0.1, 0.5]}
      free: {density: 2}
coupling: {}
"""


@pytest.mark.usefixtures("in_new_folder")
def test_bodies_beyond_a_plane_of_symmetry():
    [said], _ = warnings(FREE)
    assert said.startswith(
        "case.yaml:8:5: the body reaches 0.2 m beyond the plane of symmetry 'x-': it counts with all of its"
    )
    driven = without(FREE, "coupling").replace("free: {density: 2}", "motion: {displacement: [0, 0.1*t]}")
    for text in (FREE.replace("0.1, 0.5]", "0.4, 0.5]"), driven):
        assert warnings(text) == ([], [])


@pytest.mark.usefixtures("in_new_folder")
def test_free_bodies_behind_walls():
    """A pivot makes it a hinge, which may be in the wall."""
    behind = FREE.replace("symmetry: true", "slip: true")
    [said], _ = warnings(behind)
    assert said == "case.yaml:8:5: the free body reaches 0.2 m behind the wall 'x-', which does not hold it there"
    assert warnings(behind.replace("density: 2", "density: 2, pivot: [0, 0.5]")) == ([], [])


@pytest.mark.usefixtures("in_new_folder")
def test_friction_by_default_beside_free_bodies():
    """Free bodies have Coulomb's, too; a check says that Tresca's, which bounds tractions, is not for them."""
    block = """\
structure:
  dynamics: {}
  bodies:
    b:
      mesh: {shape: rectangle, size: [0.2, 0.2], cells: [4, 4], origin: [0.7, 0.1]}
      material: {law: neo_hooke, E: 1e4, nu: 0.3, density: 2}
contact: {bodies: all, friction: {bound: 0.2}}
"""
    text = FREE.replace("0.1, 0.5]", "0.35, 0.5]") + block
    line = next(number for number, words in enumerate(text.splitlines(), 1) if "friction" in words)
    said = [words for words in load(text).warnings if "friction" in words]
    assert said == [
        f"case.yaml:{line}:34: free rigid bodies touch each other, bodies of given motion and walls without friction: "
        "a bound of tractions needs elastic surfaces; give a 'coefficient'"
    ]
    coulomb, none = (text.replace("{bound: 0.2}", new) for new in ("{coefficient: 0.2}", "none"))
    for other in (coulomb, none, text.replace("free: {density: 2}", "slip_length: 0")):
        assert not [words for words in load(other).warnings if "friction" in words]


@pytest.mark.usefixtures("in_new_folder")
def test_meshes_in_other_units():
    [said] = [
        line
        for line in warnings(FREE.replace("radius: 0.3", "radius: 300").replace("[0.1, 0.5]", "[-299.9, 0.5]"))[0]
        if "unit" in line
    ]
    words = "the body is 600 times larger than the box: is its mesh in another unit, such as mm instead of m?"
    assert said == f"case.yaml:8:5: {words}"
    assert "times smaller than the box" in str(
        warnings(FREE.replace("radius: 0.3", "radius: 3e-4").replace("0.1, 0", "0.5, 0"))[0]
    )
    upper = TWO.replace(
        "size: [1, 1], cells: [4, 4], origin: [0, 0.7]", "size: [1000, 1000], cells: [4, 4], origin: [0, 1]"
    )
    assert "the body is 1,000 times larger than body 'lower'" in str(warnings(upper + PAIR)[0])


# --- pairs that are not made

FLYING = """\
time: {step: 0.02, end: 2}
structure:
  dynamics: {}
  bodies:
    a: &a
      mesh: {shape: disc, radius: 0.5, cells: [24, 2]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      initial_velocity: [1, 0]
    b: {<<: *a, mesh: {shape: disc, radius: 0.5, cells: [24, 2], translate: [2.6, 0]}, initial_velocity: [-1, 0]}
contact:
  bodies: all
  obstacles:
    bottom: {on: top, mesh: {shape: rectangle, size: [6, 0.1], cells: [1, 1], origin: [-2, -0.61]}}
"""


@pytest.mark.usefixtures("in_new_folder")
def test_bodies_that_approach_without_a_pair():
    assert warnings(FLYING) == ([], [])  # at any distance
    said, notes = warnings(FLYING.replace("bodies: all", "bodies: all\n  reach: 1.41"))
    assert said == []
    words = "'a' and 'b' move towards each other, but are farther apart (1.6 m) than 'reach' (1.41 m)"
    assert notes == [f"case.yaml:10:1: {words}: they are no pair of contact"]
    for text in (
        FLYING.replace("bodies: all", "bodies: all\n  reach: 2"),
        FLYING.replace("[1, 0]", "[-1, 0]").replace(
            "initial_velocity: [-1, 0]}\ncontact", "initial_velocity: [1, 0]}\ncontact"
        ),
    ):
        assert warnings(text)[1] == []
    falling = FLYING.replace("initial_velocity: [1, 0]", "gravity: [0, -1]").replace(
        "initial_velocity: [-1, 0]", "gravity: [0, -1]"
    )
    assert warnings(falling)[1] == []  # towards the obstacle, which is a pair
    high = falling.replace("-0.61]", "-9]")
    with_pair = high.replace("cells: [24, 2]}\n", "cells: [24, 2], translate: [1.2, 0]}\n")
    assert "'a' and 'bottom' move towards each other" in str(warnings(with_pair.replace("all", "all\n  reach: 1"))[1])
    nobody = FLYING[: FLYING.index("contact:")]
    words = "'a' and 'b' move towards each other, 1.6 m apart, but are no pair of contact: nothing will hold them apart"
    assert warnings(nobody)[1] == [f"case.yaml:2:1: {words}"]


@pytest.mark.usefixtures("in_new_folder")
def test_surfaces_of_bodies_that_may_turn():
    """A block that falls onto a floor may land on its side; one that a support guides, or in statics, does not."""
    block = FALLING.replace("FIXED", "")
    words = "'a' may turn, but its surfaces 'left', 'right' and 'top' are no pair with 'floor'"
    assert warnings(block)[1] == [f"case.yaml:10:1: {words}: if they can meet, name all of them in 'on' of one side"]
    held = FALLING.replace("FIXED", "supports: [{on: left, symmetry: true}]")
    every = block.replace(
        "bodies: all", "pairs: {p: {slave: {body: a, on: [left, right, top, bottom]}, master: {obstacle: floor}}}"
    )
    for text in (held, every, held.replace("  dynamics: {}\n", "")):
        assert warnings(text)[1] == []


# --- the flow

CHANNEL = """\
time: {step: 0.001, end: 0.01}
fluid:
  density: 1
  viscosity: 1e-6
  grid: {from: [0, 0], to: [2, 1], cells: [16, 8]}
  patches: {in: {on: x-, velocity: [1, 0]}, out: {on: x+, outflow: true}, walls: {on: [y-, y+], no_slip: true}}
"""


@pytest.mark.usefixtures("in_new_folder")
def test_cells_against_the_reynolds_number():
    [said], _ = warnings(CHANNEL)
    words = "the Reynolds number is 1e+06 (velocity 1, width of the box 1 m): boundary layers are about 0.001 m thick"
    assert said.startswith(f"case.yaml:5:9: {words}, the smallest cells 0.12 m: forces")
    for text in (CHANNEL.replace("1e-6", "1e-3"), CHANNEL.replace("viscosity", "flow: stokes\n  viscosity")):
        assert warnings(text) == ([], [])


# --- messages


def test_numbers_that_are_compared_differ():
    assert distinct(1.0, 2.0) == ("1", "2")
    assert distinct(7.8e-6, 7.8e-6 * (1 + 1e-9)) == ("7.8e-06", "7.80000001e-06")
    assert distinct(0.3, 0.1 + 0.2) == ("0.29999999999999999", "0.30000000000000004")
    assert distinct(0.5, 0.5) == ("0.5", "0.5")


@pytest.mark.usefixtures("in_new_folder")
def test_solids_in_space_are_not_plane():
    box = shapes.box((1, 1, 1), (2, 2, 2))
    meshio.Mesh(box.points, [("hexahedron", box.cells)]).write("m.vtu")
    case = load(LOOSE.replace("{shape: rectangle, size: [2, 1], cells: [4, 2]}", "{file: m.vtu}"))
    assert "plane" not in summary(case, check_meshes(case).meshes)
    case = load(LOOSE)
    assert "static, plane strain" in summary(case, check_meshes(case).meshes)


#: Warnings of the project's cases, by the ends of their texts: thin bodies.
THIN = {"hydrostatic_contact": 1, "piston_impact": 1, "torus_wall": 1, "valve": 2, "valve_3d": 3, "valve_thin": 2}
#: The same: few cells along the gap of two discs.
GAPS = {"hopper": 2}
#: Cases whose bodies have cells of first order and do not bend, or as in the paper they are from.
FIRST_ORDER = {
    "elastic_bar_column": 1,
    "elastic_tube": 1,
    "self_contact_fold": 1,
    "sphere_tube": 2,
    "two_tori": 2,
    "two_tori_friction": 2,
}


@pytest.mark.parametrize("name", sorted(path.name for path in CASES.iterdir() if (path / "case.yaml").exists()))
def test_cases_that_are_right(name):
    case = load_case(CASES / name)
    found = check_meshes(case)
    assert found.problems == []
    said = [note for note in found.notes if ": mixed element for nearly incompressible material" not in note]
    first_order = [True] * FIRST_ORDER.get(name, 0)
    assert [note.endswith("too stiff in bending; take 'order: 2'") for note in said] == first_order
    said = [*case.warnings, *found.warnings]
    texts = ("thick", "along it where the force acts")
    counts = [sum(words in line for line in said) for words in texts]
    assert counts == [some.get(name, 0) for some in (THIN, GAPS)]
    assert len(said) == sum(counts), said
