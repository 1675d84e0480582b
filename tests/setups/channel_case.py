"""The case of a flow in a channel around a cylinder that moves, for tests of how cases are read."""

from case_text import without

CASE = """\
title: channel
time: {step: 0.01, end: 1}
fluid:
  density: 1.2
  viscosity: 1e-3
  grid: {from: [0, 0], to: [4, 1], cells: [40, 10]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1 - y)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
  bodies:
    cylinder:
      mesh: {shape: disc, radius: 0.2, cells: [40, 1], translate: [1, 0.5]}
      motion: {displacement: [0, "0.1*sin(t)"], rotation: {centre: [1, 0.5], angle: 90*t}}
probes:
  force: {quantity: force}
  wake: {quantity: velocity, at: [2, 0.5]}
  dp: {quantity: pressure, at: [0, 0.5], minus: [4, 0.5]}
  out: {quantity: flow_rate, through: outlet}
verify:
  - {value: force.x, statistic: max, reference: 1, relative: 0.1}
"""
ALONE = without(without(CASE, "probes"), "verify")  #: without probes, and hence without reference values
RESTING = without(ALONE, "fluid", "bodies", "cylinder", "motion")  #: with a cylinder at rest
GRID = "cells: [40, 10]"  #: the part of its grid that tests replace
