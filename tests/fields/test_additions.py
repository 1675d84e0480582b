"""What the page on contributing says can be added from outside: one of each kind, made here.

Each is something of its own, not what the library has in other words, and is compared with a known answer.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
import ufl
from fluid_setup import field, make_fluid, step
from mpi4py import MPI
from petsc4py import PETSc
from structure_setup import TIGHT

from coupling import contact_surface
from fsci.builder import structure as build_structure
from fsci.case import load_case
from fsci.case.quantities import QUANTITIES
from fsci.running.history import read_history
from fsci.running.output import FORMATS, FieldWriter
from fsci.running.run import FINISHED, run_case
from fsci.shapes import rectangle
from solvers.algebra.blocks import times
from solvers.contact import Contact, Pair
from solvers.contact.blocks import block_diagonal
from solvers.contact.law.law import OPEN, SLIP, Rows, along
from solvers.contact.surface import Surface
from solvers.fluid.grid.box import uniform
from solvers.fluid.settings.time_scheme import Difference, FlowTimeScheme
from solvers.fluid.terms.boundary.patch_kinds import PatchKind
from solvers.fluid.terms.boundary.patches import Patch
from solvers.march import march
from solvers.solver_settings import SolverSettings
from solvers.structure import (
    Body,
    LinearElastic,
    NeoHooke,
    Structure,
    StVenantKirchhoff,
    Support,
    Traction,
    lame,
    probes,
)
from solvers.structure.time_scheme import Statics

# ----------------------------------------------------------------------------------------------------- structure


@dataclass(frozen=True)
class BlatzKo:
    """Foam, in plane strain: W = mu/2 (I_2 / I_3 + 2 J - 5). Source: Blatz & Ko, Trans. Soc. Rheol. 6 (1962)."""

    mu: float
    density: float = 0.0
    plane_stress: ClassVar[bool] = False
    linear: ClassVar[bool] = False

    def energy(self, F, mu):
        return mu / 2 * (ufl.tr(ufl.inv(F.T * F)) + 2 * ufl.det(F) - 4)


def pulled(material, *, mesh=None, linear="direct", time=Statics()) -> np.ndarray:
    """Displacements of a block that is stretched by a tenth."""
    supports = [Support("left"), Support("right", (0.1, 0.0))]
    mesh = mesh or rectangle([1.0, 1.0], [3, 3])
    structure = Structure(
        [Body("block", mesh, material, supports=supports, comm=MPI.COMM_SELF)],
        time,
        SolverSettings(TIGHT.newton, linear),
    )
    list(march(structure))
    return structure.now.u


def test_material():
    """Pulled by a tenth. J = l^(2/3) where nothing pulls across, and P = mu (J - 1 / l^2) / l."""
    supports = [Support("left", (0.0, None)), Support("bottom", (None, 0.0)), Support("right", (0.1, None))]
    body = Body("foam", rectangle([1.0, 1.0], [3, 3]), BlatzKo(10.0), supports=supports, comm=MPI.COMM_SELF)
    structure = Structure([body], settings=TIGHT)
    list(march(structure))
    assert structure.now.u.reshape(-1, 2)[:, 1].min() == pytest.approx(1.1 ** (-1 / 3) - 1, abs=1e-12)
    force = probes.on_surface(structure, body, "reaction", "right")()["x"]
    assert force == pytest.approx(10.0 * (1.1 ** (2 / 3) - 1.1**-2) / 1.1, rel=1e-11)


def test_linear_solver():
    def conjugate_gradients(comm, task) -> PETSc.KSP:
        ksp = PETSc.KSP().create(comm)
        ksp.setType(PETSc.KSP.Type.CG)
        ksp.getPC().setType(PETSc.PC.Type.JACOBI)
        ksp.setTolerances(rtol=1e-12)
        used.append(task)
        return ksp

    used: list = []
    material = StVenantKirchhoff(*lame(10.0, 0.3))
    assert pulled(material, linear=conjugate_gradients) == pytest.approx(pulled(material), abs=1e-11)
    assert (used[0].dim, used[0].dofs) == (2, 32)


class ImplicitEuler:
    """M (v_{n+1} - v_n) / dt + f_{n+1} = 0 with v = (u_{n+1} - u_n) / dt, without contact and damping."""

    force_weight, dissipates = 1.0, True

    def massless(self, structure):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)

    def create_damping(self, structure):
        return None

    def damping_slope(self, structure, dt):
        return None

    def start(self, structure, t, dt): ...
    def prepare(self, structure, t, dt): ...

    def extrapolation(self, structure, t, dt):
        return np.zeros(structure.layout.size)

    def guess(self, structure, dt):
        return dt * structure.held.free_part(structure.now.v)

    def motion(self, structure, dt):
        v = (structure.now.u - structure.old.u) / dt
        return v, (v - structure.old.v) / dt

    def rigid_force(self, structure, dt):
        return structure.now.rigid

    def rigid_factor(self, dt):
        return 0.0

    def balance(self, structure):
        return self.reaction(structure)

    def averaged_load(self, structure):
        return self.reaction(structure) + structure.now.surface

    def dynamic_stiffness(self, structure, dt):
        matrix = structure.inertia.assemble_mass().copy()
        matrix.scale(dt**-2)
        return matrix

    def _balance(self, structure, at):
        return times(structure.inertia.assemble_mass(), at.a) + at.internal - at.external - at.constraint

    def reaction(self, structure):
        return self._balance(structure, structure.now)

    def averaged(self, before, after):
        return after

    def damping_force(self, structure):
        return np.zeros(structure.layout.size)

    def support_forces(self, structure):
        return self._balance(structure, structure.old), self._balance(structure, structure.now)

    def stopping_force(self, structure):
        return times(structure.inertia.assemble_mass(), -structure.old.v / structure.current.dt)

    def kinetic_energy(self, structure):
        v = structure.now.v
        return 0.5 * structure.comm.allreduce(float(v @ times(structure.inertia.assemble_mass(), v)))


def test_time_scheme_of_a_structure():
    """A cell that can only be stretched has one unknown q, u = q x: density/3 a + E q = load."""
    E, density, load, dt = 10.0, 6.0, 0.3, 0.1
    rail = [Support(name, (None, 0.0)) for name in ("bottom", "top")]
    body = Body(
        "bar",
        rectangle([1.0, 1.0], [1, 1]),
        LinearElastic(*lame(E, 0.0), density),
        supports=[Support("left", (0.0, None)), *rail],
        tractions=[Traction("right", (load, 0.0))],
        comm=MPI.COMM_SELF,
    )
    structure = Structure([body], ImplicitEuler(), TIGHT)
    q = v = 0.0
    for _ in march(structure, end=10 * dt, steps=10):
        q, before = (density / 3 * (q / dt**2 + v / dt) + load) / (density / 3 / dt**2 + E), q
        v = (q - before) / dt
        assert structure.now.u.max() == pytest.approx(q, rel=1e-11)


def own_probe(structure, bodies):
    """Kinetic energy of the chosen bodies."""
    p, v = structure.inertia.times(structure.now.v), structure.now.v
    parts = zip(structure.bodies, structure.split(p), structure.split(v), strict=True)
    return {"": structure.comm.allreduce(0.5 * sum(float(p @ v) for body, p, v in parts if body in bodies))}


FALLING = """\
time: {step: 0.1, end: 0.3}
structure:
  dynamics: {}
  bodies:
    block:
      mesh: {shape: rectangle, size: [2, 1], cells: [2, 1]}
      material: {law: neo_hooke, E: 1e3, nu: 0.3, density: 5}
      gravity: [0, -10]
"""


def test_probe(monkeypatch, tmp_path):
    """A record of the quantity and a function: m v^2 / 2 of a block that falls."""
    record = replace(QUANTITIES["kinetic_energy"], structure=("",), needs=("dynamics",))
    monkeypatch.setitem(QUANTITIES, "kinetic_energy", record)
    monkeypatch.setitem(probes.OF_BODIES, "kinetic_energy", own_probe)
    table = build_structure.STRUCTURE_PROBES  # has a line for each quantity of bodies since it was imported
    monkeypatch.setitem(table, ("kinetic_energy", ""), table["energy", ""])
    text = f"{FALLING}probes: {{moving: {{quantity: kinetic_energy, body: block}}}}\n"
    (tmp_path / "case.yaml").write_text(text)
    assert run_case(load_case(tmp_path), tmp_path / "out") == FINISHED
    history = read_history(tmp_path / "out" / "history.csv")
    assert history["moving"] == pytest.approx(0.5 * 10.0 * (10.0 * history["time"]) ** 2, rel=1e-9)


def write_own(path, snapshot):
    """A file of numpy with the points."""
    with path.open("wb") as file:
        np.savez(file, points=snapshot.points)


def test_output_format(monkeypatch, tmp_path):
    """A line of a table: each run writes it, too, and a run that goes on replaces it."""
    monkeypatch.setitem(FORMATS, ".npz", write_own)
    (tmp_path / "case.yaml").write_text(FALLING)
    assert run_case(load_case(tmp_path), tmp_path / "out") == FINISHED
    fields = tmp_path / "out" / "fields"
    written = sorted(path.name for path in fields.glob("*.npz"))
    assert written == [f"block_{step:06d}.npz" for step in range(4)]
    low = np.load(fields / written[-1])["points"][:, 1].min()
    assert low == pytest.approx(-0.5 * 10.0 * 0.3**2, rel=1e-9)
    FieldWriter.resume(fields, 0.15)
    assert sorted(path.name for path in fields.glob("*.npz")) == written[:2]


OWN_SHAPE = """
from math import pi
from typing import Annotated
import sys
import fsci.shapes as shapes
from fsci.shapes import lattice
from fsci.shapes.declaration import MeshPlan, counts, meshed, positive, require_less

@meshed
def ellipse(
    long: Annotated[float, positive("half of the longer axis")],
    short: Annotated[float, positive("half of the shorter axis")],
    cells: Annotated[list[int], counts(2, "number of cells around and through the shell", {0: (4, "around")})],
    *,
    order: int = 1,
    cell: str = "quad",
) -> MeshPlan:
    "Ellipse about the origin, with the surface outer."
    require_less("short", short, than="long", limit=long)
    nodes = lattice.disc(cells[0], cells[1], order).mapped(lambda x, y: (long * x, short * y))
    return MeshPlan(nodes, cells, cell, (2 * pi * long, short), 2 * short)

shapes.SHAPES["ellipse"] = ellipse, "long: 2, short: 1, cells: [16, 2]"
from fsci.cli import main
from fsci.schema import reference_markdown
if "--reference" in sys.argv:
    print(reference_markdown())
else:
    sys.exit(main())
"""

IN_A_CASE = """\
time: {step: 1, end: 1}
structure:
  bodies:
    part:
      mesh: {shape: ellipse, long: 2, short: 1, cells: [64, 8], order: 2}
      material: {law: neo_hooke, E: 10, nu: 0.3, density: 1}
      supports: [{on: outer, displacement: [0, 0]}]
probes: {size: {quantity: volume, body: part}}
"""


def test_shape(tmp_path):
    """A function and its line of a table: case files, their messages and the reference have it."""
    (tmp_path / "own.py").write_text(OWN_SHAPE)

    def own(*arguments):
        command = [sys.executable, tmp_path / "own.py", *arguments]
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)

    case = tmp_path / "case.yaml"
    case.write_text(IN_A_CASE)
    done = own("run", case, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert read_history(tmp_path / "out" / "history.csv")["size"][-1] == pytest.approx(2 * np.pi, rel=1e-6)
    for wrong, message in {
        "short: 3": "5:46: 'short' must be less than 'long', 2, not 3",
        "short: 0": "5:46: 'short' must be greater than 0, not 0",
        "short: 1, sort: 1": "unknown setting 'sort'; did you mean 'short'?",
    }.items():
        case.write_text(IN_A_CASE.replace("short: 1", wrong))
        assert message in own("check", case).stderr
    case.write_text(IN_A_CASE.replace("[64, 8]", "[63, 8]"))
    assert "the number of cells around must be a multiple of 4, not 63" in own("check", case).stderr
    case.write_text(IN_A_CASE.replace("on: outer", "on: outside"))
    assert "'ellipse' has no surface 'outside'" in own("check", case).stderr
    assert "| `long` | number > 0 | required | m | half of the longer axis |" in own("--reference").stdout


# ------------------------------------------------------------------------------------------------------- contact


@dataclass(frozen=True)
class Viscous:
    """Contact on a viscous layer: z_t = factor u_t with the slip u_t of the step."""

    factor: float  #: [Pa/m]
    span: ClassVar = "surface"
    slips: ClassVar[bool] = True

    def status(self, at):
        return np.where(at.covered & (at.trial_pressure > 0.0), SLIP, OPEN).astype(np.int8)

    def residual(self, at, status, weight):
        missed = np.einsum("mij,mj->mi", along(at.normals), at.z - self.factor * at.slip)
        return (at.stiffness * at.gap)[:, None] * at.normals + (weight * at.D)[:, None] * missed

    def rows(self, at, slopes, status, weight):
        """d(T y) = T dy - (n.y I + n y^T) dn with y = z - factor u and T = I - n n^T."""
        n, dim = at.normals, at.z.shape[1]
        y, area = at.z - self.factor * at.slip, (weight * at.D)[:, None, None]
        turning = np.einsum("md,md->m", n, y)[:, None, None] * np.eye(dim) + n[:, :, None] * y[:, None, :]
        closing = block_diagonal((at.stiffness[:, None] * n)[:, :, None]) @ slopes.gap
        sliding = block_diagonal(area * self.factor * along(n)) @ slopes.slip
        by_u = closing - sliding - block_diagonal(area * turning) @ slopes.normals
        return Rows(self.residual(at, status, weight), area * along(n), by_u)


def test_law_of_contact():
    """The support of a block holds what the layer below it drags: the factor times the integral of the slip."""
    factor, way = 50.0, 0.02
    rubber = NeoHooke(*lame(E=1000.0, nu=0.3))
    top = [Support("top", (0.0, -0.01))]
    block = Body("block", rectangle([1.0, 1.0], [4, 4]), rubber, supports=top, comm=MPI.COMM_SELF)
    points = np.array([[3.0, 0.0], [-2.0, 0.0]])
    belt = Surface("belt", points, np.array([[0, 1]]), "line", None, motion=lambda t: points + np.array([way * t, 0.0]))
    contact = Contact(
        [Pair(contact_surface([block], "block", "bottom"), belt, law=Viscous(factor))], comm=MPI.COMM_SELF
    )
    structure = Structure([block], contact=contact, settings=TIGHT)
    list(march(structure))
    force = probes.on_surface(structure, block, "reaction", "top")()
    X, u = block.points[:2].T, structure.now.u.reshape(-1, 2)
    bottom = np.flatnonzero(np.isclose(X[:, 1], X[:, 1].min()))
    bottom = bottom[np.argsort(X[bottom, 0])]
    slip, x = way - u[bottom, 0], X[bottom, 0] + u[bottom, 0]
    assert force["y"] < -5.0
    assert 0.1 * way < way - slip.mean() < 0.2 * way
    assert force["x"] == pytest.approx(-factor * (0.5 * (slip[1:] + slip[:-1]) * np.diff(x)).sum(), rel=1e-9)


# --------------------------------------------------------------------------------------------------------- fluid


SIDES = Patch("sides", ("y-", "y+"), "slip")


def test_condition_on_the_boundary_of_a_flow():
    """A resistance t = -k u holds the pressure k u upstream of it."""
    resistance = PatchKind(open=True, depends_on_flow=True, form=lambda flow, u, value, n, v: 7.0 * ufl.dot(u, v))
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [4, 4]),
        [Patch("in", ("x-",), "velocity", (2.0, 0.0)), SIDES, Patch("out", ("x+",), resistance)],
        scheme="steady",
    )  # fmt: skip
    step(fluid, 0.0, 1.0)
    assert fluid.flow[fluid.unknowns.pressure.dofs[:, 0]] == pytest.approx(14.0, abs=1e-11)


def test_time_scheme_of_a_flow():
    """BDF3 from a rest of three times: du/dt = t^2 in a box that nothing holds along x."""

    def bdf3(dt, before):
        return Difference(11.0 / 6.0 / dt, (3.0 / dt, -1.5 / dt, 1.0 / 3.0 / dt))

    dt, speeds = 0.1, [0.0, 0.0, 0.0]
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [3, 3]), [Patch("ends", ("x-", "x+"), "periodic"), SIDES],
        dt=dt, scheme=FlowTimeScheme(bdf3, times=3), body_force=field(lambda x, y, t: t**2, 0.0),
    )  # fmt: skip
    for number in range(5):
        step(fluid, number * dt, dt)
        t = (number + 1) * dt
        speeds.append((dt * t**2 + 3.0 * speeds[-1] - 1.5 * speeds[-2] + speeds[-3] / 3.0) * 6.0 / 11.0)
        assert fluid.flow[fluid.unknowns.velocity.dofs[:, 0]] == pytest.approx(speeds[-1], rel=1e-10)
