"""Small coupled systems that several tests use."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from mpi4py import MPI

from coupling.coupled import Coupled
from coupling.parts import couple
from fsci import shapes
from solvers.algebra.linear import Method
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.terms.boundary.patches import Patch
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Body, Support, Symmetry
from solvers.structure.dynamics import Dynamics
from solvers.structure.elastic_constants import lame
from solvers.structure.field import Structure
from solvers.structure.materials import StVenantKirchhoff
from solvers.structure.time_scheme import TimeScheme

TIGHT = Tolerance(1e-10)


def couple_one(
    body: Body,
    time: TimeScheme,
    grid: Grid,
    flow: FlowSettings,
    patches: list[Patch],
    *,
    wetted: tuple[str, ...],
    linear: Method = "auto",
) -> Coupled:
    """One elastic body in a flow that touches some of its surfaces, solved more accurately than by default."""
    settings = SolverSettings(TIGHT, linear)
    return couple(Structure([body], time, settings), grid, flow, patches, wetted={body.name: wetted}, solver=settings)


#: rho_s L_s / (rho_f L) -> smallest k with k tan k = r
BAR_MODES = {10.0: 1.428870011, 1.0: 0.860333589, 0.1: 0.3110528482}


def bar_and_column(ratio: float, *, density: float | None = None, amplitude: float = 1e-3, cells: int = 10) -> Coupled:
    """An elastic bar 0 < x < 1, fixed at x = 0, and a column of fluid 1 < x < 2 with a free end, in a slip channel.

    E = rho_s = 1, nu = 0; starts at rest in its first mode, of angular frequency k. Density of the fluid: 1 / ratio.
    """
    k, height, shift = BAR_MODES[ratio], 0.2, 0.0137
    density = 1.0 / ratio if density is None else density
    first_mode = (lambda x, t: amplitude * np.sin(k * x[0]) / np.sin(k), 0.0)
    mu, lmbda = lame(1.0, 0.0)
    body = Body(
        "bar",
        shapes.rectangle([1.0, height], [cells, 2], order=1, cell="quad"),
        StVenantKirchhoff(mu, lmbda, 1.0),
        supports=(Support("left"), Symmetry("top"), Symmetry("bottom")),
        initial_displacement=first_mode,
        comm=MPI.COMM_SELF,
    )
    return couple_one(
        body,
        Dynamics(GeneralisedAlpha.from_rho_inf(1.0)),
        uniform([0.5 + shift, 0.0], [2.0, height], [15, 2]),
        FlowSettings(density, 1e-9, convection=False, scheme="bdf2"),
        [
            Patch("sides", ("y-", "y+"), "slip"),
            Patch("behind", ("x-",), "slip"),
            Patch("end", ("x+",), "traction", (0.0, 0.0)),
        ],
        wetted=("right",),
    )


def post_in_flow(
    *,
    E: float = 100.0,
    rho_s: float = 2.0,
    scheme: str = "bdf2",
    mu: float = 0.05,
    rho_inf: float = 0.8,
    element: str = "q1q1",
    linear: Method = "auto",
    growth: Callable[[float], float] = lambda t: min(t / 0.1, 1.0),
) -> Coupled:
    """A soft square post that stands on the bottom of a channel, in a flow that begins to move."""
    a, b = lame(E, 0.3)
    inflow = (lambda x, t: 4.0 * x[1] * (1.0 - x[1]) * growth(t), 0.0)
    mesh = shapes.rectangle([0.23, 0.41], [3, 5], order=1, cell="quad")
    mesh.points[:, 0] += 0.62
    material, supports = StVenantKirchhoff(a, b, rho_s), [Support("bottom")]
    return couple_one(
        Body("post", mesh, material, supports=supports, comm=MPI.COMM_SELF),
        Dynamics(GeneralisedAlpha.from_rho_inf(rho_inf)),
        uniform([0.0, 0.0], [2.0, 1.0], [20, 10]),
        FlowSettings(1.0, mu, scheme=scheme, element=element),
        [
            Patch("inlet", ("x-",), "velocity", inflow),
            Patch("outlet", ("x+",), "outflow"),
            Patch("walls", ("y-", "y+"), "no_slip"),
        ],
        wetted=("left", "right", "top"),
        linear=linear,
    )


def contraction(dt: float, cells: int) -> float:
    """Exact factor of plain Dirichlet-Neumann iterations: added mass of the column over what the bar's end resists.

    Both fields by their own rules: the fluid's acceleration of the first step is 1/dt^2 of a displacement (backward
    Euler); the bar has linear elements as in the computation.
    """
    h = 1.0 / cells
    main, side = np.full(cells + 1, 2.0), np.ones(cells)
    main[[0, -1]] = 1.0
    stiffness = (np.diag(main) - np.diag(side, 1) - np.diag(side, -1)) / h
    mass = (np.diag(2.0 * main) + np.diag(side, 1) + np.diag(side, -1)) * h / 6.0
    # generalised-alpha with rho_inf = 1: (M 4 / dt^2 + K) / 2 du = load / 2
    effective = (4.0 / dt**2 * mass + stiffness)[1:, 1:]
    return np.linalg.inv(effective)[-1, -1] / dt**2
