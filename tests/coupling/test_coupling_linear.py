"""The monolithic system by Krylov's methods: what the direct solver gives, and what happens when they stall."""

import numpy as np
import pytest
from coupling_setup import post_in_flow

from coupling.monolithic import Monolithic
from solvers import newton
from solvers.algebra import linear
from solvers.newton import Tolerance


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
    scheme.retreat(0.25)
    for start, end, now in zip(before, moved, (coupled.flow.flow, coupled.solid.structure.now.u), strict=True):
        assert np.abs(end - start).max() > 1e-6
        np.testing.assert_allclose(now, start + 0.75 * (end - start), atol=1e-12)
