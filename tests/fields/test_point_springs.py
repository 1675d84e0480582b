"""Springs and dampers between points of elastic bodies: stretches by hand, frequencies, energy, derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI
from structure_setup import TIGHT, block, constant, vector

from solvers.generalised_alpha import GeneralisedAlpha
from solvers.mesh.mesh import Mesh
from solvers.spring_law import SpringLaw
from solvers.structure.body import Body, Support
from solvers.structure.dynamics import Dynamics
from solvers.structure.field import Structure
from solvers.structure.materials import NeoHooke
from solvers.structure.point_springs import SpringBetween, SpringEnd, SpringOutside
from solvers.structure.time_scheme import Statics

STIFF = NeoHooke(8e5, 12e5, 2.0)
SOFT = NeoHooke(40.0, 60.0, 2.0)


def beside(mesh: Mesh, shift) -> Mesh:
    from dataclasses import replace

    return replace(mesh, points=mesh.points + np.array(shift))


def body(name, mesh, material=STIFF, **settings) -> Body:
    return Body(name, mesh, material, **settings, comm=MPI.COMM_SELF)


def spring(first, second, stiffness=50.0, damping=0.0, length=0.0) -> SpringBetween:
    ends = tuple(SpringEnd(name, at) for name, at in (first, second))
    return SpringBetween(ends, SpringLaw(stiffness, damping, length))


def mean(structure, index):
    dim = structure.dim
    return structure.split(structure.now.u)[index].reshape(-1, dim).mean(axis=0)


def loaded(structure):
    structure.initialise(0.0, 1.0)
    structure.begin_step(0.0, 1.0)
    structure.solve()
    structure.end_step()
    return structure


@pytest.mark.parametrize("cell_type", ["triangle", "quad9", "tetra", "hexahedron"])
def test_a_block_hangs_on_springs_from_another_one(cell_type):
    """Two springs in parallel carry its weight, of 2 kg: their stretches add up to m g / k, whatever the blocks do."""
    mesh, dim = block(cell_type, 2), 2 if cell_type in ("triangle", "quad9") else 3
    below = beside(mesh, [0.0] * (dim - 1) + [-1.5])
    still = [Support(name, tuple([constant(0.0)] * dim)) for name in mesh.surfaces]
    sideways = [Support(name, (*[constant(0.0)] * (dim - 1), None)) for name in mesh.surfaces]
    first, second = [0.25] * dim, [0.75] * dim
    springs = [spring(("up", [*at[:-1], 0.1]), ("down", [*at[:-1], -0.6]), length=0.7) for at in (first, second)]
    up = body("up", mesh, supports=still)
    down = body("down", below, supports=sideways, gravity=vector(*[0.0] * (dim - 1), -10.0))
    structure = loaded(Structure([up, down], Statics(), TIGHT, springs=springs))
    stretch = [other.x - one.x for _, one, other in structure.springs.places(structure)]
    assert sum(np.linalg.norm(d) - 0.7 for d in stretch) == pytest.approx(2.0 * 10.0 / 50.0, abs=1e-11)
    assert structure.springs.energy(structure) == pytest.approx(2 * 0.5 * 50.0 * 0.2**2, rel=1e-9)


def test_springs_in_all_directions_add_up_in_any_order():
    """A soft block between two springs of no length: the reaction is the weight; ends in other order, the same."""
    ends = []
    for turned in (False, True):
        pairs = [(("wall", (1.0, 0.3)), ("soft", (1.2, 0.31))), (("wall", (1.0, 0.7)), ("soft", (1.23, 0.72)))]
        springs = [spring(*(pair[::-1] if turned else pair)) for pair in pairs]
        wall = body("wall", block("quad", 2), supports=[Support("left", (constant(0.0), constant(0.0)))])
        soft = body("soft", beside(block("quad", 2), (1.1, 0.0)), SOFT, gravity=vector(0.0, -1.0))
        structure = loaded(Structure([wall, soft], Statics(), TIGHT, springs=springs))
        pull = sum(
            law.force(one.x - other.x, np.zeros(3))[0] for law, one, other in structure.springs.places(structure)
        )
        assert np.abs(pull) == pytest.approx([0.0, 2.0, 0.0], abs=1e-9)
        ends.append(structure.now.u)
    assert ends[1] == pytest.approx(ends[0], abs=1e-12)


def two_blocks(steps, damping=0.0, rho_inf=1.0):
    """Stiff squares of 2 kg each with a stretched spring from middle to middle; half a swing."""
    k = 40.0
    left, right = body("left", block("quad", 1)), body("right", beside(block("quad", 1), (1.5, 0.0)))
    law = spring(("left", (0.5, 0.5)), ("right", (2.0, 0.5)), k, damping, 1.3)
    scheme = Dynamics(GeneralisedAlpha.from_rho_inf(rho_inf))
    structure = Structure([left, right], scheme, TIGHT, springs=[law])
    omega = np.sqrt(k * 2.0 / 2.0)
    end = 0.7 * np.pi / omega
    structure.initialise(0.0, end / steps)
    for n in range(steps):
        structure.step(n * end / steps, end / steps)
    return structure, omega * end


def test_two_blocks_swing_on_a_spring_and_keep_their_energy():
    """Stretch 0.2 cos(omega t), omega^2 = 2 k / m, of second order; momentum and energy with the spring's stay."""
    errors, drifts = [], []
    for steps in (20, 40):
        structure, phase = two_blocks(steps)
        stretch = 0.2 + (mean(structure, 1) - mean(structure, 0))[0]
        errors.append(abs(stretch - 0.2 * np.cos(phase)))
        total = structure.energy.kinetic + structure.energy.internal + structure.springs.energy(structure)
        drifts.append(abs(total - 0.5 * 40.0 * 0.2**2))
        assert mean(structure, 1) + mean(structure, 0) == pytest.approx(0.0, abs=1e-11)
        assert abs(structure.energy.error) < 1e-9
    assert errors[1] < 1e-3 * 0.2
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    assert max(drifts) < 1e-7


def test_a_damper_brings_two_blocks_to_one_speed():
    """v_1 - v_2 = v_0 exp(-2 c t / m) with c = 1.5 and m = 2."""
    left = body("left", block("quad", 1), initial_velocity=vector(1.0, 0.0))
    right = body("right", beside(block("quad", 1), (3.0, 0.0)))
    law = spring(("left", (0.5, 0.5)), ("right", (3.5, 0.5)), 0.0, 1.5, 3.0)
    structure = Structure([left, right], Dynamics(GeneralisedAlpha.from_rho_inf(1.0)), TIGHT, springs=[law])
    structure.initialise(0.0, 0.02)
    for n in range(50):
        structure.step(n * 0.02, 0.02)
    v = [part.reshape(-1, 2).mean(axis=0)[0] for part in structure.split(structure.now.v)]
    assert v[0] - v[1] == pytest.approx(np.exp(-1.5), rel=1e-3)
    assert v[0] + v[1] == pytest.approx(1.0, abs=1e-10)


@pytest.mark.parametrize("length", [0.0, 0.4])
def test_the_derivative_of_springs_and_dampers(length):
    """Against differences, in a step of a dynamic structure, where springs turn and stretch."""
    rng = np.random.default_rng(3)
    left, right = body("left", block("quad9", 1), SOFT), body("right", beside(block("triangle", 1), (1.5, 0)), SOFT)
    law = spring(("left", (0.9, 0.3)), ("right", (1.7, 0.6)), 30.0, 2.0, length)
    rest = spring(("left", (0.2, 0.3)), (None, (0.1, 0.9)), 20.0, 1.0, length)
    scheme = Dynamics(GeneralisedAlpha.from_rho_inf(0.6))
    structure = Structure([left, right], scheme, TIGHT, springs=[law, rest])
    structure.initialise(0.0, 0.1)
    structure.step(0.0, 0.1)
    structure.begin_step(0.1, 0.1)
    start = structure.now.u + 0.05 * rng.standard_normal(structure.layout.size)

    def balance(u):
        structure.now.u[:] = u
        structure.residual()
        return structure.residual_force.copy()

    way, h = rng.standard_normal(len(start)), 1e-6
    slope = (balance(start + h * way) - balance(start - h * way)) / (2.0 * h)
    balance(start)
    x, y = structure.layout.vector(), structure.layout.vector()
    x.array[:] = way
    structure.linearise().mult(x, y)
    assert y.array == pytest.approx(slope, rel=1e-6, abs=1e-6 * np.abs(slope).max())


def test_the_end_of_a_spring_is_in_its_body():
    with pytest.raises(SpringOutside, match=r"the point \(0.5, 1.2\) is not in body 'a'") as raised:
        Structure([body("a", block("quad", 1))], springs=[spring((None, (0.0, 0.0)), ("a", (0.5, 1.2)))])
    assert (raised.value.spring, raised.value.end) == (0, 1)
