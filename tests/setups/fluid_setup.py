"""Grids, bodies and flows that several tests use, and norms over the fluid part of the grid."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI

from solvers import fem
from solvers.fluid.cut.cut import Cutter
from solvers.fluid.flow.field import Fluid
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion
from solvers.fluid.terms.boundary.patches import Patch
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

TIGHT = SolverSettings(Tolerance(residual=1e-12), linear="direct")
BOX = {2: ("x-", "x+", "y-", "y+"), 3: ("x-", "x+", "y-", "y+", "z-", "z+")}


def field(*components) -> tuple[Callable, ...]:
    """A vector field from numbers and functions of (x, y, t) or (x, y, z, t), one for each direction."""

    def value(component):
        function = component if callable(component) else lambda *_: component
        return lambda x, t: function(*x[: len(components)], t) + np.zeros(len(x[0]))

    return tuple(value(component) for component in components)


def wall(velocity) -> Patch:
    """The velocity is given all round the box (in 2D or 3D by the number of components)."""
    return Patch("box", BOX[len(velocity)], "velocity", tuple(velocity))


def make_fluid(
    grid: Grid,
    patches: Sequence[Patch],
    bodies: Sequence[ImmersedBody] = (),
    *,
    solver: SolverSettings = TIGHT,
    comm: MPI.Comm = MPI.COMM_SELF,
    start: float = 0.0,
    dt: float = 1.0,
    timer=None,
    following=None,
    rho: float = 1.0,
    mu: float = 1.0,
    **settings,
) -> Fluid:
    """A flow at its start."""
    flow = FlowSettings(rho, mu, **settings)
    fluid = Fluid(grid, flow, patches, bodies, solver, following=following, timer=timer, comm=comm)
    fluid.initialise(start, dt)
    return fluid


def step(fluid: Fluid, t: float, dt: float):
    """One step from t to t + dt."""
    fluid.begin_step(t, dt)
    info = fluid.solve()
    fluid.end_step()
    return info


def solve_steady(fluid: Fluid):
    return step(fluid, 0.0, 1.0)


# ---------------------------------------------------------------------------------------------------------- bodies


def body(name: str, points, facets, *, motion=None, velocity=0.0, wet=None) -> ImmersedBody:
    """A body whose vertices are at points + (displacement by time) and have velocity(points, t) [m/s].

    Without a motion, t -> (positions, velocities), it rests, its surface moving in itself by `velocity`.
    """
    points = np.ascontiguousarray(points, dtype=float)
    surface = ImmersedSurface(name, np.asarray(facets, dtype=np.int64), len(points), wet)
    if motion is None:
        slip = np.zeros_like(points) + velocity
        return ImmersedBody(surface, lambda t: Motion(points, slip), rests=True)
    return ImmersedBody(surface, lambda t: Motion(*motion(points, t)))


def with_slip(immersed: ImmersedBody, length: float, transmissivity: float = 0.0) -> ImmersedBody:
    """The body with a slip length [m] and a transmissivity [m^3]."""
    surface = replace(immersed.surface, slip_length=length, transmissivity=transmissivity)
    return replace(immersed, surface=surface)


def loop(count: int) -> np.ndarray:
    """Segments of a closed polygon."""
    return np.stack([np.arange(count), np.roll(np.arange(count), -1)], axis=1)


def circle(centre, radius: float, count: int, phase: float = 0.0) -> np.ndarray:
    """Corners of a regular polygon of the same area as the circle, counterclockwise."""
    angles = phase + 2.0 * np.pi * np.arange(count) / count
    radius = radius * np.sqrt(2.0 * np.pi / count / np.sin(2.0 * np.pi / count))
    return np.asarray(centre) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def sphere(centre, radius: float, refinements: int) -> tuple[np.ndarray, np.ndarray]:
    """(points, triangles) of an octahedron that was refined and blown up to the volume of the ball."""
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
    cells = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    for _ in range(refinements):
        edges = np.sort(np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]]), axis=1)
        edges, which = np.unique(edges, axis=0, return_inverse=True)
        a, b, c = len(points) + which.reshape(3, -1)
        points = np.concatenate([points, points[edges].sum(axis=1)])
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        i, j, k = cells.T
        cells = np.concatenate([np.stack(t, axis=1) for t in ((i, a, c), (j, b, a), (k, c, b), (a, b, c))])
    points *= radius * np.cbrt(4.0 * np.pi / 3.0 / enclosed(points, cells))
    return points + np.asarray(centre), cells


def enclosed(points: np.ndarray, facets: np.ndarray) -> float:
    """Volume (area in 2D) inside of a closed surface."""
    dim = points.shape[1]
    return float(np.linalg.det(points[facets]).sum()) / (2.0 if dim == 2 else 6.0)


BLOCK_FACETS = {
    2: loop(4),
    3: np.array(
        [
            [0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
            [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7],
        ]
    ),
}  # fmt: skip


def block(low, high) -> tuple[np.ndarray, np.ndarray]:
    """(points, facets) of a rectangle or a box."""
    (x0, y0), (x1, y1) = low[:2], high[:2]
    square = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=float)
    if len(low) == 2:
        return square, BLOCK_FACETS[2]
    both = [np.column_stack([square, np.full(4, float(z))]) for z in (low[2], high[2])]
    return np.concatenate(both), BLOCK_FACETS[3]


def moving_body(dim: int) -> ImmersedBody:
    """A disc or a ball in the unit box that moves and deforms; its velocity is not that of its positions."""
    if dim == 2:
        points, facets = circle((0.47, 0.52), 0.2, 24), loop(24)
    else:
        points, facets = sphere((0.47, 0.52, 0.5), 0.27, 1)
    v = np.array([0.3, -0.2, 0.1])[:dim]
    return body("mover", points, facets, motion=lambda x, t: (x + t * v, 0 * x + v + 0.3 * x[:, ::-1]))


def around_moving_body(dim: int) -> Grid:
    """The unit box in cells that the moving body cuts: 5 x 5, or 3 x 3 x 3."""
    return uniform([0] * dim, [1] * dim, [5] * dim if dim == 2 else [3] * dim)


def turned(points: np.ndarray, angle: float, about=None) -> np.ndarray:
    """Points turned in the plane of x and y."""
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.eye(points.shape[1])
    matrix[:2, :2] = [[c, -s], [s, c]]
    centre = np.zeros(points.shape[1]) if about is None else np.asarray(about)
    return (points - centre) @ matrix.T + centre


# ------------------------------------------------------------------------------------------------------- integrals


@dataclass(frozen=True)
class Rule:
    """Points of owned cells and their weights, that integrate over the fluid."""

    cells: np.ndarray
    x: np.ndarray  #: (cells, points, dim)
    weights: np.ndarray  #: (cells, points) [m^dim]
    reference: np.ndarray


def fluid_rule(fluid: Fluid, points: int = 5) -> Rule:
    """A rule of its own, with more points than the solver's."""
    grid, cut = fluid.grid, fluid.cut
    places = np.polynomial.legendre.leggauss(points)[0] / 2.0 + 0.5
    reference, rule = fem.quadrature_points(grid.domain, 2 * points - 1)
    index = np.argmin(np.abs(reference[:, :, None] - places), axis=2)
    order = index @ points ** np.arange(grid.dim)
    fine = Cutter(grid, places)(cut.facets, cut.motion, 0) if len(cut.facets) else cut
    share = np.zeros((len(grid.numbers), len(rule)))
    share[fine.uncut] = 1.0
    if len(fine.cut):
        share[fine.cut] = fine.fluid[:, order]
    cells = np.flatnonzero(share.any(axis=1) & (np.arange(len(share)) < grid.owned))
    multi = np.stack(np.unravel_index(grid.numbers[cells], grid.grid.shape, order="F"), axis=1)
    corner = np.stack([edge[i] for edge, i in zip(grid.grid.edges, multi.T, strict=True)], axis=1)
    sizes = grid.sizes[cells]
    x = corner[:, None, :] + reference * sizes[:, None, :]
    return Rule(cells, x, share[cells] * rule * sizes.prod(axis=1)[:, None], reference)


def values(fluid: Fluid, rule: Rule) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Velocity (cells, points, dim), its gradient (cells, points, component, direction), pressure (cells, points)."""
    unknowns, domain = fluid.unknowns, fluid.grid.domain
    phi, slope = fem.tabulate_lagrange(domain, unknowns.degree, rule.reference)
    psi, _ = fem.tabulate_lagrange(domain, 1, rule.reference)
    u, p = fluid.flow[unknowns.cell_velocity[rule.cells]], fluid.flow[unknowns.cell_pressure[rule.cells]]
    gradient = np.einsum("qaj,kai->kqij", slope, u) / fluid.grid.sizes[rule.cells][:, None, None, :]
    return np.einsum("qa,kai->kqi", phi, u), gradient, p @ psi.T


def errors(fluid: Fluid, velocity, gradient, pressure, t: float = 0.0, points: int = 5) -> np.ndarray:
    """L2 and H1 (seminorm) errors of the velocity and L2 error of the pressure, this one up to a constant if closed.

    `velocity` and `gradient` (rows of components) are made of functions (x, y, .., t), `pressure` is one.
    """
    rule = fluid_rule(fluid, points)
    u, du, p = values(fluid, rule)
    x = np.moveaxis(rule.x, 2, 0)
    dim = fluid.dim
    exact = np.stack([velocity[i](*x, t) + np.zeros(x.shape[1:]) for i in range(dim)], axis=-1)
    slope = np.stack(
        [np.stack([gradient[i][j](*x, t) + np.zeros(x.shape[1:]) for j in range(dim)], axis=-1) for i in range(dim)],
        axis=-2,
    )
    off = p - pressure(*x, t)
    total = fluid.comm.allreduce
    if fluid.parts.boundary.closed():
        off -= total(float((rule.weights * off).sum())) / total(float(rule.weights.sum()))
    squares = [((u - exact) ** 2).sum(axis=-1), ((du - slope) ** 2).sum(axis=(-1, -2)), off**2]
    return np.sqrt([total(float((rule.weights * square).sum())) for square in squares])


def symbolic(velocity: Sequence, pressure, symbols, *, rho=0.0, mu=1.0, steady=True):
    """Numerical functions of an exact flow given in sympy: velocity, gradient, pressure and the force that drives it.

    f = rho (u_t + u . grad u) + grad p - mu div(grad u + grad u^T); `symbols` end with the time; rho = 0: Stokes.
    """
    import sympy

    *x, t = symbols
    gradient = [[sympy.diff(u, c) for c in x] for u in velocity]
    force = []
    for i, u in enumerate(velocity):
        stress = sum(sympy.diff(gradient[i][j] + gradient[j][i], c) for j, c in enumerate(x))
        inertia = sum(velocity[j] * gradient[i][j] for j in range(len(x))) + (0 if steady else sympy.diff(u, t))
        force.append(rho * inertia + sympy.diff(pressure, x[i]) - mu * stress)

    def number(expression):
        return sympy.lambdify(symbols, expression, "numpy", cse=True)

    return (
        [number(u) for u in velocity],
        [[number(d) for d in row] for row in gradient],
        number(pressure),
        [number(f) for f in force],
    )


def nodal_errors(fluid: Fluid, velocity, pressure, t: float, *, level: bool = False) -> tuple[float, float]:
    """Largest errors of velocity and pressure at active nodes; `level`: the pressure is only known up to a constant."""
    active = fluid.system.active_dofs
    nodes, dim = fluid.unknowns.velocity, fluid.dim
    x = nodes.points.T
    exact = np.stack([velocity[i](x, t) for i in range(dim)], axis=1)
    u = np.abs(fluid.flow[nodes.dofs] - exact)[active[nodes.dofs]].max()
    nodes = fluid.unknowns.pressure
    off = (fluid.flow[nodes.dofs[:, 0]] - pressure(nodes.points.T, t))[active[nodes.dofs[:, 0]]]
    if level:
        off = off - off.mean()
    return float(u), float(np.abs(off).max())
