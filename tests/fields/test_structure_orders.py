"""Manufactured solution at finite strain: orders p + 1 (L2) and p (H1) for every cell type."""

import numpy as np
import pytest
import sympy
import ufl
from structure_setup import CELL_TYPES, block, held_everywhere, load_step, make_structure

from solvers import fem
from solvers.structure.materials import NeoHooke

MU, LAMBDA = 1.0, 1.5
X = sympy.symbols("x y z")


def exact_displacement(dim):
    x, y, z = X
    if dim == 2:
        return [sympy.sin(x + 2 * y) / 10, sympy.cos(2 * x - y) / 8]
    return [sympy.sin(x + 2 * y + z) / 10, sympy.cos(2 * x - y) / 8, sympy.sin(x - y + 2 * z) / 12]


def body_force(dim):
    """b = -Div P of the neo-Hookean law, P = mu (F - F^-T) + lambda ln J F^-T, by the chain rule:

    dP = mu dF + (mu - lambda ln J) F^-T dF^T F^-T + lambda (F^-T : dF) F^-T.
    """
    u = exact_displacement(dim)
    first = [[as_value(sympy.diff(u[i], X[j])) for j in range(dim)] for i in range(dim)]
    second = [[[as_value(sympy.diff(u[i], X[j], X[k])) for k in range(dim)] for j in range(dim)] for i in range(dim)]

    def divergence(x, t):
        F = np.eye(dim) + np.moveaxis(np.array([[f(x, t) for f in row] for row in first]), 2, 0)
        inverse = np.linalg.inv(F)
        log_J = np.log(np.linalg.det(F))[:, None, None]
        total = np.zeros((x.shape[1], dim))
        for k in range(dim):
            dF = np.moveaxis(np.array([[s[k](x, t) for s in row] for row in second]), 2, 0)
            trace = np.trace(inverse @ dF, axis1=1, axis2=2)[:, None, None]
            turned = np.swapaxes(inverse @ dF @ inverse, 1, 2)
            dP = MU * dF + (MU - LAMBDA * log_J) * turned + LAMBDA * trace * np.swapaxes(inverse, 1, 2)
            total += dP[:, :, k]
        return total

    return tuple(lambda x, t, i=i: -divergence(x, t)[:, i] for i in range(dim))


def as_value(expression):
    function = sympy.lambdify(X, expression, "numpy", cse=True)
    return lambda x, t: function(*x) + np.zeros(x.shape[1])


def errors(cell_type, cells):
    mesh = block(cell_type, cells)
    dim = mesh.points.shape[1]
    u = [as_value(component) for component in exact_displacement(dim)]
    supports = held_everywhere(mesh, lambda i: u[i])
    structure = make_structure(mesh, NeoHooke(MU, LAMBDA), supports=supports, body_force=body_force(dim))
    load_step(structure)
    body = structure.bodies[0]
    x = ufl.SpatialCoordinate(body.domain.mesh)
    coordinates = {str(X[i]): x[i] for i in range(dim)}
    names = {"sin": ufl.sin, "cos": ufl.cos, **coordinates}
    exact = ufl.as_vector([eval(str(component), names) for component in exact_displacement(dim)])
    difference = body.u - exact
    dx = fem.volume_measure(body.domain, 6)
    l2 = fem.assemble_scalar(fem.compile_form(ufl.inner(difference, difference) * dx), structure.comm)
    gradient = ufl.grad(difference)
    h1 = fem.assemble_scalar(fem.compile_form(ufl.inner(gradient, gradient) * dx), structure.comm)
    return np.sqrt([l2, h1])


#: each order and each shape; patch tests have all types
QUICK = ("triangle", "quad9", "tetra", "hexahedron27")


@pytest.mark.parametrize(
    "cell_type", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in CELL_TYPES]
)
def test_orders(cell_type):
    dim = 2 if cell_type[:4] in ("tria", "quad") else 3
    order = 1 if cell_type in ("triangle", "quad", "tetra", "hexahedron") else 2
    coarse, fine = {2: (8, 16), 3: (4, 8) if order == 1 else (3, 6)}[dim]
    rates = np.log(errors(cell_type, coarse) / errors(cell_type, fine)) / np.log(2)
    assert rates[0] > order + 1 - 0.15
    assert rates[1] > order - 0.1
