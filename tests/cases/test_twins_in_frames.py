"""`fsci twin`: a case mirrored, and turned by 90 degrees, has the same answer to the last digits."""

import json

import pytest
from programs import fsci

pytestmark = pytest.mark.usefixtures("runs_in_copies")

#: A stirrer and a beam in a channel, with gravity, formulas of place and time, nested cells and graded ones.
FLOW = """
time: {step: 0.05, end: 0.2}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  grid:
    from: [-0.3, -0.2]
    to: [1.7, 0.9]
    cells: [null, 11]
    x: [{to: 0.7, cells: 10}, {to: 1.7, cells: 10, ratio: 1.3}]
    refine: [{around: stirrer, level: 1}, {box: [[0.7, -0.1], [1.6, 0.7]]}]
  gravity: [0, -1]
  body_force: ["0.1*y", "0.2*x*t"]
  initial_velocity: ["0.01*(y + 0.2)", 0]
  patches:
    walls: {on: [y-, y+], no_slip: true}
    inlet: {on: x-, velocity: ["(y + 0.2)*(0.9 - y)*ramp(t, 0, 0.2)", "0.05*y*(0.9 - y)"]}
    upper: {on: x+, where: "y - 0.31", outflow: true}
    lower: {on: x+, where: "0.31 - y", pressure: "0.1*y"}
  bodies:
    stirrer:
      mesh: {shape: rectangle, size: [0.4, 0.12], origin: [-0.21, -0.05], cells: [4, 1], rotate: {angle: 17},
             translate: [0.31, 0.37]}
      motion: {displacement: ["0.01*t", 0], rotation: {centre: [0.3, 0.35], angle: "40*t"}}
    ball: {mesh: {shape: disc, radius: 0.1, cells: [12, 1], translate: [1.21, 0.3]}}
probes:
  force: {quantity: force, body: stirrer}
  moment: {quantity: moment, body: stirrer, about: [0.3, 0.35]}
  drag: {quantity: drag_coefficient, body: ball, reference: {velocity: 1, length: 0.2}}
  lift: {quantity: lift_coefficient, body: ball, reference: {velocity: 1, length: 0.2}}
  u: {quantity: velocity, at: [0.83, 0.61]}
  dp: {quantity: pressure, at: [-0.1, 0.4], minus: [1.6, 0.2]}
  out: {quantity: flow_rate, through: upper}
  across: {quantity: flow_rate, plane: {point: [0.71, 0.3], normal: [2, 1]}}
  wake: {quantity: velocity, box: [[0.83, 0.11], [1.37, 0.52]]}
  fastest: {quantity: speed, box: [[0.83, 0.11], [1.37, 0.52]]}
"""

#: A free body with springs, and the wall that it meets.
FREE = """
time: {step: 0.05, end: 0.2}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  grid: {from: [0, 0], to: [1.1, 0.9], cells: [18, 15]}
  patches:
    wall: {on: [x-, x+, y-], no_slip: true}
    top: {on: y+, traction: ["0.1*x", 0]}
  bodies:
    plate:
      mesh: {shape: rectangle, size: [0.3, 0.12], cells: [4, 2], rotate: {angle: 25}, translate: [0.37, 0.31]}
      free:
        density: 3
        gravity: [0.5, -1]
        springs: [{at: [0.4, 0.35], stiffness: [2, 5], damping: 0.1}]
        held: [x]
        initial_velocity: [0, -0.1]
        initial_angular_velocity: [86]
coupling: {scheme: monolithic}
probes:
  v: {quantity: velocity, body: plate, at: [0.5, 0.4]}
  spin: {quantity: angular_momentum, body: plate}
"""

#: A block of steel that turns over a soft one with friction; a support, a spring and a pressure that depend on place.
CONTACT = """
time: {step: 0.25, end: 1}
structure:
  bodies:
    low:
      mesh: {shape: rectangle, size: [2, 1], cells: [6, 3]}
      material: {law: neo_hooke, E: "100*(1 + 0.3*x)", nu: 0.3}
      supports: [{on: bottom, displacement: [0, 0]}]
      springs: [{on: left, stiffness: "3*(1 + y)", direction: [1, 0.4]}]
      pressures: [{on: right, value: "2*y*t"}]
    high:
      mesh: {shape: disc, radius: 0.4, cells: [16, 2], cell: tri, translate: [0.83, 1.41]}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.2, density: 5}
      gravity: [0.1, -1]
      supports: [{at: [0.83, 1.81], displacement: ["0.1*t", "-0.1*t"]},
                 {at: [0.83, 1.41], direction: [1, 0.2], displacement: "0.1*t"}]
contact:
  pairs:
    touch: {slave: {body: high, on: outer}, master: {body: low, on: top}, friction: {coefficient: 0.2}}
probes:
  top: {quantity: displacement, body: low, at: [1, 1]}
  reaction: {quantity: reaction, body: low, on: bottom}
verify:
  - {value: contact.touch.x, statistic: min, reference: 5, relative: 100}
"""

#: Two boxes of tetrahedra and hexahedra in space, turned, pressed and sheared; an obstacle that moves.
CONTACT_3D = """
time: {step: 0.5, end: 1}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    low:
      mesh: {shape: box, size: [1, 1, 0.5], cells: [2, 2, 1], cell: tet}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
    high:
      mesh: {shape: box, size: [0.7, 0.6, 0.4], cells: [2, 2, 2], rotate: {axis: [0, 0, 1], angle: 20},
             translate: [0.37, 0.17, 0.5]}
      material: {law: neo_hooke, E: 200, nu: 0.3, density: 1}
      initial_velocity: ["0.1*(z - 0.5)", "0.02*x", 0]
contact:
  obstacles:
    plate: {mesh: {shape: box, size: [2, 2, 0.1], origin: [-0.5, -0.5, 0.9], cells: [1, 1, 1],
                   rotate: {axis: [0, 1, 0], angle: 2}}, on: bottom, motion: ["0.02*t", "0.01*t", "-0.04*t"]}
  pairs:
    between: {slave: {body: high, on: bottom}, master: {body: low, on: top}, friction: {coefficient: 0.3}}
    above: {slave: {body: high, on: top}, master: {obstacle: plate}}
probes:
  end: {quantity: displacement, body: high, at: [0.37, 0.17, 0.9]}
  spin: {quantity: angular_momentum, body: high}
  reaction: {quantity: reaction, body: low, on: bottom}
"""

#: An elastic flag behind a cylinder in a channel.
COUPLED = """
time: {step: 0.05, end: 0.2}
fluid:
  density: 1
  viscosity: 0.02
  element: q1q1
  grid: {from: [0, 0], to: [2, 1], cells: [24, 12]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1 - y)*ramp(t, 0, 0.5)", 0]}
    walls: {on: [y-, y+], no_slip: true}
    outlet: {on: x+, outflow: true}
  bodies:
    post: {mesh: {shape: disc, radius: 0.15, cells: [16, 1], translate: [0.5, 0.46]}}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    flag:
      mesh: {shape: rectangle, size: [0.6, 0.1], origin: [0.6, 0.41], cells: [6, 2], order: 2}
      material: {law: st_venant_kirchhoff, E: 500, nu: 0.4, density: 10}
      supports: [{on: left, displacement: [0, 0]}]
      gravity: [0, -0.5]
coupling: {scheme: monolithic}
probes:
  tip: {quantity: displacement, at: [1.2, 0.46]}
  force: {quantity: force, field: fluid, body: post}
"""

#: A block in a flow in space and a rotating cylinder. First-order hexahedra would have other diagonals in the mirror.
COUPLED_3D = """
time: {step: 0.1, end: 0.2}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  grid: {from: [0, 0, 0], to: [1.4, 1, 1], cells: [7, 5, 5]}
  patches:
    inlet: {on: x-, velocity: ["y*(1 - y)*z*(1 - z)", 0, "0.01*y*(1 - y)"]}
    walls: {on: [y-, y+, z-, z+], no_slip: true}
    outlet: {on: x+, outflow: true}
  bodies:
    roller:
      mesh: {shape: cylinder, radius: 0.17, height: 0.3, cells: [8, 1, 1], cell: tet,
             rotate: {axis: [1, 0.3, 0], angle: 40}, translate: [0.43, 0.53, 0.41]}
      motion: {rotation: {centre: [0.43, 0.5, 0.5], axis: [0.2, 0, 1], angle: "50*t"}}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    block:
      mesh: {shape: box, size: [0.2, 0.3, 0.4], cells: [1, 1, 2], cell: tet, order: 2, translate: [0.81, 0.33, 0]}
      material: {law: neo_hooke, E: 20, nu: 0.3, density: 1}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
coupling: {scheme: monolithic}
probes:
  tip: {quantity: displacement, at: [0.81, 0.33, 0.4]}
  moment: {quantity: moment, body: roller}
  force: {quantity: force, field: fluid, body: roller}
"""

SCENES = {
    "flow": FLOW, "free": FREE, "contact": CONTACT, "contact_3d": CONTACT_3D, "coupled": COUPLED,
    "coupled_3d": COUPLED_3D,
}  # fmt: skip

#: of which a flow with bodies, and contact in space, show as much
DEAR = ("flow", "coupled_3d")


@pytest.mark.parametrize(
    "scene", [pytest.param(name, marks=pytest.mark.slow if name in DEAR else ()) for name in SCENES]
)
def test_the_same_in_other_coordinates(scene, tmp_path):
    (tmp_path / "case.yaml").write_text(SCENES[scene])
    ended = fsci("twin", tmp_path, "-o", tmp_path / "out", "--only", "mirrored", "--only", "turned")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    found = json.loads((tmp_path / "out" / "twin.json").read_text())
    assert set(found["runs"]) == {"case", "mirrored", "turned"}
    for name, value in found["values"].items():
        assert value["scale"] > 0.0, name
        for twin, change in value["changes"].items():
            assert change["curve"] < 1e-8, (name, twin)
