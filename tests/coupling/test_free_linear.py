"""Free rigid bodies by Krylov methods: as many linear iterations as with bodies whose motion is given."""

import numpy as np
import pytest
from programs import fsci

from fsci.running.history import read_history

#: a light and a heavy ball, so that added mass counts
SCENE = """\
title: two balls
time: {step: 0.02, end: 0.06}
fluid:
  density: 1
  viscosity: 1
  element: q1q1
  flow: stokes
  scheme: bdf2
  grid: {from: [0, 0, 0], to: [1, 1, 1.6], cells: [8, 8, 13]}
  patches: {walls: {on: [x-, x+, y-, y+, z-, z+], no_slip: true}}
  bodies:
    light:
      mesh: {shape: sphere, radius: 0.2, cells: [6, 1], translate: [0.43, 0.5, 1.13]}
      LIGHT
    heavy:
      mesh: {shape: sphere, radius: 0.22, cells: [6, 1], translate: [0.55, 0.45, 0.52]}
      HEAVY
solver: {linear: {method: METHOD}}
output: {fields_every: 0}
"""
FREE = {
    "LIGHT": "free: {density: 0.5, gravity: [0, 0, -0.5]}",
    "HEAVY": "free: {density: 2, gravity: [0, 0, -0.5]}",
}
GIVEN = {
    "LIGHT": 'motion: {velocity: [0, 0, "-0.0007*ramp(t, 0, 0.02)"]}',
    "HEAVY": 'motion: {velocity: [0, 0, "-0.002*ramp(t, 0, 0.02)"]}',
}
COUPLED = """\
coupling: {scheme: monolithic}
probes:
  light: {body: light, quantity: velocity, at: [0.43, 0.5, 1.13]}
  heavy: {body: heavy, quantity: velocity, at: [0.55, 0.45, 0.52]}
"""


def run(folder, bodies, method="iterative", processes=1):
    text = SCENE.replace("METHOD", method) + (COUPLED if bodies is FREE else "")
    for name, given in bodies.items():
        text = text.replace(name, given)
    folder.mkdir()
    (folder / "case.yaml").write_text(text)
    done = fsci("run", folder / "case.yaml", "-o", folder / "out", processes=processes)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "stalled" not in done.stdout
    return read_history(folder / "out" / "history.csv")


@pytest.fixture(scope="module")
def free(tmp_path_factory):
    return run(tmp_path_factory.mktemp("free") / "free", FREE)


def test_iterations_of_free_bodies(tmp_path, free):
    """At most 1.5 times those of given motions in each Newton iteration: without the elimination they are 3 times."""
    given = run(tmp_path / "given", GIVEN)
    per_system = sum(free["coupling.linear"]) / sum(free["iterations"])
    assert per_system <= 1.5 * sum(given["fluid.linear"]) / sum(given["iterations"])


@pytest.mark.parametrize(
    ("method", "processes"),
    [pytest.param("direct", 1, marks=pytest.mark.slow), pytest.param("iterative", 2, marks=pytest.mark.slow)],
)
def test_motions_do_not_depend_on_the_linear_solver(tmp_path, free, method, processes):
    other = run(tmp_path / "other", FREE, method, processes)
    for name in ("light", "heavy"):
        one, two = (np.array([h[f"{name}.{axis}"] for axis in "xyz"]) for h in (free, other))
        assert np.abs(one).max() > 1e-4
        np.testing.assert_allclose(two, one, atol=1e-7 * np.abs(one).max())
