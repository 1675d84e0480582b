"""Stokes flow around a cut disc by ngsxfem; a script of its Python. Prints a row as JSON.

python ngsxfem_stokes.py ORDER CELLS: velocity of order 1 or 2, pressure of order 1, triangles of a square's halves.
After share/ngsxfem/stokescutfem.py.
"""

import json
import sys
from math import sqrt
from time import process_time

import ngsolve as ng
from ngsolve.meshes import MakeStructured2DMesh
from ngsxfem_cut import cut_flow

CENTRE, RADIUS = (0.51, 0.48), 0.21


def solve(order: int, cells: int) -> dict[str, float]:
    """Errors (roots of mean squares in the fluid) relative to the largest value, and seconds of the processor."""
    begin = process_time()
    mesh = MakeStructured2DMesh(quads=False, nx=cells, ny=cells)
    exact = ng.CF((20 * ng.x * ng.y**3, 5 * ng.x**4 - 5 * ng.y**4))
    flow = cut_flow(mesh, CENTRE, RADIUS, order, ".*")
    V, W, dx, ds, dw, normal = flow.velocity, flow.both, flow.dx, flow.ds, flow.dw, flow.normal
    (u, p), (v, q) = W.TnT()
    h = ng.specialcf.mesh_size

    def traction(u, p):
        return (ng.Grad(u) + ng.Grad(u).trans) * normal - p * normal

    def strain(u):
        return 0.5 * (ng.Grad(u) + ng.Grad(u).trans)

    a = flow.form()
    f = ng.LinearForm(W)
    a += (2 * ng.InnerProduct(strain(u), strain(v)) - ng.div(u) * q - ng.div(v) * p) * dx
    a += (-traction(u, p) * v - traction(v, q) * u + 20 * order**2 / h * u * v) * ds
    f += (-traction(v, q) * exact + 20 * order**2 / h * exact * v) * ds
    if order == 1:  # Brezzi and Pitkaranta
        a += -0.05 * h**2 * ng.grad(p) * ng.grad(q) * dx
    a += 0.05 / h**2 * (u - u.Other()) * (v - v.Other()) * dw
    a += -0.05 * (p - p.Other()) * (q - q.Other()) * dw
    a.Assemble()
    f.Assemble()

    found = ng.GridFunction(W)
    velocity, pressure = found.components
    free = W.FreeDofs()
    free.Clear(V.ndof)  # the level of the pressure, which is not determined
    velocity.Set(exact, definedon=mesh.Boundaries(".*"))
    f.vec.data -= a.mat * found.vec
    found.vec.data += a.mat.Inverse(free, inverse="pardiso") * f.vec
    seconds = process_time() - begin

    fine = dx.order(2 * order + 2)
    area = ng.Integrate(ng.CF(1.0) * fine, mesh)
    exact_p = 60 * ng.x**2 * ng.y - 20 * ng.y**3
    level_p = ng.Integrate((pressure - exact_p) * fine, mesh) / area
    off_u = ng.Integrate(ng.InnerProduct(velocity - exact, velocity - exact) * fine, mesh) / area
    off_p = ng.Integrate((pressure - exact_p - level_p) ** 2 * fine, mesh) / area
    return {
        "dofs": W.ndof,
        "time [s]": seconds,
        "velocity [%]": 100 * sqrt(off_u) / 20,
        "pressure [%]": 100 * sqrt(off_p) / 60,
    }


if __name__ == "__main__":
    ng.SetNumThreads(1)
    print(json.dumps(solve(int(sys.argv[1]), int(sys.argv[2]))))
