"""Mesh tying from the mortar operators: meshes that do not match are joined by u_slave = D^-1 M u_master.

Constraints of the slave nodes are condensed as in contact (T^T K T x = T^T f). The interface is a patch test when flat;
when curved, errors fall with the orders of the elements (Puso & Laursen 2004; Wohlmuth 2011).
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.sparse as sp
import ufl
from contact_setup import brick
from mortar_surfaces import DIM, all_pairs, dense, patch, rotation
from mpi4py import MPI
from scipy.sparse.linalg import spsolve
from structure_setup import distort

from fsci import shapes
from solvers import fem
from solvers.kernels import basis_transformation, mortar, nodal_normals
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.topology import cut_out


def tie(xs, fs, slave, xm, fm, master):
    """Nodal values on the slave of unit values on the master, shape (ns, nm)."""
    normals, _ = nodal_normals(xs, fs, slave, derivatives=False)
    result = mortar(xs, fs, slave, xm, fm, master, normals, all_pairs(fs, fm))
    T, _ = basis_transformation(fs, slave, len(xs))  # tri6: of coefficients to nodal values
    return sp.csr_matrix(T, shape=(len(xs),) * 2) @ (dense(result.M, len(xs), len(xm)) / result.D[:, None])


# ----------------------------------------------------------------------------------- a field handed over a bent surface


def bend(x, turn):
    """A patch bent by up to a seventh of its width, anyhow in space."""
    height = 0.15 * np.prod(np.cos(2.0 * x[:, :-1] + 0.3), axis=1)
    return np.column_stack([x[:, :-1], height]) @ turn.T


def smooth(x):
    return np.sin(2.0 * x).sum(axis=1) + x.prod(axis=1)


@pytest.mark.parametrize(
    ("slave", "master", "order"),
    [
        ("line2", "line2", 2),
        ("line3", "line3", 3),
        ("tri3", "quad4", 2),
        ("quad4", "tri3", 2),
        ("quad9", "quad9", 3),
        ("tri6", "tri6", 2),
    ],
)
def test_a_smooth_field_crosses_a_bent_surface(slave, master, order):
    """L2 order 2 (first-order facets) and 3; tri6 is 2, for its dual functions reproduce no linear ones."""
    turn = rotation(np.random.default_rng(4), DIM[slave])
    errors = []
    for n in (4, 8, 16):
        xs, fs = patch(slave, n)
        xm, fm = patch(master, round(1.5 * n), turned=True, size=1.2)
        xs, xm = bend(xs, turn), bend(xm, turn)
        errors.append(np.sqrt(np.mean((tie(xs, fs, slave, xm, fm, master) @ smooth(xm) - smooth(xs)) ** 2)))
    orders = -np.diff(np.log2(errors))
    assert orders.max() > order - 0.2, (errors, orders)
    assert orders.mean() > order - 0.3, (errors, orders)


# --------------------------------------------------------------------------------------------- two meshes, one solution


@dataclass
class Part:
    """A mesh with a scalar space on it, dofs in the order of the nodes of the mesh."""

    mesh: object
    domain: object
    space: object
    dofs: np.ndarray  #: of each node


def part(mesh):
    domain = fem.distribute(MPI.COMM_SELF, mesh)
    space = fem.scalar_space(domain)
    dofs = np.empty(len(mesh.points), dtype=int)
    dofs[fem.node_of_block(domain, space)] = np.arange(len(mesh.points))
    return Part(mesh, domain, space, dofs)


def solve_tied(lower, upper, exact, held):
    """-div grad u = f on both, u given on the `held` surfaces, natural conditions elsewhere; slave: the lower part.

    `exact(x)` is a UFL expression. Returns (largest error at nodes, H1 seminorm, L2 norm of the error).
    """
    parts = [part(lower), part(upper)]
    matrices, loads, fixed, values = [], [], [], []
    for piece, (kept, away) in zip(parts, held, strict=True):
        u, v = ufl.TrialFunction(piece.space), ufl.TestFunction(piece.space)
        dx = fem.volume_measure(piece.domain, 6)
        solution = exact(ufl.SpatialCoordinate(piece.domain.mesh))
        matrix = fem.create_matrix(form := fem.compile_form(ufl.inner(ufl.grad(u), ufl.grad(v)) * dx))
        fem.assemble_matrix(matrix, form)
        matrix.assemble()
        indptr, indices, data = matrix.getValuesCSR()
        matrices.append(sp.csr_matrix((data, indices, indptr)))
        load, normal = fem.function(piece.space), ufl.FacetNormal(piece.domain.mesh)
        right = [-ufl.div(ufl.grad(solution)) * v * dx]
        for name in away:
            right.append(ufl.dot(ufl.grad(solution), normal) * v * fem.surface_measure(piece.domain, name, 6))
        for form in right:
            fem.assemble_vector(fem.compile_form(form), load.x.array)
        loads.append(load.x.array.copy())
        at = np.concatenate([fem.surface_blocks(piece.domain, piece.space, name) for name in kept])
        fixed.append(np.unique(at))
        points = fem.block_points(piece.space)
        values.append(np.array(exact(points), dtype=float) * np.ones(points.shape[1]))
    n = [len(load) for load in loads]
    K, f = sp.block_diag(matrices, format="csr"), np.concatenate(loads)
    T, slave = condensation(parts, n)
    known = np.concatenate([fixed[0], n[0] + fixed[1]])
    x = np.concatenate(values)
    free = np.setdiff1d(np.arange(sum(n)), np.concatenate([known, slave]))
    u = np.zeros(sum(n))
    u[known] = x[known]
    reduced, right = T.T @ K @ T, T.T @ (f - K @ (T @ u))
    u[free] = spsolve(reduced[free][:, free].tocsc(), right[free])
    u = T @ u
    squares = np.zeros(2)
    for piece, found in zip(parts, np.split(u, [n[0]]), strict=True):
        function = fem.function(piece.space)
        function.x.array[:] = found
        error = function - exact(ufl.SpatialCoordinate(piece.domain.mesh))
        dx = fem.volume_measure(piece.domain, 6)
        for k, form in enumerate((ufl.inner(ufl.grad(error), ufl.grad(error)) * dx, error**2 * dx)):
            squares[k] += fem.assemble_scalar(fem.compile_form(form), MPI.COMM_SELF)
    return np.abs(u - x).max(), *np.sqrt(np.maximum(squares, 0.0))


def condensation(parts, n):
    """(T: all values from those that are not the slave's, the slave's dofs)."""
    (xs, fs, slave), (xm, fm, master) = (
        cut_out(piece.mesh, [name]) for piece, name in zip(parts, ("top", "bottom"), strict=True)
    )
    types = [CELL_TYPES[CELL_TYPES[piece.mesh.cell_type].facet].kernel for piece in parts]
    P = sp.coo_matrix(tie(xs, fs, types[0], xm, fm, types[1]))
    slave, master = parts[0].dofs[slave], n[0] + parts[1].dofs[master]
    keep = np.ones(sum(n))
    keep[slave] = 0.0
    joined = sp.csr_matrix((P.data, (slave[P.row], master[P.col])), shape=(sum(n), sum(n)))
    return (sp.diags(keep) + joined).tocsr(), slave


SIDES = {2: ["left", "right"], 3: ["left", "right", "front", "back"]}
PATCHES = [
    ("quad", "triangle"),
    ("triangle6", "quad"),
    ("quad9", "triangle6"),
    ("hexahedron", "tetra"),
    ("tetra", "hexahedron"),
    ("tetra10", "hexahedron"),
    ("hexahedron27", "tetra10"),
]


@pytest.mark.parametrize(("lower", "upper"), PATCHES)
def test_patch(lower, upper):
    """A linear solution passes the flat interface; its flux through the sides is given, also at the interface."""
    dim = 2 if lower[:4] in ("quad", "tria") else 3
    slope = [0.3, -0.7, 1.1][:dim]
    meshes = []
    for cell_type, n, height in ((lower, 3, 0.0), (upper, 2, 0.5)):
        mesh = distort(brick(cell_type, n, [1] * dim, [0] * dim, 0.0), 0.1 / n)
        meshes.append(replace(mesh, points=mesh.points * ([1] * (dim - 1) + [0.5]) + height * np.eye(dim)[-1]))
    held = [(["bottom"], SIDES[dim]), (["top"], SIDES[dim])]
    error, *_ = solve_tied(*meshes, lambda x: 2 + sum(slope[i] * x[i] for i in range(dim)), held)
    assert error < 1e-8


def bent_pair(n, order, cell):
    """Two meshes that meet along a wave; the upper one is finer by half."""
    found = []
    for cells, low in ((n, 0.0), (3 * n // 2, 0.5)):
        mesh = shapes.rectangle([1, 1], [cells, max(2, cells // 2)], order=order, cell=cell)
        x, s = mesh.points.T
        wave = 0.5 + 0.1 * np.sin(2 * np.pi * x)
        y = s * wave if low == 0.0 else wave + s * (1 - wave)
        found.append(replace(mesh, points=np.column_stack([x, y])))
    return found


def wavy(x):
    sin, cos = (ufl.sin, ufl.cos) if isinstance(x, ufl.core.expr.Expr) else (np.sin, np.cos)
    return cos(3.0 * x[0] + 0.2) * sin(2.0 * x[1] + 0.5)


@pytest.mark.parametrize(
    ("order", "cell", "h1", "l2"), [(1, "quad", 1, 2), (1, "tri", 1, 2), (2, "quad", 2, 3), (2, "tri", 2, 3)]
)
def test_curved_interface(order, cell, h1, l2):
    """H1 order 1 and 2 for first and second order, L2 one more."""
    held = [(["bottom"], ["left", "right"]), (["top"], ["left", "right"])]
    errors = np.array([solve_tied(*bent_pair(n, order, cell), wavy, held)[1:] for n in (8, 16, 32)])
    orders = -np.diff(np.log2(errors), axis=0)[-1]
    assert orders[0] > h1 - 0.15, (errors, orders)
    assert orders[1] > l2 - 0.25, (errors, orders)
