"""Texts of small cases that several tests take, change and put together."""

BEAM = """\
time: {step: 0.05, end: 1}
structure:
  dynamics: {rho_inf: 0.9}
  bodies:
    beam:
      mesh: {shape: rectangle, size: [2, 0.5], cells: [22, 2], order: 1}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [0, 0]}]
      gravity: [0, "-3*sin(3*t)"]
"""

BLOCK = """\
time: {step: 0.005, end: 1}
structure:
  dynamics: {rho_inf: 0.9}
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 0.5], cells: [8, 4], order: 1, origin: [0, 0.001]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      gravity: [0, -10]
contact:
  obstacles:
    floor: {mesh: {shape: rectangle, size: [3, 0.2], cells: [3, 1], origin: [-1, -0.2]}, on: top}
  pairs:
    floor: {slave: {body: block, on: bottom}, master: {obstacle: floor}}
"""

CHANNEL = """\
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  grid: {from: [0, 0], to: [2, 1], cells: [20, 10]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1 - y)*min(t/0.1, 1)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
"""

FLOW = "time: {step: 0.02, end: 1}\n" + CHANNEL

DISC = """\
  bodies:
    disc: {mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [0.78, 0.51]}}
"""

COLUMN = """\
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    post:
      mesh: {shape: rectangle, size: [0.23, 0.41], origin: [0.62, 0], cells: [3, 5], order: 1}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.3, density: 10}
      supports: [{on: bottom, displacement: [0, 0]}]
"""

POST = COLUMN + "coupling: {scheme: monolithic}\n"
