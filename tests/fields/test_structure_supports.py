"""Supports in any direction: exact solutions turned by an angle, nodes with several conditions, what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from structure_setup import TIGHT, block, constant, distort, load_step, make_structure, vector

from fsci import shapes
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.body import Pressure, Roller, Support, Symmetry, Traction
from solvers.structure.dynamics import Dynamics
from solvers.structure.materials import NeoHooke

MATERIAL = NeoHooke(80.0, 120.0, 2.0)


def rotation(dim: int, seed: int = 1) -> np.ndarray:
    """One that takes no axis to an axis."""
    spin = np.random.default_rng(seed).uniform(-1.0, 1.0, (dim, dim))
    return expm(spin - spin.T)


def turned(mesh, R):
    return replace(mesh, points=mesh.points @ R.T)


def displacement(structure):
    body = structure.bodies[0]
    return structure.now.u.reshape(-1, body.dim), body.points[: body.dim, : body.owned].T


@pytest.mark.parametrize("cell_type", ["triangle6", "quad", "tetra10", "hexahedron27"])
@pytest.mark.parametrize("kind", ["symmetry", "normal", "direction"])
def test_uniaxial_stretch_in_a_turned_frame(cell_type, kind):
    """A block on rollers is pulled: it stretches by t along its axis and by n across it.

    P_tt = mu (t - 1/t) + lambda ln J / t = load and P_nn = mu (n - 1/n) + lambda ln J / n = 0, the load being chosen.
    """
    mesh = distort(block(cell_type, 2), 0.05)
    dim = mesh.points.shape[1]
    R, mu, lmbda = rotation(dim), MATERIAL.mu, MATERIAL.lmbda
    along = 1.3
    across = _free_stretch(along, dim)
    J = along * across ** (dim - 1)
    load = mu * (along - 1 / along) + lmbda * np.log(J) / along
    zero = constant(0.0)
    faces = ["left", "bottom"] if dim == 2 else ["left", "front", "bottom"]
    held = {
        "symmetry": [Symmetry(face) for face in faces],
        "normal": [Roller(face, None, zero) for face in faces],
        "direction": [Roller(face, tuple(-3.0 * R[:, i]), zero) for i, face in enumerate(faces)],
    }[kind]
    loads = [Traction("right", vector(*(load * R[:, 0])))]
    structure = make_structure(turned(mesh, R), MATERIAL, supports=held, tractions=loads)
    load_step(structure)
    u, X = displacement(structure)
    stretches = np.array([along] + [across] * (dim - 1)) - 1.0
    assert np.abs(u - X @ R @ np.diag(stretches) @ R.T).max() < 1e-11


def _free_stretch(along: float, dim: int) -> float:
    """Root of mu (n - 1/n) + lambda ln(t n^(dim - 1)) / n = 0."""
    from scipy.optimize import brentq

    mu, lmbda = MATERIAL.mu, MATERIAL.lmbda
    return brentq(lambda n: mu * (n - 1 / n) + lmbda * np.log(along * n ** (dim - 1)) / n, 0.5, 1.0, xtol=1e-15)


def test_conditions_at_one_node():
    """They hold beside each other; of those that contradict each other the last one counts."""
    n, mesh = np.array([0.6, 0.8]), block("quad", 2)
    left, right = (np.flatnonzero((mesh.points == corner).all(axis=1)) for corner in ([0, 1], [1, 1]))
    supports = [
        Support("bottom", vector(0.0, 0.0)),
        Roller("bottom", tuple(5.0 * n), constant(1.0)),
        Roller(left, tuple(n), constant(1.0)),
        Roller(left, tuple(-n), constant(-2.0)),
        Support(right, (None, constant(7.0))),
        Support(right, (constant(0.5), None)),
        Roller(right, tuple(n), constant(2.0)),
    ]
    structure = make_structure(mesh, MATERIAL, supports=supports)
    target = structure.held.displacement(1.0).reshape(-1, 2)
    body = structure.bodies[0]
    expected = {tuple(left): 2.0 * n, tuple(right): [0.5, 1.7 / 0.8]}
    expected |= {(node,): [1.0 / 0.6, 0.0] for node in np.flatnonzero(mesh.points[:, 1] == 0.0)}
    for (node,), value in expected.items():
        assert target[body.nodes[: body.owned] == node][0] == pytest.approx(value, abs=1e-14)
    others = ~np.isin(body.nodes[: body.owned], [node for (node,) in expected])
    assert not target[others].any()


def test_directions_along_axes_are_components():
    """They need no projection, and contact can know them."""
    value = constant(0.25)
    supports = [Roller("left", None, value), Roller("top", (0.0, -2.0), value), Roller("bottom", None, value)]
    structure = make_structure(block("quad", 2), MATERIAL, supports=supports)
    body, target = structure.bodies[0], structure.held.displacement(1.0).reshape(-1, 2)
    assert not structure.held.oblique
    x, y = np.round(body.points[:2, : body.owned], 9)
    assert target == pytest.approx(-0.25 * np.stack([x == 0.0, (y == 1.0) | (y == 0.0)], axis=1))


def test_normals_of_a_circle():
    """A ring under inner pressure keeps its radius where rollers hold its outer surface."""
    ring = shapes.ring(1.0, 2.0, [12, 2], order=2, angle=90.0)
    supports = [Symmetry("start"), Symmetry("end"), Roller("outer", None, constant(0.0))]
    structure = make_structure(ring, MATERIAL, supports=supports, pressures=[Pressure("inner", constant(5.0))])
    load_step(structure)
    u, X = displacement(structure)
    outer = np.abs(np.hypot(*X.T) - 2.0) < 1e-9
    assert np.abs(np.einsum("nd,nd->n", u, X)[outer]).max() < 1e-9
    inner = np.hypot(*(X + u)[np.abs(np.hypot(*X.T) - 1.0) < 1e-9].T)
    assert inner.min() > 1.005
    assert np.ptp(inner) < 1e-5


def test_a_mass_that_slides_down_a_slope():
    """A block on rollers of 30 degrees falls along them by g sin(30) t^2 / 2; they push across only."""
    R = expm(np.radians(-30.0) * np.array([[0.0, -1.0], [1.0, 0.0]]))
    structure = make_structure(
        turned(block("quad", 2), R),
        NeoHooke(8e3, 12e3, 2.0),
        supports=[Symmetry(name) for name in ("bottom", "top")],
        gravity=vector(0.0, -10.0),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)),
    )
    structure.initialise(0.0, 0.05)
    for step in range(4):
        structure.begin_step(0.05 * step, 0.05)
        structure.solve()
        structure.end_step()
    u, X = displacement(structure)
    across = (X @ R)[:, 1]
    assert np.abs((u @ R)[(across < 1e-9) | (across > 1 - 1e-9), 1]).max() < 1e-15
    assert u.mean(axis=0) @ R[:, 0] == pytest.approx(5.0 * 0.2**2 / 2.0, rel=1e-10)
    assert structure.energy.error == pytest.approx(0.0, abs=1e-10)
    reaction = structure.time.reaction(structure).reshape(-1, 2).sum(axis=0) @ R
    assert reaction[0] == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize("rows_only", [False, True])
def test_linear_systems_with_held_directions(rows_only):
    """K du = b with P du = m, as the dense system with multipliers gives it."""
    supports = [Roller("left", None, constant(0.0)), Roller("bottom", (1.0, 2.0), constant(0.3))]
    structure = make_structure(turned(block("quad", 2), rotation(2)), MATERIAL, supports=supports)
    structure.initialise(0.0, 1.0)
    structure.begin_step(0.0, 1.0)
    structure.residual()
    K, n = structure.linearise(), structure.layout.size
    dense, right = K.convert("dense").getDenseArray().copy(), np.random.default_rng(0).standard_normal(n)
    projection = np.stack([structure.held.part(e) for e in np.eye(n)])
    missing = structure.missing_displacement()
    assert np.abs(missing).max() > 0.05
    assert not structure.held.reached(structure.now.u, structure.target, 1.0)
    assert structure.held.reached(structure.now.u + missing, structure.target, 1.0)
    held = np.linalg.svd(projection)[2][: round(np.trace(projection))]
    size = len(held)
    assert size == 3 + 3  # two of them at the corner
    saddle = np.block([[dense, held.T], [held, np.zeros((size, size))]])
    expected = np.linalg.solve(saddle, np.concatenate([right, held @ missing]))[:n]

    x, b = structure.layout.vector(), structure.layout.vector()
    x.array[:], b.array[:] = missing, right
    if rows_only:
        (K,) = structure.held.impose_rows([K], x.array, b.array)
    else:
        K = structure.held.impose(K, x, b)
        assert K.isSymmetric(1e-12)
    found = np.linalg.solve(K.convert("dense").getDenseArray(), b.array)
    assert found == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize("linear", ["direct", "iterative", "ilu"])
def test_linear_solvers(linear):
    """They agree on a turned block between rollers, with the rigid modes of multigrid."""
    R = rotation(3)
    supports = [Symmetry(name) for name in ("left", "front", "bottom")]
    loads = [Traction("right", vector(*(20.0 * R[:, 0])))]
    mesh = turned(block("hexahedron", 4), R)
    settings = replace(TIGHT, linear=linear, linear_tolerance=1e-12)
    found = []
    for chosen in (TIGHT, settings):
        structure = make_structure(mesh, MATERIAL, supports=supports, tractions=loads, settings=chosen)
        load_step(structure)
        found.append(structure.now.u.copy())
    assert np.abs(found[0] - found[1]).max() < 1e-9 * np.abs(found[0]).max()


def test_supports_that_move_in_time():
    """Two directions that span the plane, each with its motion, drive a body as its components do."""
    a, b = np.array([1.0, 2.0]) / np.sqrt(5.0), np.array([-1.0, 1.0]) / np.sqrt(2.0)

    def along(direction):
        return lambda x, t: np.full(x.shape[1], direction @ [0.1 * np.sin(9.0 * t), 0.2 * t**2])

    whole = Support("left", (lambda x, t: 0.1 * np.sin(9.0 * t) + 0.0 * x[0], lambda x, t: 0.2 * t**2 + 0.0 * x[0]))
    found = []
    for supports in ([whole], [Roller("left", (1.0, 2.0), along(a)), Roller("left", (-2.0, 2.0), along(b))]):
        structure = make_structure(
            block("quad", 2), MATERIAL, supports=supports, time=Dynamics(GeneralisedAlpha.from_rho_inf(0.8))
        )
        structure.initialise(0.0, 0.05)
        for step in range(3):
            structure.begin_step(0.05 * step, 0.05)
            structure.solve()
            structure.end_step()
        found.append(np.array([*structure.now.u, *structure.now.v, *structure.now.a, structure.energy.work]))
    assert found[1] == pytest.approx(found[0], rel=1e-9, abs=1e-9 * np.abs(found[0]).max())
