"""The active set, and Newton with it: quadratic convergence, and a result that does not depend on c_n."""

import numpy as np
import pytest
from contact_setup import make_body, make_contact, solve_step

from fsci import shapes
from solvers.contact.active_set import ActiveSet
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.law.law import OPEN, SLIP, STICK, Point
from solvers.contact.surface import Surface
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Support

ONE = np.ones(3)
ALL = np.ones(3, dtype=bool)
C_N = (1e-2, 1e-1, 1.0, 1e1, 1e2)


def update(active_set, pressure, gap, covered=ALL, c=ONE):
    """Frictionless multipliers with these pressures on a surface that looks up; D is 1, so that gaps are mean gaps."""
    size = len(pressure)
    up = np.tile([0.0, 1.0], (size, 1))
    z, one = np.array(pressure, dtype=float)[:, None] * up, np.ones(size)
    gap = np.array(gap, dtype=float)
    point = Point(
        z=z,
        normals=up,
        D=one,
        gap=gap,
        covered=covered,
        stiffness=one,
        stuck=np.zeros(size, dtype=bool),
        free=np.zeros(size, dtype=bool),
        c_n=c,
        c_t=one,
        touching=0.0 * one,
        slip=0.0 * z,
        slip_defined=covered,
        shares=np.zeros((1, 1)),
    )
    active_set.choose(Frictionless().status(point))
    return active_set.active.tolist()


def test_pressed_or_overlapping_nodes_are_active():
    active_set = ActiveSet(3)
    assert update(active_set, [1, 0, -1], [0, -1, 0]) == [True, True, False]
    assert update(active_set, [1, 1, -1], [2, 0.5, -2]) == [False, True, True]


def test_c_weighs_gap_against_pressure():
    assert update(ActiveSet(3), [1, 1, 1], [0.05, 0.11, 0.2], c=10 * ONE) == [True, False, False]
    assert update(ActiveSet(3), [1, 1, 1], [0.5, 0.5, 0.5], c=np.array([1.0, 1.9, 2.1])) == [True, True, False]


def test_nodes_that_see_no_master_are_never_active():
    assert update(ActiveSet(3), [1, 1, 1], [-1, -1, -1], np.array([True, False, True])) == [True, False, True]


def test_changes_are_counted_within_a_step():
    active_set = ActiveSet(3)
    active_set.begin_step()
    for pressure, changed, changes in (([1, 0, 0], True, 1), ([1, 0, 0], False, 1), ([1, 1, 0], True, 2)):
        update(active_set, pressure, [0, 0, 0])
        assert (active_set.changed, active_set.changes) == (changed, changes)
    active_set.begin_step()
    assert (active_set.changed, active_set.changes) == (False, 0)
    assert active_set.active.tolist() == [True, True, False]
    update(active_set, [0, 0, 0], [1, 1, 1])
    assert active_set.changed
    assert not active_set.active.any()


def flip(active_set, times):
    for i in range(times):
        update(active_set, [1, i % 2, i % 2], [0, 0, 0])


def test_going_in_circles_is_reported():
    active_set = ActiveSet(3)
    active_set.begin_step()
    flip(active_set, 1)
    assert active_set.cycle() == ""
    flip(active_set, 100)
    assert active_set.cycle() == "the active set cycles: 2 nodes change their status again and again"


def test_a_component_cycles_whatever_others_do():
    """Its set comes back while that of another one grows. A whole set that is new is settled where only it changed."""
    active_set = ActiveSet(6)
    active_set.take_components(np.array([0, 0, 3, 3, 3, 3]))
    active_set.begin_step()
    for grown, flips in ((0, 1), (1, 0), (2, 1)):
        active_set.choose(np.array([1, flips, *(np.arange(4) < grown)], dtype=np.int8))
    assert active_set.cycle() == "the active set cycles: 1 node changes its status again and again"
    assert active_set.returned.tolist() == [False, True, False, False, False, False]
    assert not active_set.settled
    active_set.choose(np.array([1, 0, 1, 1, 0, 0], dtype=np.int8))
    assert active_set.settled


def test_slips_reverse_again_whatever_other_components_do():
    active_set = ActiveSet(2)
    active_set.take_components(np.array([0, 1]))
    active_set.begin_step()
    active_set.choose(np.full(2, STICK, dtype=np.int8))
    for other in (STICK, SLIP):
        active_set.choose(np.array([SLIP, other], dtype=np.int8))
        active_set.begin_increment(np.array([True, False]))
    assert active_set.stuck.tolist() == [False, True]


@pytest.mark.parametrize(("second", "wedges"), [(STICK, True), (OPEN, False)])
def test_nodes_that_stick_and_slip_in_turn(second, wedges):
    """Nodes that open in turn are no wedge."""
    active_set = ActiveSet(2)
    active_set.begin_step()
    for status in ([SLIP, STICK], [second, STICK]) * 2:
        active_set.choose(np.array(status, dtype=np.int8))
    cycles = "the active set cycles: 1 node changes its status again and again"
    words = "; it sticks and slips in turn: with this much friction an edge may wedge, and no forces balance; take less"
    assert active_set.cycle() == cycles + words * wedges
    active_set.begin_step()
    active_set.choose(np.array([OPEN, STICK], dtype=np.int8))
    assert active_set.cycle() == ""


def test_nodes_that_reverse_again_in_the_same_set_may_stick():
    """Until a new solve begins; an evaluation without an increment, as of a line search, is no second reversal."""
    active_set, reversing = ActiveSet(2), np.array([True, False])
    slips = np.full(2, SLIP, dtype=np.int8)
    active_set.begin_step()
    active_set.choose(np.full(2, STICK, dtype=np.int8))
    for again in (False, True):
        active_set.choose(slips)
        active_set.choose(slips)
        assert active_set.stuck.all()
        active_set.begin_increment(reversing)
        assert active_set.stuck.any() == (not again)
    active_set.choose(np.full(2, STICK, dtype=np.int8))
    assert not active_set.stuck.any()
    active_set.begin_solve()
    active_set.choose(np.full(2, STICK, dtype=np.int8))
    assert active_set.stuck.all()


def test_a_new_step_forgets_the_circles():
    active_set = ActiveSet(3)
    flip(active_set, 100)
    active_set.begin_step()
    assert active_set.cycle() == ""


def test_growing_is_no_circle():
    active_set = ActiveSet(100)
    active_set.begin_step()
    for n in range(100):
        active_set.choose((np.arange(100) <= n).astype(np.int8))
    assert active_set.changes == 100
    assert active_set.cycle() == ""


# ------------------------------------------------------------------------------------------ Newton with the active set

SHAPES = {
    "ring": lambda: shapes.ring(0.5, 1, [32, 3]),
    "ring, second order": lambda: shapes.ring(0.5, 1, [24, 2], order=2, cell="tri"),
    "sphere": lambda: shapes.hollow_sphere(0.5, 1, [6, 2]),
    "sphere, second order": lambda: shapes.hollow_sphere(0.5, 1, [4, 1], order=2, cell="tet"),
}


def lowered(dim, depth):
    still = (lambda x, t: np.zeros(x.shape[1]),) * (dim - 1)
    return Support("inner", (*still, lambda x, t: np.full(x.shape[1], -depth * t)))


def plane(dim, height):
    """A rigid plane that looks up."""
    if dim == 2:
        return Surface("plane", np.array([[3.0, height], [-3.0, height]]), np.array([[0, 1]]), "line", None)
    points = np.array([[-3.0, -3, height], [3, -3, height], [3, 3, height], [-3, 3, height]])
    return Surface("plane", points, np.array([[0, 1, 2, 3]]), "quad", None)


def press(mesh, target, *, depth=0.1, c_n=1.0):
    """From a gap of 0.02 to an indentation of 0.08 in one step; `target` is a rigid surface or a block."""
    settings = SolverSettings(Tolerance(residual=1e-13), linear="direct")
    bodies, master = [make_body("ball", mesh, supports=[lowered(mesh.points.shape[1], depth)])], target
    if not isinstance(target, Surface):
        still = (lambda x, t: np.zeros(x.shape[1]),) * mesh.points.shape[1]
        bodies.append(make_body("block", target, supports=[Support("bottom", still)]))
        master = ("block", "top")
    structure, contact = make_contact(bodies, [(("ball", "outer"), master)], settings=settings, c_n=c_n)
    info = solve_step(structure)
    return structure, contact, info


def assert_quadratic(residuals):
    """r'/r^2 does not grow over the last residuals that rounding does not blur; linear convergence by q has 1/q."""
    *_, first, second, third = (r for r in residuals[1:] if r > 1e-13 * max(residuals))
    growth = (third / second**2) / (second / first**2)
    assert third < 1e-3 * second
    assert growth < 10, f"{growth:.2g} of {residuals}"


@pytest.mark.parametrize("name", SHAPES)
def test_quadratic_convergence_on_a_rigid_plane(name):
    mesh = SHAPES[name]()
    _, contact, info = press(mesh, plane(mesh.points.shape[1], -1.02))
    assert contact.active_set.active.sum() >= 3
    assert info.iterations <= 7, info.residuals
    assert_quadratic(info.residuals)


@pytest.mark.parametrize("cell", ["hex", "tet"])
def test_quadratic_convergence_on_a_block(cell):
    block = shapes.box([2, 2, 1], [5, 5, 2], [-1, -1, -2.02], cell=cell)
    _, contact, info = press(SHAPES["sphere"](), block, depth=0.2)
    assert contact.active_set.active.sum() >= 3
    assert info.iterations <= 7, info.residuals
    assert_quadratic(info.residuals)


@pytest.mark.parametrize("name", ["ring", "sphere, second order"])
def test_result_does_not_depend_on_c_n(name):
    mesh = SHAPES[name]()
    found = {c_n: press(mesh, plane(mesh.points.shape[1], -1.02), c_n=c_n) for c_n in C_N}
    counts = {c_n: info.iterations for c_n, (_, _, info) in found.items()}
    (reference, contact, _) = found[1.0]
    for c_n, (structure, other, _) in found.items():
        error = np.abs(structure.now.u - reference.now.u).max() / np.abs(reference.now.u).max()
        assert error < 1e-9, f"c_n = {c_n}: {error:.1e}; Newton steps {counts}"
        assert np.abs(other.z - contact.z).max() < 1e-9 * np.abs(contact.z).max(), f"Newton steps {counts}"
    assert max(counts.values()) <= 8, f"Newton steps {counts}"


def test_sets_of_other_loads_are_no_cycle():
    """A partitioned step solves for the contact of many loads, which may choose two sets by turns."""
    active_set = ActiveSet(1)
    active_set.begin_step()
    for _ in range(20):
        for pressure in (1, -1):
            active_set.begin_solve()
            assert update(active_set, [pressure], [0], ALL[:1], ONE[:1]) == [pressure > 0]
            assert active_set.cycle() == ""
    assert active_set.changes == 40


def test_a_residual_that_grows_counts_in_contact_only():
    """Twice, in a body that contact acts on; one beside it that Newton finds hard needs no line search."""
    structure, _, _ = press(SHAPES["ring"](), plane(2, -1.02))
    assert structure.pieces.count == 1
    here, elsewhere = np.array([True]), np.array([False])
    assert structure.astray([here, elsewhere, here])
    assert not structure.astray([here, elsewhere, elsewhere])
    assert not structure.astray([])


def test_loads_between_iterates_forget_no_set():
    """A monolithic iteration sets a load in each iterate of its one solve; `solve` of the structure begins anew."""
    structure, contact, _ = press(SHAPES["ring"](), plane(2, -1.02))
    contact.active_set.alternating = 1  # as after a return
    contact.active_set.returned[0] = True
    structure.load(np.zeros(structure.layout.size))
    assert structure.cycle().startswith("the active set cycles: 1 node ")
    assert structure.astray([])
    structure.solve()
    assert not structure.astray([])
    assert structure.cycle() == ""
