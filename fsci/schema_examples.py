"""An example for every section of the input reference: model -> YAML text, with the setting that holds the section."""

from __future__ import annotations

from fsci.case.material import MATERIAL_EXAMPLES
from fsci.case.shapes import SHAPE_EXAMPLES

CASE = """\
title: A block under its weight
time: {step: 0.5, end: 1}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 0.5], cells: [4, 2]}
      material: {law: neo_hooke, E: 1e5, nu: 0.3, density: 1000}
      supports: [{on: bottom, displacement: [0, 0]}]
      gravity: [0, "-9.81*t"]
"""

BODY = """\
bodies:
  beam:
    mesh: {shape: rectangle, size: [1, 0.1], cells: [20, 2], order: 2}
    material: {law: st_venant_kirchhoff, E: 1e8, nu: 0.3, density: 1000}
    supports: [{on: left, displacement: [0, 0]}]
    gravity: [0, -9.81]
"""

STRUCTURE = """\
structure:
  dynamics: {rho_inf: 0.9}
  bodies:
    ball:
      mesh: {shape: sphere, radius: 0.1, cells: [4, 2]}
      material: {law: neo_hooke, E: 1e5, nu: 0.4, density: 1000}
      initial_velocity: [0, 0, -1]
"""

FLUID = """\
fluid:
  density: 1000
  viscosity: 1e-3
  grid: {from: [0, 0], to: [2, 1], cells: [80, 40]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1 - y)*ramp(t, 0, 0.5)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
"""

CONTACT = """\
contact:
  obstacles:
    floor: {mesh: {shape: rectangle, size: [3, 0.1], cells: [1, 1], origin: [-1.5, -0.1]}, on: top}
  pairs:
    floor: {slave: {body: ball, on: outer}, master: {obstacle: floor}}
"""

EXAMPLES = {
    **SHAPE_EXAMPLES,
    **MATERIAL_EXAMPLES,
    "Case": CASE,
    "Units": "units: {length: mm, mass: t, time: s}   # stresses are in MPa",
    "Time": "time: {step: 0.01, end: 2}",
    "Retry": "retry: {halvings: 2}",
    "Curve": "curves:\n  pulse: {table: [[0, 0], [0.1, 5], [0.3, 0]], smooth: true}   # then pulse(t) is an expression",
    "Structure": STRUCTURE,
    "Dynamics": "dynamics: {rho_inf: 0.8, damping: {stiffness: 1e-3}}",
    "Damping": "damping: {mass: 0.1, stiffness: 1e-3}",
    "Body": BODY,
    "FileMesh": "mesh: {file: flag.geo, order: 2, parameters: {refine: 2}}",
    "MeshSurface": ("surfaces:\n  top: {normal: [0, 0, 1], within: 5}\n  hole: {box: [[0.4, 0.4, 0], [0.6, 0.6, 1]]}"),
    "Rotation": "rotate: [{angle: 90, axis: [0, 0, 1]}, {angle: 30, axis: [1, 0, 0]}]",
    "Support": (
        'supports:\n  - {on: bottom, displacement: [0, 0, 0]}\n  - {on: top, displacement: [null, null, "-0.1*t"]}\n'
        "  - {on: left, symmetry: true}"
    ),
    "Spring": "springs:\n  - {on: left, stiffness: 1e4, normal: true}",
    "Traction": 'tractions:\n  - {on: right, value: [0, "-1e3*ramp(t, 0, 1)"]}',
    "Pressure": 'pressures:\n  - {on: [inner, start], value: "2e3*t"}',
    "Active": 'active:\n  - {direction: [1, 0, 0.2], stress: "6e4*ramp(t, 0, 1)"}',
    "PreStretch": "pre_stretch: [{direction: [1, 0, 0], stretch: 1.2}]",
    "LineForce": "line_forces:\n  - {on: edge, value: [0, 0, -10]}",
    "PointForce": "point_forces:\n  - {at: [1, 0.05], value: [0, -10]}",
    "Fluid": FLUID,
    "Grid": "grid:\n  from: [0, 0]\n  to: [2.2, 0.41]\n  cells: [null, 41]\n"
    "  x: [{to: 0.1, cells: 10, ratio: 0.3}, {to: 0.3, cells: 50}, {to: 2.2, cells: 60, ratio: 12}]",
    "Stretch": "x: [{to: 0.3, cells: 30}, {to: 2.2, cells: 60, ratio: 12}]",
    "Refinement": "refine: [{around: cylinder, level: 2}, {box: [[0.25, 0.1], [0.6, 0.3]], level: 1}]",
    "Patch": 'patches:\n  in: {on: x-, velocity: ["1 - y^2", 0]}\n  outlet: {on: x+, where: "y - 0.5", outflow: true}'
    "\n  walls: {on: [y-, y+], no_slip: true}",
    "Windkessel": "windkessel: {proximal: 1e7, capacitance: 1e-9, distal: 1e8}",
    "Carreau": "shear: {law: carreau, infinite: 0.00345, time: 3.313, exponent: 0.3568}",
    "PowerLaw": "shear: {law: power_law, exponent: 0.6, least_rate: 1e-3}",
    "RigidBody": "bodies:\n  cylinder: {mesh: {shape: disc, radius: 0.05, cells: [120, 1], translate: [0.2, 0.2]}}",
    "Movement": 'motion: {displacement: [0, "0.02*sin(2*pi*t)"]}',
    "Turn": 'rotation: {centre: [0.2, 0.2], angle: "30*sin(2*pi*t)"}',
    "Free": "free: {density: 1120, gravity: [0, 0, -9.81], held: [x, y], initial_angular_velocity: [0, 0, 90]}",
    "PointSpring": "springs:\n  - {at: [0, 0, 0], stiffness: [1, 1, 1], damping: 0.1}\n"
    "  - {at: [0, 0, 0], stiffness: 40, to: {body: other, at: [1, 0, 0]}, length: 0.8}",
    "SpringEnd": "to: {body: other, at: [1, 0]}",
    "RigidLoad": 'loads:\n  - {force: [0, "-100*ramp(t, 0, 1)"], at: [0.1, 0]}\n  - {moment: 5}',
    "Rigid": "rigid:\n  gravity: [0, -9.81]\n  bodies:\n"
    "    bar: {mesh: {shape: rectangle, size: [1, 0.1], cells: [1, 1]}, density: 1000, pivot: [0, 0.05]}",
    "FreeBody": "bodies:\n  ball: {mesh: {shape: sphere, radius: 0.1, cells: [4, 2]}, density: 1120}",
    "FreeMotion": 'free: {density: 7800, held: [x, rotation], loads: [{force: [0, "-1e4*ramp(t, 0, 1)"]}]}',
    "RigidDynamics": "dynamics: {rho_inf: 0.8}",
    "Coupling": "coupling: {scheme: partitioned, accelerator: iqn, tolerance: 1e-7}",
    "Contact": CONTACT,
    "Pair": "pairs:\n  floor:\n    slave: {body: ball, on: outer}\n    master: {obstacle: floor}\n"
    "    friction: {bound: 2}\n  glue: {slave: {body: lid, on: bottom}, master: {body: box, on: top}, tied: true}"
    "\n  fold: {self: {body: strip, on: inside}}",
    "Side": "slave: {body: ball, on: outer}",
    "Friction": "friction: {coefficient: 0.3}",
    "RigidPair": "rigid_pairs:\n  slippery: {bodies: [ball, floor], friction: {coefficient: 0.1}}",
    "Film": "film: {roughness: 1e-5}",
    "Obstacle": 'obstacles:\n  stamp: {mesh: {file: stamp.geo}, on: face, motion: [0, 0, "-0.1*t"]}',
    "Probe": "probes:\n  tip: {quantity: displacement, at: [1, 0.05]}\n  clamp: {quantity: reaction, on: left}\n"
    "  drag: {quantity: drag_coefficient, body: cylinder, reference: {velocity: 0.2, length: 0.1}}\n"
    "  gap: {quantity: gap, pair: floor}\n  wake: {quantity: velocity, box: [[0.5, 0], [1, 0.2]]}",
    "Plane": "plane: {point: [0.5, 0], normal: [1, 0]}",
    "Reference": "reference: {velocity: 0.2, length: 0.1}",
    "Output": "output: {fields_every: 5, checkpoint_every: 20}",
    "Check": "verify:\n  - {value: tip.y, statistic: min, reference: -0.0661, relative: 0.001}\n"
    "  - {value: fluid.mass, reference: 0, absolute: 1e-9}",
    "Solver": "solver: {newton: {residual: 1e-10}, linear: {method: direct}}",
    "Newton": "newton: {residual: 1e-10, max_iterations: 40, line_search: true}",
    "Linear": "linear: {method: iterative, tolerance: 1e-10}",
}
