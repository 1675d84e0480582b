"""One slave on several masters with different friction."""

from dataclasses import replace

import numpy as np
import pytest
from contact_setup import brick, make_body, make_contact, solve_step
from programs import fsci
from structure_setup import constant
from test_contact_friction import LOOSER

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from solvers.contact.law.by_pair import ByPair
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.law.law import SLIP
from solvers.contact.law.tied import Tied
from solvers.contact.law.tresca import Tresca
from solvers.contact.surface import Surface
from solvers.structure.body import Support
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import StVenantKirchhoff

ZERO = constant(0)
LAWS = {
    "coulomb": (Coulomb(0.1), Coulomb(0.5)),
    "none": (Frictionless(), Coulomb(0.4)),
    "both laws": (Tresca(4.0), Coulomb(0.2)),
    "bounds": (Tresca(4.0), Tresca(1.0)),
}


def floor(dim, left, right):
    """A rigid plane y = 0, in space z = 0, between two values of x."""
    if dim == 2:
        return Surface(f"floor{left}", np.array([[right, 0.0], [left, 0.0]]), np.array([[0, 1]]), "line", None)
    points = np.array([[left, -3.0, 0.0], [right, -3.0, 0.0], [right, 3.0, 0.0], [left, 3.0, 0.0]])
    return Surface(f"floor{left}", points, np.array([[0, 1, 2, 3]]), "quad", None)


def dragged(cell_type, laws, split, *, order=1):
    """A thin plate of nu = 0, pressed onto two floors that meet at x = split and then moved along x by its top."""
    dim = 2 if cell_type == "quad" else 3
    material = StVenantKirchhoff(*lame(1000.0, 0.0), 1.0)

    def along(x, t):
        return np.full(x.shape[1], 0.02 * max(t - 1.0, 0.0))

    top = Support("top", (along, *[ZERO] * (dim - 2), lambda x, t: np.full(x.shape[1], -0.0004 * min(t, 1.0))))
    body = make_body(
        "block", brick(cell_type, 3, [*[1.0] * (dim - 1), 0.02], [0.0] * dim, 0.0), material, supports=[top]
    )
    floors = floor(dim, -3.0, split), floor(dim, split, 4.0)
    pairs = [(("block", "bottom"), place, law) for place, law in zip(floors, laws, strict=True)]
    return make_contact([body], pairs[::order], settings=LOOSER)


@pytest.mark.parametrize(
    ("cell_type", "split"),
    [
        *(("quad", split) for split in (1 / 3, 0.431, 0.95)),
        ("hexahedron", 0.431),
        *(pytest.param("hexahedron", split, marks=pytest.mark.slow) for split in (1 / 3, 0.95)),
    ],
)
@pytest.mark.parametrize("name", LAWS)
def test_a_block_on_two_floors(name, split, cell_type):
    """The plate is thin, so that the pressure is even: each floor resists by its law times its area.

    The areas are those at the beginning of the step. The order of the pairs does not matter.
    """
    found = []
    for order in (1, -1):
        structure, contact = dragged(cell_type, LAWS[name], split, order=order)
        structure.initialise(0.0, 1.0)
        newton = [solve_step(structure, float(k), first=False).iterations for k in range(8)]
        assert max(newton) <= 10, newton
        structure.begin_step(8.0, 1.0)
        begin = contact.x_old[contact.interface.nodes_of(contact.pairs[0].slave), 0].min()
        structure.solve()
        assert (contact.active_set.status[contact.active_set.active] == SLIP).all()
        normal = sum(contact.resultant(pair) for pair in (0, 1))
        found.append(-normal[0])
        pressure = normal[-1]  # the area is 1
        areas = split - begin, 1.0 - split + begin
        expected = sum(bound(law, pressure) * area for law, area in zip(LAWS[name], areas, strict=True))
        assert found[-1] == pytest.approx(expected, rel=6e-3)
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def bound(law, pressure):
    if isinstance(law, Tresca):
        return law.bound
    return law.mu * pressure if isinstance(law, Coulomb) else 0.0


@pytest.mark.parametrize("name", ["coulomb", "none", "both laws"])
def test_slopes_of_the_bound(name):
    """By z, by the normal and by the gap, as differences of the bound give them."""
    structure, contact = dragged("hexahedron", LAWS[name], 0.431)
    structure.initialise(0.0, 1.0)
    for k in range(3):
        solve_step(structure, float(k), first=False)
    structure.begin_step(3.0, 1.0)
    structure.residual()
    law = contact.interface.laws[0][0]
    assert isinstance(law, ByPair)
    point = contact.point(np.flatnonzero(contact.active_set.active))
    assert ((point.shares > 0.1).sum(axis=1) == 2).any()
    rng = np.random.default_rng(2)
    dz, dn, dg = rng.normal(size=point.z.shape), rng.normal(size=point.z.shape), rng.normal(size=len(point.z))
    by_z, by_normal, by_gap = law.radius_slopes(point)
    step = 1e-6

    def difference(**change):
        ends = [
            replace(point, **{key: getattr(point, key) + s * d for key, d in change.items()}) for s in (step, -step)
        ]
        return (law.radius(ends[0]) - law.radius(ends[1])) / (2 * step)

    scale = np.abs(by_z).max()
    assert difference(z=dz) == pytest.approx(np.einsum("nd,nd->n", by_z, dz), abs=1e-6 * scale)
    assert difference(normals=dn) == pytest.approx(
        np.einsum("nd,nd->n", by_normal, dn), abs=1e-6 * np.abs(by_normal).max()
    )
    assert difference(gap=dg) == pytest.approx(by_gap * dg, abs=1e-6 * np.abs(by_gap).max())


def test_equal_laws_are_one_law():
    structure, contact = dragged("quad", (Coulomb(0.3), Coulomb(0.3)), 0.431)
    assert contact.interface.laws[0][0] == Coulomb(0.3)
    assert structure is not None


def test_a_tie_and_friction_have_no_mean():
    with pytest.raises(ValueError, match="have laws of which there is no mean"):
        dragged("quad", (Coulomb(0.3), Tied()), 0.431)


#: A soft block on two floors of different friction, the second pair found: pressed down, then pulled along.
CASE = """\
title: a block on ice and stone
time: {step: 0.25, end: 2}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 0.5], cells: [5, 3]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: top, displacement: ["0.04*max(t-1, 0)", "-0.01*min(t, 1)"]}]
    stone:
      mesh: {shape: rectangle, size: [0.8, 0.3], cells: [4, 1], origin: [0.5, -0.3]}
      material: {law: neo_hooke, E: 1.0e+6, nu: 0.3}
      supports: [{on: bottom, displacement: [0, 0]}]
    ice:
      mesh: {shape: rectangle, size: [0.8, 0.3], cells: [4, 1], order: 1, origin: [-0.3, -0.3]}
      material: {law: neo_hooke, E: 1.0e+6, nu: 0.3}
      supports: [{on: bottom, displacement: [0, 0]}]
contact:
  bodies: [block, ice, stone]
  pairs:
    rough: {slave: {body: block, on: bottom}, master: {body: stone, on: top}, friction: {coefficient: 0.4}}
probes:
  on_ice: {quantity: pressure, pair: block_bottom_ice_top}
"""


@pytest.mark.slow
def test_named_and_found_pairs_on_several_processes_and_resumed(tmp_path):
    (tmp_path / "case.yaml").write_text(CASE)
    case = load_case(tmp_path / "case.yaml")
    assert run_case(case, tmp_path / "one") == FINISHED
    one = read_history(tmp_path / "one" / "history.csv")
    columns = [name for name in one if name.startswith("contact.") and name.endswith((".x", ".y"))]
    ice, stone = (next(c[:-2] for c in columns if word in c) for word in ("ice", "rough"))
    assert abs(one[f"{stone}.x"][-1]) == pytest.approx(0.4 * abs(one[f"{stone}.y"][-1]), rel=0.05)
    assert abs(one[f"{ice}.x"][-1]) < 0.05 * abs(one[f"{ice}.y"][-1])
    done = fsci("run", tmp_path / "case.yaml", "-o", tmp_path / "two", processes=2)
    assert done.returncode == FINISHED, done.stdout + done.stderr
    two = read_history(tmp_path / "two" / "history.csv")
    (tmp_path / "case.yaml").write_text(CASE.replace("end: 2", "end: 1.5"))
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "part") == FINISHED
    written = tmp_path / "part" / "case.yaml"
    written.write_text(written.read_text().replace("end: 1.5", "end: 2"))
    assert fsci("resume", tmp_path / "part").returncode == FINISHED
    part = read_history(tmp_path / "part" / "history.csv")
    for name in columns:
        assert np.abs(two[name] - one[name]).max() <= 1e-8 * np.abs(one[name]).max(), name
        assert np.array_equal(part[name], one[name]), name


def test_ties_of_one_slave_are_all_or_none(tmp_path):
    pair = "    glue: {slave: {body: block, on: bottom}, master: {body: ice, on: top}, tied: true}\nprobes:\n"
    (tmp_path / "case.yaml").write_text(CASE.replace("probes:\n", pair))
    with pytest.raises(CaseError, match="pair 'rough' has the same slave: both need the same 'tied'"):
        load_case(tmp_path / "case.yaml")
