"""Newton as a generator, and the caller that judges its iterates: on scalar equations with known answers."""

import itertools
import math

import numpy as np
import pytest
from advised import require_advice

from solvers.api import FailureKind, NoResidual, StepFailed
from solvers.newton import ENOUGH, Tolerance, converge, enough, iterates


class Scalar:
    """f(x) = 0 with one unknown; force: what its residual is compared with, that of the start if it is not given."""

    name = "scalar"

    def __init__(self, f, slope, x, *, force=None, round_off=0.0, settled_after=0):
        self.f, self.slope, self.x = f, slope, x
        self.force = abs(f(x)) if force is None else force
        self.increment, self.solves, self.kept, self.reductions = 0.0, 0, [], []
        self.used = math.nan  #: slope of the last iterate
        self._round_off, self.settled_after = round_off, settled_after

    def follow(self): ...

    def residual(self):
        return np.array([abs(self.f(self.x))])

    def forces(self):
        return np.array([self.force])

    def advance(self, *, keep=False, reduction=0.0):
        self.used = self.used if keep else self.slope(self.x)
        self.kept.append(keep)
        self.reductions.append(reduction)
        self.increment = -self.f(self.x) / self.used
        self.x += self.increment
        self.solves += 1
        return np.array([abs(self.increment / self.x) if self.x else 0.0])

    def retreat(self, fraction):
        self.x -= fraction[0] * self.increment

    def linked(self):
        return np.zeros(1, dtype=np.int64)

    def only_rounding(self):
        return self.residual() <= self._round_off

    def cycle(self):
        return ""

    def astray(self, risen):
        return np.zeros(1, dtype=bool)

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
    require_advice(e.value, FailureKind.NEWTON)
    assert e.value.iteration == 3
    assert len(e.value.history) == 4
    assert e.value.where is not None


def test_not_a_number_is_named():
    with pytest.raises(StepFailed, match="the residual is not a number at iteration 1") as e:
        converge(Scalar(lambda x: x if x == 1 else math.nan, lambda x: 2.0, 1.0), Tolerance())
    require_advice(e.value, FailureKind.NOT_FINITE)


def test_an_iterate_without_a_residual_has_its_number():
    """What a field says of it comes with the residuals before."""

    class Bounded(Scalar):
        def follow(self):
            if self.x < -3.0:
                raise NoResidual("field", FailureKind.DIVERGED, "beyond -3", where=(self.x,))

    for start, number in ((2.0, 1), (-4.0, 0)):  # from 2 to -3.5
        with pytest.raises(NoResidual, match=f"field: beyond -3 at iteration {number} near") as e:
            converge(Bounded(math.atan, lambda x: 1 / (1 + x * x), start), Tolerance())
        require_advice(e.value, FailureKind.DIVERGED)
        assert e.value.history == pytest.approx((math.atan(2.0),) * number)


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


def test_tolerance_is_relative_to_forces():
    """Neither a good guess makes it stricter nor an iterate that blows up looser."""
    guess = Scalar(lambda x: x * x - 2, lambda x: 2 * x, math.sqrt(2.0) + 1e-6, force=2.0)
    assert converge(guess, Tolerance(1e-8)).iterations == 1  # |x^2 - 2| = 3e-6
    far = Scalar(lambda x: x * x - 2, lambda x: 2 * x, 1e-9, force=2.0)  # the first increment is 1e9
    info = converge(far, Tolerance(1e-8, max_iterations=60))
    assert max(info.residuals) > 1e17
    assert info.residuals[-1] <= 2e-8


def test_a_change_below_the_tolerance_is_not_lost():
    """Forces that change by 1e-9 of themselves: Newton's method makes one iterate, however small the residual is."""
    system = Scalar(lambda x: x - 1.0 - 1e-9, lambda x: 1.0, 1.0, force=1.0)
    assert converge(system, Tolerance(1e-6)).iterations == 1
    assert system.x == pytest.approx(1.0 + 1e-9, abs=1e-15)


class Together:
    """Systems that know nothing of each other, each of which is a part."""

    name = "together"

    def __init__(self, *systems):
        self.systems = systems

    def _each(self, what):
        return np.concatenate([what(system) for system in self.systems])

    def follow(self):
        for system in self.systems:
            system.follow()

    def residual(self):
        return self._each(lambda system: system.residual())

    def forces(self):
        return self._each(lambda system: system.forces())

    def advance(self, *, keep=False, reduction=0.0):
        return self._each(lambda system: system.advance(keep=keep, reduction=reduction))

    def retreat(self, fraction):
        for system, own in zip(self.systems, fraction, strict=True):
            system.retreat([own])

    def linked(self):
        return np.arange(len(self.systems))

    def only_rounding(self):
        return self._each(lambda system: system.only_rounding())

    def settled(self):
        return all(system.settled() for system in self.systems)

    def cycle(self):
        return ""

    def astray(self, risen):
        return np.zeros(len(self.systems), dtype=bool)

    def worst(self):
        return None


def soft():
    return Scalar(lambda x: 1e-6 * (x * x - 2), lambda x: 2e-6 * x, 2.0)


def stiff(**options):
    return Scalar(lambda x: 1e9 * (math.exp(x) - 1), lambda x: 1e9 * math.exp(x), 3.0, **options)


@pytest.mark.parametrize("beside", [stiff, lambda: stiff(round_off=1.0), lambda: stiff(round_off=1e12)])
@pytest.mark.parametrize("line_search", [False, True])
def test_a_soft_part_converges_beside_a_stiff_one(beside, line_search):
    """Whether that takes longer, has an error of rounding above all forces on the soft part, or consists of it."""
    system, alone = soft(), soft()
    converge(Together(beside(), system), Tolerance(1e-10, line_search=line_search))
    converge(alone, Tolerance(1e-10, line_search=line_search))
    assert system.residual() <= 1e-10 * system.force
    assert system.x == pytest.approx(alone.x, abs=1e-10)


def test_each_component_has_its_own_line_search():
    """Newton's method diverges from 2 for the arctangent, and needs whole steps for the other one."""
    alone = arctangent(), stiff()
    found = [converge(system, Tolerance(1e-10, line_search=True)).iterations for system in alone]
    together = arctangent(), stiff()
    assert converge(Together(*together), Tolerance(1e-10, line_search=True)).iterations == max(found)
    fewer = int(np.argmin(found))
    assert together[1 - fewer].x == alone[1 - fewer].x
    assert together[fewer].x == pytest.approx(alone[fewer].x, abs=1e-9)


def test_residuals_of_rounding_are_not_reported():
    noise = Scalar(lambda x: 1.0, lambda x: 1e300, 1.0, round_off=2.0)
    info = converge(Together(noise, root_of_two()), Tolerance(1e-10))
    assert info.residuals == converge(root_of_two(), Tolerance(1e-10)).residuals
    assert converge(noise, Tolerance(1e-10)).residuals == (1.0,)


def test_rounding_of_one_part_does_not_shorten_the_increments_of_another():
    """Rounding errors that grow with each solution: no fraction of an increment reduces them."""
    noise = Scalar(lambda x: math.exp(x), lambda x: -math.exp(x), 1.0, force=1e-3, round_off=1e9)
    system = root_of_two()
    info = converge(Together(noise, system), Tolerance(1e-10, line_search=True))
    assert info.iterations == converge(root_of_two(), Tolerance(1e-10)).iterations


class Watching(Together):
    """Keeps the parts whose residuals rose last."""

    def astray(self, risen):
        self.risen = list(risen)
        return super().astray(risen)


@pytest.mark.parametrize(("round_off", "rises"), [(1e9, 0), (0.0, 4)])
def test_rounding_errors_that_grow_are_no_rise(round_off, rises):
    """A part that rises may need shorter increments, for all parts; one whose residual is noise does not."""
    growing = Scalar(lambda x: math.exp(x), lambda x: -math.exp(x), 1.0, force=1e-3, round_off=round_off)
    system = Watching(growing, root_of_two())
    for iterate in iterates(system, Tolerance(1e-10)):
        if iterate.number == 4:
            break
    assert [mask[0] for mask in system.risen] == [True] * rises


def test_a_part_that_fails_is_reported():
    """x^2 + 1 = 0 beside a part that has converged, and one whose residual is rounding error."""
    noise = Scalar(lambda x: 1e6, lambda x: 1e300, 1.0, round_off=2e6)
    without = Scalar(lambda x: x * x + 1, lambda x: 2 * x, 0.5)
    with pytest.raises(StepFailed, match="did not converge in 3 iterations") as failure:
        converge(Together(noise, without, root_of_two()), Tolerance(1e-3, max_iterations=3))
    assert failure.value.history[0] == pytest.approx(math.hypot(1.25, 2.0))


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
    def of(*parts):
        residual, ratio, tolerance = np.array(parts).T
        return enough(residual, ratio, tolerance=tolerance)

    assert of((0.0, math.inf, 0.0)) == ENOUGH
    assert of((1.0, math.inf, 1e-8)) == ENOUGH
    assert of((1.0, 1e-2, 1e-8)) == pytest.approx(1e-5)  # Newton's method leaves 1e-4
    assert of((1e-4, 1e-4, 1e-8)) == pytest.approx(1e-6)  # a hundredth of the tolerance
    assert of((1e-9, 1.0, 1e-8)) == ENOUGH
    assert of((1.0, 1e-2, 1e-8), (0.0, 0.0, 0.0), (1e-4, 1e-4, 1e-8)) == pytest.approx(1e-6)  # the strictest of all


class Placed(Scalar):
    """A residual is that of the place to which the system has followed."""

    place, places = math.nan, 0

    def follow(self):
        self.place, self.places = self.x, self.places + 1

    def residual(self):
        assert self.place == self.x
        return super().residual()


def test_systems_follow_each_iterate_before_its_residual():
    """In a line search, too, whose halved increments are other places."""
    system = Placed(math.atan, lambda x: 1 / (1 + x * x), 3.0)
    info = converge(system, Tolerance(residual=1e-10, line_search=True))
    assert system.places > info.iterations + 1
