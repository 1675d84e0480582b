"""The mixed element: consistent, exact for homogeneous states, free of locking, robust; contact, time, processes."""

import numpy as np
import pytest
import ufl
from contact_setup import SETTINGS, make_body, make_contact, solve_step
from programs import fsci
from structure_setup import block, distort, held_everywhere, load_step, make_structure, vector
from test_structure_tangent import MATERIALS, tangent_error

from fsci import shapes
from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from solvers.api import StepFailed
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Pressure, Support, Traction
from solvers.structure.dynamics import Dynamics
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import LinearElastic, NeoHooke, parameters

LAWS = {name: law for name, law in MATERIALS.items() if name != "varying"} | {"linear": LinearElastic(3.0, 5.0, 2.0)}


def value(expression) -> float:
    return float(expression(()))


@pytest.mark.parametrize("law", LAWS)
def test_energy_is_distortion_and_change_of_volume(law):
    material = LAWS[law]
    numbers = {"mu": 3.0, "lmbda": 5.0}
    if law in ("mooney_rivlin", "yeoh", "holzapfel_gasser_ogden"):
        numbers = parameters(material)
    constants = {name: ufl.as_ufl(number) for name, number in numbers.items()}
    for stretch in (0.8, 1.3):
        dilation = ufl.as_tensor(stretch * np.eye(3))
        J = material.volume_ratio(dilation)
        exact = value(material.energy(dilation, **constants))
        assert value(material.volumetric(J, **constants)) == pytest.approx(exact, rel=1e-12)
        assert value(material.distortional(dilation, **constants)) == pytest.approx(0.0, abs=1e-12)
    for dim in (2, 3):
        F = np.eye(3) + np.array([[0.2, 0.3, -0.1], [-0.1, 0.4, 0.2], [0.3, 0.0, -0.2]])
        F = ufl.as_tensor(F[:dim, :dim])
        parts = material.distortional(F, **constants) + material.volumetric(material.volume_ratio(F), **constants)
        assert value(parts) == pytest.approx(value(material.energy(F, **constants)), rel=1e-12)
        less_bulk = constants | ({"bulk": 0.0} if "bulk" in constants else {"lmbda": 0.0})
        assert value(material.distortional(F, **less_bulk)) == value(material.distortional(F, **constants))


@pytest.mark.parametrize(
    ("law", "cell_type"),
    [(law, "quad") for law in LAWS] + [("varying", "quad"), ("neo_hooke", "hexahedron"), ("neo_hooke", "quad9")],
)
def test_forces_and_tangent_are_derivatives(law, cell_type):
    """Forces are the derivative of the energy, the tangent is that of the forces."""
    structure = make_structure(distort(block(cell_type, 2), 0.05), (LAWS | MATERIALS)[law], element="mixed")
    assert tangent_error(structure) < 1e-6
    body, u = structure.bodies[0], structure.now.u.copy()
    direction = np.random.default_rng(5).uniform(-1.0, 1.0, len(u))
    energies = []
    for sign in (1, -1):
        body.set_displacement(u + sign * 1e-6 * direction)
        energies.append(body.internal_energy())
    body.set_displacement(u)
    assert (energies[0] - energies[1]) / 2e-6 == pytest.approx(body.internal_force() @ direction, rel=1e-6)


@pytest.mark.slow
def test_forces_and_tangent_of_27_nodes():
    test_forces_and_tangent_are_derivatives("neo_hooke", "hexahedron27")


@pytest.mark.parametrize("cell_type", ["quad", "quad9", "hexahedron"])
def test_patch(cell_type):
    """A homogeneous deformation imposed on the boundary holds inside; stress and energy are those of the law."""
    mesh = distort(block(cell_type, 3), 0.08)
    dim = mesh.points.shape[1]
    gradient = np.array([[0.10, 0.15, 0.03], [-0.08, 0.12, 0.05], [0.04, -0.06, -0.10]])[:dim, :dim]

    def displacement(i):
        return lambda x, t: t * (0.3 + gradient[i] @ x[:dim])

    law = MATERIALS["neo_hooke"]
    structure = make_structure(mesh, law, element="mixed", supports=held_everywhere(mesh, displacement))
    load_step(structure)
    body = structure.bodies[0]
    exact = 0.3 + body.points[:dim].T @ gradient.T
    assert np.abs(body.u.x.array.reshape(-1, dim) - exact).max() < 1e-11
    F = np.eye(3)
    F[:dim, :dim] += gradient
    J, mu, lmbda = np.linalg.det(F), 3.0, 5.0
    sigma = (mu * (F @ F.T - np.eye(3)) + lmbda * np.log(J) * np.eye(3)) / J
    assert body.stress().reshape(-1, 3, 3) == pytest.approx(np.broadcast_to(sigma, (body.owned, 3, 3)), abs=1e-10)
    energy = mu / 2 * (np.trace(F.T @ F) - 3) - mu * np.log(J) + lmbda / 2 * np.log(J) ** 2
    assert body.internal_energy() == pytest.approx(energy, rel=1e-12)


def tip(dim, order, across, *, nu, element):
    """Deflection of a slender cantilever under an end load, cells twice as long as thick."""
    cells, size = [5 * across] + [across] * (dim - 1), [10] + [1] * (dim - 1)
    mesh = shapes.rectangle(size, cells, order=order) if dim == 2 else shapes.box(size, cells, order=order)
    structure = make_structure(
        mesh,
        NeoHooke(*lame(1000.0, nu)),
        element=element,
        supports=[Support("left", vector(*[0] * dim))],
        tractions=[Traction("right", vector(0, 0.01, *[0] * (dim - 2)))],
        settings=SolverSettings(Tolerance(residual=1e-9), linear="direct"),
    )
    load_step(structure)
    body = structure.bodies[0]
    return body.u.x.array.reshape(-1, dim)[np.abs(body.points[0] - 10) < 1e-9, 1].mean()


def test_cells_of_four_nodes_do_not_lock():
    """Within 2 % of second order with the same cells, nearly incompressible; the plain element is off by 98 %."""
    second = tip(2, 2, 4, nu=0.4999, element="displacement")
    assert tip(2, 1, 4, nu=0.4999, element="mixed") == pytest.approx(second, rel=0.02)
    assert tip(2, 1, 4, nu=0.4999, element="displacement") < 0.03 * second


def test_cells_of_nine_nodes_do_not_lock():
    """Two cells across are within 2 % of eight times finer ones; plain ones are off by more than 5 %."""
    fine = tip(2, 2, 16, nu=0.4999, element="mixed")
    assert tip(2, 2, 2, nu=0.4999, element="mixed") == pytest.approx(fine, rel=0.02)
    assert tip(2, 2, 2, nu=0.4999, element="displacement") < 0.95 * fine


@pytest.mark.slow
@pytest.mark.parametrize("across", [2, 4])
def test_cells_of_eight_nodes_do_not_lock(across):
    """Within 2 % of second order with the same nodes; those are themselves 7 % and 3 % too stiff."""
    second = tip(3, 2, across, nu=0.4999, element="displacement")
    assert tip(3, 1, 2 * across, nu=0.4999, element="mixed") == pytest.approx(second, rel=0.02)
    assert tip(3, 1, 2 * across, nu=0.4999, element="displacement") < 0.4 * second


def sheared(traction):
    """A nearly incompressible square on a fixed base, pulled at the top by a traction that grows with time."""
    return make_structure(
        block("quad", 6),
        NeoHooke(*lame(1000.0, 0.4999)),
        element="mixed",
        supports=[Support("bottom", vector(0, 0))],
        tractions=[Traction("top", (lambda x, t: traction * t + 0 * x[0], lambda x, t: 0.4 * traction * t + 0 * x[0]))],
        settings=SolverSettings(Tolerance(residual=1e-9, max_iterations=12), linear="direct"),
    )


def test_large_steps(monkeypatch):
    """Newton's method of the three fields takes a large step; that of the displacement alone does not."""
    assert load_step(sheared(100.0)).iterations <= 8
    structure = sheared(100.0)
    element = structure.bodies[0].element
    linearise = element.linearise
    monkeypatch.setattr(element, "linearise", lambda: (element.begin_step(1.0), linearise()))
    with pytest.raises(StepFailed):
        load_step(structure)


def test_resumed_steps_are_the_same():
    """Bit for bit, though the tangent remembers the last one within a step."""
    structure = sheared(20.0)
    load_step(structure)
    state = structure.save()
    structure.begin_step(1.0, 1.0)
    structure.solve()
    resumed = sheared(20.0)
    resumed.initialise(0.0, 1.0)
    resumed.restore(state)
    resumed.begin_step(1.0, 1.0)
    resumed.solve()
    assert np.array_equal(structure.now.u, resumed.now.u)


def test_energy_of_a_free_vibration():
    """rho_inf = 1: kinetic and stored energy of a swinging beam keep their sum to 0.1 %."""
    structure = make_structure(
        shapes.rectangle([4, 1], [8, 2]),
        NeoHooke(*lame(100.0, 0.499), 1.0),
        element="mixed",
        time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)),
        supports=[Support("left", vector(0, 0))],
        initial_velocity=(lambda x, t: 0 * x[0], lambda x, t: 0.1 * x[0]),
    )
    structure.initialise(0.0, 0.05)
    for step in range(100):
        structure.begin_step(0.05 * step, 0.05)
        structure.solve()
        structure.end_step()
    assert structure.energy.internal > 0.0
    assert abs(structure.energy.error) < 1e-3 * structure.energy.initial


def test_contact():
    """A block pressed on another by a pressure, cells that do not match: the state is homogeneous and exact."""
    lower, upper = block("quad", 3), block("quad", 2)
    upper.points[:, 1] += 1.0
    sides = [Support(name, (lambda x, t: 0 * x[0], None)) for name in ("left", "right")]
    bodies = [
        make_body("lower", lower, element="mixed", supports=[Support("bottom", vector(0, 0)), *sides]),
        make_body(
            "upper", upper, element="mixed", supports=sides, pressures=[Pressure("top", lambda x, t: 50 + 0 * x[0])]
        ),
    ]
    structure, _ = make_contact(bodies, [(("lower", "top"), ("upper", "bottom"))], settings=SETTINGS)
    info = solve_step(structure)
    assert info.iterations <= 6
    for body in bodies:
        stress = body.stress().reshape(-1, 3, 3)[:, 1, 1]
        assert stress == pytest.approx(-50.0, rel=1e-9)


def test_contact_of_nearly_incompressible_blocks():
    """A narrow block is pushed into a wide one in one step: Newton converges, forces balance."""
    law = NeoHooke(*lame(1000.0, 0.4999))
    lower, upper = block("quad", 6), block("quad", 4)
    upper.points[:] = upper.points * 0.5 + [0.3, 1.0]
    bodies = [
        make_body("lower", lower, law, element="mixed", supports=[Support("bottom", vector(0, 0))]),
        make_body("upper", upper, law, element="mixed", supports=[Support("top", vector(0, -0.02))]),
    ]
    structure, _ = make_contact(bodies, [(("upper", "bottom"), ("lower", "top"))], settings=SETTINGS)
    assert solve_step(structure).iterations <= 13
    contact = [part.reshape(-1, 2).sum(axis=0) for part in structure.split(structure.now.constraint)]
    inner = structure.split(structure.time.reaction(structure))
    held = np.abs(bodies[0].points[1, : bodies[0].owned]) < 1e-9
    assert contact[1][1] > 10.0
    assert contact[0] == pytest.approx(-contact[1], abs=1e-8)
    assert inner[0].reshape(-1, 2)[held].sum(axis=0) == pytest.approx(contact[1], abs=1e-7)


CASE = """
time: {step: 0.25, end: 1}
structure:
  bodies:
    bar:
      mesh: {shape: box, size: [3, 1, 1], cells: [6, 2, 2]}
      material: {law: neo_hooke, E: 100, nu: 0.499}
      element: mixed
      supports: [{on: left, displacement: [0, 0, 0]}]
      tractions: [{on: right, value: [0, 0, "-0.4*t"]}]
      pressures: [{on: top, value: "t"}]
probes:
  tip: {quantity: displacement, at: [3, 0.5, 1]}
  energy: {quantity: energy}
  reaction: {quantity: reaction, on: left}
  traction: {quantity: traction, on: left}
solver: {newton: {residual: 1e-11}}
"""


@pytest.mark.parametrize("several", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_processes(several, tmp_path):
    (tmp_path / "case.yaml").write_text(CASE)
    found = []
    for processes in (1, several):
        done = fsci("run", tmp_path, "-o", tmp_path / str(processes), processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        found.append(read_history(tmp_path / str(processes) / "history.csv"))
    columns = [name for name in found[0] if name.split(".")[0] in ("tip", "energy", "reaction", "traction")]
    assert len(columns) == 13
    assert abs(found[0]["tip.z"][-1]) > 0.1
    for column in columns:
        assert found[1][column] == pytest.approx(found[0][column], rel=1e-8, abs=1e-9), column


REFUSED = """
time: {step: 1, end: 1}
structure:
  PLANE
  bodies:
    body:
      mesh: MESH
      material: {law: st_venant_kirchhoff, E: 100, nu: 0.3}
      element: mixed
"""


def test_triangles_of_a_file_are_refused(tmp_path):
    import meshio

    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    meshio.write(tmp_path / "one.msh", meshio.Mesh(points, [("triangle", [[0, 1, 2]])]), file_format="gmsh")
    (tmp_path / "case.yaml").write_text(REFUSED.replace("PLANE", "").replace("MESH", "{file: one.msh}"))
    done = fsci("run", tmp_path, "-o", tmp_path / "out")
    assert done.returncode != 0
    assert "case.yaml:9:16: 'mixed' is for quadrilaterals and hexahedra" in done.stdout + done.stderr


def test_plane_stress_is_refused(tmp_path):
    mesh = "{shape: rectangle, size: [1, 1], cells: [1, 1]}"
    (tmp_path / "case.yaml").write_text(REFUSED.replace("PLANE", "plane: stress").replace("MESH", mesh))
    with pytest.raises(CaseError) as error:
        load_case(tmp_path)
    message = "case.yaml:9:16: 'mixed' is not available in plane stress, which does not lock; take 'displacement'"
    assert message in str(error.value)


@pytest.mark.slow
def test_flow_around_a_nearly_incompressible_flap(tmp_path):
    """Both schemes give the same first steps of a flap that a flow bends; st_venant_kirchhoff, nine-node cells."""
    tips = []
    for scheme in ("monolithic", "partitioned"):
        changes = (
            f"coupling.scheme={scheme}",
            "structure.bodies.flap.material.nu=0.4999",
            "time.end=0.03",
            "verify=[]",
        )
        sets = (word for change in changes for word in ("--set", change))
        done = fsci("run", "cases/flap", "-o", tmp_path / scheme, *sets, timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr
        tips.append(read_history(tmp_path / scheme / "history.csv")["tip.x"])
    assert tips[0][-1] > 1e-4
    assert tips[1] == pytest.approx(tips[0], rel=1e-6)
