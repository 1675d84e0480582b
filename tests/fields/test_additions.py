"""What the page on contributing says can be added from outside: one of each kind, made here.

Each is compared with what the library has for the same thing, or with mathematics.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
import ufl
from coupling_setup import bar_and_column
from fluid_setup import block, body, field, make_fluid, step
from mpi4py import MPI
from petsc4py import PETSc
from structure_setup import TIGHT

from coupling import Partitioned, contact_surface
from coupling.coupled import Coupled
from coupling.partitioned import FixedPointTolerance
from coupling.wetted import immerse
from fsci.shapes import rectangle
from solvers.api import StepInfo
from solvers.contact import Contact, Frictionless, Pair
from solvers.fluid.background.grid import uniform
from solvers.fluid.bodies.surface import ImmersedSurface
from solvers.fluid.boundary.patch_kinds import PatchKind
from solvers.fluid.boundary.patches import Patch
from solvers.fluid.time_scheme import Difference, FlowTimeScheme
from solvers.march import march
from solvers.mesh import Mesh
from solvers.solver_settings import SolverSettings
from solvers.structure import Body, NeoHooke, Structure, StVenantKirchhoff, Support, lame
from solvers.structure.time_scheme import Statics

# ----------------------------------------------------------------------------------------------------- structure


@dataclass(frozen=True)
class OwnMaterial:
    """St. Venant and Kirchhoff's law by Young's modulus and Poisson's ratio."""

    E: float
    nu: float
    density: float = 0.0
    plane_stress: ClassVar[bool] = False
    linear: ClassVar[bool] = False

    def energy(self, F, E, nu):
        strain = (F.T * F - ufl.Identity(2)) / 2
        mu, lmbda = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
        return mu * ufl.inner(strain, strain) + lmbda / 2 * ufl.tr(strain) ** 2


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
    reference = pulled(StVenantKirchhoff(*lame(10.0, 0.3)))
    assert pulled(OwnMaterial(10.0, 0.3)) == pytest.approx(reference, abs=1e-13)


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


def test_shape():
    """A shape is a function that returns a mesh: here one cell between given corners."""

    def one_cell(corners) -> Mesh:
        return Mesh(
            np.asarray(corners, dtype=float),
            np.array([[0, 1, 2, 3]]),
            "quad",
            {"left": np.array([[3, 0]]), "right": np.array([[1, 2]])},
        )

    u = pulled(StVenantKirchhoff(*lame(10.0, 0.3)), mesh=one_cell([[0, 0], [2, 0], [2, 1], [0, 1]]))
    assert np.sort(u) == pytest.approx(np.sort([0, 0, 0.1, 0, 0.1, 0, 0, 0]), abs=1e-15)


class LoadSteps(Statics):
    """A time scheme of a structure: statics whose first guess goes on with the support's speed."""

    def guess(self, structure, dt):
        guesses.append(dt)
        return np.zeros(structure.layout.size)


guesses: list[float] = []


def test_time_scheme_of_a_structure():
    material = StVenantKirchhoff(*lame(10.0, 0.3))
    assert np.array_equal(pulled(material, time=LoadSteps()), pulled(material))
    assert guesses == [1.0]


# ------------------------------------------------------------------------------------------------------- contact


class OwnLaw:
    """Frictionless contact, in parts."""

    span: ClassVar = "normal"
    slips: ClassVar[bool] = False

    def status(self, at):
        return Frictionless().status(at)

    def residual(self, at, status, weight):
        return Frictionless().residual(at, status, weight)

    def rows(self, at, slopes, status, weight):
        calls.append(len(status))
        return Frictionless().rows(at, slopes, status, weight)


calls: list[int] = []


def test_law_of_contact():
    found = []
    for law in (Frictionless(), OwnLaw()):
        rubber = NeoHooke(*lame(E=1000.0, nu=0.3))
        lower = Body("lower", rectangle([2.0, 1.0], [6, 3]), rubber, supports=[Support("bottom")], comm=MPI.COMM_SELF)
        mesh = rectangle([1.0, 1.0], [4, 4], origin=[0.5, 1.0])
        top = [Support("top", (0.0, -0.05))]
        upper = Body("upper", mesh, rubber, supports=top, comm=MPI.COMM_SELF)
        bodies = [lower, upper]
        slave, master = contact_surface(bodies, "upper", "bottom"), contact_surface(bodies, "lower", "top")
        contact = Contact([Pair(slave, master, law=law)], comm=MPI.COMM_SELF)
        list(march(Structure(bodies, contact=contact)))
        found.append(contact.z)
    assert calls
    assert np.abs(found[0]).max() > 1.0
    assert np.array_equal(*found)


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


# ------------------------------------------------------------------------------------------------------ coupling


class Halfway:
    """An accelerator: half of each correction."""

    finds_levels = False

    def begin_step(self): ...
    def forget(self): ...
    def next(self, d, found):
        return d + 0.5 * (found - d)

    def save(self):
        return {}

    def restore(self, state): ...


def test_accelerator():
    tight, found = FixedPointTolerance(1e-10), []
    for accelerator in (None, Halfway()):
        scheme = Partitioned(bar_and_column(10.0), accelerator, tight)
        list(march(scheme, end=0.1))
        found.append(scheme.coupled.interface.now)
    assert found[1] == pytest.approx(found[0], abs=1e-9 * np.abs(found[0]).max())


class Still:
    """A kind of body: a block that does not move, whatever the flow does. It has no unknowns."""

    name, comm, size, force_weight = "still", MPI.COMM_SELF, 0, 1.0

    def __init__(self, points):
        self.surfaces, self.force = {"block": points}, np.zeros_like(points)

    def initialise(self, t, dt): ...
    def begin_step(self, t, dt): ...
    def predict(self, t): ...
    def end_step(self): ...

    def displacement(self):
        return np.zeros_like(self.force)

    def load(self, force):
        self.force = force

    def solve(self):
        return StepInfo(0, ())

    def touching(self):
        return None

    def numbers(self):
        return {}

    def reduced(self, force):
        return force.sum(axis=0)

    def taken(self):
        return self.force.sum(axis=0)

    def taken_at_start(self):
        return np.zeros(2)

    def moved(self):
        return np.zeros(2)


def test_kind_of_body():
    """It feels what a rigid body of the flow feels."""
    points, facets = block([0.31, 0.32], [0.57, 0.66])
    patches = [Patch("in", ("x-",), "velocity", (1.0, 0.0)), SIDES, Patch("out", ("x+",), "outflow")]
    settings = {"solver": SolverSettings(TIGHT.newton, "direct"), "dt": 0.1}
    moved = [(ImmersedSurface("block", facets, len(points)), points)]
    immersed = immerse(moved, [], deform=False)
    still = Still(points)
    alone = make_fluid(
        uniform([0, 0], [1, 1], [10, 10]),
        patches,
        [body("block", points, facets, motion=lambda x, t: (x, 0.0 * x))],
        **settings,
    )
    flow = make_fluid(uniform([0, 0], [1, 1], [10, 10]), patches, immersed, **settings)
    scheme = Partitioned(Coupled(flow, still))
    for t, _ in march(scheme, end=0.2, steps=2):
        step(alone, t - 0.1, 0.1)
    assert np.abs(still.force).max() > 0.01
    assert still.force == pytest.approx(alone.force()["block"], abs=1e-9)
