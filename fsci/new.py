"""First cases to start from."""

from __future__ import annotations

from pathlib import Path

BEAM = """\
# A cantilever beam is released from its straight shape and swings under its own weight.
# Check it:    fsci check {folder}
# Run it:      fsci run {folder}
# See it:      fsci plot results/{name}
# All settings: fsci schema --markdown
title: {name}

# The units of all numbers below; they are written to the results.
units: {{length: m, mass: kg, time: s}}

# 0.4 s are two periods of the slowest oscillation.
time: {{step: 0.004, end: 0.4}}

structure:
  # Without this line the case is static. rho_inf: 1 keeps the energy, smaller values damp the fastest oscillations.
  dynamics: {{rho_inf: 0.9}}
  bodies:
    beam:
      # A built-in shape: 1 m long, 0.1 m high, with the surfaces left, right, bottom and top.
      mesh: {{shape: rectangle, size: [1, 0.1], cells: [20, 2], order: 2}}
      material: {{law: st_venant_kirchhoff, E: 1e8, nu: 0.3, density: 1000}}
      supports:
        - {{on: left, displacement: [0, 0]}}   # null instead of a number leaves a component free
      gravity: [0, -9.81]
      # More loads; numbers may be expressions of x, y, z and t:
      # tractions:
      #   - {{on: right, value: [0, "1e4*min(t/0.1, 1)"]}}
      # pressures:
      #   - {{on: top, value: "500*sin(2*pi*x)"}}

# Every step writes these to history.csv.
probes:
  tip: {{quantity: displacement, at: [1, 0.05]}}
  clamp: {{quantity: reaction, on: left}}
  energy: {{quantity: energy}}

# States for ParaView: every second step.
output: {{fields_every: 2}}

# The run fails if it misses these. By beam theory in plane strain, with E' = E/(1 - nu^2), height h and length l,
# the tip swings about the static deflection -1.5 density gravity l^4/(E' h^2) with the frequency
# 0.1615 h/l^2 sqrt(E'/density).
verify:
  - {{value: tip.y, statistic: mean, reference: -0.0134, relative: 0.05}}
  - {{value: tip.y, statistic: frequency, reference: 5.355, relative: 0.05}}
"""

BEAM_README = """\
# {name}

A cantilever beam, 1 m x 0.1 m in plane strain, is released from its straight shape and swings under its own weight.

    fsci check {folder}           # is the case right?
    fsci run {folder}             # results in results/{name}
    fsci plot results/{name}      # pictures

Other settings without editing:

    fsci run {folder} --set structure.bodies.beam.material.E=2e8 --set verify=[] -o results/stiffer
"""


CHANNEL = """\
# Flow past a cylinder in a channel, from rest to a steady flow of Reynolds number 20.
# Check it:    fsci check {folder}
# Run it:      fsci run {folder}
# See it:      fsci plot results/{name}
# All settings: fsci schema --markdown
title: {name}
time: {{step: 0.05, end: 3}}

fluid:
  density: 1
  viscosity: 1e-3
  # The grid is a box; the cylinder cuts its cells. Here they are 2.5 cm, but 1 cm around the cylinder.
  grid:
    from: [0, 0]
    to: [2.2, 0.41]
    x: [{{to: 0.1, cells: 4}}, {{to: 0.3, cells: 20}}, {{to: 2.2, cells: 32, ratio: 8}}]
    y: [{{to: 0.1, cells: 6, ratio: 0.4}}, {{to: 0.3, cells: 20}}, {{to: 0.41, cells: 6, ratio: 3}}]
  # What happens on the faces x-, x+, y-, y+ of the box; where patches overlap, the one named last decides.
  patches:
    inlet: {{on: x-, velocity: ["min(t, 1)*1.2*y*(0.41 - y)/0.41^2", 0]}}
    outlet: {{on: x+, outflow: true}}
    walls: {{on: [y-, y+], no_slip: true}}
  bodies:
    cylinder:
      mesh: {{shape: disc, radius: 0.05, cells: [120, 1], translate: [0.2, 0.2]}}
      # motion: {{displacement: [0, "0.02*sin(2*pi*t)"]}}   # it may move

# Every step writes these to history.csv.
probes:
  force: {{quantity: force, body: cylinder}}
  dp: {{quantity: pressure, at: [0.15, 0.2], minus: [0.25, 0.2]}}
  outlet: {{quantity: flow_rate, through: outlet}}

output: {{fields_every: 5}}

# The run fails if it misses these: the drag of a benchmark (Schaefer and Turek, 1996), and that what comes in goes out.
verify:
  - {{value: force.x, reference: 0.01116, relative: 0.02}}
  - {{value: outlet, reference: 0.2*0.41, relative: 0.01}}
"""

CHANNEL_README = """\
# {name}

Flow past a cylinder of 0.1 m in a channel of 2.2 m x 0.41 m. It speeds up for 1 s and becomes steady;
the Reynolds number is 20.

    fsci check {folder}           # is the case right?
    fsci run {folder}             # results in results/{name}
    fsci plot results/{name}      # pictures

Other settings without editing, here for a vortex street at Reynolds number 100:

    fsci run {folder} --set fluid.viscosity=2e-4 --set time.end=15 --set verify=[] -o results/vortices
"""

BALL = """\
# An elastic ball (in 2D: a disc) falls through a fluid on the bottom of a box and bounces.
# Check it:    fsci check {folder}
# Run it:      fsci run {folder}
# See it:      fsci plot results/{name} --movie
# All settings: fsci schema --markdown
title: {name}
time: {{step: 0.02, end: 4}}

fluid:
  density: 1
  viscosity: 0.01
  scheme: backward_euler
  # The grid is a box, and stays where it is: the ball cuts its cells.
  grid: {{from: [-1.5, 0], to: [1.5, 3], cells: [20, 20]}}
  patches:
    surface: {{on: y+, outflow: true}}
    walls: {{on: [x-, x+, y-], no_slip: true}}

structure:
  dynamics: {{rho_inf: 0.8}}
  bodies:
    ball:
      mesh: {{shape: disc, radius: 0.5, cells: [32, 2], translate: [0, 1.5]}}
      material: {{law: neo_hooke, E: 4000, nu: 0.3, density: 20}}
      gravity: [0, -1]

contact:
  obstacles:
    bottom: {{mesh: {{shape: rectangle, size: [3, 0.1], cells: [1, 1], origin: [-1.5, -0.1]}}, on: top}}
  pairs:
    bottom: {{slave: {{body: ball, on: outer}}, master: {{obstacle: bottom}}}}

coupling: {{scheme: monolithic}}

# Every step writes these to history.csv.
probes:
  ball: {{field: structure, body: ball, quantity: centre}}
  force: {{field: fluid, body: ball, quantity: force}}
  energy: {{field: structure, quantity: energy}}

output: {{fields_every: 4}}

# The run fails if it misses these: results of this program on this grid, of the first jump and the deepest place.
verify:
  - {{value: ball.y, statistic: max, from: 1.7, reference: 0.854, absolute: 0.02, regression: true}}
  - {{value: ball.y, statistic: min, reference: 0.430, absolute: 0.005, regression: true}}
"""

BALL_README = """\
# {name}

An elastic ball of 1 m, 20 times as dense as the fluid, falls 1 m to the bottom of a box,
touches it, and jumps up again.

    fsci check {folder}                  # is the case right?
    fsci run {folder}                    # results in results/{name}
    fsci plot results/{name} --movie     # pictures

In a thinner fluid it jumps higher:

    fsci run {folder} --set fluid.viscosity=0.003 --set verify=[] -o results/thinner
"""

TEMPLATES = {"beam": (BEAM, BEAM_README), "channel": (CHANNEL, CHANNEL_README), "ball": (BALL, BALL_README)}


def texts(folder: Path, template: str) -> dict[Path, str]:
    """The files of a commented case that runs, and what stands in them."""
    case, readme = TEMPLATES[template]
    name = folder.absolute().name
    files = {folder / "case.yaml": case, folder / "README.md": readme}
    return {path: text.format(name=name, folder=folder) for path, text in files.items()}


def new_case(folder: Path, template: str = "beam") -> list[Path]:
    """Write a commented case that runs; raises FileExistsError rather than overwrite anything."""
    folder.mkdir(parents=True)
    files = texts(folder, template)
    for path, text in files.items():
        path.write_text(text, encoding="utf-8")
    return list(files)
