"""Fields that follow from written ones, against formulas: exact for linear velocities and homogeneous strain."""

import numpy as np
import pytest
from case_mistakes import load

import fsci
from fsci.plot.derived import component_of, with_derived
from fsci.plot.picture import plot_run
from fsci.plot.render import import_pyvista
from fsci.running.output import FieldWriter
from solvers.api import Snapshot

GRADIENT = np.array([[0.3, -1.0, 0.7], [0.4, 0.5, -0.2], [1.1, 0.6, -0.8]])


def grid_of(dim):
    """3 x 4 (x 5) cells of unequal sizes."""
    edges = [np.linspace(0, 1, n) ** 1.3 for n in (4, 5, 6)[:dim]] + [np.zeros(1)] * (3 - dim)
    return import_pyvista().RectilinearGrid(*edges).cast_to_unstructured_grid()


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_fields_of_the_velocity_gradient(dim, scale):
    L = np.zeros((3, 3))
    L[:dim, :dim] = GRADIENT[:dim, :dim]
    flow = grid_of(dim)
    flow.points = np.asarray(flow.points, dtype=float) * scale
    flow.cell_data["fluid_fraction"] = np.ones(flow.n_cells)
    flow.point_data["velocity"] = np.array([1.0, 2.0, 0.0]) + flow.points @ L.T

    def values(field):
        return component_of(with_derived(flow, field).point_data, field)

    D, W = 0.5 * (L + L.T), 0.5 * (L - L.T)
    assert values("strain_rate") == pytest.approx(np.sqrt(2) * np.linalg.norm(D), rel=1e-9)
    if dim == 2:
        assert values("vorticity") == pytest.approx(L[1, 0] - L[0, 1], rel=1e-9)
    else:
        assert values("vorticity.y") == pytest.approx(L[0, 2] - L[2, 0], rel=1e-9)
        assert values("vorticity") == pytest.approx(np.sqrt(2) * np.linalg.norm(W), rel=1e-9)
    q = 0.5 * (np.linalg.norm(W) ** 2 - np.linalg.norm(D) ** 2)
    assert values("q_criterion") == pytest.approx(q, rel=1e-9)
    assert with_derived(flow, "temperature") is flow


def stretched(cell="hexahedron"):
    """A block with x = F X + c and a given stress; the file has the present shape."""
    F = np.eye(3) + 0.4 * GRADIENT
    sigma = np.array([[3.0, 1.0, -0.5], [1.0, -2.0, 0.25], [-0.5, 0.25, 0.5]])
    X = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float)
    x = X @ F.T + [3.0, 0, 0]
    six = np.tile(sigma[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]], (8, 1))
    return F, sigma, Snapshot("block", x, np.arange(8)[None], cell, {"displacement": x - X, "stress": six})


def test_principal_and_nominal_stress(tmp_path):
    F, sigma, block = stretched()
    FieldWriter(tmp_path / "fields").write(0, 0.0, [block])
    mesh = import_pyvista().read(tmp_path / "fields/block_000000.vtu")
    values = np.linalg.eigvalsh(sigma)[::-1]
    P = np.linalg.det(F) * sigma @ np.linalg.inv(F).T
    principal, nominal = with_derived(mesh, "principal_stress.1"), with_derived(mesh, "nominal_stress")
    for number in (1, 2, 3):
        found = component_of(principal.point_data, f"principal_stress.{number}")
        assert found == pytest.approx(values[number - 1], rel=1e-12)
    assert component_of(principal.point_data, "principal_stress") == pytest.approx(values[0], rel=1e-12)
    for i, j in ((0, 0), (0, 1), (1, 0), (2, 1)):
        assert component_of(nominal.point_data, f"nominal_stress.{'xyz'[i]}{'xyz'[j]}") == pytest.approx(P[i, j])
    assert component_of(mesh.point_data, "stress.xy") == pytest.approx(1.0)
    assert component_of(mesh.point_data, "stress") == pytest.approx(np.linalg.norm(sigma))
    assert component_of(mesh.point_data, "stress.zx") is None


@pytest.mark.parametrize(
    "field",
    [
        "principal_stress.1",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("nominal_stress.xx", "stress.yz")),
    ],
)
def test_pictures_of_derived_fields(tmp_path, field):
    *_, block = stretched()
    FieldWriter(tmp_path / "fields").write(0, 0.0, [block])
    assert (tmp_path / f"pictures/final_{field}.png") in plot_run(tmp_path, field=field)
    known = "there are displacement, stress, nominal_stress, principal_stress"
    with pytest.raises(ValueError, match=f"no body has a field 'vorticity'; {known}"):
        plot_run(tmp_path, field="vorticity")


STRIP = """\
time: {step: 1, end: 1}
structure:
  bodies:
    strip:
      mesh: {shape: rectangle, size: [2, 1], cells: [2, 1], order: 1}
      kinematics: linear
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.25, density: 0}
      supports:
        - {on: [left, right, bottom, top], displacement: ["1e-3*x + 4e-4*y", "-2e-3*y"]}
"""


@pytest.mark.usefixtures("in_new_folder")
def test_the_stress_of_a_body_is_written():
    """Hooke's law in plane strain."""
    steps = fsci.build(load(STRIP))
    steps.take()
    mu = 1000 / 2.5
    lmbda = 1000 * 0.25 / (1.25 * 0.5)
    expected = [2 * mu * 1e-3 - lmbda * 1e-3, -2 * mu * 2e-3 - lmbda * 1e-3, -lmbda * 1e-3, mu * 4e-4, 0.0, 0.0]
    assert steps.fields()["strip"].point_data["stress"] == pytest.approx(np.tile(expected, (6, 1)), abs=1e-9)
