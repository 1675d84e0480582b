"""The monolithic system by Krylov's methods: what the direct solver gives, and what happens when they stall."""

import numpy as np
import pytest
from coupling_setup import couple_one, post_in_flow
from mpi4py import MPI

from coupling.monolithic import Monolithic
from fsci import shapes
from solvers import newton
from solvers.algebra import linear
from solvers.fluid.grid.box import uniform
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.terms.boundary.patches import Patch
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.newton import Tolerance
from solvers.structure.body import Body, Support
from solvers.structure.dynamics import Dynamics
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import StVenantKirchhoff


def after_two_steps(method, element):
    coupled = post_in_flow(linear=method, element=element)
    coupled.initialise(0.0, 0.02)
    scheme = Monolithic(coupled, Tolerance(1e-10))
    infos = [scheme.step(0.02 * number, 0.02) for number in range(2)]
    return coupled, infos


@pytest.fixture(scope="module", params=["q1q1", "q2q1"])
def direct(request):
    coupled, _ = after_two_steps("direct", request.param)
    return request.param, coupled


def same_state(one, other):
    for a, b in ((one.flow.flow, other.flow.flow), (one.solid.structure.now.u, other.solid.structure.now.u)):
        assert np.abs(b).max() > 1e-4
        np.testing.assert_allclose(a, b, atol=1e-8 * np.abs(b).max())


@pytest.mark.parametrize("method", ["iterative", "ilu"])
def test_krylov_methods_give_what_the_direct_solver_gives(direct, method):
    element, exact = direct
    coupled, _ = after_two_steps(method, element)
    assert coupled.flow.iterative.sequence.position == 0
    assert coupled.flow.iterative.sequence.current != "direct"
    same_state(coupled, exact)


def test_incomplete_factors_of_the_solid_give_what_the_direct_solver_gives(direct, monkeypatch):
    element, exact = direct
    used, preconditioner = [], linear.solid_preconditioner

    def recorded(matrix):
        used.append(preconditioner(matrix))
        return used[-1]

    monkeypatch.setattr(linear, "SMALL_SOLID", 0)
    monkeypatch.setattr(linear, "solid_preconditioner", recorded)
    coupled, _ = after_two_steps("ilu", element)
    assert coupled.flow.iterative.sequence.position == 0
    assert {factors.getPC().getType() for factors in used} == {"ilu"}
    same_state(coupled, exact)


def test_a_method_that_stalls_is_followed_by_the_next(direct, monkeypatch):
    """The first one fails once: the run goes on with the next one, says so, and finds the same state."""
    element, exact = direct
    solver, made = linear.coupled_solver, []

    def stalls(*args, **options):
        made.append(options["fill"])
        if len(made) == 1:
            raise linear.LinearSolveFailed("the linear solver stalled")
        return solver(*args, **options)

    monkeypatch.setattr(linear, "coupled_solver", stalls)
    coupled, infos = after_two_steps("iterative", element)
    assert coupled.flow.iterative.sequence.position == 1
    following = {"q1q1": "multigrid with stronger smoothers", "q2q1": "the direct solver"}[element]
    assert infos[0].notes[0].startswith(f"the linear solver stalled with multigrid: {following} from here on")
    assert made[1:2] == ([False] if element == "q1q1" else [])
    same_state(coupled, exact)


@pytest.mark.parametrize("method", ["iterative", "ilu"])
def test_early_systems_are_solved_inexactly(direct, method, monkeypatch):
    """As many Newton steps as with exact solutions, at most four fifths of the linear iterations, the same state."""
    element, exact = direct
    counts = []
    for enough in (newton.ENOUGH, 0.0):
        monkeypatch.setattr(newton, "ENOUGH", enough)
        coupled, infos = after_two_steps(method, element)
        same_state(coupled, exact)
        counts.append([sum(i.iterations for i in infos), sum(i.numbers["coupling.linear"] for i in infos)])
    inexact, whole = counts
    assert inexact[0] == whole[0], counts
    assert inexact[1] < 0.8 * whole[1]


def post_in_closed_box(method, element):
    """A soft post on the bottom of a closed box, whose lid begins to move: the post determines the pressure level."""
    mesh = shapes.rectangle([0.23, 0.41], [3, 5], order=1, cell="quad")
    mesh.points[:, 0] += 0.62
    material = StVenantKirchhoff(*lame(100.0, 0.3), 2.0)
    post = Body("post", mesh, material, supports=[Support("bottom")], comm=MPI.COMM_SELF)
    lid = (lambda x, t: 16.0 * (x[0] * (2.0 - x[0])) ** 2 * min(t / 0.1, 1.0), 0.0)
    walls = [Patch("lid", ("y+",), "velocity", lid), Patch("walls", ("x-", "x+", "y-"), "no_slip")]
    coupled = couple_one(
        post, Dynamics(GeneralisedAlpha.from_rho_inf(0.8)), uniform([0.0, 0.0], [2.0, 1.0], [20, 10]),
        FlowSettings(1.0, 0.05, scheme="bdf2", element=element), walls,
        wetted=("left", "right", "top"), linear=method,
    )  # fmt: skip
    coupled.initialise(0.0, 0.02)
    scheme = Monolithic(coupled, Tolerance(1e-10))
    return coupled, [scheme.step(0.02 * number, 0.02) for number in range(2)]


def linear_iterations(infos):
    return sum(info.numbers["coupling.linear"] for info in infos)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_a_pressure_level_that_a_body_determines_takes_no_iterations(element):
    """A closed box takes as many as one with an outlet; without its level multigrid stalled after 600."""
    exact, _ = post_in_closed_box("direct", element)
    coupled, infos = post_in_closed_box("iterative", element)
    flow = coupled.flow.iterative
    assert flow.sequence.current == "multigrid"
    same_state(coupled, exact)
    assert linear_iterations(infos) <= linear_iterations(after_two_steps("iterative", element)[1])
    matrix, (level,) = flow.linearise(picard=False), flow.free_levels().T
    x, rows = matrix.createVecs()
    x.array[:] = level
    for product in (matrix.mult, matrix.multTranspose):
        product(x, rows)
        assert np.abs(rows.array[~flow.held]).max() < 1e-14 * matrix.norm()


def test_an_increment_can_be_taken_back():
    """The line search takes back what Newton's method added: all of it leaves the state before."""
    coupled = post_in_flow()
    coupled.initialise(0.0, 0.02)
    scheme = Monolithic(coupled)
    coupled.begin_step(0.0, 0.02)
    scheme.follow()
    scheme.residual()
    before = coupled.flow.flow.copy(), coupled.solid.structure.now.u.copy()
    scheme.advance()
    moved = coupled.flow.flow.copy(), coupled.solid.structure.now.u.copy()
    scheme.retreat(np.full(len(scheme.forces()), 0.25))
    for start, end, now in zip(before, moved, (coupled.flow.flow, coupled.solid.structure.now.u), strict=True):
        assert np.abs(end - start).max() > 1e-6
        np.testing.assert_allclose(now, start + 0.75 * (end - start), atol=1e-12)
