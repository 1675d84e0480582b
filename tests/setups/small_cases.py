"""The smallest cases, for tests of what is around the computation: folders, files, bounds, the end of runs."""

#: a block that nothing moves
BLOCK = """\
time: {step: 1, end: 1}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [1, 1], order: 1}
      material: {law: neo_hooke, E: 1, nu: 0}
      supports: [{on: left, displacement: [0, 0]}]
"""

#: a plate under a load that grows, in five steps
PLATE = """\
time: {step: 0.2, end: 1}
structure:
  bodies:
    plate:
      mesh: {shape: rectangle, size: [1, 1], cells: [2, 2], order: 1}
      material: {law: neo_hooke, E: 1, nu: 0.3}
      supports: [{on: left, displacement: [0, 0]}]
      body_force: [0, "1e-6*t"]
"""
