"""The text of a small coupled case that several tests change: a post on the floor of a channel."""

from small_scenes import CHANNEL, COLUMN

PROBES = """\
probes:
  tip: {quantity: displacement, at: [0.735, 0.41]}
  force: {quantity: force}
  outflow: {quantity: flow_rate, through: outlet}
"""

REST = """\
verify:
  - {value: tip.x, reference: 0.02, relative: 1}
solver: {newton: {residual: 1.0e-11}}
"""


def post(end: float, coupling: str = "coupling: {scheme: monolithic}\n", rest: str = REST) -> str:
    """Until a time, with sections between the structure and the probes, and after these."""
    head = f"title: a post in a channel\ntime: {{step: 0.02, end: {end}}}\n"
    return head + CHANNEL + COLUMN + coupling + PROBES + rest


POST = post(0.1)
