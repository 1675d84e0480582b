"""Every tangent is the finite difference of its residual; energies have the known small-strain limit."""

import numpy as np
import pytest
import ufl
from structure_setup import block, constant, distort, make_structure, vector

from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.body import Pressure, Support
from solvers.structure.dynamics import Dynamics
from solvers.structure.elastic_constants import lame, plane_stress_lambda
from solvers.structure.materials import (
    CoupNeoHooke,
    HolzapfelGasserOgden,
    MooneyRivlin,
    NeoHooke,
    PlaneStressStVenantKirchhoff,
    StVenantKirchhoff,
    Yeoh,
)
from solvers.structure.rayleigh import Damping

MATERIALS = {
    "st_venant_kirchhoff": StVenantKirchhoff(3.0, 5.0, 2.0),
    "neo_hooke": NeoHooke(3.0, 5.0, 2.0),
    "coup_neo_hooke": CoupNeoHooke(3.0, 5.0, 2.0),
    "coup_neo_hooke, nu = 0": CoupNeoHooke(3.0, 0.0, 2.0),
    "mooney_rivlin": MooneyRivlin(1.0, 0.5, 7.0, 2.0),
    "yeoh": Yeoh(1.5, -0.4, 0.2, 7.0, 2.0),
    "holzapfel_gasser_ogden": HolzapfelGasserOgden(3.0, 2.0, 4.0, 0.1, 7.0, 1.0, 0.5, 0.0, 2.0, -3.0, 0.0, 2.0),
    "varying": NeoHooke(lambda x, t: 3.0 + x[0], lambda x, t: 5.0 - x[1], 2.0),
}
#: laws whose tangents are checked in space in quick tests, too: one of invariants, one of directions
IN_SPACE = ("neo_hooke", "holzapfel_gasser_ogden")


def deformed(structure, seed=3):
    """A random state in the middle of a step."""
    rng = np.random.default_rng(seed)
    structure.initialise(0.0, 0.1)
    structure.begin_step(0.0, 0.1)
    structure.now.u[:] = rng.uniform(-0.04, 0.04, structure.layout.size)
    return rng


def tangent_error(structure):
    """Relative difference between the tangent and the central difference of the balance in a random direction."""
    rng = deformed(structure)
    u = structure.now.u.copy()
    direction = rng.uniform(-1.0, 1.0, len(u))
    step = 1e-6

    def balance(displacement):
        structure.now.u[:] = displacement
        structure.residual()
        return structure.residual_force.copy()

    difference = (balance(u + step * direction) - balance(u - step * direction)) / (2 * step)
    balance(u)
    x, y = structure.layout.vector(), structure.layout.vector()
    x.array[:] = direction
    structure.tangent().mult(x, y)
    return np.linalg.norm(y.array - difference) / np.linalg.norm(difference)


@pytest.mark.parametrize(
    ("law", "cell_type"),
    [
        *((law, "quad") for law in MATERIALS),
        *((law, "tetra") for law in IN_SPACE),
        ("neo_hooke", "hexahedron"),
        *(pytest.param(law, "tetra", marks=pytest.mark.slow) for law in MATERIALS if law not in IN_SPACE),
    ],
)
def test_material(law, cell_type):
    """In the plane and in space; what a law says does not depend on the cells."""
    structure = make_structure(distort(block(cell_type, 2), 0.05), MATERIALS[law])
    assert tangent_error(structure) < 1e-6


@pytest.mark.parametrize("cell_type", ["triangle6", "quad", "hexahedron"])
def test_follower_pressure(cell_type):
    mesh = distort(block(cell_type, 2), 0.05)
    pressures = [Pressure("top", lambda x, t: 2.0 + x[0]), Pressure("left", constant(-1.0))]
    structure = make_structure(mesh, MATERIALS["neo_hooke"], pressures=pressures)
    assert tangent_error(structure) < 1e-6


def test_dynamics_with_damping():
    time = Dynamics(GeneralisedAlpha.from_rho_inf(0.7), damping=Damping(mass=3.0, stiffness=0.2))
    structure = make_structure(block("quad", 2), MATERIALS["neo_hooke"], time=time)
    assert tangent_error(structure) < 1e-6


def small_stress(material, gradient):
    """Cauchy stress of a small homogeneous deformation."""
    dim = len(gradient)
    structure = make_structure(block("quad" if dim == 2 else "tetra", 1), material)
    body = structure.bodies[0]
    body.set_displacement((body.points[:dim, : body.owned].T @ np.asarray(gradient).T).ravel())
    return body.stress()[0].reshape(3, 3)


@pytest.mark.parametrize("law", ["st_venant_kirchhoff", "neo_hooke", "coup_neo_hooke", "mooney_rivlin", "yeoh"])
@pytest.mark.parametrize("dim", [2, 3])
def test_small_strain_is_hookes_law(law, dim):
    """All have mu = 3 Pa and lambda = 5 Pa: a bulk modulus of 7 Pa."""
    mu, lmbda = 3.0, 5.0
    gradient = 1e-6 * np.array([[1.0, 2.0, 0.5], [-0.5, 3.0, 1.0], [0.2, 0.1, -2.0]])[:dim, :dim]
    strain = np.zeros((3, 3))
    strain[:dim, :dim] = (gradient + gradient.T) / 2
    hooke = 2 * mu * strain + lmbda * np.trace(strain) * np.eye(3)
    assert small_stress(MATERIALS[law], gradient) == pytest.approx(hooke, abs=3e-5 * np.abs(hooke).max())


@pytest.mark.parametrize("lmbda", [0.0, 1e-9, 5.999e-4, 6.001e-4])
def test_coup_neo_hooke_for_small_nu(lmbda):
    """c/beta (J^(-2 beta) - 1) + c (I1 - 3) becomes neo_hooke with lambda = 0; P = mu (F - J^(-2 beta) F^-T)."""
    mu, gradient = 3.0, np.array([[0.2, 0.3], [-0.1, 0.4]])
    body = make_structure(block("quad", 1), CoupNeoHooke(mu, lmbda)).bodies[0]
    body.set_displacement((body.points[:2, : body.owned].T @ gradient.T).ravel())
    F = np.eye(2) + gradient
    J, I1, beta = np.linalg.det(F), (F**2).sum() + 1.0, lmbda / (2.0 * mu)
    P = mu * (F - J ** (-2.0 * beta) * np.linalg.inv(F).T)
    assert body.stress()[0].reshape(3, 3)[:2, :2] == pytest.approx(P @ F.T / J, rel=1e-11)
    volumetric = -2.0 * np.log(J) if lmbda == 0.0 else np.expm1(-2.0 * beta * np.log(J)) / beta
    assert body.internal_energy() == pytest.approx(mu / 2.0 * (volumetric + I1 - 3.0), rel=1e-11)


@pytest.mark.parametrize("ratio", [1e-6, 9.99e-4, 1.001e-3])
@pytest.mark.parametrize("J", [0.01, 0.5, 100.0])
def test_energy_of_coup_neo_hooke_for_small_nu_and_large_changes_of_volume(J, ratio):
    """mu ((J^-n - 1)/n + (I_1 - 3)/2) with n = lambda/mu, below and above the limit of the series."""
    stretch, n = J ** (1.0 / 3.0), ratio
    energy = CoupNeoHooke(1.0, n).energy(stretch * ufl.Identity(3), ufl.as_ufl(1.0), ufl.as_ufl(n))(())
    exact = np.expm1(-n * np.log(J)) / n + 1.5 * (stretch**2 - 1.0)
    assert energy == pytest.approx(exact, rel=1e-12, abs=1e-12)


def test_coup_neo_hooke_without_lateral_contraction():
    """nu = 0, also in a part of the body only: the tangent is that of the forces; a stretched bar keeps its width."""
    law = CoupNeoHooke(3.0, lambda x, t: np.where(x[0] < 0.5, 0.0, 2.0), 2.0)
    assert tangent_error(make_structure(distort(block("quad", 2), 0.05), law)) < 1e-6
    stretch = small_stress(CoupNeoHooke(3.0, 0.0), [[1e-6, 0.0], [0.0, 0.0]])
    assert stretch == pytest.approx(np.diag([6e-6, 0.0, 0.0]), abs=1e-10)


def test_plane_stress_uniaxial():
    """sigma_33 = 0, and Young's modulus and Poisson's ratio are those of a free strip."""
    mu, lmbda = lame(E := 10.0, nu := 0.3)
    material = PlaneStressStVenantKirchhoff(mu, plane_stress_lambda(mu, lmbda))
    stress = small_stress(material, [[1e-6, 0.0], [0.0, -nu * 1e-6]])
    assert stress == pytest.approx(np.diag([E * 1e-6, 0.0, 0.0]), abs=1e-10)


def test_pressure_on_a_closed_surface_has_no_resultant():
    """Follower pressure acts along the deformed normal: int p n da = 0 over a closed surface, however deformed."""
    mesh = distort(block("hexahedron", 2), 0.05)
    structure = make_structure(
        mesh, MATERIALS["neo_hooke"], pressures=[Pressure(name, constant(3.0)) for name in mesh.surfaces]
    )
    deformed(structure)
    structure.residual()
    force = structure.now.external.reshape(-1, 3)
    assert np.abs(force).max() > 0.1
    assert np.abs(force.sum(axis=0)).max() < 1e-12


def test_uniform_loads_are_exact():
    """Dead traction and body force add up to value times reference area and volume."""
    from solvers.structure.body import Traction

    structure = make_structure(
        block("tetra10", 2),
        MATERIALS["neo_hooke"],
        body_force=vector(1.0, 2.0, 3.0),
        gravity=vector(0.0, 0.0, -9.0),
        tractions=[Traction("top", vector(0.5, 0.0, -0.25))],
        supports=[Support("bottom", vector(0, 0, 0))],
    )
    structure.initialise(0.0, 1.0)
    assert structure.now.external.reshape(-1, 3).sum(axis=0) == pytest.approx([1.5, 2.0, 3.0 - 18.0 - 0.25])
