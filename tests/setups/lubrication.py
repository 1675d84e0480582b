"""Drag of a cylinder and of a sphere that approach a wall in creeping flow: exact, and computed."""

from __future__ import annotations

import numpy as np
from fluid_setup import body, circle, field, loop, make_fluid, solve_steady, sphere, step, with_slip

from solvers.fluid.flow.field import Fluid
from solvers.fluid.grid.box import Grid
from solvers.fluid.terms.boundary.patches import Patch


def cylinder_drag(gap: float) -> float:
    """F / (mu V) per length for a gap in radii (Jeffrey and Onishi 1981)."""
    alpha = np.arccosh(1.0 + gap)
    return float(4.0 * np.pi / (alpha - np.tanh(alpha)))


def sphere_drag(gap: float) -> float:
    """F / (6 pi mu a V) for a gap in radii (Brenner 1961)."""
    alpha, n = np.arccosh(1.0 + gap), np.arange(1.0, 40.0 / np.arccosh(1.0 + gap))
    top = 2.0 * np.sinh((2 * n + 1) * alpha) + (2 * n + 1) * np.sinh(2 * alpha)
    bottom = 4.0 * np.sinh((n + 0.5) * alpha) ** 2 - (2 * n + 1) ** 2 * np.sinh(alpha) ** 2
    terms = n * (n + 1) / ((2 * n - 1) * (2 * n + 3)) * (top / bottom - 1.0)
    return float(4.0 / 3.0 * np.sinh(alpha) * terms.sum())


def stretched(h: float, fine: float, end: float, growth: float) -> np.ndarray:
    """Planes from 0: cells of size h up to `fine`, then each larger than the last by a factor, up to `end`."""
    planes = list(np.linspace(0.0, fine, round(fine / h) + 1))
    size = h
    while planes[-1] < end:
        size *= growth
        planes.append(planes[-1] + size)
    return np.array(planes)


def film_force(dim: int, gap: float, *, slip: float = 0.0, transmissivity: float = 0.0) -> float:
    """F / (mu V) of the film alone in the limit of small gaps, whose height is gap + r^2 / 2 (lubrication theory).

    With the flux T p' / mu, T = g^3 / 12 + slip g^2 / 2 + transmissivity (slip: slip length of both walls), it is
    F = 2 int x^2 / T dx in 2D and pi / 2 int r^3 / T dr in 3D.
    """
    # r = tan(s): a smooth integrand over a finite interval
    places, weights = np.polynomial.legendre.leggauss(400)
    s = np.pi / 4 * (places + 1.0)
    r, dr = np.tan(s), np.pi / 4 * weights / np.cos(s) ** 2
    g = gap + r**2 / 2
    T = g**3 / 12.0 + slip * g**2 / 2.0 + transmissivity
    return float(dr @ (2.0 * r**2 / T if dim == 2 else np.pi / 2 * r**3 / T))


def approaching(
    dim: int,
    gap: float,
    h: float,
    element: str,
    *,
    size=8.0,
    growth=1.15,
    fine=1.0,
    slip: float = 0.0,
    transmissivity=0.0,
    narrow_gaps: bool = False,
) -> Fluid:
    """A body of radius 1 at rest for an instant, its surface moving down to the wall y = 0 (z = 0) with velocity 1.

    Half of the cylinder, a quarter of the sphere; free outer boundary. Cells of size h near the gap. slip: slip length
    of both walls; transmissivity: of the body's surface.
    """
    sides = stretched(h, fine, size, growth)
    up = stretched(h, max(4 * h, round((gap + 0.3) / h) * h), size, growth)
    down = -np.eye(dim)[-1]
    if dim == 2:
        points, facets = circle([0.0, 1.0 + gap], 1.0, 2000), loop(2000)
        planes = [Patch("symmetry", ("x-",), "slip"), Patch("free", ("x+", "y+"), "traction", field(0, 0))]
    else:
        points, facets = sphere([0.0, 0.0, 1.0 + gap], 1.0, 5)
        planes = [
            Patch("symmetry", ("x-", "y-"), "slip"),
            Patch("free", ("x+", "y+", "z+"), "traction", field(0, 0, 0)),
        ]
    face = ("xyz"[dim - 1] + "-",)
    wall = Patch("wall", face, "slip_length", field(slip)) if slip else Patch("wall", face, "no_slip")
    moving = with_slip(body("body", points, facets, velocity=down), slip, transmissivity)
    grid = Grid((*[sides] * (dim - 1), up))
    settings = {"element": element, "scheme": "steady", "convection": False, "narrow_gaps": narrow_gaps}
    fluid = make_fluid(grid, [*planes, wall], [moving], **settings)
    solve_steady(fluid)
    return fluid


def drag_ratio(dim: int, gap: float, h: float, element: str, **options) -> float:
    """Computed over exact drag."""
    force = approaching(dim, gap, h, element, **options).force()["body"].sum(axis=0)[-1]
    exact = cylinder_drag(gap) if dim == 2 else 6.0 * np.pi * sphere_drag(gap)
    return float(force * 2 ** (dim - 1) / exact)


def slip_ratio(dim: int, gap: float, h: float, element: str, slip: float, **options) -> float:
    """Computed over expected drag with slip on both walls: the film's, and around it that without slip."""
    force = approaching(dim, gap, h, element, slip=slip, **options).force()["body"].sum(axis=0)[-1]
    exact = cylinder_drag(gap) if dim == 2 else 6.0 * np.pi * sphere_drag(gap)
    return float(force * 2 ** (dim - 1) / (film_force(dim, gap, slip=slip) + exact - film_force(dim, gap)))


def seepage_ratio(dim: int, gap: float, h: float, element: str, transmissivity: float, **options) -> float:
    """Computed drag over that of the film with transmissivity alone."""
    fluid = approaching(dim, gap, h, element, transmissivity=transmissivity, **options)
    force = fluid.force()["body"].sum(axis=0)[-1] * 2 ** (dim - 1)
    return float(force / film_force(dim, gap, transmissivity=transmissivity))


def closing_ratios(
    h: float, steps: int, dt: float, start: float | None = None, more: tuple[float, ...] = (), **settings
) -> list[tuple[float, float]]:
    """(gap in cells, computed over exact drag) of a cylinder whose gap is start exp(-t), step by step.

    start: h if it is not given; more: lengths of further steps.
    """
    start, t = h if start is None else start, 0.0
    points, facets = circle([0.0, 1.0], 1.0, 2000), loop(2000)

    def motion(x, t):
        gap = start * np.exp(-t)
        return x + np.array([0.0, gap]), 0.0 * x - np.array([0.0, gap])

    patches = [
        Patch("symmetry", ("x-",), "slip"),
        Patch("free", ("x+", "y+"), "traction", field(0, 0)),
        Patch("wall", ("y-",), "no_slip"),
    ]
    grid = Grid((stretched(h, 1.0, 8.0, 1.15), stretched(h, 4 * h, 8.0, 1.15)))
    settings = {"element": "q2q1", "scheme": "bdf2", "convection": False, "rho": 1e-3} | settings
    fluid = make_fluid(grid, patches, [body("body", points, facets, motion=motion)], dt=dt, **settings)
    ratios = []
    for length in (*[dt] * steps, *more):
        step(fluid, t, length)
        t += length
        gap = start * np.exp(-t)
        force = 2.0 * fluid.force()["body"].sum(axis=0)[1]
        ratios.append((gap / h, float(force / (gap * cylinder_drag(gap)))))
    return ratios


def settling_ratio(start: float, end: float, h: float, element: str, points: int = 3) -> float:
    """Time in which a constant force F brings a cylinder from one gap to another, computed over exact.

    Without inertia F = D V with the drag D of unit velocity, hence time = int D d gap / F. Gauss points in ln(gap): two
    of them integrate the exact drag to 1e-5 where the gap falls to 0.4 times its size, three to 1e-8.
    """
    places, weights = np.polynomial.legendre.leggauss(points)
    gaps = np.sqrt(start * end) * (start / end) ** (places / 2.0)
    exact = weights * gaps * [cylinder_drag(gap) for gap in gaps]
    return float(exact @ [drag_ratio(2, gap, h, element) for gap in gaps] / exact.sum())


if __name__ == "__main__":
    import sys

    dim, element, h = int(sys.argv[1]), sys.argv[2], float(sys.argv[3])
    for gap in (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01):
        ratio = drag_ratio(dim, gap, h, element)
        print(f"{dim}D {element} h {h} gap {gap:5} = {gap / h:6.2f} h  drag / exact {ratio:.4f}", flush=True)
