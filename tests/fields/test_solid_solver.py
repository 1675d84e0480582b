"""The linear solvers that `auto` tries near contact: incomplete factors where they are good, else the direct solver."""

import numpy as np
import pytest
from mpi4py import MPI
from pressed_block import assert_same_results, press_block
from structure_setup import load_step, make_structure, vector

from fsci import shapes
from solvers.algebra.solid_factors import SolidFactors
from solvers.api import StepFailed
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure import solid_solver
from solvers.structure.body import Support, Traction
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import NeoHooke

COMM = MPI.COMM_SELF


def pressed(method, *, size, cells):
    """A block on the free end of a plate that is held on its left, or on its bottom if it is thick."""
    block = shapes.box((0.5, 0.5, 0.5), (4, 4, 4), (size[0] - 0.8, 0.3, size[2]))
    return press_block(method, block, shapes.box(size, cells), held="left" if size[2] < 1.0 else "bottom")


@pytest.mark.parametrize(
    ("size", "cells", "position"),
    [((4.0, 1.1, 0.1), (24, 8, 1), 1), ((2.0, 1.1, 1.0), (8, 6, 4), 0)],
    ids=["bent plate", "compact block"],
)
def test_auto_solves_as_the_direct_solver(size, cells, position):
    """As many Newton steps, and the same results, whether the trial succeeds or not."""
    direct, auto = (pressed(method, size=size, cells=cells) for method in ("direct", "auto"))
    assert_same_results(auto, direct, displacement=1e-7)
    solver = auto[0].solver
    assert solver.sequence == ("ilu", "direct")
    assert solver.position == position
    kind = auto[0].create_solver(contact=True).getPC().getType()
    assert kind == ("lu" if position else "python")


def test_the_choice_is_part_of_the_state():
    structure, _, _ = pressed("auto", size=(2.0, 1.1, 1.0), cells=(4, 3, 2))
    first = structure.save()
    assert isinstance(structure.create_solver(contact=True).getPC().getPythonContext(), SolidFactors)
    structure.solver.position = 1
    second = structure.save()
    structure.restore(first)
    assert structure.solver.position == 0
    structure.restore(second)
    assert structure.create_solver(contact=True).getPC().getType() == "lu"


def test_first_system_of_a_step_is_solved_to_the_square(monkeypatch):
    """Those after it are solved as well as is asked for."""
    seen = []
    solve = solid_solver.linear.solve

    def noted(*arguments, reduction, squared):
        seen.append((reduction, squared))
        solve(*arguments, reduction=reduction, squared=squared)

    monkeypatch.setattr(solid_solver.linear, "solve", noted)
    structure, _, info = pressed("auto", size=(2.0, 1.1, 1.0), cells=(4, 3, 2))
    assert seen[:2] == [(1e-3, True), (1e-3, False)]
    assert len(seen) == info.iterations
    structure.begin_step(1.0, 1.0)
    structure.solve()
    assert [squared for _, squared in seen[info.iterations :]].index(True) == 0


def test_tolerance_is_a_part_of_newtons():
    """A direct solver is replaced by one as exact as Newton's method needs it."""
    tolerances = []
    for residual in (1e-6, 1e-8, 1e-11):
        settings = SolverSettings(Tolerance(residual=residual))
        solver = solid_solver.SolidSolver(COMM, 3, 3000, settings, contact=True)
        tolerances.append(solver.current(symmetric=True).getTolerances()[0])
    assert tolerances == pytest.approx([1e-8, 1e-10, 1e-12])
    alone = solid_solver.SolidSolver(COMM, 3, 3000, SolverSettings(linear="ilu"), contact=True)
    assert alone.current(symmetric=True).getTolerances()[0] == 1e-8


def test_sequence_by_size():
    def choose(method, dim, dofs, contact=True):
        return solid_solver.choose(method, dim, dofs, contact=contact)

    assert choose("auto", 3, 30_000) == ("ilu", "direct")
    assert choose("auto", 3, 30_001) == ("ilu", "iterative", "direct")
    assert choose("auto", 3, 30_001, contact=False) == ("iterative", "direct")
    assert choose("auto", 3, 10**6) == ("ilu", "iterative")
    assert choose("iterative", 3, 10**6) == ("iterative",)
    assert choose("auto", 3, 30_000, contact=False) == ("direct",)
    assert choose("auto", 2, 30_000) == ("direct",)
    assert choose("ilu", 3, 100) == ("ilu",)
    assert [solid_solver.iterations_allowed(n) for n in (600, 6_000, 10**6)] == [30, 120, 300]


def test_multigrid_that_stalls_is_replaced(monkeypatch):
    """A nearly incompressible cube is sheared: `auto` gives what the direct solver gives, multigrid alone nothing."""
    monkeypatch.setitem(solid_solver.linear.DIRECT_LIMIT, 3, 100)
    ends = []
    for method in ("direct", "auto", "iterative"):
        structure = make_structure(
            shapes.box([1, 1, 1], [8, 8, 8]),
            NeoHooke(*lame(1000.0, 0.4999)),
            element="mixed",
            supports=[Support("left", vector(0, 0, 0))],
            tractions=[Traction("right", vector(0, 10, 0))],
            settings=SolverSettings(Tolerance(residual=1e-8), linear=method),
        )
        if method == "iterative":
            with pytest.raises(StepFailed, match="stalled"):
                load_step(structure)
        else:
            load_step(structure)
            ends.append(structure.now.u.copy())
            assert structure.solver.position == (method == "auto")
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-12 * np.abs(ends[0]).max())
