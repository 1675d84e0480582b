"""The text of a small coupled case that several tests change: a post on the floor of a channel."""

POST = """\
title: a post in a channel
time: {step: 0.02, end: 0.1}
fluid:
  density: 1
  viscosity: 0.05
  grid: {from: [0, 0], to: [2, 1], cells: [20, 10]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1 - y)*min(t/0.1, 1)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    post:
      mesh: {shape: rectangle, size: [0.23, 0.41], origin: [0.62, 0], cells: [3, 5]}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.3, density: 10}
      supports: [{on: bottom, displacement: [0, 0]}]
coupling: {scheme: monolithic}
probes:
  tip: {quantity: displacement, at: [0.735, 0.41]}
  force: {quantity: force}
  outflow: {quantity: flow_rate, through: outlet}
verify:
  - {value: tip.x, reference: 0.01, relative: 1}
solver: {newton: {residual: 1.0e-11}}
"""
