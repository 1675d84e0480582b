"""The time grid of a run: exact over many steps, through halving and recovery, to the end."""

from fractions import Fraction

import numpy as np
import pytest

from fsci.case.time import number_of_steps
from fsci.running.clock import Clock


def clock(end, step, *, start=0.0, halvings=4, recover_after=5):
    return Clock(start, end, step, halvings, recover_after)


def steps(clock):
    """(time before, step) of all accepted steps to the end."""
    found = []
    while not clock.done:
        found.append((clock.time, clock.dt))
        clock.accept()
    return found


def test_plain_steps():
    times, sizes = zip(*steps(clock(1.0, 0.25)), strict=True)
    assert times == (0.0, 0.25, 0.5, 0.75)
    assert sizes == (0.25,) * 4


def test_starts_elsewhere():
    run = clock(3.0, 0.5, start=2.0)
    assert (run.time, run.dt) == (2.0, 0.5)
    assert steps(run) == [(2.0, 0.5), (2.5, 0.5)]
    assert (run.time, run.step) == (3.0, 2)


def test_no_rounding_drift():
    """After a million ticks the time is the product, rounded once or twice; a sum would be off by thousands of ulps."""
    step, count = 0.1, 62_500
    run = clock(2 * count * step, step, halvings=4)
    for n in range(1, count + 1):
        assert run.dt == step
        run.accept()
        exact = n * Fraction(step)
        assert abs(Fraction(run.time) - exact) <= 2 * exact * Fraction(2) ** -53
    assert run.tick == 1_000_000


@pytest.mark.parametrize("step", [0.1, 0.01, 0.003, 1 / 3, 0.7])
def test_ends_exactly(step):
    """However the step rounds: the right number of steps, none of them a sliver, the end exactly."""
    for count in (1, 3, 7, 30, 1000):
        run = clock(count * step, step)
        found = steps(run)
        assert len(found) == count
        assert {size for _, size in found} == {step}
        assert run.time == count * step


def test_last_step_is_partial():
    run = clock(1.0, 0.3)
    found = steps(run)
    assert [size for _, size in found] == pytest.approx([0.3, 0.3, 0.3, 0.1])
    assert (run.time, run.step) == (1.0, 4)
    time, size = found[-1]
    assert time + size == 1.0


def test_step_longer_than_the_run():
    run = clock(0.2, 1.0)
    assert steps(run) == [(0.0, 0.2)]
    assert run.time == 0.2


def test_halving():
    run = clock(1.0, 0.5, halvings=2)
    assert run.halve()
    assert run.dt == 0.25
    assert run.halve()
    assert run.dt == 0.125
    assert not run.halve()
    assert run.dt == 0.125
    run.accept()
    assert run.time == 0.125


def test_no_halvings():
    assert not clock(1.0, 0.5, halvings=0).halve()


def test_halving_the_last_partial_step():
    """Halves that are longer than what is left would only repeat the step that failed."""
    run = clock(1.0, 0.3)
    for _ in range(3):
        run.accept()
    assert run.dt == pytest.approx(0.1)
    assert run.halve()
    assert run.dt == pytest.approx(0.075)
    assert [size for _, size in steps(run)] == pytest.approx([0.075, 0.025])
    assert run.time == 1.0


def test_halvings_that_do_not_shorten_the_last_step():
    run = clock(1.0, 0.8, halvings=1)
    run.accept()
    assert run.dt == pytest.approx(0.2)
    assert not run.halve()


@pytest.mark.parametrize("step", [0.0333333, 0.0999, 0.95, 0.33])
def test_a_short_rest_is_shared_by_the_steps_before_it(step):
    """What is left after the whole steps is less than a tenth of one: all steps are a little longer."""
    sizes = [size for _, size in steps(clock(1.0, step))]
    assert len(sizes) == int(1.0 / step) == number_of_steps(1.0, step)
    assert sizes == pytest.approx([1.0 / len(sizes)] * len(sizes), rel=1e-12)


@pytest.mark.parametrize("start", [0.0, 1e6])
@pytest.mark.parametrize("level", [0, 1, 2, 3, 4])
def test_no_step_is_much_shorter_than_the_one_before_it(start, level):
    """Whatever is left: halved steps end as whole ones do."""
    for rest in np.linspace(0.0, 1.0, 41):
        run = clock(start + 3.0 + rest, 1.0, start=start, recover_after=100)
        for _ in range(level):
            run.halve()
        sizes = [size for _, size in steps(run)]
        assert min(sizes) > 0.0999 * max(sizes)
        assert sum(sizes) == pytest.approx(3.0 + rest, rel=1e-9)
        assert level or number_of_steps(run.end - run.start, 1.0) == len(sizes)
        assert run.time == start + 3.0 + rest


def test_a_resumed_run_keeps_the_shared_steps():
    """Twice resumed: the ticks count from the same time with the same size."""
    straight, resumed = clock(1.0, 0.33), clock(1.0, 0.33)
    for _ in range(2):
        straight.accept()
        resumed.accept()
        other = clock(1.0, 0.33)
        other.restore(resumed.save())
        resumed = other
    assert steps(resumed) == steps(straight)


def test_a_later_end_changes_what_is_shared():
    """The rest of the first end was shared; the steps from there to the later end share their own."""
    run = clock(1.0, 0.33)
    steps(run)
    longer = clock(2.0, 0.33)
    longer.restore(run.save())
    again = clock(2.0, 0.33)
    again.restore(longer.save())
    assert steps(longer) == steps(again)
    assert longer.time == 2.0


def test_recovery_waits_for_the_coarse_grid():
    """Halved at once and again after one step: the step doubles only where the doubled grid has a point."""
    run = clock(10.0, 1.0, recover_after=2)
    run.halve()  # 0.5
    run.accept()
    run.halve()  # 0.25 from 0.5 on
    found = steps(run)
    assert [size for _, size in found[:5]] == [0.25, 0.25, 0.5, 0.5, 1.0]
    assert all((time / size).is_integer() for time, size in found)
    assert found[-1] == (9.0, 1.0)


def test_recovery_off_the_coarse_grid_is_late():
    run = clock(10.0, 1.0, recover_after=3)
    run.halve()
    found = steps(run)
    assert [size for _, size in found[:5]] == [0.5, 0.5, 0.5, 0.5, 1.0]


def test_halving_starts_the_count_anew():
    run = clock(10.0, 1.0, recover_after=4)
    run.halve()
    for _ in range(3):
        run.accept()
    run.halve()
    found = steps(run)
    sizes = [size for _, size in found]
    assert sizes[:4] == [0.25] * 4
    assert sizes[4] == 0.5
    assert sizes.index(1.0) >= 8


def test_save_and_restore():
    run = clock(10.0, 1.0)
    run.halve()
    run.accept()
    state = run.save()
    rest = steps(run)
    other = clock(10.0, 1.0)
    other.restore(state)
    assert steps(other) == rest
    assert other.save() == run.save()


@pytest.mark.parametrize("step", [0.5, 0.3, 2.0])
def test_goes_on_with_another_step_from_the_time_of_the_checkpoint(step):
    """A case whose step was changed between run and resume: ticks of the old size say nothing."""
    run = clock(10.0, 1.0)
    for _ in range(4):
        run.accept()
    other = clock(10.0, step)
    other.restore(run.save())
    assert other.time == 4.0
    assert other.step == 4
    found = steps(other)
    assert found[0] == (4.0, pytest.approx(step))
    assert other.time == 10.0


def test_a_later_end_after_a_partial_last_step():
    """The last step to 2.5 was half a step: the next ones start there."""
    run = clock(2.5, 1.0)
    steps(run)
    longer = clock(4.0, 1.0)
    longer.restore(run.save())
    assert longer.time == 2.5
    assert [time for time, _ in steps(longer)] == pytest.approx([2.5, 3.5])


@pytest.mark.parametrize(("step", "end", "later"), [(0.02, 0.28, 0.46), (0.1, 0.3, 1.0), (0.05, 0.35, 2.0)])
def test_a_later_end_keeps_the_times_of_whole_steps(step, end, later):
    """The last time is the end itself, which rounding sets apart from the multiple of the step: no new beginning."""
    run, straight = clock(end, step), clock(later, step)
    steps(run)
    resumed = clock(later, step)
    resumed.restore(run.save())
    assert steps(resumed) == steps(straight)[run.step :]
