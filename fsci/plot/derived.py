"""Fields that follow from written ones: of a flow from its velocity gradient, of a body from its stress.

With L = grad v and D = (L + L^T)/2:

- vorticity: curl v; in the plane its component out of it
- strain_rate: sqrt(2 D : D), the shear rate of viscosity laws
- q_criterion: -1/2 tr(L L) = (|W|^2 - |D|^2)/2 for div v = 0. Source: Hunt, Wray, Moin, CTR-S88 (1988) 193.
- principal_stress.1, .2, .3: eigenvalues of the Cauchy stress, the largest one first
- nominal_stress: P = J sigma F^-T, with components .xx, .xy, ..., by rows; J and F are from the displacement, in 2D
  per present depth

Gradients are those of the cells of the file, averaged at nodes: exact for linear fields.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

OF_GRADIENT = ("vorticity", "strain_rate", "q_criterion")
OF_TENSOR = ("principal_stress", "nominal_stress")
TENSOR = ("xx", "yy", "zz", "xy", "yz", "xz")  #: order of the components of symmetric tensors in VTK
FIELD_COMPONENTS = {
    "stress": TENSOR,
    "principal_stress": ("1", "2", "3"),
    "nominal_stress": tuple(a + b for a in "xyz" for b in "xyz"),
}  #: field -> names of its components; all others have x, y and z

Array = NDArray[np.float64]


def with_derived(mesh: Any, field: str) -> Any:
    """The mesh with the field among its point data, if it follows from what is there."""
    name = field.partition(".")[0]
    data = mesh.point_data
    if name in data:
        return mesh
    if name in OF_GRADIENT and "velocity" in data and "fluid_fraction" in mesh.cell_data:
        return _with(mesh, name, _of_gradient(name, _gradient(mesh, np.asarray(data["velocity"])), flat=_is_flat(mesh)))
    if name in OF_TENSOR and "stress" in data:
        stress = matrices(np.asarray(data["stress"]))
        if name == "principal_stress":
            return _with(mesh, name, np.linalg.eigvalsh(stress)[:, ::-1])
        u = np.asarray(data["displacement"])
        reference = mesh.copy()
        reference.points = np.asarray(mesh.points) - u
        F = np.eye(3) + _gradient(reference, u)
        P = np.linalg.det(F)[:, None, None] * stress @ np.linalg.inv(F).transpose(0, 2, 1)
        return _with(mesh, name, P.reshape(-1, 9))
    return mesh


def names_of_derived(data: Any) -> list[str]:
    """The derived fields of a part with these point data."""
    of_flow = OF_GRADIENT if "pressure" in data and "velocity" in data else ()
    return [*of_flow, *(OF_TENSOR if "stress" in data else ())]


def component_of(data: Any, field: str) -> Array | None:
    """The values of a field, shape (points,): its component, name.xx, or its size; None without such a field.

    The size of a symmetric tensor of six components is its Frobenius norm, of principal values the largest in size.
    """
    name, _, component = field.rpartition(".")
    if name in data and component in (known := FIELD_COMPONENTS.get(name, ("x", "y", "z"))):
        values = np.asarray(data[name], dtype=np.float64)
        return values[:, known.index(component)] if values.ndim > 1 else None
    if field not in data:
        return None
    values = np.asarray(data[field], dtype=np.float64)
    if values.ndim == 1:
        return values
    if field == "principal_stress":
        return values[np.arange(len(values)), np.abs(values).argmax(axis=1)]
    return np.linalg.norm(matrices(values).reshape(len(values), 9) if values.shape[1] == 6 else values, axis=1)


def matrices(six: Array) -> Array:
    """Symmetric 3 x 3 tensors from their six components, shape (n, 3, 3)."""
    return np.asarray(six, dtype=np.float64)[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]


def _with(mesh: Any, name: str, values: Array) -> Any:
    found = mesh.copy(deep=False)
    found.point_data[name] = values
    return found


def _is_flat(mesh: Any) -> bool:
    return bool(np.ptp(np.asarray(mesh.points)[:, 2]) == 0.0)


def _gradient(mesh: Any, values: Array) -> Array:
    """grad of vectors at the nodes, shape (n, 3, 3): row i is the gradient of component i."""
    found = _with(mesh, "to be derived", np.asarray(values, dtype=np.float64))
    derived = found.compute_derivative(scalars="to be derived", gradient="gradient")
    return np.asarray(derived.point_data["gradient"], dtype=np.float64).reshape(-1, 3, 3)


def _of_gradient(name: str, L: Array, *, flat: bool) -> Array:
    if name == "vorticity":
        curl = np.stack([L[:, 2, 1] - L[:, 1, 2], L[:, 0, 2] - L[:, 2, 0], L[:, 1, 0] - L[:, 0, 1]], axis=1)
        return curl[:, 2] if flat else curl
    if name == "q_criterion":
        return -0.5 * np.einsum("nij,nji->n", L, L)
    D = 0.5 * (L + L.transpose(0, 2, 1))
    return np.sqrt(2.0 * np.einsum("nij,nij->n", D, D))
