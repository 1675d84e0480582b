"""Bodies that fall on floors, walls and each other in a flow, without a section `contact`: nothing passes anything.

The scenes are those that once fell through, with their whole times, and variants of them.
"""

from __future__ import annotations

import numpy as np
import pytest

from fsci.builder.rigid_contact import STANDOFF
from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

HEAD = """\
time: {step: 0.02, end: 1.5}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 1.5], cells: [16, 24]}
  patches: {top: {on: y+, outflow: true}, w: {on: [x-, x+, y-], no_slip: true}}
"""
ONE = (
    HEAD
    + """\
  bodies: {a: {mesh: {shape: disc, radius: 0.15, cells: [24, 1], translate: [0.5, 0.4]}, free: {density: 8, gravity: [0, -10]}}}
coupling: {}
probes: {a: {body: a, quantity: centre}}
output: {fields_every: 0}
"""  # noqa: E501
)
TWO = (
    HEAD
    + """\
  bodies:
    a: {mesh: {shape: disc, radius: 0.15, cells: [24, 1], translate: [0.5, 0.4]}, free: {density: 8, gravity: [0, -10]}}
    b: {mesh: {shape: disc, radius: 0.15, cells: [24, 1], translate: [0.5, 1.0]}, free: {density: 20, gravity: [0, -10]}}
coupling: {}
probes: {a: {body: a, quantity: centre}, b: {body: b, quantity: centre}}
output: {fields_every: 0}
"""  # noqa: E501
)
WIDE = """\
time: {step: 0.02, end: 1}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  grid: {from: [-1, 0], to: [1, 1.5], cells: [24, 18]}
  patches: {walls: {on: [x-, x+, y-], no_slip: true}, top: {on: y+, traction: [0, 0]}}
  bodies:
    a: {mesh: {shape: disc, radius: 0.25, cells: [48, 1], translate: [0, 0.6]}, free: {density: 5, gravity: [0, -8]}}
coupling: {scheme: monolithic}
probes: {a: {body: a, quantity: centre}}
output: {fields_every: 0}
"""
FIXED = (
    WIDE.replace("to: [1, 1.5], cells: [24, 18]", "to: [1, 2], cells: [24, 24]")
    .replace("translate: [0, 0.6]", "translate: [0.02, 1.2]")
    .replace(
        "coupling:",
        "    b: {mesh: {shape: disc, radius: 0.25, cells: [48, 1], translate: [0, 0.5]}}\ncoupling:",
    )
)
ELASTIC = """\
time: {step: 0.02, end: 0.8}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 1.2], cells: [14, 17]}
  patches: {top: {on: y+, outflow: true}, w: {on: [x-, x+, y-], no_slip: true}}
structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    a:
      mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [0.5, 0.5]}
      material: {law: neo_hooke, E: 3000, nu: 0.3, density: 15}
      gravity: [0, -10]
coupling: {}
probes: {a: {body: a, quantity: centre}, fluid: {field: fluid, quantity: volume}, solid: {body: a, quantity: volume}}
output: {fields_every: 0}
"""
BALL = """\
time: {step: 0.02, end: 0.6}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0, 0], to: [0.6, 0.6, 0.7], cells: [6, 6, 7]}
  patches: {top: {on: z+, outflow: true}, w: {on: [x-, x+, y-, y+, z-], no_slip: true}}
  bodies:
    a: {mesh: {shape: sphere, radius: 0.15, cells: [3, 1], translate: [0.31, 0.28, 0.3]}, free: {density: 8, gravity: [0, 0, -10]}}
coupling: {}
probes: {a: {body: a, quantity: centre}}
output: {fields_every: 0}
"""  # noqa: E501
SMALL = (
    ONE.replace("to: [1, 1.5]", "to: [0.001, 0.0015]")
    .replace("radius: 0.15", "radius: 0.00015")
    .replace("[0.5, 0.4]", "[0.0005, 0.0004]")
    .replace("viscosity: 0.05", "viscosity: 5.0e-8")
    .replace("[0, -10]", "[0, -0.01]")
)


def run(text, folder):
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


FLOORS = {
    "as it was": (ONE, "y", 0.15, 24),
    "large": (WIDE, "y", 0.25, 48),
    "partitioned": (ONE.replace("coupling: {}", "coupling: {scheme: partitioned}"), "y", 0.15, 24),
    "a third of a cell beside": (ONE.replace("[0.5, 0.4]", "[0.521, 0.4]"), "y", 0.15, 24),
    "half of the step": (ONE.replace("step: 0.02, end: 1.5", "step: 0.01, end: 0.6"), "y", 0.15, 24),
    "a thousandth of the size": (SMALL, "y", 0.00015, 24),
    "sideways": (ONE.replace("gravity: [0, -10]", "gravity: [-10, 0]"), "x", 0.15, 24),
    # the facets of the ball are 0.936 radii from its centre, those of an octagon 0.924
    "in space": (BALL, "z", 0.15, 8),
}


@pytest.mark.slow
@pytest.mark.parametrize("scene", FLOORS)
def test_a_free_body_stops_at_a_wall(tmp_path, scene):
    """It comes down to it, as far as its polygon can, and stays."""
    text, axis, radius, sides = FLOORS[scene]
    place = run(text, tmp_path)[f"a.{axis}"]
    assert place.min() > radius * np.cos(np.pi / sides) * (1.0 - 1e-9)
    assert place[-1] < radius + 3.0 * STANDOFF * radius + 0.05 * radius
    assert abs(place[-1] - place[-3]) < 0.02 * radius


@pytest.mark.slow
@pytest.mark.parametrize("other_first", [False, True])
def test_one_free_disc_falls_on_another(tmp_path, other_first):
    """In either order of the case; the lower one lies on the floor."""
    text = TWO
    if other_first:
        lines = text.splitlines(keepends=True)
        first = next(i for i, line in enumerate(lines) if line.startswith("    a: "))
        lines[first], lines[first + 1] = lines[first + 1], lines[first]
        text = "".join(lines)
    found = run(text, tmp_path)
    distance = np.hypot(found["a.x"] - found["b.x"], found["a.y"] - found["b.y"])
    assert distance.min() > 2.0 * 0.15 * np.cos(np.pi / 24) * (1.0 - 1e-9)
    for name in "ab":
        assert found[f"{name}.y"].min() > 0.15 * np.cos(np.pi / 24) * (1.0 - 1e-9)
    assert distance.min() < 0.3 * 1.01


@pytest.mark.slow
def test_a_free_disc_falls_on_a_fixed_one(tmp_path):
    found = run(FIXED, tmp_path)
    distance = np.hypot(found["a.x"], found["a.y"] - 0.5)
    assert 2.0 * 0.25 * np.cos(np.pi / 48) * (1.0 - 1e-9) < distance.min() < 0.5 * 1.01


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["monolithic", "partitioned"])
def test_an_elastic_disc_stops_at_the_floor(tmp_path, scheme):
    """It bounces on the floor; fluid and solid fill the box."""
    found = run(ELASTIC.replace("coupling: {}", f"coupling: {{scheme: {scheme}}}"), tmp_path)
    assert 0.15 < found["a.y"].min() < 0.205
    assert found["fluid"] + found["solid"] == pytest.approx(1.2, rel=1e-3)
