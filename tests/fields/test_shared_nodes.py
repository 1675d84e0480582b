"""Slave and master that share nodes: the lips of a notch, which meet at its tip."""

import numpy as np
import pytest
from contact_setup import make_body, make_contact, solve_step
from structure_setup import constant

from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.frictionless import Frictionless
from solvers.mesh.mesh import Mesh
from solvers.structure.body import Support

ZERO = constant(0)
TIP = 0.3  #: where the notch ends
STEPS = 8
N = 10  #: cells along an edge


def notched(opening: float, n: int = N, dim: int = 2, size: float = 1.0, shift: float = 0.0) -> Mesh:
    """A square, in 3D a slab of it, of n x n cells with a notch from the right; its lips share the nodes at the tip."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    first, half = round(TIP * n), n // 2
    upper = number.copy()
    upper[first + 1 :, half] = (n + 1) ** 2 + np.arange(n - first)
    points = np.concatenate(
        [np.stack([x.ravel(), y.ravel()], axis=1), np.stack([x[first + 1 :, 0], y[first + 1 :, half]], axis=1)]
    )
    away = opening * np.maximum(points[:, 0] - TIP, 0.0) / (1.0 - TIP)
    below = points[:, 1] < 0.5 - 1e-9
    below[number[first + 1 :, half]] = True
    height = np.where(below, points[:, 1], 1.0 - points[:, 1]) / 0.5
    points[:, 1] += np.where(below, -1.0, 1.0) * away * height
    cells = []
    for i in range(n):
        for j in range(n):
            own = upper if j >= half else number
            cells.append([own[i, j], own[i + 1, j], own[i + 1, j + 1], own[i, j + 1]])
    low = np.stack([number[first:-1, half], number[first + 1 :, half]], axis=1)
    up = np.stack([upper[first:-1, half], upper[first + 1 :, half]], axis=1)
    surfaces = {
        "low": low,
        "up": up,
        "notch": np.concatenate([low, up]),
        "bottom": np.stack([number[:-1, 0], number[1:, 0]], axis=1),
        "top": np.stack([number[:-1, n], number[1:, n]], axis=1),
    }
    cells = np.array(cells)
    if dim == 3:
        count = len(points)
        points = np.concatenate([np.column_stack([points, np.full(count, z)]) for z in (0.0, 0.2)])
        cells = np.concatenate([cells, cells + count], axis=1)
        surfaces = {name: np.concatenate([s, s[:, ::-1] + count], axis=1) for name, s in surfaces.items()}
    return Mesh(size * (points + shift), cells, "quad" if dim == 2 else "hexahedron", surfaces)


def close(mesh, sides, law=Frictionless(), way=0.3):
    """(force along y, multipliers in contact) and displacement of the nodes, step by step, as the notch is closed."""
    dim, size = mesh.points.shape[1], np.ptp(mesh.points[:, 0])

    def down(x, t):
        return np.full(x.shape[1], -way * size * max(t - 1.0, 0.0) / (STEPS - 1))

    free = (None,) * (dim - 2)
    supports = [Support("bottom", (ZERO,) * dim), Support("top", (ZERO, down, *free))]
    structure, contact = make_contact(
        [make_body("b", mesh, supports=supports)], [tuple(("b", side) for side in sides)], law=law
    )
    structure.initialise(0.0, 1.0)
    found = []
    for step in range(STEPS):
        solve_step(structure, float(step), first=False)
        found.append([contact.resultant(0)[1], contact.active_set.active.sum()])
    at_nodes = np.empty_like(mesh.points)
    at_nodes[structure.bodies[0].nodes] = structure.now.u.reshape(-1, dim)
    return np.array(found).T, at_nodes


@pytest.mark.parametrize(
    ("law", "dim", "opening"),
    [
        pytest.param(Frictionless(), 2, 0.1, id="frictionless-2-0.1"),
        pytest.param(Coulomb(0.3), 2, 0.05, id="coulomb-2-0.05"),
        pytest.param(Frictionless(), 3, 0.1, id="frictionless-3-0.1"),
        pytest.param(Coulomb(0.3), 2, 0.1, id="coulomb-2-0.1", marks=pytest.mark.slow),
        pytest.param(Frictionless(), 2, 0.05, id="frictionless-2-0.05", marks=pytest.mark.slow),
        pytest.param(Coulomb(0.3), 3, 0.1, id="coulomb-3-0.1", marks=pytest.mark.slow),
    ],
)
def test_lips_close_as_a_surface_on_itself(dim, law, opening):
    """No force before the lips touch, then that of self contact; who is slave changes the error of the mesh only."""
    mesh = notched(opening, dim=dim)
    (force, active), u = close(mesh, ("up", "low"), law)
    (other, _), _ = close(mesh, ("low", "up"), law)
    (itself, _), v = close(mesh, ("notch", "notch"), law)
    assert active[0] == 0
    assert not force[0]
    assert force[-1] > 1.0
    np.testing.assert_allclose(np.abs(other), np.abs(force), rtol=0.02, atol=0.02 * force[-1])
    if law == Frictionless():
        np.testing.assert_allclose(np.abs(itself), np.abs(force), rtol=5e-4, atol=1e-9)
        np.testing.assert_allclose(v, u, atol=1e-5)


@pytest.mark.parametrize(("size", "shift"), [(1e-3, 0.0), (1.0, 1 / 30)])
def test_neither_unit_nor_place_matters(size, shift):
    (force, _), u = close(notched(0.1), ("up", "low"))
    (scaled, _), v = close(notched(0.1, size=size, shift=shift), ("up", "low"))
    np.testing.assert_allclose(scaled, size * force, rtol=1e-6, atol=1e-9 * size * abs(force).max())
    np.testing.assert_allclose(v, size * u, atol=1e-8 * size)


def test_a_crack_without_opening():
    """Lips at the same place: a crack that is pulled opens without a force, one that is pressed bears like none."""
    mesh = notched(0.0)
    (pulled, _), _ = close(mesh, ("up", "low"), way=-0.1)
    np.testing.assert_allclose(pulled, 0.0, atol=1e-9)
    (force, active), u = close(mesh, ("up", "low"), way=0.1)
    assert active[1:].min() > 0
    assert force[-1] > 60.0
    count = (N + 1) ** 2
    mid = np.flatnonzero(np.isclose(mesh.points[:count, 1], 0.5) & (mesh.points[:count, 0] > TIP + 1e-9))
    number = np.concatenate([np.arange(count), mid])
    plain = {name: mesh.surfaces[name] for name in ("bottom", "top")}
    whole = Mesh(mesh.points[:count], number[mesh.cells], "quad", plain | {"up": plain["top"], "low": plain["bottom"]})
    _, v = close(whole, ("up", "low"), way=0.1)
    np.testing.assert_allclose(u[:count], v, atol=2e-4)
