"""Multigrid for flows: what direct solvers give, in a few iterations whatever the size, the cut and the stretching."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from fluid_setup import body, field, make_fluid, sphere, wall
from mpi4py import MPI
from programs import on_processes

from fsci.bench.fluid import ring_in_channel
from fsci.case import load_case
from fsci.running.run import FAILED, run_case
from solvers import newton
from solvers.algebra import linear
from solvers.algebra.linear import LinearSolveFailed
from solvers.algebra.rounded_product import RoundedProducts
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.grid.nested import RefinedBox, refined
from solvers.fluid.solve.linear_systems import krylov
from solvers.fluid.solve.linear_systems.krylov import SolverSequence
from solvers.fluid.solve.linear_systems.level_grid import LevelGrid
from solvers.fluid.solve.linear_systems.multigrid import Multigrid, coarsen, finest, interpolation
from solvers.fluid.solve.linear_systems.rough_cells import is_rough
from solvers.fluid.terms.boundary.patches import Patch
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.timing import Timer

PROGRAM = Path(__file__).parents[1] / "setups" / "fluid_pattern.py"


def test_short_cells_are_joined_first():
    """Cells of 4 x 1: two across become one, then two more, then both ways; planes of coarse lattices are fine ones."""
    lattice = LevelGrid((np.linspace(0, 16, 5), np.linspace(0, 16, 17)), ())
    shapes = []
    while not lattice.smallest:
        coarse = lattice.coarser()
        assert all(np.isin(some, every).all() for some, every in zip(coarse.planes, lattice.planes, strict=True))
        shapes.append(tuple(len(some) - 1 for some in coarse.planes))
        lattice = coarse
    assert shapes == [(4, 8), (4, 4), (2, 2), (1, 1)]


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_interpolation_of_linear_fields_is_exact(element):
    """On a stretched grid, on all levels; components stay apart."""
    edges = tuple(np.cumsum([0.0, *np.geomspace(1.0, ratio, 16)]) for ratio in (1.0, 8.0))
    fluid = make_fluid(
        Grid(edges), [wall(field(1, 0))], solver=SolverSettings(linear="iterative"), scheme="steady",
        convection=False, element=element,
    )  # fmt: skip
    levels = [finest(fluid.unknowns), *fluid.iterate.solver.create_multigrid().levels[1:]]
    lattices = [levels[-1].components[-1].lattice.coarser()] * 3
    levels.append(coarsen(MPI.COMM_SELF, levels[-1], lattices))
    for fine, coarse in itertools.pairwise(levels):
        P = interpolation(MPI.COMM_SELF, fine, coarse)
        x, y = P.createVecs()
        x.array[:], expected = linear_field(coarse), linear_field(fine)
        P.mult(x, y)
        assert np.abs(y.array - expected).max() < 1e-12 * np.abs(expected).max()


def linear_field(level):
    values = np.zeros(level.owned)
    for number, component in enumerate(level.components):
        x = [some[i] for some, i in zip(component.lattice.planes, component.nodes.T, strict=True)]
        values[component.dofs - level.start] = number + 2.0 * x[0] - 0.3 * (1 + number) * x[1]
    return values


def around_a_ball(*arguments, **more):
    """The first linear system of `flow_around_a_ball`: (its solution, iterations)."""
    fluid = flow_around_a_ball(*arguments, **more)
    fluid.advance()
    return fluid.flow.copy(), fluid.iterate.linear_iterations


def flow_around_a_ball(grid, method, element="q1q1", dt=None, comm=MPI.COMM_SELF):
    """Stokes flow around a ball, steady without dt, in its first step."""
    points, facets = sphere((0.07, 0.03, -0.05), 1.0, 2)
    solver = SolverSettings(Tolerance(1e-6), linear=method, linear_tolerance=1e-8)
    fluid = make_fluid(
        grid, [wall(field(1, 0, 0))], [body("ball", points, facets)], solver=solver, dt=dt or 1.0, comm=comm,
        scheme="bdf2" if dt else "steady", convection=False, element=element,
    )  # fmt: skip
    fluid.begin_step(0.0, dt or 1.0)
    fluid.residual()
    return fluid


def stretched(fine, coarse, ratio):
    """A cube of cells around the ball that grow outwards to `ratio` times their length."""
    steps = np.geomspace(1.0, ratio, coarse)
    outer = 1.4 + 10.0 * np.cumsum(steps) / steps.sum()
    edge = np.concatenate([-outer[::-1], np.linspace(-1.4, 1.4, fine + 1), outer])
    return Grid((edge,) * 3)


def test_stretched_cells_take_few_iterations():
    """Cells of aspect 20, where incomplete factors need three times as many, and the solution of the direct solver."""
    grid = stretched(6, 3, 20.0)
    flow, iterations = around_a_ball(grid, "iterative")
    exact, _ = around_a_ball(grid, "direct")
    assert np.abs(flow - exact).max() < 1e-5 * np.abs(exact).max()
    assert iterations <= 15


def test_iterations_do_not_grow():
    """From 5,000 to 20,000 unknowns."""
    counts = [around_a_ball(uniform([-2.0] * 3, [2.0] * 3, [n] * 3), "iterative")[1] for n in (10, 16)]
    assert max(counts) <= 10
    assert counts[1] <= counts[0] + 2


def test_a_cycle_follows_the_matrix_that_multiplies():
    """One for rounded products, then one without for another matrix with the same pattern: the same as a new one."""
    fluid = flow_around_a_ball(uniform([-2.0] * 3, [2.0] * 3, [10] * 3), "iterative")
    matrix, held = fluid.linearise(), fluid.iterate.held
    used, new = (Multigrid(MPI.COMM_SELF, fluid.unknowns) for _ in range(2))
    rounded = RoundedProducts().of(matrix, 1e-3)
    assert rounded.handle != matrix.handle
    b, x = matrix.createVecs()
    b.array[:] = np.where(held, 0.0, np.arange(len(held)) % 7)
    used.preconditioner(matrix, held, fluid.system, rounded).apply(b, x)
    matrix.scale(2.0)
    found = []
    for levels in (used, new):
        levels.preconditioner(matrix, held, fluid.system).apply(b, x)
        found.append(x.array.copy())
    assert np.array_equal(*found)


@pytest.mark.parametrize("cells", [16, pytest.param(24, marks=pytest.mark.slow)])
def test_steady_flow_with_convection_takes_few_iterations(cells, monkeypatch):
    """To 1e-8 in each system of Newton's method, at Reynolds number 200, without solves in vain. It was up to 200."""
    monkeypatch.setattr(newton, "ENOUGH", 0.0)
    counts = []

    def counted(ksp, *arguments, **more):
        try:
            return solve(ksp, *arguments, **more)
        finally:
            counts.append(ksp.getIterationNumber())

    solve = linear.solve
    fluid = ring_in_channel(cells, Timer(), steady=True)
    fluid.initialise(0.0, 1.0)
    fluid.begin_step(0.0, 1.0)
    monkeypatch.setattr(linear, "solve", counted)
    assert fluid.solve().iterations == len(counts)
    assert max(counts) <= 8


def test_early_systems_of_a_flow_are_solved_inexactly(monkeypatch):
    """As many Newton steps as with exact solutions, two thirds of the linear iterations at most, and the same flow."""
    found = []
    for enough in (newton.ENOUGH, 0.0):
        monkeypatch.setattr(newton, "ENOUGH", enough)
        fluid = ring_in_channel(16, Timer(), steady=True)
        fluid.initialise(0.0, 1.0)
        fluid.begin_step(0.0, 1.0)
        info = fluid.solve()
        found.append((info.iterations, info.numbers["fluid.linear"], fluid.flow.copy()))
    inexact, exact = found
    assert inexact[0] == exact[0]
    assert inexact[1] < 0.67 * exact[1]
    assert np.abs(inexact[2] - exact[2]).max() < 1e-6 * np.abs(exact[2]).max()


def test_interpolation_across_levels_of_nested_cells_is_exact():
    """Of linear fields, from the coarsest cells to all nodes; hanging nodes are unknowns of no coarse level."""
    region = RefinedBox([0.2, 0.2, 0.2], [0.6, 0.5, 0.4], 2)
    grid = refined(Grid(tuple(np.cumsum([0.0, *np.geomspace(1.0, r, 8)]) / 8.0 for r in (1.0, 1.3, 2.0))), [region])
    fluid = make_fluid(
        grid, [wall(field(1, 0, 0))], solver=SolverSettings(linear="iterative"), scheme="steady", convection=False
    )
    levels = [finest(fluid.unknowns)]
    for _ in range(3):
        levels.append(coarsen(MPI.COMM_SELF, levels[-1], [levels[-1].components[-1].lattice.coarser()] * 4))
    assert [level.components[0].lattice.nested is None for level in levels] == [False, False, True, True]
    assert levels[2].owned == 4 * 9**3
    for fine, coarse in itertools.pairwise(levels):
        P = interpolation(MPI.COMM_SELF, fine, coarse)
        x, y = P.createVecs()
        x.array[:], expected = linear_field(coarse), linear_field(fine)
        P.mult(x, y)
        assert np.abs(y.array - expected).max() < 1e-12 * np.abs(expected).max()


def test_nested_cells_take_few_iterations():
    """Of two levels around the ball, to 1e-8; incomplete factors take five times as many."""
    regions = [RefinedBox([-2.2] * 3, [2.3] * 3, 2)]
    counts = []
    for cells in (4, 6):
        grid = refined(uniform([-4.0] * 3, [4.0] * 3, [cells] * 3), regions)
        flow, iterations = around_a_ball(grid, "iterative")
        counts.append(iterations)
        if cells == 4:
            exact, _ = around_a_ball(grid, "direct")
            assert np.abs(flow - exact).max() < 1e-5 * np.abs(exact).max()
    assert max(counts) <= 10


@pytest.mark.parametrize("dt", [None, pytest.param(1e-3, marks=pytest.mark.slow)])
def test_second_degree_around_a_ball(dt):
    """Cut cells at which incomplete factors alone stall, with cells to a radius at which errors grew most."""
    grid = uniform([-2.0] * 3, [2.0] * 3, [7] * 3)
    flow, iterations = around_a_ball(grid, "iterative", "q2q1", dt)
    exact, _ = around_a_ball(grid, "direct", "q2q1", dt)
    assert np.abs(flow - exact).max() < 1e-5 * np.abs(exact).max()
    assert iterations <= 10


@pytest.mark.slow
@pytest.mark.parametrize("dt", [None, 1e-3])
def test_second_degree_in_more_cells(dt):
    """49,072 unknowns; small steps took 40 iterations when the cells around cut ones had incomplete factors."""
    assert around_a_ball(uniform([-2.0] * 3, [2.0] * 3, [12] * 3), "iterative", "q2q1", dt)[1] <= 15


@pytest.mark.slow
def test_second_degree_on_stretched_cells():
    """The case on which incomplete factors stalled (76,542 unknowns), here with 29,000."""
    _, iterations = around_a_ball(stretched(4, 3, 20.0), "iterative", "q2q1")
    assert iterations <= 20


@pytest.mark.slow
def test_second_degree_on_nested_cells():
    """60,422 unknowns on two levels; incomplete factors alone stall."""
    grid = refined(uniform([-4.0] * 3, [4.0] * 3, [4] * 3), [RefinedBox([-2.2] * 3, [2.3] * 3, 2)])
    assert around_a_ball(grid, "iterative", "q2q1")[1] <= 15


@pytest.mark.slow
def test_second_degree_on_two_processes():
    """The exact factors are those of the unknowns near the ball of both processes."""
    on_processes(2, __file__)


# ------------------------------------------------------------------------------------------------------- the sequence


def test_what_stalls_is_followed_by_what_does_not(monkeypatch):
    said = []
    sequence = SolverSequence(MPI.COMM_SELF, ("multigrid", "fill", "direct"), 1000, said.append)
    stalled = LinearSolveFailed("the linear solver stalled after 200 iterations (it reached its limit of iterations)")
    sequence.advance(stalled)
    assert sequence.current == "fill"
    sequence.advance(stalled)
    assert sequence.current == "direct"
    assert said[1] == (
        "the linear solver stalled after 200 iterations (it reached its limit of iterations) with incomplete factors "
        "with more fill and overlap: the direct solver from here on ('solver.linear.method' chooses)"
    )
    with pytest.raises(LinearSolveFailed, match="stalled"):
        sequence.advance(stalled)


def test_a_stall_is_remembered_when_the_unknowns_change():
    """Thin bodies that appear and go change the methods: one that has stalled is not tried again."""
    sequence = SolverSequence(MPI.COMM_SELF, ("multigrid", "smoothed", "fill", "direct"), 1000, print)
    stalled = LinearSolveFailed("the linear solver stalled")
    sequence.advance(stalled)
    assert sequence.current == "smoothed"
    fewer = sequence.replaced(("ilu", "fill", "direct"), 1000)
    assert fewer.current == "ilu"
    sequence.advance(stalled)
    sequence.advance(stalled)
    assert sequence.replaced(("ilu", "fill", "direct"), 1000).current == "ilu"
    assert sequence.replaced(("multigrid", "fill", "direct"), 1000).current == "direct"


def test_stretched_cells_need_stronger_smoothers():
    """A sphere near a wall, far away walls: plain multigrid and incomplete factors would stall."""
    growth = np.cumsum(1.35 ** np.arange(9))
    fine = np.linspace(0.0, 0.8, 9)
    ends = np.append(fine, fine[-1] + (12.0 - fine[-1]) * growth / growth[-1])
    above = np.append(np.linspace(0.0, 0.6, 7), 0.6 + 11.4 * growth / growth[-1])
    points, facets = sphere((0.0, 0.0, 1.3), 1.0, 2)
    patches = [
        Patch("wall", ("z-",), "velocity", (0.0, 0.0, 0.0)),
        Patch("planes", ("x-", "y-"), "symmetry"),
        Patch("far", ("x+", "y+", "z+"), "traction", (0.0, 0.0, 0.0)),
    ]
    ball = body("ball", points, facets, velocity=np.array([0.0, 0.0, -1.0]))
    solver = SolverSettings(Tolerance(1e-6), linear="iterative")
    grid = Grid((ends, ends, above))
    fluid = make_fluid(grid, patches, [ball], solver=solver, scheme="steady", convection=False)
    fluid.begin_step(0.0, 1.0)
    info = fluid.solve()
    assert fluid.iterative.sequence.methods[0] == "smoothed"
    assert info.notes == ()
    assert info.numbers["fluid.linear"] < 20 * info.iterations


def test_method_is_chosen_by_size():
    """Incomplete factors where they are cheaper: in time steps of small flows."""
    assert linear.choose_flow("auto", 3, 20_000, degree=1, steady=False) == ("ilu", "multigrid", "smoothed", "direct")
    assert linear.choose_flow("auto", 3, 21_000, degree=1, steady=False) == ("multigrid", "smoothed", "fill", "direct")
    with_solids = linear.choose_flow("auto", 3, 200_000, degree=1, steady=False, with_solids=True)
    assert with_solids == ("ilu", "multigrid", "smoothed", "direct")
    assert linear.choose_flow("auto", 3, 200_000, degree=1, steady=False) == ("multigrid", "smoothed", "fill", "direct")
    assert linear.choose_flow("auto", 3, 20_000, degree=2, steady=True) == ("multigrid", "direct")
    assert linear.choose_flow("auto", 2, 20_000, degree=2, steady=True) == ("direct",)
    assert linear.choose_flow("iterative", 3, 10, degree=1, steady=False) == ("multigrid", "smoothed", "fill", "direct")
    assert linear.choose_flow("direct", 3, 10**6, degree=1, steady=False) == ("direct",)


def test_rough_cells_in_steady_flow_begin_with_stronger_smoothers():
    cubes, flat = uniform([0, 0, 0], [2, 1, 1], [20, 10, 10]), uniform([0, 0, 0], [2, 1, 1], [20, 10, 40])
    finer = refined(cubes, [RefinedBox(np.array([0.4, 0.4, 0.4]), np.array([0.6, 0.6, 0.6]), 1)])
    found = [is_rough(grid, convection=fast) for grid in (cubes, flat, finer) for fast in (False, True)]
    assert found == [False, False, True, True, False, True]
    assert linear.choose_flow("auto", 3, 20_000, degree=1, steady=True, rough=True) == ("smoothed", "fill", "direct")
    with_time = linear.choose_flow("auto", 3, 30_000, degree=1, steady=False, rough=True)
    assert with_time == ("multigrid", "smoothed", "fill", "direct")


def test_the_direct_solver_needs_memory(monkeypatch):
    monkeypatch.setattr(krylov, "free_memory", lambda comm: 1e9)
    sequence = SolverSequence(MPI.COMM_SELF, ("multigrid", "direct"), 10**6, print)
    with pytest.raises(LinearSolveFailed, match=r"would need about 110 GB of the 1 GB .* 'solver.linear.tolerance'"):
        sequence.advance(LinearSolveFailed("the linear solver stalled"))
    assert sequence.current == "multigrid"


def test_a_singular_system_stays_singular():
    sequence = SolverSequence(MPI.COMM_SELF, ("multigrid", "fill", "direct"), 1000, print)
    with pytest.raises(LinearSolveFailed, match="singular"):
        sequence.advance(LinearSolveFailed("the linear system is singular", singular=True))
    assert sequence.current == "multigrid"


def test_a_stalled_solver_is_replaced_within_the_solve(monkeypatch):
    """One iteration is not enough for multigrid: the flow is solved all the same, and notes say how."""
    monkeypatch.setattr(krylov.linear, "flexible_solver", impatient(krylov.linear.flexible_solver))
    points, facets = sphere((0.07, 0.03, -0.05), 1.0, 2)
    solver = SolverSettings(Tolerance(1e-6), linear="iterative")
    fluid = make_fluid(
        uniform([-2.0] * 3, [2.0] * 3, [10] * 3), [wall(field(1, 0, 0))], [body("ball", points, facets)],
        solver=solver, scheme="steady", convection=False,
    )  # fmt: skip
    fluid.begin_step(0.0, 1.0)
    info = fluid.solve()
    assert info.residuals[-1] < 1e-6 * info.residuals[0]
    assert len(info.notes) == 2
    assert all("stalled after 1 iteration (" in note for note in info.notes)
    assert fluid.save()["linear_solver"] == 2


def impatient(create):
    def flexible_solver(comm, *, tolerance):
        ksp = create(comm, tolerance=tolerance)
        ksp.setTolerances(max_it=1)
        return ksp

    return flexible_solver


def test_a_steady_flow_is_not_repeated(tmp_path):
    """Half the step would be the same problem: one failure ends the run."""
    (tmp_path / "case.yaml").write_text(
        """
time: {step: 1, end: 1}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  scheme: steady
  grid: {from: [0, 0], to: [1, 1], cells: [4, 4]}
  patches:
    lid: {on: y+, velocity: [1, 0]}
    walls: {on: [x-, x+, y-], no_slip: true}
solver: {newton: {max_iterations: 1, residual: 1.0e-12}}
"""
    )
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out") == FAILED
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["steps"] == {"accepted": 0, "retried": 0}


def test_rows_of_the_identity_keep_their_entries_on_several_processes():
    """The conversion of the matrix for multigrid makes PETSc forget to; the next tangent did not fit then."""
    on_processes(2, PROGRAM)


if __name__ == "__main__":
    _, iterations = around_a_ball(uniform([-2.0] * 3, [2.0] * 3, [7] * 3), "iterative", "q2q1", comm=MPI.COMM_WORLD)
    assert iterations <= 10


@pytest.mark.slow
def test_second_degree_at_reynolds_number_200():
    """Poorly cut nodes that counted as free in 3D left Newton's method without a solution, after any count of steps."""
    fluid = ring_in_channel(12, Timer(), steady=True, element="q2q1")
    fluid.initialise(0.0, 1.0)
    fluid.begin_step(0.0, 1.0)
    assert fluid.solve().iterations <= 8
