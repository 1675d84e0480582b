"""A steady flow presses a flap against a stop: closed contact stays closed while Newton's method converges."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from fsci.builder.build import build
from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case
from solvers.timing import Timer

#: The slit behind the flap is less than a cell wide. Contact closes it, so that the fluid below is a pocket.
FLAP = """\
title: Flap on a stop
time: {{step: {step}, end: 1}}
fluid:
  density: 1
  viscosity: {viscosity}
  element: q1q1
  scheme: steady
  grid: {{from: [0, 0], to: [{to}], cells: [24, 12]}}
  patches:
    inlet: {{on: x-, velocity: ["{speed}*ramp(t,0,1)*2*(y/{size})*(2-y/{size})", 0]}}
    outlet: {{on: x+, outflow: true}}
    floor: {{on: y-, no_slip: true}}
    top: {{on: y+, slip: true}}
  bodies:
    stop: {{mesh: {{shape: rectangle, size: [{stop}], cells: [1, 1], origin: [{stop_at}]}}}}
structure:
  bodies:
    flap:
      mesh: {{shape: rectangle, size: [{flap}], cells: [3, 9], origin: [{flap_at}, 0]}}
      material: {{law: neo_hooke, E: 400, nu: 0.3, density: 2}}
      supports: [{{on: bottom, displacement: [0, 0]}}]
contact:
{film}  pairs: {{stop: {{slave: {{body: flap, on: right}}, master: {{obstacle: stop}}}}}}
coupling: {{scheme: {scheme}}}
probes:
  tip: {{field: structure, body: flap, quantity: displacement, at: [{flap_at}, {tip}]}}
output: {{fields_every: 0}}
"""


def write(path, *, overrides=(), scheme="monolithic", step=0.25, speed=1.0, film="", size=1.0, shift=0.0):
    def scaled(*numbers):
        return ", ".join(repr(size * number) for number in numbers)

    text = FLAP.format(
        scheme=scheme, step=step, speed=speed, film=film, size=size, viscosity=0.1 * size, to=scaled(2, 1),
        stop=scaled(0.3, 0.75), stop_at=scaled(1.06 + shift, -0.1), flap=scaled(0.2, 0.6), flap_at=scaled(0.8 + shift),
        tip=scaled(0.6),
    )  # fmt: skip
    path.write_text(text)
    return load_case(path, overrides)


def final(folder, name, **settings) -> tuple[float, float]:
    """(displacement of the tip [m], force on the stop [N]) in the end, by those of a flap of size 1."""
    assert run_case(write(folder / f"{name}.yaml", **settings), folder / name) == FINISHED
    found, size = read_history(folder / name / "history.csv"), settings.get("size", 1.0)
    return found["tip.x"][-1] / size, found["contact.stop.x"][-1] / size


@pytest.mark.parametrize(
    "settings",
    [
        {"speed": 0.85},
        pytest.param({"speed": 1.1}, marks=pytest.mark.slow),
        pytest.param({"shift": 0.0278}, marks=pytest.mark.slow),
        {"scheme": "partitioned"},
    ],
)
def test_steady_contact_converges(tmp_path, settings):
    tip, force = final(tmp_path, "run", **settings)
    assert 0.08 < tip < 0.09
    assert force < -3.0


@pytest.mark.parametrize(
    "factor", [pytest.param(0.2, marks=pytest.mark.slow), 0.5, pytest.param(0.8, marks=pytest.mark.slow)]
)
def test_a_load_that_is_too_large_comes_in_halves(tmp_path, factor, monkeypatch):
    """Whatever c_n is: with all of the load at once elements are inverted in the second step."""
    monkeypatch.setattr("solvers.structure.tangent.of_surfaces", lambda matrix, body: factor)
    tip, force = final(tmp_path, "run", scheme="partitioned")
    assert 0.08 < tip < 0.09
    assert force < -3.0


@pytest.mark.slow
def test_result_is_that_with_a_tight_layer(tmp_path):
    """A layer of 1e-4 closes all slits by itself. Half the step and a thousandth of the size change nothing."""
    tip, force = final(tmp_path, "sealed", film="  film: {seal: 1.0e-4}\n")
    for name, settings in {"run": {}, "halved": {"step": 0.125}, "small": {"size": 1e-3}}.items():
        found = final(tmp_path, name, **settings)
        assert found == pytest.approx((tip, force), rel=0.03), name


@pytest.mark.slow
def test_resumed_run_keeps_contact_closed(tmp_path):
    whole = final(tmp_path, "whole")
    first = write(tmp_path / "parts.yaml", overrides=[("time.end", "0.75")])
    assert run_case(first, tmp_path / "parts") == FINISHED
    assert resume_run(tmp_path / "parts", [("time.end", "1")]) == FINISHED
    found = read_history(tmp_path / "parts" / "history.csv")
    assert (found["tip.x"][-1], found["contact.stop.x"][-1]) == whole


def test_taking_back_an_increment_gives_the_residual_before(tmp_path):
    """Also where the increment moves the flap over nodes of the fluid, or lays nodes bare.

    Only the velocity that scales stabilisation may be that of another iterate.
    """
    scheme = build(write(tmp_path / "case.yaml"), MPI.COMM_WORLD, Timer()).scheme
    scheme.initialise(0.0, 0.25)
    scheme.step(0.0, 0.25)
    solid, flow = scheme.coupled.solid, scheme.coupled.flow
    scheme.coupled.begin_step(0.25, 0.25)
    scheme.follow()
    before, active = scheme.residual(), flow.system.active_dofs.copy()
    solid.update(solid.structure.held.free_part(np.full(solid.size, 0.07)))
    flow.update(np.ones(flow.size))
    scheme.follow()
    scheme.residual()
    assert (active & ~flow.system.active_dofs).any()
    for fraction in (0.5, 0.25, 0.25):
        scheme.retreat(np.full(len(before), fraction))
        scheme.follow()
        after = scheme.residual()
    assert after == pytest.approx(before, rel=1e-4, abs=1e-6)
