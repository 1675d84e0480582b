"""Linear solvers: multigrid with rigid-body modes gives what the factorisation gives, at a cost that hardly grows."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc
from programs import PARALLEL, fsci
from structure_setup import constant, load_step, make_structure, vector

from fsci import shapes
from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from solvers.algebra import linear
from solvers.algebra.gauss_seidel import TwoFields, matrix_of
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Body, Pressure, Support, Traction
from solvers.structure.field import Structure
from solvers.structure.materials import NeoHooke
from solvers.structure.rigid_modes import attach_rigid_modes

LIMIT = 60  #: iterations to a residual of 1e-8


def held(on="left", *, dim=3):
    return Support(on, vector(*[0] * dim))


def cantilever(mesh, method, **loads):
    settings = SolverSettings(Tolerance(residual=1e-10), linear=method)
    loads = loads or {"tractions": [Traction("right", vector(0, 0, -4))]}
    return make_structure(mesh, NeoHooke(400.0, 600.0), settings=settings, supports=[held()], **loads)


def iterations(structure):
    return structure.create_solver().getIterationNumber()


@pytest.mark.parametrize(
    "mesh",
    [
        shapes.box((4, 1, 1), (12, 3, 3)),
        shapes.box((4, 1, 1), (8, 2, 2), order=2),
        shapes.box((4, 1, 1), (12, 3, 3), cell="tet"),
        shapes.box((4, 1, 1), (8, 2, 2), order=2, cell="tet"),
    ],
    ids=["hex8", "hex27", "tet4", "tet10"],
)
def test_iterative_equals_direct(mesh):
    direct, iterative = (cantilever(mesh, method) for method in ("direct", "iterative"))
    steps = [load_step(structure).iterations for structure in (direct, iterative)]
    assert steps[0] == steps[1]
    assert direct.create_solver().getPC().getType() != iterative.create_solver().getPC().getType() == "gamg"
    size = np.abs(direct.now.u).max()
    assert size > 0.3
    assert np.abs(iterative.now.u - direct.now.u).max() < 1e-6 * size
    assert iterations(iterative) < LIMIT


@pytest.mark.parametrize("unit", [1e-24, 1e12])
@pytest.mark.parametrize("method", ["direct", "ilu"])
@pytest.mark.parametrize("dim", [2, 3])
def test_units_of_stiffness(dim, method, unit):
    """The same displacement: no matrix is singular because its numbers are small."""
    shape, cells = (shapes.rectangle, (8, 2)) if dim == 2 else (shapes.box, (8, 2, 2))
    mesh, found = shape((4, 1, 1)[:dim], cells), []
    for scale in (1.0, unit):
        settings = SolverSettings(Tolerance(residual=1e-9), linear=method, linear_tolerance=1e-12)
        material, load = NeoHooke(400.0 * scale, 600.0 * scale), vector(*[0.0] * (dim - 1), -4.0 * scale)
        supports, tractions = [held(dim=dim)], [Traction("right", load)]
        structure = make_structure(mesh, material, settings=settings, supports=supports, tractions=tractions)
        load_step(structure)
        found.append(structure.now.u.copy())
    assert np.abs(found[0]).max() > 0.1
    assert found[1] == pytest.approx(found[0], abs=1e-8 * np.abs(found[0]).max())


def test_unsymmetric_system():
    """A follower pressure."""
    loads = {"pressures": [Pressure("top", constant(3.0))]}
    direct, iterative = (
        cantilever(shapes.box((4, 1, 1), (12, 3, 3)), method, **loads) for method in ("direct", "iterative")
    )
    for structure in (direct, iterative):
        load_step(structure)
    assert np.abs(iterative.now.u - direct.now.u).max() < 1e-6 * np.abs(direct.now.u).max()
    assert iterations(iterative) < LIMIT


def solve_once(structure):
    """The first Newton step of a load."""
    structure.initialise(0.0, 1.0)
    structure.begin_step(0.0, 1.0)
    structure.residual()
    structure.advance()
    return iterations(structure)


def test_iterations_hardly_grow():
    """From 3,000 to 50,000 unknowns."""
    counts = [solve_once(cantilever(shapes.box((4, 1, 1), (4 * n, n, n)), "iterative")) for n in (6, 10, 15)]
    assert max(counts) < 30
    assert max(counts) <= 1.5 * min(counts)


def test_rigid_modes_are_needed():
    """With translations only, as constant vectors, it takes more: rotations make the difference."""
    structure = cantilever(shapes.box((4, 1, 1), (24, 6, 6)), "iterative")
    with_rotations = solve_once(structure)
    structure = cantilever(shapes.box((4, 1, 1), (24, 6, 6)), "iterative")
    structure.initialise(0.0, 1.0)
    structure.begin_step(0.0, 1.0)
    structure.residual()
    matrix, x, b = structure.tangent(), structure.layout.vector(), structure.layout.vector()
    b.array[:] = -structure.residual_force
    matrix.zeroRowsColumns(structure.held.dofs.astype(PETSc.IntType), 1.0, x, b)
    matrix.setNearNullSpace(PETSc.NullSpace().create(vectors=translations(structure)))
    linear.solve(structure.create_solver(), matrix, b, x)
    assert iterations(structure) > 1.5 * with_rotations


def test_indefinite_tangent():
    """A load step so large that Newton overshoots into unstable states, where the tangent has negative eigenvalues."""
    loads = {"tractions": [Traction("right", vector(0, 0, -8))]}
    direct, iterative = (
        cantilever(shapes.box((4, 1, 1), (8, 2, 2)), method, **loads) for method in ("direct", "iterative")
    )
    assert load_step(direct).iterations == load_step(iterative).iterations
    assert np.abs(iterative.now.u - direct.now.u).max() < 1e-6 * np.abs(direct.now.u).max()


def translations(structure):
    vectors = []
    for axis in range(structure.dim):
        vectors.append(structure.layout.vector())
        vectors[-1].array[axis :: structure.dim] = 1.0
        vectors[-1].normalize()
    return vectors


def test_modes_are_rigid_motions():
    """The stiffness of a free body at rest does no work on them."""
    mesh = shapes.box((2, 1, 1), (3, 2, 2), origin=(5, -3, 2))
    structure = make_structure(mesh, NeoHooke(400.0, 600.0))
    load_step(structure)
    matrix = structure.tangent()
    attach_rigid_modes(matrix, structure.bodies, structure.now.u)
    modes = matrix.getNearNullSpace().getVecs()
    assert len(modes) == 6
    y = structure.layout.vector()
    for mode in modes:
        matrix.mult(mode, y)
        assert y.norm() < 1e-10 * matrix.norm() * mode.norm()
    assert np.array([[a.dot(b) for a in modes] for b in modes]) == pytest.approx(np.eye(6), abs=1e-12)


def test_turned_body():
    """Modes are those of the present configuration: a beam turned by 90 degrees is as easy as before."""
    structure = cantilever(shapes.box((4, 1, 1), (32, 8, 8)), "iterative")
    first = solve_once(structure)
    x = structure.bodies[0].points[:, : structure.bodies[0].owned].T
    quarter = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    structure.now.u[:] = (x @ quarter.T - x).ravel()
    structure.residual()
    structure.target = structure.held.part(structure.now.u)
    structure.advance()
    assert iterations(structure) <= first + 5


def test_two_bodies():
    """Modes of all bodies as one serve each of them: together they take as long as the slower one."""
    meshes = [shapes.box((4, 1, 1), (16, 4, 4)), shapes.box((2, 1, 1), (6, 3, 3), origin=(20, 5, 0), cell="tet")]

    def structure(chosen, method):
        bodies = [
            Body(
                f"body{i}",
                meshes[i],
                NeoHooke(400.0, 600.0),
                supports=[held()],
                tractions=[Traction("right", vector(0, 0, -4))],
                comm=MPI.COMM_SELF,
            )
            for i in chosen
        ]
        return Structure(bodies, settings=SolverSettings(Tolerance(residual=1e-10), linear=method))

    alone = [solve_once(structure([i], "iterative")) for i in (0, 1)]
    assert solve_once(structure([0, 1], "iterative")) <= max(alone) + 3
    direct, iterative = (structure([0, 1], method) for method in ("direct", "iterative"))
    for s in (direct, iterative):
        load_step(s)
    assert np.abs(iterative.now.u - direct.now.u).max() < 1e-6 * np.abs(direct.now.u).max()


def test_method_is_chosen_by_size_and_dimension():
    assert linear.choose("auto", 3, linear.DIRECT_LIMIT[3]) == "direct"
    assert linear.choose("auto", 3, linear.DIRECT_LIMIT[3] + 1) == "iterative"
    assert linear.choose("auto", 2, linear.DIRECT_LIMIT[3] + 1) == "direct"
    assert linear.choose("direct", 3, 10**7) == "direct"
    assert linear.choose("iterative", 2, 10) == "iterative"


CASE = """
time: {step: 0.5, end: 1.0}
structure:
  bodies:
    one:
      mesh: {shape: box, size: [3, 1, 1], cells: [9, 3, 3]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: left, displacement: [0, 0, 0]}]
      tractions: [{on: right, value: [0, 0, "-4*t"]}]
    two:
      mesh: {shape: box, size: [2, 1, 1], cells: [6, 3, 3], cell: tet, translate: [0, 5, 0]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: left, displacement: [0, 0, 0]}]
      tractions: [{on: right, value: [0, "3*t", 0]}]
probes:
  a: {body: one, quantity: displacement, at: [3, 1, 1]}
  b: {body: two, quantity: displacement, at: [2, 6, 1]}
"""


def test_two_processes(tmp_path):
    """Multigrid on two processes, two bodies, as the program runs it."""
    (tmp_path / "case.yaml").write_text(CASE)
    for name, method, processes in (("direct", "direct", 1), ("pair", "iterative", 2)):
        out = tmp_path / name
        run = fsci("run", tmp_path, "-o", out, "--set", f"solver.linear.method={method}", processes=processes)
        assert run.returncode == 0, run.stdout + run.stderr
    direct, pair = (read_history(tmp_path / name / "history.csv") for name in ("direct", "pair"))
    for column in ("a.x", "a.y", "a.z", "b.x", "b.y", "b.z"):
        assert pair[column] == pytest.approx(direct[column], rel=1e-6, abs=1e-9), column


def test_resume_is_bitwise(tmp_path):
    """No multigrid hierarchy outlives its matrix: a resumed run builds the ones that an uninterrupted run builds."""
    (tmp_path / "case.yaml").write_text(CASE)
    straight, broken = tmp_path / "straight", tmp_path / "broken"
    case = load_case(tmp_path, [("solver.linear.method", "iterative")])
    assert run_case(case, straight) == FINISHED
    first_half = load_case(tmp_path, [("solver.linear.method", "iterative"), ("time.end", "0.5")])
    assert run_case(first_half, broken) == FINISHED
    (broken / "case.yaml").write_text((broken / "case.yaml").read_text().replace("end: 0.5", "end: 1.0"))
    done = fsci("resume", broken)
    assert done.returncode == FINISHED, done.stdout + done.stderr
    one, two = (read_history(folder / "history.csv") for folder in (straight, broken))
    for column in one.keys() - {"wall"}:
        assert np.array_equal(one[column], two[column]), column


def two_fields():
    """(context of a matrix with blocks of 5 and 8 rows, the same as an array)."""
    rng = np.random.default_rng(4)
    whole = rng.standard_normal((13, 13)) + 8.0 * np.eye(13)
    parts = np.split(np.arange(13), [5])
    blocks = tuple(tuple(dense(whole[np.ix_(rows, columns)]) for columns in parts) for rows in parts)
    first, second = (PETSc.IS().createStride(len(part), part[0], 1, comm=PETSc.COMM_SELF) for part in parts)
    return TwoFields(blocks, first, second), whole


def dense(values):
    rows, columns = values.shape
    indices = np.tile(np.arange(columns, dtype=np.int32), rows)
    start = np.arange(0, rows * columns + 1, columns, dtype=np.int32)
    return PETSc.Mat().createAIJ(values.shape, csr=(start, indices, values.ravel()), comm=PETSc.COMM_SELF)


def test_system_of_two_fields():
    """Products and solutions are those of the whole matrix; one step of Gauss-Seidel is that of its definition."""
    fields, whole = two_fields()
    matrix = matrix_of(fields)
    b, x = matrix.createVecs()
    b.array[:] = np.arange(13.0)
    assert np.abs((matrix * b).array - whole @ b.array).max() < 1e-13 * np.abs(whole @ b.array).max()
    ksp = linear.coupled_solver(PETSc.COMM_SELF, tolerance=1e-12)
    linear.solve(ksp, matrix, b, x)
    assert np.abs(whole @ x.array - b.array).max() < 1e-10
    ksp.getPC().apply(b, x)  # the factors without fill of a full matrix are complete
    y1 = np.linalg.solve(whole[:5, :5], b.array[:5])
    y2 = np.linalg.solve(whole[5:, 5:], b.array[5:] - whole[5:, :5] @ y1)
    assert np.abs(x.array - np.concatenate([y1, y2])).max() < 1e-12


def test_levels_that_the_first_field_determines():
    """The second field is singular, its pivots rounding errors: one application solves for the level exactly.

    Without it the level is 1e10 times too large or so.
    """
    fields, whole = two_fields()
    level = np.array([0.0, 1, 1, 0, 1, 1, 1, 0])
    without = np.eye(8) - np.outer(level, level) / level.sum()
    whole[5:, 5:] = without @ whole[5:, 5:] @ without
    matrix = matrix_of(replace(fields, blocks=(fields.blocks[0], (fields.blocks[1][0], dense(whole[5:, 5:])))))
    b, x = matrix.createVecs()
    b.array[:] = np.arange(13.0)
    one = np.zeros(13)
    one[5:] = level
    sources = []
    for levels in (None, level[:, None]):
        ksp = linear.coupled_solver(PETSc.COMM_SELF, tolerance=1e-10, levels=levels)
        ksp.setOperators(matrix)
        ksp.setUp()
        ksp.getPC().apply(b, x)
        sources.append(abs(one @ (b.array - whole @ x.array)))
    assert sources[1] < 1e-12 * np.abs(b.array).sum()
    assert sources[0] > 1e-3
    linear.solve(ksp, matrix, b, x)
    assert np.abs(whole @ x.array - b.array).max() < 1e-8
    assert ksp.getIterationNumber() <= 6  # five unknowns of the first field and one


def test_few_unknowns_are_eliminated_exactly():
    """With exact factors of the second field one application solves, where Gauss-Seidel leaves much."""
    fields, whole = two_fields()
    matrix = matrix_of(fields)
    b, x = matrix.createVecs()
    b.array[:] = np.arange(13.0)
    left = []
    for few in (None, np.arange(5)):
        ksp = linear.coupled_solver(PETSc.COMM_SELF, tolerance=1e-12, few=few)
        linear.solve(ksp, matrix, b, x)
        assert np.abs(whole @ x.array - b.array).max() < 1e-10
        ksp.getPC().apply(b, x)
        left.append(np.abs(whole @ x.array - b.array).max())
    assert left[0] > 0.1
    assert left[1] < 1e-10


def test_few_unknowns_without_a_solution_stop_the_solver():
    """The complement of unknowns without any equation is singular."""
    fields, _ = two_fields()
    fields.blocks[0][0].zeroEntries()
    fields.blocks[0][1].zeroEntries()
    matrix = matrix_of(fields)
    b, x = matrix.createVecs()
    b.set(1.0)
    with pytest.raises(linear.LinearSolveFailed):
        linear.solve(linear.coupled_solver(PETSc.COMM_SELF, tolerance=1e-12, few=np.arange(5)), matrix, b, x)


def test_singular_first_field_stops_the_solver():
    fields, _ = two_fields()
    fields.blocks[0][0].zeroEntries()
    matrix = matrix_of(fields)
    b, x = matrix.createVecs()
    b.set(1.0)
    with pytest.raises(linear.LinearSolveFailed):
        linear.solve(linear.coupled_solver(PETSc.COMM_SELF, tolerance=1e-12), matrix, b, x)


def test_functions_in_python_end_before_python():
    """Programs that keep such a matrix to their end leave no message, on two processes too."""
    program = (
        "from mpi4py import MPI\nfrom petsc4py import PETSc\nfrom solvers.algebra import linear\n"
        "A = PETSc.Mat().createBAIJ((8, 8), 4, nnz=1, comm=MPI.COMM_WORLD)\nfor i in range(*A.getOwnershipRange()):\n"
        "    A.setValue(i, i, 2.0)\nA.assemble()\n"
        "ksp = linear.flow_solver(MPI.COMM_WORLD, tolerance=1e-8)\nb, x = A.createVecs()\nb.set(1.0)\n"
        "linear.solve(ksp, A, b, x)\nassert abs(x.array - 0.5).max() < 1e-6\nMPI.kept = ksp\n"
    )
    for launcher in ([], ["mpirun", "-n", "2"]):  # the end of a real process
        command = [*launcher, sys.executable, "-c", program]
        done = subprocess.run(command, capture_output=True, text=True, env=PARALLEL, timeout=600, check=True)
        assert "rror" not in done.stdout + done.stderr
        assert "leaked" not in done.stdout + done.stderr


@pytest.mark.parametrize(
    ("most", "matrix", "why"),
    [
        (1, np.diag([1.0, 2.0, 3.0]), "after 1 iteration (it reached its limit of iterations)"),
        (9, np.diag([1.0, -2.0, 3.0]), "after 2 iterations (the matrix is not positive definite)"),
        (9, np.diag([1.0, np.nan, 3.0]), "after 1 iteration (a number is not finite)"),
    ],
)
def test_a_solver_that_stalls_says_why(most, matrix, why):
    A = PETSc.Mat().createDense(matrix.shape, array=matrix, comm=MPI.COMM_SELF)
    ksp = PETSc.KSP().create(MPI.COMM_SELF)
    ksp.setType(PETSc.KSP.Type.CG)
    ksp.getPC().setType(PETSc.PC.Type.NONE)
    ksp.setTolerances(rtol=1e-12, max_it=most)
    x, b = A.createVecs()
    b.set(1.0)
    with pytest.raises(linear.LinearSolveFailed) as failed:
        linear.solve(ksp, A, b, x)
    assert str(failed.value) == f"the linear solver stalled {why}"


@pytest.mark.parametrize(("motion", "kind"), [(0.0, "lu"), (0.1, "ilu")])
def test_a_solid_has_incomplete_factors_if_they_are_good(motion, kind):
    """Not a thin plate at rest, but the same plate with the inertia of a short step."""
    structure = cantilever(shapes.box([1.0, 1.0, 0.02], [16, 16, 1], order=1, cell="hex"), "direct")
    structure.begin_step(0.0, 1.0)
    structure.residual()
    matrix = structure.linearise()
    assert matrix.size[0] > linear.SMALL_SOLID
    matrix = structure.held.impose(matrix, *matrix.createVecs())
    matrix.shift(motion * matrix.getDiagonal().max()[1])
    factors = linear.solid_preconditioner(matrix)
    assert factors.getPC().getType() == kind
    x, b = matrix.createVecs()
    x.set(1.0)
    matrix.mult(x, b)
    found = x.duplicate()
    factors.solve(b, found)
    assert (found - x).norm() < (0.5 if kind == "ilu" else 1e-9) * x.norm()
