"""Pressure near rims of slave surfaces: a dragged block makes no work, whichever side is the slave."""

import numpy as np
import pytest
from contact_cases import run
from contact_setup import make_body, make_contact
from mortar_surfaces import TYPES_2D, TYPES_3D, all_pairs, patch

from fsci import shapes
from solvers.contact.rims import FACETS_FROM_RIM, SHARES, integrals_of_nodes, rims_near
from solvers.kernels import mortar, nodal_normals
from solvers.mesh.cell_types import CELL_TYPES
from solvers.structure.body import Symmetry

#: A block is pressed into a base as soft as itself and dragged along it; from t = 0.5 on nothing sticks.
SLEDGE = """\
title: sledge
time: {{step: 0.05, end: 1}}
structure:
  bodies:
    base:
      mesh: {{shape: rectangle, size: [2.6, 1], cells: [{0}, {1}]}}
      material: {{law: neo_hooke, E: 1000, nu: 0.3}}
      supports: [{{on: bottom, displacement: [0, 0]}}]
    block:
      mesh: {{shape: rectangle, size: [0.9, 0.5], cells: [{2}, {3}], origin: [0.5, 1]}}
      material: {{law: neo_hooke, E: 1000, nu: 0.3}}
      supports: [{{on: top, displacement: ["0.4*max(t - 0.25, 0)", "-0.16*min(t, 0.25)"]}}]
contact:
  pairs: {{p: {{slave: {4}, master: {5}, friction: {{coefficient: 0.25}}}}}}
probes:
  force: {{body: block, quantity: reaction, on: top}}
  energy: {{quantity: energy}}
solver: {{newton: {{residual: 1.0e-10}}, linear: {{method: direct}}}}
output: {{fields_every: 0, checkpoint_every: 0}}
"""


def dragged_sledge(fine, slave, folder):
    """(mean force [N], friction and stored energy less the work done, over that work)."""
    sides = ["{body: block, on: bottom}", "{body: base, on: top}"]
    cells = [20 * fine, 5 * fine, 6 * fine, 4 * fine]
    text = SLEDGE.format(*cells, *(sides if slave == "block" else sides[::-1]))
    history = run(text, folder, ("time.step", str(0.05 / fine)))
    drag = history["time"] > 0.5 - 1e-9
    force, way = history["force.x"][drag], 0.4 * (history["time"][drag] - 0.5)
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(way))
    energy = history["contact.friction"][drag] + history["energy.internal"][drag]
    return work / way[-1], (energy[-1] - energy[0]) / work - 1.0


def test_a_dragged_block_makes_no_work(tmp_path):
    assert abs(dragged_sledge(1, "block", tmp_path)[1]) < 1e-3


@pytest.mark.slow(seconds=60)
def test_the_force_does_not_depend_on_the_slave(tmp_path):
    """Balance to 0.1 % on three meshes with the block as the slave; the difference falls at least in first order."""
    differences = []
    for fine in (1, 2, 4):
        (force, balance), (other, _) = (
            dragged_sledge(fine, slave, tmp_path / f"{slave}{fine}") for slave in ("block", "base")
        )
        assert abs(balance) < 1e-3
        differences.append(abs(force / other - 1.0))
    assert differences[0] < 3e-3
    assert differences[2] < differences[0] / 4.0


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("beyond", [0.0, 0.23], ids=["covered", "partly covered"])
def test_directions_have_exact_derivatives(dim, beyond):
    """A rough block on a rough one, inside its edges or beyond them."""
    rng = np.random.default_rng(60)
    shape = shapes.rectangle if dim == 2 else shapes.box
    lower = shape([1.0] * dim, [4] * dim)
    upper = shape([0.5] * dim, [3] * dim, [0.23 + 1.3 * beyond] + [0.27] * (dim - 2) + [0.95])
    bodies = [make_body("lower", lower), make_body("upper", upper)]
    structure, contact = make_contact(bodies, [(("upper", "bottom"), ("lower", "top"))])
    structure.initialise(0.0, 1.0)
    size = contact.nodes.points.shape
    u, change = (rng.uniform(-0.03, 0.03, size) for _ in range(2))

    own = contact.multipliers.patches[0]
    contact.evaluate(u, 0.0)
    averaged = own.normals((contact.nodes.points + u)[own.nodes])[0]
    pressed_first = contact.terms.normals[own.multipliers][contact.active_set.active[own.multipliers]]
    np.testing.assert_allclose(pressed_first, averaged[contact.active_set.active[own.multipliers]], atol=1e-12)
    contact.begin_step()

    def terms(at):
        contact.evaluate(at, 0.0)
        return contact.terms

    step, now = 1e-6, terms(u)
    near = now.D > 0.02 * contact.multipliers.areas
    slope = (now.dnormals @ change.ravel()).reshape(size)
    expected = (terms(u + step * change).normals - terms(u - step * change).normals) / (2 * step)
    np.testing.assert_allclose(slope[near], expected[near], atol=1e-5 * np.abs(expected[near]).max())
    assert np.linalg.norm(now.normals[own.multipliers] - averaged, axis=1).max() > 0.01


def test_a_node_between_folded_facets_has_no_direction():
    """An iterate folds a facet onto the next one: normals cancel between them, and the rims are not covered."""
    bodies = [make_body("lower", shapes.rectangle([1.0, 1.0], [2, 2]))]
    bodies.append(make_body("upper", shapes.rectangle([0.75, 0.5], [3, 2], [0.125, 0.9375])))
    structure, contact = make_contact(bodies, [(("upper", "bottom"), ("lower", "top"))])
    structure.initialise(0.0, 1.0)
    u = np.zeros(contact.nodes.points.shape)
    contact.evaluate(u, 0.0)
    contact.begin_step()
    own = contact.multipliers.patches[0]
    nodes = own.nodes
    first, left, right, last = nodes[np.argsort(contact.nodes.points[nodes, 0])]
    u[first] = contact.nodes.points[right] - contact.nodes.points[first]
    u[last] = -0.25, 0.25  # upright, with nothing opposite
    with np.errstate(divide="raise", invalid="raise"):
        contact.evaluate(u, 0.0)
    (folded,) = own.multipliers[nodes == left]
    assert contact.terms.D[folded] > 0.0
    assert not contact.terms.normals[folded].any()
    assert np.isfinite(contact.terms.dnormals.data).all()


def test_a_plane_of_symmetry_cuts_no_rim():
    """Half of a block: at its middle only the other end of the surface is a rim."""
    held = [Symmetry("left")]
    bodies = [
        make_body("lower", shapes.rectangle([3.0, 1.0], [9, 3]), supports=held),
        make_body("upper", shapes.rectangle([2.0, 0.5], [8, 2], [0.0, 1.0]), supports=held),
    ]
    _, contact = make_contact(bodies, [(("upper", "bottom"), ("lower", "top"))])
    patch_of_slave = contact.multipliers.patches[0]
    places = contact.nodes.points[patch_of_slave.nodes, 0]
    assert np.array_equal(np.diff(rims_near(patch_of_slave).indptr) > 0, places > 2.0 - 0.25 * FACETS_FROM_RIM - 1e-9)


@pytest.mark.parametrize("facet_type", [*TYPES_2D, *TYPES_3D])
def test_integrals_of_nodes(facet_type):
    """Those of the kernel where everything is covered."""
    xs, fs = patch(facet_type, 2)
    xm, fm = patch(facet_type, 2, turned=True, size=1.5)
    pairs, normals = all_pairs(fs, fm), nodal_normals(xs, fs, facet_type)[0]
    covered = mortar(xs, fs, facet_type, xm, fm, facet_type, normals, pairs).D
    name = next(name for name in SHARES if CELL_TYPES[name].kernel == facet_type)
    np.testing.assert_allclose(integrals_of_nodes(xs, fs, name), covered, atol=1e-12)


def test_much_friction(tmp_path):
    """A step whose active set cycles is taken again with normals for directions: the block goes through."""
    text = SLEDGE.format(46, 12, 14, 10, "{body: block, on: bottom}", "{body: base, on: top}")
    text = text.replace("0.16*min(t, 0.25)", "0.2*min(t, 0.25)").replace("coefficient: 0.25", "coefficient: 0.65")
    history = run(text, tmp_path)
    assert history["time"][-1] == 1.0


#: A block is pressed into a soft base by a fifth of its height; two cells of the base are in front of its rim.
PRESSED = """\
title: pressed
time: {{step: {0}, end: 1}}
structure:
  bodies:
    base:
      mesh: {{shape: rectangle, size: [2, 1], cells: [10, 4]}}
      material: {{law: neo_hooke, E: 1000, nu: 0.3}}
      supports: [{{on: bottom, displacement: [0, 0]}}, {{on: left, symmetry: true}}]
    block:
      mesh: {{shape: rectangle, size: [1.1, 1], cells: [4, 2], origin: [0, 1]}}
      material: {{law: neo_hooke, E: 1.0e+7, nu: 0.3}}
      supports: [{{on: top, displacement: [0, "-0.2*t"]}}, {{on: left, symmetry: true}}]
contact: {{pairs: {{p: {{slave: {{body: block, on: bottom}}, master: {{body: base, on: top}}}}}}}}
probes: {{force: {{body: base, quantity: reaction, on: bottom}}}}
solver: {{newton: {{residual: 1.0e-11}}, linear: {{method: direct}}}}
output: {{fields_every: 0, checkpoint_every: 0}}
"""


def test_the_first_step_of_a_contact_has_the_directions_of_all_others(tmp_path):
    """Elastic and without friction: the force does not depend on the steps."""
    one, two, eight = (run(PRESSED.format(1.0 / n), tmp_path / str(n))["force.y"][-1] for n in (1, 2, 8))
    np.testing.assert_allclose([one, two], eight, rtol=1e-9)


def block_above_base():
    """(contact between them, status of its nodes if all slaves are in contact)"""
    bodies = [
        make_body("base", shapes.rectangle([3, 1], [6, 2])),
        make_body("block", shapes.rectangle([1, 1], [2, 2], [1, 1])),
    ]
    structure, contact = make_contact(bodies, [(("block", "bottom"), ("base", "top"))])
    structure.initialise(0.0, 1.0)
    return contact, (contact.multipliers.areas > 0.0).astype(np.int8)


def test_a_surface_whose_set_cycled_twice_keeps_its_normals_until_it_parts():
    """In the step that is taken again, in later ones and in resumed runs."""
    contact, pressed = block_above_base()

    def failures(contact, status):
        contact.active_set.status[:] = status
        contact.begin_step()
        return contact.save()["failures"]

    def fail():
        state = contact.save()
        for status in (pressed, 0 * pressed, pressed):
            contact.active_set.choose(status)
        contact.restore(state)
        return failures(contact, pressed)

    assert not failures(contact, pressed).any()
    np.testing.assert_array_equal(fail(), pressed)
    np.testing.assert_array_equal(fail(), pressed)  # it had its own normals
    contact.end_step(1.0)
    failures(contact, pressed)
    np.testing.assert_array_equal(fail(), 2 * pressed)
    contact.end_step(1.0)
    state = contact.save()
    other, _ = block_above_base()
    other.restore(state)
    for resumed in (contact, other):
        np.testing.assert_array_equal(failures(resumed, pressed), 2 * pressed)
        assert not failures(resumed, 0 * pressed).any()
        assert not failures(resumed, pressed).any()


@pytest.mark.slow(seconds=60)
def test_a_stiff_block_is_dragged_over_fine_cells(tmp_path):
    """Slopes of facets at its rim lift the force by a fifth and lower it, until no equilibrium follows."""
    forces, iterations = [], []
    for sides in (
        ["{body: block, on: bottom}", "{body: base, on: top}"],
        ["{body: base, on: top}", "{body: block, on: bottom}"],
    ):
        text = SLEDGE.format(46, 12, 14, 10, *sides)
        settings = {
            "structure.bodies.base.mesh.size": "[3, 1]",
            "structure.bodies.block.mesh.size": "[1, 0.6]",
            "structure.bodies.block.mesh.origin": "[0.6, 1]",
            "structure.bodies.block.material.E": "1.0e+7",
            "structure.bodies.block.supports": '[{on: top, displacement: ["0.4*max(t - 0.5, 0)", "-0.1*min(t, 0.5)"]}]',
            "contact.pairs.p.friction.coefficient": "0.3",
            "time.end": "1.25",
        }
        history = run(text, tmp_path / sides[0][7:11], *settings.items())
        assert history["time"][-1] == pytest.approx(1.25)
        slides = history["time"] > 0.8
        forces.append(np.abs(history["contact.p.x"][slides] / history["contact.p.y"][slides]))
        iterations.append(history["iterations"].sum())
    assert max(iterations) <= 1.5 * min(iterations)
    assert [found.max() for found in forces] == pytest.approx([0.3, 0.3], rel=0.02)
