"""The sentinels of energy and momentum, and the work of supports and moved obstacles in the balance of energy."""

from types import SimpleNamespace

import pytest
from programs import fsci, warnings_of

from coupling.balance import InterfaceSentinel
from fsci.running.history import read_history
from solvers.structure.deformation import LimitPoint
from solvers.structure.energy import EnergyBalance, EnergySentinel


def balance(steps, start=1.0):
    """A balance with initial kinetic energy 1; steps: (work, kinetic, internal)."""
    found = EnergyBalance()
    found.start(start, 0.0, 0.0)
    for work, kinetic, internal in steps:
        found.add_step([work], 0.0, kinetic, internal, 0.0)
    return found


def kinds(energy, *, dissipates=False):
    return [finding.kind for finding in EnergySentinel(energy, LimitPoint(), dissipates=dissipates).look(0.0, 0.1)]


def test_energy_from_nothing():
    impact = [(0.0, 0.2, 0.8), (0.0, 2.0, 0.0)]  # a block leaves a floor with twice its energy
    assert kinds(balance(impact)) == []  # what the last step exchanges is not known better
    flight = [*impact, (0.0, 2.0, 0.0)]
    assert kinds(balance(flight)) == kinds(balance(flight), dissipates=True) == ["energy"]
    (found,) = EnergySentinel(balance(flight), LimitPoint(), dissipates=True).look(0.0, 0.1)
    assert found.value == pytest.approx(1.0)
    assert "has grown without external work, by 1 [energy]" in found.message
    assert kinds(balance([(0.0, 0.2, 0.8), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0)])) == []
    assert kinds(balance([(0.0, 0.2, 0.8), (1.0, 2.0, 0.0), (0.0, 2.0, 0.0)])) == []  # work was done


def test_losses_count_if_nothing_chosen_explains_them():
    lost = [(0.0, 0.5, 0.0), (0.0, 0.5, 0.0)]
    assert kinds(balance(lost)) == ["energy"]
    assert kinds(balance(lost), dissipates=True) == []


def interface(steps, *, exchanged=0.0, **settings):
    """Findings of the last step; steps: (work taken by the solid, work of the fluid, momentum missed)."""
    balance = SimpleNamespace(work=0.0, load=1.0, unsolved=1e-12, supplied=0.0)
    solid = SimpleNamespace(exchanged=lambda: exchanged)
    sentinel, found = InterfaceSentinel(balance, solid, **{"steady": False, **settings}), []
    for taken, given, missed in steps:
        balance.last_works, balance.work, balance.momentum = (taken, given), balance.work + taken - given, missed
        found = sentinel.look(0.0, 0.1)
    return [(finding.kind, finding.body) for finding in found]


def test_energy_and_momentum_pass_the_interface():
    assert interface([(1.0, 1.0, 0.0)] * 3) == []
    assert interface([(1.0, 0.5, 0.0)]) == []  # time schemes weight forces within a step differently
    assert interface([(1.0, -1.0, 0.0)]) == []  # nor do they where the force changes its sign within it
    assert interface([(1.0, -1.0, 0.0)] * 2) == [("energy", "interface")]
    assert interface([(1.0, 0.5, 0.0)] * 3) == [("energy", "interface")]
    assert interface([(1.0, 0.5, 0.0)] * 3, steady=True) == []
    assert interface([(1.0, 0.5, 0.0)] * 3, exchanged=5.0) == [("energy", "interface")]
    assert interface([(1.0, 0.5, 0.0)] * 3, exchanged=50.0) == []  # the bodies have exchanged much more
    assert interface([(0.5, 1.0, 0.0)] * 3) == []
    assert interface([(1.0, 1.0, 0.1)]) == [("momentum", "fluid")]
    assert interface([(1.0, 1.0, 0.01)]) == []


# -------------------------------------------------------------------------------------- the work in the balance

BLOCK = """\
title: a block under its supports
time: {step: 0.1, end: 1}
structure:
  DYNAMICS
  bodies:
    b:
      mesh: {shape: rectangle, size: [1, 2], cells: [4, 8]}
      material: {law: neo_hooke, E: 1000, nu: 0.2, density: 0.01}
      supports:
        - {on: bottom, displacement: [0, 0]}
        - {on: top, displacement: [0, "-0.2*t"]}
probes: {e: {quantity: energy}}
solver: {newton: {residual: 1e-10}}
output: {fields_every: 0}
"""
APART = """\
contact:
  obstacles: {wall: {mesh: {shape: rectangle, size: [1, 2], cells: [1, 1], origin: [50, 0]}, on: left}}
  pairs: {p: {slave: {body: b, on: right}, master: {obstacle: wall}}}
"""
PRESSED = """\
title: a moved obstacle presses a block
time: {step: 0.05, end: 1}
structure:
  DYNAMICS
  bodies:
    b:
      mesh: {shape: rectangle, size: [1, 1], cells: [4, 4]}
      material: {law: neo_hooke, E: 1000, nu: 0.2, density: 0.01}
      supports: [{on: bottom, displacement: [0, 0]}]
contact:
  obstacles:
    plate:
      mesh: {shape: rectangle, size: [3, 1], cells: [1, 1], origin: [-1, 1]}
      on: bottom
      motion: [0, "-0.1*t"]
  pairs: {p: {slave: {body: b, on: top}, master: {obstacle: plate}}}
probes: {e: {quantity: energy}}
solver: {newton: {residual: 1e-10}}
output: {fields_every: 0}
"""


@pytest.mark.parametrize("text", [BLOCK, BLOCK + APART, PRESSED], ids=["supports", "massless", "obstacle"])
@pytest.mark.parametrize("dynamics", ["", "dynamics: {rho_inf: 1}"], ids=["static", "dynamic"])
def test_all_work_is_counted(text, dynamics, tmp_path):
    """It is the energy that the bodies have, within the error of the steps."""
    (tmp_path / "case.yaml").write_text(text.replace("DYNAMICS", dynamics))
    done = fsci("run", tmp_path, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "warning" not in done.stdout
    history = read_history(tmp_path / "out" / "history.csv")
    total = history["e.internal"][-1] + history["e.kinetic"][-1]
    assert history["e.work"][-1] == pytest.approx(total, rel=0.01)
    assert abs(history["structure.energy"][-1]) < 0.01 * total


PRESS_FIT = """\
title: two blocks that overlap at the start
time: {step: 0.5, end: 1}
structure:
  bodies:
    lower:
      mesh: {shape: rectangle, size: [1, 1], cells: [4, 4]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: bottom, displacement: [0, 0]}]
    upper:
      mesh: {shape: rectangle, size: [1, 1], cells: [4, 4], origin: [0, 0.95]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: top, displacement: [0, 0]}]
contact: {pairs: {p: {slave: {body: upper, on: bottom}, master: {body: lower, on: top}}}}
"""


def test_a_press_fit_has_its_energy_from_the_overlap(tmp_path):
    (tmp_path / "case.yaml").write_text(PRESS_FIT)
    done = fsci("run", tmp_path, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    assert warnings_of(tmp_path / "out") == []
    energy = read_history(tmp_path / "out" / "history.csv")["structure.energy"]
    assert energy.min() > 0.1  # what is stored, and no load has brought
