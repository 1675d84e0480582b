"""The monolithic system: its blocks against finite differences, action against reaction."""

from __future__ import annotations

import numpy as np
import pytest
from coupling_setup import post_in_flow

from coupling.monolithic import Monolithic
from solvers.fluid.solve.system import FlowSystem
from solvers.fluid.terms import coupling_entries
from solvers.newton import Tolerance


@pytest.fixture(scope="module")
def disturbed():
    """A coupled system in the middle of its second step, at a state that solves nothing."""
    coupled = post_in_flow()
    coupled.initialise(0.0, 0.02)
    scheme = Monolithic(coupled)
    scheme.step(0.0, 0.02)
    coupled.begin_step(0.02, 0.02)
    rng = np.random.default_rng(0)
    structure, fluid = coupled.solid.structure, coupled.flow
    structure.now.u += structure.held.free_part(1e-3 * rng.standard_normal(structure.layout.size))
    fluid.move(coupled.interface.move(coupled.interface.displacement()))
    free = np.flatnonzero(~fluid.iterate.held)
    fluid.flow[free] += 0.1 * rng.standard_normal(len(free))
    scheme.follow()
    scheme.residual()
    return scheme


def rows(scheme) -> np.ndarray:
    """Both residuals with the cut held: velocity and force of the surface follow the unknowns, its place does not.

    The velocity is that whose flux is the volume that the surface sweeps.
    """
    coupled = scheme.coupled
    fluid, structure, interface = coupled.flow, coupled.solid.structure, coupled.interface
    d, cut = interface.displacement(), fluid.cut
    cut.motion.v[:] = interface.velocity(d)
    fluid.system.sweep_velocity = fluid.moving.sweep.velocity(
        cut.facets, interface.points + d, cut.motion.v, fluid.current.difference
    )
    fluid.residual()
    coupled.solid.load(coupled.force())
    structure.residual()
    return np.concatenate([structure.held.free_part(structure.residual_force), fluid.iterate.rows])


@pytest.fixture
def without_shape(monkeypatch):
    """The cut is held: derivatives by the shape of the fluid's domain are left out."""
    with_shape = coupling_entries.shape_derivatives

    def without(*a):
        into_flow, load = with_shape(*a)
        return 0.0 * into_flow, 0.0 * load

    monkeypatch.setattr(coupling_entries, "shape_derivatives", without)
    monkeypatch.setattr(FlowSystem, "shape_derivatives", lambda *_, **__: (None, None))


def split(scheme, rows_of_both) -> tuple[np.ndarray, np.ndarray]:
    """Free rows of the structure and of the fluid."""
    fluid, structure = scheme.coupled.flow, scheme.coupled.solid.structure
    own = structure.layout.size
    return structure.held.free_part(rows_of_both[:own]), np.where(fluid.iterate.held, 0.0, rows_of_both[own:])


def direction(scheme, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random changes of the free unknowns of the structure and of the fluid."""
    fluid, structure = scheme.coupled.flow, scheme.coupled.solid.structure
    rng = np.random.default_rng(seed)
    du = structure.held.free_part(rng.standard_normal(structure.layout.size))
    return du, np.where(fluid.iterate.held, 0.0, rng.standard_normal(fluid.unknowns.owned))


def by_matrix(scheme, matrix, du, dw) -> tuple[np.ndarray, np.ndarray]:
    """A matrix of all unknowns times a direction."""
    x, y = matrix.createVecs()
    x.array[:] = np.concatenate([du, dw])
    matrix.mult(x, y)
    return split(scheme, y.array.copy())


def by_differences(scheme, du, dw, h: float = 1e-6) -> tuple[np.ndarray, np.ndarray]:
    """Derivative of both residuals along a direction, by central differences."""
    fluid, structure = scheme.coupled.flow, scheme.coupled.solid.structure
    u, flow = structure.now.u.copy(), fluid.flow.copy()
    values = []
    for sign in (1.0, -1.0):
        structure.now.u[:] = u + sign * h * du
        fluid.flow[:] = flow + sign * h * dw
        values.append(rows(scheme))
    structure.now.u[:], fluid.flow[:] = u, flow
    rows(scheme)  # the state of the coefficients as it was
    return split(scheme, (values[0] - values[1]) / (2.0 * h))


def difference(a, b) -> float:
    """Relative to the second."""
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_blocks_against_finite_differences(disturbed, without_shape, seed: int):
    rows(disturbed)
    du, dw = direction(disturbed, seed)
    found = by_matrix(disturbed, disturbed.blocks().assembled(), du, dw)
    for part, exact in zip(found, by_differences(disturbed, du, dw), strict=True):
        assert difference(part, exact) < 1e-6


@pytest.mark.parametrize(("number", "name"), enumerate(["into_fluid", "into_structure", "mass"]))
def test_every_coupling_block_counts(disturbed, without_shape, number: int, name: str):
    """Each block is right in the rows where it acts alone or beside K; without it these rows are wrong by far."""
    rows(disturbed)
    du, dw = direction(disturbed, 4)
    if name == "into_structure":
        du = 0.0 * du
    else:
        dw = 0.0 * dw
    part = 1 if name == "into_fluid" else 0
    exact = by_differences(disturbed, du, dw)[part]
    found = by_matrix(disturbed, disturbed.blocks().assembled(), du, dw)[part]
    assert difference(found, exact) < 1e-6
    block = disturbed.coupling_blocks()[number]
    x, y = block.createVecs()
    x.array[:] = dw if name == "into_structure" else du
    block.mult(x, y)
    both = [np.zeros(len(du)), np.zeros(len(dw))]
    both[part] = y.array
    share = split(disturbed, np.concatenate(both))[part]
    assert difference(found - share, exact) > 1e-3


@pytest.mark.parametrize(("E", "rho_s", "factor"), [(1000.0, 10.0, 3000.0), (100.0, 2.0, 100.0)])
def test_every_newton_step_gains_much(E, rho_s, factor):
    """Fast convergence in the mean: the derivative by the shape lacks little, which counts for soft bodies."""
    coupled = post_in_flow(E=E, rho_s=rho_s)
    coupled.initialise(0.0, 0.02)
    scheme = Monolithic(coupled, Tolerance(1e-9))
    for number in range(3):
        residuals = np.array(scheme.step(0.02 * number, 0.02).residuals)
    assert len(residuals) <= 7
    assert (residuals[1] / residuals[-1]) ** (1.0 / (len(residuals) - 2)) > factor
    assert (residuals[1:-1] / residuals[2:]).min() > 0.5 * factor


def test_the_force_on_the_structure_is_the_reaction_of_the_fluid():
    """f = C' S w - M g, with the C by which motion enters the fluid's rows."""
    coupled = post_in_flow()
    coupled.initialise(0.0, 0.02)
    Monolithic(coupled).step(0.0, 0.02)
    fluid = coupled.flow
    interface, velocity = fluid.system.assemble_interface(), fluid.unknowns.velocity.dofs.ravel()
    rng = np.random.default_rng(3)
    w, g = rng.standard_normal(fluid.unknowns.local), rng.standard_normal(fluid.cut.motion.v.shape)
    signed = w.copy()
    signed[velocity] *= -1.0
    work_on_motion = np.vdot(interface.force(w, np.zeros_like(g)), g)
    assert work_on_motion == pytest.approx(interface.velocity_terms(g) @ signed, rel=1e-10)
    assert coupled.balance.force < 1e-8  # what Newton's method leaves
    assert np.abs(interface.force(fluid.flow, fluid.cut.motion.v)).max() > 1e-3
