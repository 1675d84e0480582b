"""Schaefer-Turek 2D-1 by ngsxfem with a cut cylinder; a script of its Python. Prints a row as JSON.

python ngsxfem_cylinder.py SIZE: elements P2-P1, triangles of SIZE [m] around the cylinder. Newton's method from rest.
"""

import json
import sys
from time import process_time

import ngsolve as ng
from netgen.geom2d import SplineGeometry
from ngsxfem_cut import cut_flow

LENGTH, HEIGHT, CENTRE, RADIUS, MEAN, VISCOSITY = 2.2, 0.41, (0.2, 0.2), 0.05, 0.2, 1e-3
DRAG, LIFT, PRESSURE = 5.57953523384, 0.010618948146, 0.11752016697


def channel(size: float) -> ng.Mesh:
    """Triangles of this size around the cylinder, not in it, growing to 6 times as large."""
    geometry = SplineGeometry()
    geometry.AddRectangle((0, 0), (LENGTH, HEIGHT), bcs=["wall", "outlet", "wall", "inlet"], leftdomain=1)
    geometry.AddCircle(CENTRE, 1.4 * RADIUS, leftdomain=2, rightdomain=1, bc="inner")
    geometry.SetDomainMaxH(2, size)
    return ng.Mesh(geometry.GenerateMesh(maxh=6 * size, grading=0.15))


def solve(size: float) -> dict[str, float]:
    """Errors of drag, lift and pressure difference, and seconds of the processor from the mesh on."""
    begin = process_time()
    mesh = channel(size)
    flow = cut_flow(mesh, CENTRE, RADIUS, 2, "wall|inlet")
    W, dx, ds, dw, normal = flow.both, flow.dx, flow.ds, flow.dw, flow.normal
    (u, p), (v, q) = W.TnT()
    h = ng.specialcf.mesh_size
    penalty = 40 * VISCOSITY / h

    def traction(u, p):
        return VISCOSITY * ng.Grad(u) * normal - p * normal

    a = flow.form()
    a += (VISCOSITY * ng.InnerProduct(ng.Grad(u), ng.Grad(v)) - ng.div(u) * q - ng.div(v) * p) * dx
    a += (ng.Grad(u) * u) * v * dx
    a += (-traction(u, p) * v - traction(v, q) * u + penalty * u * v) * ds
    a += 0.1 * VISCOSITY / h**2 * (u - u.Other()) * (v - v.Other()) * dw
    a += -0.1 / VISCOSITY * (p - p.Other()) * (q - q.Other()) * dw

    found = ng.GridFunction(W)
    velocity, pressure = found.components
    inflow = 6 * MEAN * ng.y * (HEIGHT - ng.y) / HEIGHT**2
    velocity.Set(ng.CF((inflow, 0)), definedon=mesh.Boundaries("inlet"))
    residual, change = found.vec.CreateVector(), found.vec.CreateVector()
    free, steps, first = W.FreeDofs(), 0, 0.0
    while steps < 20:
        a.Apply(found.vec, residual)
        ng.Projector(free, True).Project(residual)
        first = first or residual.Norm()
        if residual.Norm() < 1e-8 * first:
            break
        a.AssembleLinearization(found.vec)
        change.data = a.mat.Inverse(free, inverse="pardiso") * residual
        found.vec.data -= change
        steps += 1
    pull = -traction(velocity, pressure) + penalty * velocity
    force = [ng.Integrate(pull[i] * ds, mesh) for i in (0, 1)]
    seconds = process_time() - begin

    drag, lift = (2 * value / (MEAN**2 * 2 * RADIUS) for value in force)
    front, back = (pressure(mesh(x, 0.2)) for x in (0.15 - 1e-5, 0.25 + 1e-5))
    return {
        "dofs": W.ndof,
        "newton": steps,
        "time [s]": seconds,
        "c_D error [%]": 100 * (drag / DRAG - 1),
        "c_L error [%]": 100 * (lift / LIFT - 1),
        "dp error [%]": 100 * ((front - back) / PRESSURE - 1),
    }


if __name__ == "__main__":
    ng.SetNumThreads(1)
    print(json.dumps(solve(float(sys.argv[1]))))
