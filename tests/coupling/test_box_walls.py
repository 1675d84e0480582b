"""Elastic bodies in a flow stop at closed faces of its box, without a section `contact`."""

from __future__ import annotations

import numpy as np
import pytest
from programs import fsci

from fsci.builder.automatic_pairs import with_pairs
from fsci.builder.wall_pairs import wall_pairs
from fsci.case import CaseError, load_case
from fsci.meshes.of_case import read_body
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case

#: A block falls on the floor, a third of a cell beside the middle; damping brings it to rest.
BLOCK = """\
time: {step: 0.02, end: 0.8}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 0.8], cells: [10, 8]}
  patches: {top: {on: y+, outflow: true}, sides: {on: [x-, x+], slip: true}, floor: {on: y-, no_slip: true}}
structure:
  dynamics: {rho_inf: 0, damping: {mass: 20}}
  bodies:
    block:
      mesh: {shape: rectangle, size: [0.4, 0.2], cells: [4, 3], order: 1, origin: [0.333, 0.05]}
      material: {law: neo_hooke, E: 3e4, nu: 0.3, density: 20}
      gravity: [0, -10]
coupling: {}
probes:
  centre: {field: structure, body: block, quantity: centre}
  on_block: {field: fluid, body: block, quantity: force}
output: {fields_every: 0}
"""
WEIGHT = 20.0 * 10.0 * 0.4 * 0.2
SPACE = {
    "from: [0, 0], to: [1, 0.8], cells: [10, 8]": "from: [0, 0, 0], to: [1, 0.8, 0.8], cells: [5, 4, 4]",
    "top: {on: y+": "top: {on: z+",
    "[x-, x+], slip": "[x-, x+, y-, y+], slip",
    "floor: {on: y-": "floor: {on: z-",
    "shape: rectangle, size: [0.4, 0.2], cells: [4, 3], order: 1, origin: [0.333, 0.05]": (
        "shape: box, size: [0.4, 0.4, 0.2], cells: [2, 2, 2], origin: [0.333, 0.2, 0.05]"
    ),
    "gravity: [0, -10]": "gravity: [0, 0, -10]",
}


def changed(text, *changes, **more):
    for old, new in (*changes, *more.items()):
        assert old in text, old
        text = text.replace(old, new)
    return text


def run(text, folder, code=FINISHED):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == code
    return read_history(folder / "out" / "history.csv")


def pairs(text, folder):
    """Name of the pair -> number of its slave facets."""
    (folder / "case.yaml").write_text(text)
    case = load_case(folder / "case.yaml")
    case = case if case.contact is None else with_pairs(case)
    found = wall_pairs(case, {name: read_body(case, name) for name in case.elastic_bodies})
    return {pair.name: len(pair.facets) for pair in found}


# ------------------------------------------------------------------------------------------------------------- runs


@pytest.mark.parametrize(
    ("scheme", "condition"),
    [
        ("monolithic", "no_slip"),
        pytest.param("partitioned", "slip", marks=pytest.mark.slow),
        pytest.param("monolithic", "slip", marks=pytest.mark.slow),
        pytest.param("monolithic", "symmetry", marks=pytest.mark.slow),
    ],
)
def test_the_floor_carries_the_weight_less_the_force_of_the_fluid(tmp_path, scheme, condition):
    text = changed(
        BLOCK, ("on: y-, no_slip", f"on: y-, {condition}"), ("coupling: {}", f"coupling: {{scheme: {scheme}}}")
    )
    found = run(text, tmp_path)
    force = found["contact.block_floor_y_low.y"]
    assert force[0] == 0.0
    assert found["centre.y"].min() > 0.09
    assert force[-1] == pytest.approx(WEIGHT - found["on_block.y"][-1], rel=1e-6)
    assert abs(found["contact.block_floor_y_low.x"][-1]) < 1e-9 * WEIGHT


@pytest.mark.slow
@pytest.mark.parametrize("film", ["zone: wetted", "roughness: 0.002"])
def test_with_fluid_below_it_the_floor_carries_the_weight_less_the_buoyancy(tmp_path, film):
    """Wetted and seeping contact have the pressure of the fluid below the block, too."""
    deep = changed(BLOCK, ("  viscosity: 0.1", "  viscosity: 0.1\n  gravity: [0, -10]"), ("end: 0.8", "end: 1.2"))
    found = run(deep + f"contact: {{film: {{{film}}}}}\n", tmp_path)
    buoyancy = 10.0 * 0.4 * 0.2
    force = found["contact.block_floor_y_low.y"][-1]
    assert force == pytest.approx(WEIGHT - found["on_block.y"][-1], rel=1e-6)
    assert force == pytest.approx(WEIGHT - buoyancy, rel=1e-3)


@pytest.mark.slow
def test_a_block_in_space(tmp_path):
    found = run(changed(BLOCK, *SPACE.items()), tmp_path)
    weight = 0.4 * WEIGHT
    assert found["centre.z"].min() > 0.09
    assert found["contact.block_floor_z_low.z"][-1] == pytest.approx(weight - found["on_block.z"][-1], rel=1e-6)


PROBES = """probes:
  gap: {quantity: gap, pair: block_floor_y_low}
  pressure: {quantity: pressure, pair: block_floor_y_low}
  first: {quantity: first_contact, pair: block_floor_y_low}
"""


def test_probes_of_pairs_with_walls(tmp_path):
    """The floor comes in during the run; then the gap closes, and there is a pressure."""
    text = changed(BLOCK, ("probes:\n", PROBES), ("end: 0.8", "end: 0.3"))
    found = run(text, tmp_path)
    assert np.isnan(found["gap"][0])
    assert found["pressure"][0] == 0.0
    touching = found["contact.block_floor_y_low.y"] > 0.0
    assert touching.any()
    assert (found["pressure"] > 0.0).tolist() == touching.tolist()
    assert np.abs(found["gap"][touching]).max() < 1e-3
    assert found["first"][-1] == pytest.approx(found["time"][touching][0])
    for wrong, said in (("roof_y_high", "unknown pair"), ("top_y_high", "did you mean 'block_sides_x_high'")):
        with pytest.raises(CaseError, match=said):
            run(
                changed(text, ("first_contact, pair: block_floor_y_low", f"gap, pair: block_{wrong}")), tmp_path / wrong
            )


def test_a_body_that_stays_away_moves_as_without_contact(tmp_path):
    """Bit for bit, in all columns."""
    text = changed(BLOCK, ("0.333, 0.05", "0.3, 0.4"), ("end: 0.8", "end: 0.1"))
    found = run(text, tmp_path / "walls")
    alone = run(text + "contact: none\n", tmp_path / "none")
    assert list(found) == list(alone)
    for column in found.keys() - {"wall"}:
        assert np.array_equal(found[column], alone[column]), column


def test_bodies_all_does_not_find_walls_anew(tmp_path):
    """Bit for bit as without a section."""
    text = changed(BLOCK, ("end: 0.8", "end: 0.2"), ("0.333, 0.05", "0.333, 0.02"))
    found, plain = run(text + "contact: {bodies: all}\n", tmp_path / "section"), run(text, tmp_path / "plain")
    assert plain["contact.block_floor_y_low.y"].max() > 1.0
    assert list(found) == list(plain)
    for column in found.keys() - {"wall"}:
        assert np.array_equal(found[column], plain[column]), column


def test_a_disc_bounces_in_both_schemes_alike(tmp_path):
    """A disc reaches the floor at 1.5 m/s; `contact: none` lets it through."""
    disc = changed(
        BLOCK,
        ("shape: rectangle, size: [0.4, 0.2], cells: [4, 3], order: 1, origin: [0.333, 0.05]", DISC),
        (", damping: {mass: 20}", ""),
        ("viscosity: 0.1", "viscosity: 0.02"),
        ("gravity: [0, -10]", "initial_velocity: [0, -1.5]"),
        ("end: 0.8", "end: 0.2"),
    )
    one = run(disc, tmp_path / "one")
    other = run(changed(disc, ("coupling: {}", "coupling: {scheme: partitioned}")), tmp_path / "other")
    np.testing.assert_allclose(one["centre.y"], other["centre.y"], rtol=1e-4)
    assert one["contact.block_floor_y_low.y"].max() > 10.0
    assert one["centre.y"].min() > 0.12
    assert one["centre.y"][-1] > one["centre.y"].min()
    through = run(disc + "contact: none\n", tmp_path / "through", code=1)
    assert through["centre.y"][-1] < 0.12


DISC = "shape: disc, radius: 0.15, cells: [16, 2], order: 1, translate: [0.533, 0.25]"


def test_a_resumed_run_is_the_same(tmp_path):
    """Before the floor is near, and in contact with it."""
    short = changed(BLOCK, ("end: 0.8", "end: 0.28"), ("0.333, 0.05", "0.333, 0.06"), ("{mass: 20}", "{mass: 5}"))
    whole = run(short, tmp_path / "whole")
    force = whole["contact.block_floor_y_low.y"]
    assert force[-1] != 0.0
    for end in (0.02, 0.26):
        part = tmp_path / f"to_{end}"
        run(changed(short, ("end: 0.28", f"end: {end}")), part)
        assert resume_run(part / "out", [("time.end", "0.28")]) == FINISHED
        found = read_history(part / "out" / "history.csv")
        for column in ("centre.x", "centre.y", "contact.block_floor_y_low.y"):
            assert np.array_equal(found[column], whole[column]), (end, column)


def test_a_force_that_begins_suddenly_drives_no_body_through_a_wall(tmp_path):
    """The velocity before that step says nothing of it: the step is taken again with contact."""
    sudden = changed(
        BLOCK,
        ("0.333, 0.05", "0.333, 0.15"),
        ("gravity: [0, -10]", "gravity: [0, -1000 * (t > 0.05)]"),
        ("E: 3e4", "E: 3e5"),
        ("end: 0.8", "end: 0.14"),
    )
    found = run(sudden, tmp_path)
    assert found["centre.y"].min() > 0.08
    assert found["contact.block_floor_y_low.y"].max() > 0.0


def test_a_wall_comes_in_while_another_contact_is_closed(tmp_path):
    """A block on a platform slides to a wall: the force of the platform goes on, with its friction."""
    text = changed(
        BLOCK,
        ("0.333, 0.05", "0.4, 0.2"),
        ("damping: {mass: 20}", "damping: {stiffness: 0.001}"),
        ("gravity: [0, -10]", "gravity: [20 * (t > 0.05), -10]"),
        ("end: 0.8", "end: 0.5"),
    )
    text += """\
contact:
  obstacles: {platform: {mesh: {shape: rectangle, size: [3, 0.2], cells: [1, 1], origin: [-1, 0]}, on: top}}
  pairs: {below: {slave: {body: block, on: bottom}, master: {obstacle: platform}, friction: {coefficient: 0.1}}}
"""
    found = run(text, tmp_path)
    side, below = found["contact.block_sides_x_high.x"], found["contact.below.y"]
    assert side[0] == 0.0
    assert side.min() < -0.1 * WEIGHT
    assert found["centre.x"].max() < 0.81
    first = int(np.flatnonzero(side)[0])
    assert np.ptp(below[first - 4 : first]) < 0.2 * WEIGHT
    assert (np.diff(found["contact.friction"]) >= -1e-9).all()


def test_two_bodies_and_a_free_one(tmp_path):
    """Each has its own pairs; the free rigid one has contact of its own."""
    more = """\
    small:
      mesh: {shape: rectangle, size: [0.12, 0.12], cells: [2, 2], origin: [0.1, 0.02]}
      material: {law: neo_hooke, E: 3e4, nu: 0.3, density: 8}
      gravity: [0, -10]
coupling: {}"""
    free = """\
  bodies: {ball: {mesh: {shape: disc, radius: 0.06, cells: [12, 1], translate: [0.88, 0.08]}, free: {density: 8, gravity: [0, -10]}}}
structure:"""  # noqa: E501
    text = changed(
        BLOCK,
        ("coupling: {}", more),
        ("structure:\n", free + "\n"),
        ("0.333, 0.05", "0.333, 0.02"),
        ("end: 0.8", "end: 0.4"),
    )
    found = run(text, tmp_path)
    for column in ("contact.block_floor_y_low.y", "contact.small_floor_y_low.y", "contact.on_ball.y"):
        assert found[column].max() > 0.1, column


# ------------------------------------------------------------------------------------------------- which are paired

ALL = {"block_sides_x_low": 14, "block_sides_x_high": 14, "block_floor_y_low": 14}


def test_all_closed_faces(tmp_path):
    assert pairs(BLOCK, tmp_path) == ALL
    assert pairs(BLOCK + "contact: none\n", tmp_path) == {}
    lid = changed(BLOCK, ("outflow: true", "velocity: [1, 0]"), ("viscosity: 0.1", "viscosity: 0.1\n  gravity: [0, 0]"))
    assert pairs(lid, tmp_path) == ALL | {"block_top_y_high": 14}


def test_friction_of_walls_needs_no_pairs(tmp_path):
    (tmp_path / "case.yaml").write_text(BLOCK + "contact: {friction: {coefficient: 0.3}}\n")
    case = with_pairs(load_case(tmp_path / "case.yaml"))
    found = wall_pairs(case, {"block": read_body(case, "block")})
    assert [pair.friction.coefficient for pair in found] == [0.3] * 3


def test_names_are_free(tmp_path):
    """A pair of the case may have the name; a check may name the column, or nearly."""
    own = changed(OBSTACLE, ("  pairs: {ground", "  pairs: {block_floor_y_low"), ("[-1, -0.2]", "[-1, -0.1]"))
    assert "block_floor_y_low_" in pairs(BLOCK + own, tmp_path)
    check = "verify: [{value: contact.block_floor_y_low.y, reference: 16, relative: 0.1}]\n"
    assert pairs(BLOCK + check, tmp_path) == ALL
    with pytest.raises(CaseError, match=r"did you mean 'contact.block_floor_y_low.y'"):
        pairs(BLOCK + check.replace("floor_y", "flor_y"), tmp_path)


def test_check_lists_them(tmp_path):
    (tmp_path / "case.yaml").write_text(BLOCK)
    row = "walls of block  pairs block_sides_x_low, block_sides_x_high, block_floor_y_low, once it is near"
    assert row in fsci("check", tmp_path / "case.yaml").stdout


def test_held_nodes_are_left_out(tmp_path):
    """What is held on the floor, with the facets beside it; all of the sides of a body that is held elsewhere."""
    held = changed(
        BLOCK,
        ("0.333, 0.05", "0.333, 0"),
        ("      gravity", "      supports: [{on: bottom, displacement: [0, 0]}]\n      gravity"),
    )
    assert pairs(held, tmp_path) == ALL | {"block_sides_x_low": 10, "block_sides_x_high": 10, "block_floor_y_low": 8}
    above = changed(held, ("on: bottom", "on: top"))
    assert pairs(above, tmp_path)["block_floor_y_low"] == 10
    along = changed(held, ("displacement: [0, 0]", "displacement: [0, null]"))
    assert pairs(along, tmp_path) == ALL


def test_parts_in_the_wall_are_left_out(tmp_path):
    assert pairs(changed(BLOCK, ("0.333, 0.05", "0.333, -0.1")), tmp_path)["block_floor_y_low"] == 6
    start = changed(BLOCK, ("      gravity", "      initial_displacement: [0, -0.15]\n      gravity"))
    assert pairs(start, tmp_path)["block_floor_y_low"] == 6
    assert pairs(changed(BLOCK, ("0.333, 0.05", "0.333, 0")), tmp_path) == ALL


def test_cut_faces_of_a_plane_of_symmetry_are_left_out(tmp_path):
    """Held there or not."""
    cut = changed(BLOCK, ("0.333, 0.05", "0, 0.03"), ("on: [x-, x+], slip", "on: [x-, x+], symmetry"))
    assert pairs(cut, tmp_path)["block_sides_x_low"] == 11
    held = changed(cut, ("      gravity", "      supports: [{on: left, symmetry: true}]\n      gravity"))
    assert pairs(held, tmp_path)["block_sides_x_low"] == 9


def test_a_body_that_a_plane_of_symmetry_cuts_moves_as_without_contact(tmp_path):
    cut = changed(
        BLOCK,
        ("0.333, 0.05", "0, 0.4"),
        ("on: [x-, x+], slip", "on: [x-, x+], symmetry"),
        ("      gravity", "      supports: [{on: left, symmetry: true}]\n      gravity"),
        ("end: 0.8", "end: 0.1"),
    )
    found, alone = run(cut, tmp_path / "walls"), run(cut + "contact: none\n", tmp_path / "none")
    assert list(found) == list(alone)
    assert np.array_equal(found["centre.y"], alone["centre.y"])


OBSTACLE = """\
contact:
  obstacles: {ground: {mesh: {shape: rectangle, size: [3, 0.2], cells: [1, 1], origin: [-1, -0.2]}, on: top}}
  pairs: {ground: {slave: {body: block, on: bottom}, master: {obstacle: ground}}}
"""


def test_surfaces_with_an_obstacle_there_are_left_out(tmp_path):
    assert pairs(BLOCK + OBSTACLE, tmp_path) == ALL | {"block_floor_y_low": 10}
    whole = changed(OBSTACLE, ("on: bottom", "on: [bottom, left, right, top]"))
    assert "block_floor_y_low" not in pairs(BLOCK + whole, tmp_path)
    before = changed(OBSTACLE, ("[-1, -0.2]", "[-1, -0.1]"))
    assert pairs(BLOCK + before, tmp_path) == ALL


def test_a_patch_on_part_of_a_face(tmp_path):
    """The body meets that part alone: beside it the floor is open."""
    part = changed(
        BLOCK,
        ("top: {on: y+, outflow: true}", "top: {on: [y+, y-], outflow: true}"),
        ("on: y-, no_slip", "on: y-, where: WHERE, no_slip"),
    )
    assert pairs(changed(part, ("WHERE", "0.5 - x")), tmp_path) == ALL
    on = run(changed(part, ("WHERE", "0.95 - x"), ("end: 0.8", "end: 0.3")), tmp_path / "on")
    assert on["contact.block_floor_y_low.y"].max() > 1.0
    (tmp_path / "case.yaml").write_text(changed(part, ("WHERE", "0.25 - x")))
    case = load_case(tmp_path / "case.yaml")
    (floor,) = [one.wall for one in wall_pairs(case, {"block": read_body(case, "block")}) if one.wall.patch == "floor"]
    np.testing.assert_allclose(floor.rectangles, [[[-0.5, 0.0], [0.2, 0.0]]])


def test_walls_in_space(tmp_path):
    """Rectangles of the cells' faces; their normals point into the box."""
    text = changed(
        BLOCK,
        *SPACE.items(),
        ("outflow: true", "outflow: true, where: x - 0.45"),
        ("patches: {", "patches: {roof: {on: z+, slip: true}, "),
    )
    (tmp_path / "case.yaml").write_text(text)
    case = load_case(tmp_path / "case.yaml")
    walls = {one.name: one.wall for one in wall_pairs(case, {"block": read_body(case, "block")})}
    assert len(walls) == 6
    np.testing.assert_allclose(walls["block_roof_z_high"].rectangles, [[[-0.5, -0.4, 0.8], [0.4, 1.2, 0.8]]])
    for wall in walls.values():
        points, facets = wall.surface()
        corners = points[facets[0]]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        assert np.sign(normal[wall.axis]) == wall.inward
        assert np.count_nonzero(normal) == 1


@pytest.mark.slow
def test_two_processes(tmp_path):
    """The force when the floor has come in, to 1e-10."""
    (tmp_path / "case.yaml").write_text(changed(BLOCK, ("0.333, 0.05", "0.333, 0.02"), ("end: 0.8", "end: 0.16")))
    found = []
    for processes in (1, 2):
        done = fsci("run", tmp_path / "case.yaml", "-o", tmp_path / str(processes), processes=processes)
        assert done.returncode == 0, done.stdout
        assert done.stdout.count("contact block_floor_y_low") == 1
        found.append(read_history(tmp_path / str(processes) / "history.csv"))
    one, two = found
    assert one["contact.block_floor_y_low.y"].max() > 1.0
    for column in ("centre.y", "contact.block_floor_y_low.y"):
        np.testing.assert_allclose(two[column], one[column], rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("scheme", ["monolithic", "partitioned"])
def test_a_body_without_inertia(tmp_path, scheme):
    """A post that hangs from the roof is stretched down to the floor, within one step, and is held there."""
    post = changed(
        BLOCK,
        ("  dynamics: {rho_inf: 0, damping: {mass: 20}}\n", ""),
        ("size: [0.4, 0.2], cells: [4, 3]", "size: [0.2, 0.74], cells: [2, 6]"),
        ("[0.333, 0.05]", "[0.433, 0.06]"),
        ("      gravity", "      supports: [{on: top, displacement: [0, 0]}]\n      gravity"),
        ("gravity: [0, -10]", "body_force: [0, -20000 * (t > 0.05)]"),
        ("top: {on: y+, outflow", "top: {on: [x-, x+], outflow"),
        ("sides: {on: [x-, x+]", "sides: {on: y+"),
        ("scheme: backward_euler", "scheme: steady"),
        ("end: 0.8", "end: 0.12"),
        ("coupling: {}", f"coupling: {{scheme: {scheme}}}"),
    )
    post = post.replace(
        "output:", "  tip: {field: structure, body: block, quantity: displacement, at: [0.533, 0.06]}\noutput:"
    )
    found = run(post, tmp_path)
    assert found["tip.y"].min() == pytest.approx(-0.06, abs=1e-3)
    assert found["contact.block_floor_y_low.y"][-1] > 100.0
