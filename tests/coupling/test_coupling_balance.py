"""Balances of the interface: zero where they must be, and as large as an error that is put in on purpose."""

from __future__ import annotations

import numpy as np
import pytest
from coupling_setup import TIGHT, post_in_flow

from coupling import accelerate
from coupling.monolithic import Monolithic
from coupling.partitioned import FixedPointTolerance, Partitioned
from solvers.fluid.terms.interface import InterfaceTerms
from solvers.structure.field import Structure

SCHEMES = {
    "monolithic": lambda coupled: Monolithic(coupled, TIGHT),
    "partitioned": lambda coupled: Partitioned(coupled, accelerate.QuasiNewton(reuse=2), FixedPointTolerance(1e-10)),
}


def advance(scheme, coupled, steps, dt=0.02):
    """After each step: (force balance, momentum balance, work, power, force, displacement)."""
    coupled.initialise(0.0, dt)
    method, seen = SCHEMES[scheme](coupled), []
    for n in range(steps):
        method.step(n * dt, dt)
        balance = coupled.balance
        numbers = balance.force, balance.momentum, balance.work, balance.power
        seen.append((*numbers, coupled.force(), coupled.interface.displacement()))
    return [list(column) for column in zip(*seen, strict=True)]


@pytest.mark.parametrize("scheme", list(SCHEMES))
def test_the_structure_takes_what_the_fluid_gives(scheme):
    force, momentum, _, _, given, _ = advance(scheme, post_in_flow(E=1e4), 3)
    assert max(force) < 1e-8
    assert max(momentum) < 1e-9 * np.abs(given[-1].sum(axis=0)).max()


@pytest.mark.parametrize("scheme", list(SCHEMES))
@pytest.mark.parametrize("factor", [-1.0, 1.01, 0.0])
def test_a_load_that_is_changed_on_its_way_shows(scheme, factor, monkeypatch):
    """Wrong sign: the balance misses twice the force; a hundredth too much: a hundredth; nothing: all of it."""
    load = Structure.load
    monkeypatch.setattr(Structure, "load", lambda self, force: load(self, factor * force))
    force, momentum, _, _, given, _ = advance(scheme, post_in_flow(E=1e5), 2)
    assert force == pytest.approx([abs(factor - 1.0)] * 2, rel=1e-6)
    assert max(momentum) < 1e-9 * np.abs(given[-1].sum(axis=0)).max()


@pytest.mark.parametrize("scheme", list(SCHEMES))
def test_a_load_of_the_step_before_shows(scheme, monkeypatch):
    """The structure that gets f_n for f_{n+1} misses w (f_n - f_{n+1}) + (1 - w) (f_{n-1} - f_n)."""
    coupled = post_in_flow(E=1e5)
    load = Structure.load
    late = lambda self, force: load(self, coupled.solid.spread(coupled.balance.given.reshape(-1, 2)))  # noqa: E731
    monkeypatch.setattr(Structure, "load", late)
    force, _, _, _, given, _ = advance(scheme, coupled, 4)
    w, zero = coupled.solid.structure.time.force_weight, np.zeros_like(given[0])
    levels = [zero, zero, *given]
    for n, found in enumerate(force):
        older, old, new = levels[n : n + 3]
        mean = w * new + (1.0 - w) * old
        missed = w * old + (1.0 - w) * older - mean
        assert found == pytest.approx(np.linalg.norm(missed) / np.linalg.norm(mean), rel=1e-6)
    assert min(force) > 0.05


def test_a_wrong_force_of_the_fluid_shows_in_its_momentum(monkeypatch):
    """A hundredth more than the fluid's own equations say; the structure takes it, and balances."""
    right = InterfaceTerms.force
    monkeypatch.setattr(InterfaceTerms, "force", lambda *arguments: 1.01 * right(*arguments))
    force, momentum, _, _, given, _ = advance("partitioned", post_in_flow(E=1e5), 2)
    total = np.array([np.linalg.norm(vertices.sum(axis=0)) for vertices in given])
    assert momentum == pytest.approx(total * 0.01 / 1.01, rel=1e-6)
    assert max(force) < 1e-8


@pytest.mark.parametrize("scheme", list(SCHEMES))
def test_work_is_one_where_the_rules_agree(scheme):
    """Backward Euler moves the surface by dt g, and rho_inf = 0 loads the structure with the force at the end."""
    coupled = post_in_flow(E=1e3, scheme="backward_euler", rho_inf=0.0)
    _, _, work, power, _, _ = advance(scheme, coupled, 4)
    assert np.abs(work).max() < 1e-9 * 0.02 * np.abs(power).max()


def test_work_that_the_mean_force_loses():
    """Backward Euler with a mean of forces: the work differs by (1 - w) (f_n - f_{n+1}) . (d_{n+1} - d_n)."""
    coupled = post_in_flow(E=1e3, scheme="backward_euler", rho_inf=1.0)
    _, _, work, _, given, places = advance("monolithic", coupled, 4)
    forces, places = [np.zeros_like(given[0]), *given], [np.zeros_like(places[0]), *places]
    steps = np.sum(-0.5 * np.diff(forces, axis=0) * np.diff(places, axis=0), axis=(1, 2))
    assert work == pytest.approx(np.cumsum(steps), rel=1e-6)


def test_work_that_bdf2_loses_is_half_a_step_of_power():
    """Its sum of dt f . g is that of right ends, the structure's that of trapezoids: they differ by dt / 2 of the
    power at the end, and by what is of second order."""
    errors = []
    for dt, steps in ((0.02, 4), (0.01, 8), (0.005, 16)):
        coupled = post_in_flow(E=1e4, rho_s=10.0, mu=0.5, rho_inf=1.0)
        _, _, work, power, _, _ = advance("monolithic", coupled, steps, dt)
        errors.append(abs(work[-1] / (-0.5 * dt * power[-1]) - 1.0))
    assert errors[-1] < 0.04
    assert errors[-1] < 0.3 * errors[0]
