"""A leaflet of a valve in a round tube: a third of the section, or another part of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fsci.shapes import lattice
from solvers.mesh import Mesh


def leaflet(
    radius: float,
    thickness: float,
    height: float,
    lip: float,
    post: float,
    cells: Sequence[int],
    angle: float = 120,
    gap: float = 0,
    *,
    order: int = 1,
    cell: str = "hex",
) -> Mesh:
    """Leaflet about the z axis, middle on the x axis: from an arc of `radius` at z = 0 up to its lips at `height` [m].

    It fills a sector of `angle` degrees. The lips are upright, `lip` high, parallel to the straight sides of the sector
    and half of the `gap` away from them at the axis, nothing at the wall, so that leaflets side by side touch there.
    Below they go over into a pouch, a parabola from the lips down to the wall. Its edge at the wall is half of an
    ellipse, up to `post` below the lips, on a cylinder of `radius + thickness`.

    `cells` counts them along the wall (even), through the thickness, and up, at least two: the lips are whole rows of
    them. Surfaces inner (of the pouch, towards the inflow), lips (towards those of the other leaflets), outer, bottom
    (at the wall), top, start and end (upright, at the wall).
    """
    around, through, up = cells
    if up < 2:
        raise ValueError(f"the number of cells up must be at least 2, got {up}")
    if around % 2:
        raise ValueError(f"the number of cells along the wall must be even, got {around}")
    if not lip + post < height:
        raise ValueError(f"lip and post, {lip:g} and {post:g}, must be lower together than {height:g}")
    half = np.radians(angle / 2)
    nodes = lattice.product(
        lattice.product(
            lattice.line(through, order, ("inner", "outer")), lattice.line(around, order, ("start", "end"))
        ),
        lattice.line(up, order, ("bottom", "top")),
    )

    rows = min(max(1, round(up * lip / height)), up - 1)  # of the lips
    edge = 1 - rows / up  # the part of t below the lips
    upright = np.flatnonzero(nodes.points[:, 2] > edge - 0.25 / (order * up))

    def place(depth: lattice.Array, s: lattice.Array, t: lattice.Array) -> list[lattice.Array]:
        side, share = np.sign(2 * s - 1), np.abs(2 * s - 1)
        x, y = _lips(share, thickness * depth + gap / 2 * (1 - share**2), radius, half)
        foot = (height - lip - post) * (1 - np.cos(np.pi / 2 * share))
        # the foot's normal is that of the straight line to the lips; at the sides it is that of the lips
        turn = np.sin(np.pi / 2 * share) * (half - np.arcsin(thickness * depth / (radius + thickness)))
        slope = np.arctan2(height - lip - foot, radius * (1 - share)) * (1 - share)
        out = thickness * (depth - 0.5) * (1 - share)
        at_wall = radius + thickness + out * np.sin(slope)
        wall = at_wall * np.cos(turn), at_wall * np.sin(turn), foot + out * np.cos(slope)
        p = np.minimum(t / edge, 1)
        middle = (foot + height - lip) / 2
        return [
            (1 - p) ** 2 * wall[0] + (1 - (1 - p) ** 2) * x,
            side * ((1 - p) ** 2 * wall[1] + (1 - (1 - p) ** 2) * y),
            np.where(
                t < edge,
                (1 - p) ** 2 * wall[2] + 2 * p * (1 - p) * middle + p**2 * (height - lip),
                height - lip + lip * (t - edge) / (1 - edge),
            ),
        ]

    whole = lattice.mesh(nodes.mapped(place), cell)
    inner = whole.surfaces["inner"]
    of_lips = np.isin(inner, upright).all(axis=1)
    return replace(whole, surfaces=whole.surfaces | {"inner": inner[~of_lips], "lips": inner[of_lips]})


def _lips(share: lattice.Array, distance: lattice.Array, radius: float, half: float) -> tuple[lattice.Array, ...]:
    """(x, y) of points at a distance from the side of a sector: 0 of the share on the x axis, 1 at the radius."""
    first = distance / np.tan(half)
    along = first + share * (np.sqrt(radius**2 - distance**2) - first)
    return along * np.cos(half) + distance * np.sin(half), along * np.sin(half) - distance * np.cos(half)
