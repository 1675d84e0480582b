"""Outlets with a Windkessel as a user runs them: both schemes, free bodies, 3D, resumed, on two processes."""

import numpy as np
import pytest
from coupled_case import POST
from programs import fsci
from small_scenes import FLOW

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

OUTFLOW = "outlet: {on: x+, outflow: true}"
WINDKESSEL = "outlet: {on: x+, windkessel: {proximal: 40, capacitance: 1e-3, distal: 200, initial_pressure: 2}}"
PRESSURE = "probes:\n  outlet: {quantity: outlet_pressure, through: outlet}\n"
ON_OUTLET = POST.replace(OUTFLOW, WINDKESSEL).replace("probes:\n", PRESSURE)
PARTITIONED = "coupling: {scheme: partitioned, tolerance: 1.0e-9}"
FLOATING = "    disc: {mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [0.78, 0.51]}, free: {density: 3}}\n"


def run(text, folder, *overrides):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml", overrides), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


@pytest.fixture(scope="module")
def on_outlet(tmp_path_factory):
    """(results folder, history) of the monolithic run."""
    folder = tmp_path_factory.mktemp("outlet")
    return folder / "out", run(ON_OUTLET, folder)


def test_the_pressure_is_that_of_the_flow(on_outlet):
    """Of its history alone, integrated here in a thousand parts of each step, between which the flow is linear."""
    history = on_outlet[1]
    q, stored, past, dt = history["outflow"], 2.0, 0.0, 0.02
    for number, rate in enumerate(q):
        for part in range(1000):
            middle = rate if number == 0 else past + (part + 0.5) / 1000 * (rate - past)
            stored = (stored + dt / 1000 * middle / 1e-3) / (1.0 + dt / 1000 / (1e-3 * 200))
        past = rate
        assert history["outlet"][number] == pytest.approx(40.0 * rate + stored, rel=1e-4)
    assert history["outlet"][-1] > 10.0


def test_partitioned_is_monolithic(on_outlet, tmp_path):
    expected = on_outlet[1]
    found = run(ON_OUTLET.replace("coupling: {scheme: monolithic}", PARTITIONED), tmp_path)
    for name in ("tip.x", "tip.y", "outlet"):
        assert np.abs(found[name] - expected[name]).max() < 1e-6 * np.abs(expected[name]).max()


@pytest.mark.slow
def test_resumed_bit_for_bit(on_outlet, tmp_path):
    expected, folder = on_outlet[1], tmp_path / "part"
    run(ON_OUTLET, folder, ("time.end", "0.04"))
    out = folder / "out"
    resumed = fsci("resume", out, "--set", "time.end=0.1")
    assert resumed.returncode == 0, resumed.stderr
    history = read_history(out / "history.csv")
    for name in ("tip.x", "outlet", "outflow"):
        assert np.array_equal(history[name], expected[name])


@pytest.mark.slow
def test_on_two_processes(on_outlet, tmp_path):
    (tmp_path / "case.yaml").write_text(ON_OUTLET)
    assert fsci("run", tmp_path / "case.yaml", "-o", tmp_path / "two", processes=2).returncode == 0
    history, expected = read_history(tmp_path / "two" / "history.csv"), on_outlet[1]
    for name in ("tip.x", "outlet", "outflow"):
        assert np.abs(history[name] - expected[name]).max() < 1e-8 * np.abs(expected[name]).max()


@pytest.mark.parametrize("linear", ["direct", "iterative"])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_a_free_body_beside_an_outlet(tmp_path, element, linear):
    """Its motion takes a pressure of the outlet into account, and neither solver nor element changes the pressure."""
    text = FLOW.replace(OUTFLOW, WINDKESSEL).replace("element: q1q1", f"element: {element}")
    text += "  bodies:\n" + FLOATING + "coupling: {}\n" + PRESSURE + "  rate: {quantity: flow_rate, through: outlet}\n"
    found = run(text, tmp_path, ("time.end", "0.08"), ("solver.linear.method", linear))
    q = found["rate"]
    assert q == pytest.approx(2.0 / 3.0 * np.array([0.2, 0.4, 0.6, 0.8]), rel=3e-2)
    assert found["outlet"][-1] > 40.0 * q[-1]
    assert found["fluid.mass"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("scheme", ["monolithic", "partitioned"])
def test_a_steady_outlet_with_an_elastic_body(tmp_path, scheme):
    """P = (R_p + R_d) q."""
    text = ON_OUTLET.replace("density: 1\n", "density: 1\n  scheme: steady\n", 1).replace("*min(t/0.1, 1)", "/10")
    text = text.replace("  dynamics: {rho_inf: 0.8}\n", "").replace("density: 10", "density: 1")
    found = run(text, tmp_path, ("time.end", "0.02"), ("verify", "[]"), ("coupling.scheme", scheme))
    assert found["outlet"] == pytest.approx(240.0 * found["outflow"], rel=1e-10)
    assert found["outflow"] == pytest.approx(1.0 / 15.0, rel=2e-2)
