"""Newton as a generator, and the caller that judges its iterates: on scalar equations with known answers."""

import itertools
import math

import pytest

from solvers.api import StepFailed
from solvers.newton import ENOUGH, Tolerance, converge, enough, iterates


class Scalar:
    """f(x) = 0 with one unknown."""

    name = "scalar"

    def __init__(self, f, slope, x, *, round_off=0.0, settled_after=0):
        self.f, self.slope, self.x = f, slope, x
        self.increment, self.solves, self.kept, self.reductions = 0.0, 0, [], []
        self.used = math.nan  #: slope of the last iterate
        self._round_off, self.settled_after = round_off, settled_after

    def residual(self):
        return abs(self.f(self.x))

    def advance(self, *, keep=False, reduction=0.0):
        self.used = self.used if keep else self.slope(self.x)
        self.kept.append(keep)
        self.reductions.append(reduction)
        self.increment = -self.f(self.x) / self.used
        self.x += self.increment
        self.solves += 1
        return abs(self.increment / self.x)

    def retreat(self, fraction):
        self.x -= fraction * self.increment

    def round_off(self):
        return self._round_off

    def astray(self, rises):
        return ""

    def settled(self):
        return self.solves >= self.settled_after

    def worst(self):
        return (self.x,)


def root_of_two(**options):
    return Scalar(lambda x: x * x - 2, lambda x: 2 * x, 2.0, **options)


def arctangent():
    """Newton diverges from 2: the classical example for a line search."""
    return Scalar(math.atan, lambda x: 1 / (1 + x * x), 2.0)


def test_iterates_are_quadratic():
    errors = []
    system = root_of_two()
    for iterate in iterates(system, Tolerance(residual=0.0)):
        errors.append(abs(system.x - math.sqrt(2)))
        if iterate.number == 4:
            break
    for before, after in itertools.pairwise(errors):
        assert after == pytest.approx(before**2 / (2 * (before + math.sqrt(2))), rel=1e-2, abs=1e-15)


@pytest.mark.parametrize(("tolerance", "kept"), [(1e-4, [False, False, False]), (2.5e-4, [False, False, True])])
def test_a_tangent_is_kept_for_the_last_iterate(tolerance, kept):
    """x^2 = 2 from 2 has the residuals 2, 0.25 and 0.00694.

    With the slope of 1.5 the next one is 3.91e-4, as 2 (r_2 / r_1) r_2 = 3.86e-4 says, with a new slope 6e-6.
    """
    system = root_of_two()
    info = converge(system, Tolerance(residual=tolerance))
    assert system.kept == kept
    assert info.residuals[-1] == pytest.approx(3.91e-4 if kept[-1] else 6.0e-6, rel=1e-2)


def test_converge_counts_linear_solves():
    system = root_of_two()
    info = converge(system, Tolerance(residual=1e-10))
    assert system.x == pytest.approx(math.sqrt(2), abs=1e-9)
    assert info.iterations == system.solves == len(info.residuals) - 1
    assert info.residuals[0] == 2.0


def test_line_search():
    with pytest.raises(StepFailed):
        converge(arctangent(), Tolerance(max_iterations=5))
    system = arctangent()
    converge(system, Tolerance(residual=1e-10, line_search=True))
    assert abs(system.x) < 1e-9


def test_diverged_is_named():
    with pytest.raises(
        StepFailed, match=r"scalar: Newton did not converge in 3 iterations \(residual .*\) at iter"
    ) as e:
        converge(Scalar(lambda x: x * x + 1, lambda x: 2 * x, 0.5), Tolerance(max_iterations=3))
    assert e.value.iteration == 3
    assert len(e.value.history) == 4
    assert e.value.where is not None


def test_not_a_number_is_named():
    with pytest.raises(StepFailed, match="the residual is not a number at iteration 1"):
        converge(Scalar(lambda x: x if x == 1 else math.nan, lambda x: 2.0, 1.0), Tolerance())


def test_round_off_is_good_enough():
    """A residual that is only rounding error is accepted, however small the relative tolerance."""
    info = converge(root_of_two(round_off=1e-5), Tolerance(residual=1e-30))
    assert info.residuals[-1] <= 1e-5 < info.residuals[-2]


def test_absolute_tolerance_and_increment():
    assert len(converge(root_of_two(), Tolerance(residual=1e-30, residual_absolute=0.3)).residuals) == 2  # f(1.5) = 1/4
    loose = converge(root_of_two(), Tolerance(residual=0.2))
    tight = converge(root_of_two(), Tolerance(residual=0.2, increment=1e-6))
    assert tight.iterations > loose.iterations


def test_unsettled_is_not_accepted():
    """What is imposed (a support, an active set) must be reached even if the residual is zero from the start."""
    system = Scalar(lambda x: 0.0 * x, lambda x: 1.0, 1.0, settled_after=2)
    assert converge(system, Tolerance()).iterations == 2


def test_a_good_first_guess_does_not_make_the_tolerance_stricter():
    """|x^2 - 2| = 3e-6 at the guess: with 1e-8 of the 7 that the unmoved system had, one step is enough."""
    guess = math.sqrt(2.0) + 1e-6
    alone, moved = (Scalar(lambda x: x * x - 2, lambda x: 2 * x, guess) for _ in range(2))
    assert converge(moved, Tolerance(1e-8), 7.0).iterations == 1
    assert converge(alone, Tolerance(1e-8)).iterations == 2


class Inexact(Scalar):
    """A linear solver that leaves as much of the residual as is allowed."""

    def advance(self, *, keep=False, reduction=0.0):
        found = super().advance(keep=keep, reduction=reduction)
        self.x -= reduction * self.increment
        return found


def test_inexact_solutions_cost_no_iterate():
    """As many iterates as with exact solutions, and the linear systems are solved to what each of them needs."""
    for start in (2.0, 5.0, 40.0):
        exact, inexact = (kind(lambda x: x * x - 2, lambda x: 2 * x, start) for kind in (Scalar, Inexact))
        found = [converge(system, Tolerance(residual=1e-12)) for system in (exact, inexact)]
        assert found[0].iterations == found[1].iterations
        assert abs(inexact.x**2 - 2) <= 1e-12 * abs(start**2 - 2)
        assert max(inexact.reductions) == inexact.reductions[0] == ENOUGH
        assert min(inexact.reductions) < 1e-4


def test_reduction_that_is_enough():
    assert enough(0.0, math.inf, tolerance=0.0) == ENOUGH
    assert enough(1.0, math.inf, tolerance=1e-8) == ENOUGH
    assert enough(1.0, 1e-2, tolerance=1e-8) == pytest.approx(1e-5)  # Newton's method leaves 1e-4
    assert enough(1e-4, 1e-4, tolerance=1e-8) == pytest.approx(1e-6)  # a hundredth of the tolerance
    assert enough(1e-9, 1.0, tolerance=1e-8) == ENOUGH
