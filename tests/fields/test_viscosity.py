"""Damping in proportion to the stiffness: that of strain rates, however a body has turned."""

import numpy as np
import pytest
from contact_setup import make_body
from scipy.spatial.transform import Rotation
from structure_setup import CELL_TYPES, block, make_structure
from test_contact_start import TIGHT, advance
from test_rigid_inertia import probe, spins

from solvers.algebra.blocks import times
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.dynamics import Dynamics
from solvers.structure.materials import (
    CoupNeoHooke,
    LinearElastic,
    NeoHooke,
    PlaneStressStVenantKirchhoff,
    StVenantKirchhoff,
)
from solvers.structure.rayleigh import Damping
from solvers.structure.springs import Spring
from solvers.structure.viscosity import Viscosity

MATERIALS = {
    "neo_hooke": NeoHooke(400.0, 600.0, 2.0),
    "st_venant_kirchhoff": StVenantKirchhoff(400.0, 600.0, 2.0),
    "linear_elastic": LinearElastic(400.0, 600.0, 2.0),
    "coup_neo_hooke": CoupNeoHooke(400.0, 0.3, 2.0),
    "plane_stress": PlaneStressStVenantKirchhoff(400.0, 300.0, 2.0),
}


def stiffness(body):
    """K of the undeformed body."""
    body.set_displacement(np.zeros(body.size))
    matrix = body.create_tangent()
    body.assemble_tangent(matrix, 0.0)
    return matrix


def rigid(body, rotvec, omega, v=(1.0, 2.0, -3.0)):
    """(displacement, velocity) of a body that has turned by a rotation vector and goes on to turn."""
    dim = body.dim
    X = np.pad(body.points[:dim, : body.owned].T, ((0, 0), (0, 3 - dim)))
    x = X @ Rotation.from_rotvec(rotvec).as_matrix().T + [3.0, -2.0, 0.0]
    return (x - X)[:, :dim].ravel(), (np.cross(omega, x) + v)[:, :dim].ravel()


#: Forms of the others take seconds to compile.
FEW_FORMS = [
    pytest.param(name, marks=() if name in ("quad", "quad9", "hexahedron") else pytest.mark.slow) for name in CELL_TYPES
]


@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS.keys())
def test_undeformed_bodies_have_the_stiffness_of_their_material(material):
    body = make_body("block", block("quad", 3), material, springs=[Spring("left", lambda x, t: 0.0 * x[0] + 70.0)])
    K, v = stiffness(body), np.random.default_rng(1).standard_normal(body.size)
    assert Viscosity(body).force(v) == pytest.approx(times(K, v), rel=1e-11, abs=1e-10)
    assert times(Viscosity(body).matrix(), v) == pytest.approx(times(K, v), rel=1e-11, abs=1e-10)


@pytest.mark.parametrize(
    "cell_type",
    ["quad", *(pytest.param(name, marks=pytest.mark.slow) for name in ("hexahedron", "quad9", "hexahedron27"))],
)
def test_mixed_elements_do_not_lock(cell_type):
    """The power of smooth velocities that keep the volume is that by the stiffness of the mixed element."""
    body = make_body("block", block(cell_type, 3), NeoHooke(400.0, 6e5, 2.0), element="mixed")
    K, X = stiffness(body), body.points[: body.dim, : body.owned]
    v = np.zeros((body.owned, body.dim))
    v[:, 0], v[:, 1] = X[0] * (1.0 - X[1]), 0.5 * X[1] * (X[1] - 2.0) + 0.3 * X[0] ** 2
    power = v.ravel() @ Viscosity(body).force(v.ravel())
    assert power == pytest.approx(v.ravel() @ times(K, v.ravel()), rel=0.01)
    locked = make_body("block", block(cell_type, 3), NeoHooke(400.0, 6e5, 2.0))
    assert cell_type in ("quad9", "hexahedron27") or power < 0.2 * (v.ravel() @ Viscosity(locked).force(v.ravel()))


@pytest.mark.parametrize("cell_type", FEW_FORMS)
def test_rigid_motion_is_not_damped(cell_type):
    body = make_body("block", block(cell_type, 2), NeoHooke(400.0, 600.0, 2.0))
    plane = body.dim == 2
    u, v = rigid(body, [0, 0, 2.3] if plane else [0.4, -1.2, 1.9], [0, 0, 1.7] if plane else [0.3, 0.8, -1.1])
    viscosity = Viscosity(body)
    body.set_displacement(u)
    turned = viscosity.force(v)
    body.set_displacement(0.0 * u)
    assert np.abs(turned).max() < 1e-11 * np.abs(viscosity.force(v)).max()


@pytest.mark.parametrize("cell_type", ["quad", "tetra"])
def test_force_is_symmetric_in_velocities_and_dissipates(cell_type):
    """In a deformed and turned state; its matrix is its derivative by the velocity."""
    body, rng = make_body("block", block(cell_type, 2), NeoHooke(400.0, 600.0, 2.0)), np.random.default_rng(5)
    u, _ = rigid(body, [0, 0, 1.1], [0, 0, 0])
    body.set_displacement(u + 0.03 * rng.standard_normal(body.size))
    viscosity = Viscosity(body)
    v, w = rng.standard_normal((2, body.size))
    f, matrix = viscosity.force(v), viscosity.matrix()
    assert times(matrix, v) == pytest.approx(f, rel=1e-11, abs=1e-11 * np.abs(f).max())
    assert w @ f == pytest.approx(v @ viscosity.force(w), rel=1e-11)
    assert v @ f > 0.0


@pytest.mark.parametrize("element", ["displacement", "mixed"])
@pytest.mark.parametrize("cell_type", FEW_FORMS)
def test_derivative_by_the_displacement(cell_type, element):
    """Against finite differences, in a deformed and turned state."""
    if element == "mixed" and cell_type not in ("quad", "hexahedron", "quad9", "hexahedron27"):
        pytest.skip("the mixed element is one of quadrilaterals and hexahedra")
    body = make_body("block", block(cell_type, 1), NeoHooke(400.0, 600.0, 2.0), element=element)
    rng = np.random.default_rng(5)
    u, _ = rigid(body, [0.3, 0.2, 1.1] if body.dim == 3 else [0, 0, 1.1], [0, 0, 0])
    u = u + 0.05 * rng.standard_normal(body.size)
    viscosity, (v, du), h = Viscosity(body), rng.standard_normal((2, body.size)), 1e-6
    forces = []
    for step in (h, -h):
        body.set_displacement(u + step * du)
        forces.append(viscosity.force(v))
    body.set_displacement(u)
    wanted = (forces[0] - forces[1]) / (2.0 * h)
    assert times(viscosity.turning(v), du) == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max())


@pytest.mark.parametrize(
    ("dim", "damping"),
    [
        pytest.param(2, Damping(), id="2-none"),
        pytest.param(2, Damping(0.0, 1e-3), id="2-weak"),
        pytest.param(3, Damping(0.0, 0.1), id="3-strong"),
        pytest.param(2, Damping(0.0, 0.1), id="2-strong", marks=pytest.mark.slow),
        pytest.param(3, Damping(), id="3-none", marks=pytest.mark.slow),
        pytest.param(3, Damping(0.0, 1e-3), id="3-weak", marks=pytest.mark.slow),
    ],
)
def test_a_block_that_spins_keeps_its_spin(dim, damping):
    """Half a turn."""
    cell_type = "quad" if dim == 2 else "hexahedron"
    structure = make_structure(
        block(cell_type, 2),
        StVenantKirchhoff(4e4, 6e4, 1.0),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0), damping),
        settings=TIGHT,
        initial_velocity=spins([0.0, 0.0, 2.0], (0.5,) * dim),
    )
    spin = [probe(structure, "angular_momentum")[-1] for _ in advance(structure, 0.02, 80)]
    assert np.array(spin) == pytest.approx(2.0 / 6.0, rel=2e-3)
    assert structure.energy.kinetic == pytest.approx(structure.energy.initial, rel=2e-3)


def test_vibrations_of_a_body_that_has_turned_decay_as_before():
    """A block that vibrates, in its first orientation and turned by a right angle: the same history."""
    ends = []
    for angle in (0.0, np.pi / 2.0):
        turn = Rotation.from_rotvec([0, 0, angle]).as_matrix()[:2, :2]
        structure = make_structure(
            block("quad", 3),
            NeoHooke(400.0, 600.0, 1.0),
            time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0), Damping(0.0, 0.01)),
            settings=TIGHT,
        )
        (body,) = structure.bodies
        X = body.points[:2, : body.owned].T
        structure.now.u[:] = (X @ turn.T - X).ravel()
        v = np.stack([np.cos(3.0 * X[:, 0]), 0.0 * X[:, 0]], axis=1) @ turn.T
        structure.now.v[:] = v.ravel()
        *_, _ = advance(structure, 0.01, 20)
        ends.append([structure.energy.kinetic, structure.energy.internal, structure.energy.damping])
        moved = (X + structure.now.u.reshape(-1, 2)) @ turn - X
        ends[-1] = np.concatenate([ends[-1], moved.ravel()])
    assert ends[0][2] > 0.01
    assert ends[1] == pytest.approx(ends[0], rel=1e-8, abs=1e-9)
