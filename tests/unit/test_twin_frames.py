"""Cases in other coordinates: meshes, grids, formulas and histories go where the coordinates say."""

import json
from pathlib import Path

import numpy as np
import pytest
from cell_geometry import smallest_determinant
from pydantic import TypeAdapter

from fsci.case import Case, load_case
from fsci.case.grid import GridSection
from fsci.case.mesh import FileMesh
from fsci.case.shapes import AnyShape
from fsci.expression import Expression
from fsci.meshes.mesh import MeshError, build_mesh
from fsci.twin.frames import MIRRORED, TURNED, TURNING_VECTORS, _Sections
from solvers.mesh.topology import surface_facets

FRAMES = [MIRRORED, TURNED]
MATRICES = {MIRRORED: np.diag([-1.0, 1.0, 1.0]), TURNED: np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])}

#: Lists of numbers that say neither where something is nor in which direction, or that have a function of their own.
OTHERS = {
    ("Curve", "table"), ("Grid", "cells"), ("Grid", "from"), ("Grid", "to"), ("Output", "residuals"),
    ("PointSpring", "stiffness"), ("Free", "initial_angular_velocity"), ("FreeMotion", "initial_angular_velocity"),
    ("FreeBody", "initial_angular_velocity"), ("Rotation", "axis"), ("Turn", "axis"),
    ("MeshSurface", "normal"),  # of the file: its mesh is placed as a whole
    ("Reference", "drag"), ("Reference", "lift"),
}  # fmt: skip


def test_every_list_of_numbers_is_known():
    """A new setting that is a point or a direction has its name in TURNING_VECTORS, or a function in frames.py."""
    models = Case.model_json_schema()["$defs"]
    unknown = []
    for model, schema in models.items():
        for name, value in schema.get("properties", {}).items():
            placed = "rotate" in schema["properties"]  # a mesh: its shape is placed as a whole
            entries = [one.get("items", {}) for one in [value, *value.get("anyOf", [])]]
            numbers = any("expression" not in one.get("$comment", "expression") for one in entries)
            of_lists = any(one.get("items", {}).get("$comment") == "number" for one in entries)
            key = (model.removesuffix("Section"), name)
            if (numbers or of_lists) and not placed and key not in OTHERS and name not in TURNING_VECTORS:
                unknown.append(key)
    assert unknown == []


def test_a_mesh_file_keeps_its_scale_and_surfaces():
    surfaces = {"top": {"normal": (0.0, 1.0)}, "hole": {"box": ((0.0, 0.0), (1.0, 1.0))}}
    given = {"file": "part.vtu", "scale": 0.001, "refine": 1, "surfaces": surfaces}
    assert _Sections(MIRRORED, 2).mesh(FileMesh(**given)) == given | {"mirror": "x", "rotate": []}


@pytest.mark.parametrize("frame", FRAMES, ids=lambda frame: frame.name)
@pytest.mark.parametrize("mirror", [None, "x", "y", "z"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_meshes(frame, mirror, dimension, tmp_path):
    """The mesh of the new settings is that of the old ones, moved: with mirrors, several rotations, a displacement."""
    shape = {"shape": "disc", "radius": 1, "cells": [8, 1], "cell": "tri", "translate": [0.3, 2]}
    rotations = [{"angle": 20.0}, {"angle": -50.0}]
    if dimension == 3:
        shape = {"shape": "box", "size": [1, 2, 3], "cells": [1, 2, 2], "cell": "tet", "translate": [0.3, 2, 1]}
        rotations = [{"angle": 20.0, "axis": [1, 2, 3]}, {"angle": -50.0, "axis": [0.5, 0, -1]}]
    read = TypeAdapter(AnyShape).validate_python
    own = read(shape | {"rotate": rotations, "mirror": mirror})
    other = read(_Sections(frame, dimension).mesh(own))
    if mirror == "z" and dimension == 2:
        with pytest.raises(MeshError, match="'mirror: z' is for meshes of three dimensions"):
            build_mesh(own, tmp_path)
        return
    one, two = (build_mesh(settings, tmp_path) for settings in (own, other))
    matrix = MATRICES[frame][:dimension, :dimension]
    assert two.points == pytest.approx(one.points @ matrix.T, abs=1e-14)
    assert smallest_determinant(two) > 0.0
    assert np.sort(np.sort(two.cells, axis=1), axis=0) == pytest.approx(np.sort(np.sort(one.cells, axis=1), axis=0))
    for name in one.surfaces:
        first, second = ({tuple(sorted(f)) for f in surface_facets(mesh, name)} for mesh in (one, two))
        assert first == second


@pytest.mark.parametrize("frame", FRAMES, ids=lambda frame: frame.name)
def test_grids(frame):
    grid = GridSection(**{
        "from": [-1, 0, 2], "to": [3, 1, 4], "cells": [None, 5, 2],
        "x": [{"to": 0.5, "cells": 3, "ratio": 2}, {"to": 3, "cells": 4}],
        "refine": [{"box": [[0, 0.2, 2.5], [1, 0.7, 3]]}, {"around": "body", "layers": 5}],
    })  # fmt: skip
    other = GridSection(**_Sections(frame, 3).grid(grid))
    for new, old in enumerate(frame.source):
        planes = grid.planes[old] if frame.sign[new] > 0 else -grid.planes[old][::-1]
        assert other.planes[new] == pytest.approx(planes, abs=1e-14)
    corners = np.array(grid.refine[0].box) @ MATRICES[frame].T
    assert np.array(other.refine[0].box) == pytest.approx(np.array([corners.min(axis=0), corners.max(axis=0)]))
    assert other.refine[1] == grid.refine[1]


@pytest.mark.parametrize("frame", FRAMES, ids=lambda frame: frame.name)
@pytest.mark.parametrize(
    "text", ["x", "2*x - y^2*z + exp(x)", "where(x > 0.1, max(y, 1e-3*x), -t)", "pulse(x)*t", "2*pi"]
)
def test_formulas(frame, text):
    """The new formula has at the new place the value of the old one at the old place."""
    functions = {"pulse": np.sin}
    old = Expression.parse(text, functions)
    new = Expression.parse(_Sections(frame, 3).formula(old), functions)
    places = np.random.default_rng(1).normal(size=(3, 20))
    assert new(MATRICES[frame] @ places, 0.7) == pytest.approx(old(places, 0.7), rel=1e-14)


@pytest.mark.parametrize("frame", FRAMES, ids=lambda frame: frame.name)
def test_faces(frame):
    signs = {"-": -1.0, "+": 1.0}
    outward = {f"{axis}{side}": signs[side] * np.eye(3)[n] for n, axis in enumerate("xyz") for side in signs}
    for face, normal in outward.items():
        assert outward[_Sections(frame, 3).face(face)] == pytest.approx(MATRICES[frame] @ normal)


FREE = """
time: {step: 0.1, end: 1}
fluid:
  density: 1
  viscosity: 1
  grid: {from: [0, 0, 0], to: [1, 1, 1], cells: [8, 8, 8]}
  patches: {all: {on: [x-, x+, y-, y+, z-, z+], no_slip: true}}
  bodies:
    ball:
      mesh: {shape: sphere, radius: 0.2, cells: [2, 1], translate: [0.5, 0.5, 0.5]}
      free:
        density: 2
        held: [x, rotation_x]
        initial_angular_velocity: [0, 2, 3]
        springs: [{at: [0.5, 0.5, 0.5], stiffness: [1, 2, 3]}]
coupling: {}
probes:
  spin: {quantity: angular_momentum, body: ball}
  v: {quantity: velocity, body: ball, at: [0.5, 0.5, 0.5]}
  drag: {quantity: drag_coefficient, body: ball, reference: {velocity: 1, area: 1}}
verify: [{value: v.z, reference: 1, relative: 1}]
"""


@pytest.mark.parametrize("frame", FRAMES, ids=lambda frame: frame.name)
def test_a_free_body(frame, tmp_path):
    (tmp_path / "case.yaml").write_text(FREE)
    case = load_case(tmp_path)
    other = load_case(tmp_path, frame.settings(case, 3))
    free = other.fluid.bodies["ball"].free
    matrix = MATRICES[frame]
    assert free.initial_angular_velocity == pytest.approx(frame.determinant * matrix @ [0.0, 2.0, 3.0])
    assert free.springs[0].stiffness == ((1, 2, 3) if frame is MIRRORED else (2, 1, 3))
    assert free.held == (("x", "rotation_x") if frame is MIRRORED else ("y", "rotation_y"))
    assert other.probes["drag"].reference.drag == pytest.approx(matrix[:, 0])
    assert other.probes["drag"].reference.lift == pytest.approx(matrix[:, 1])
    assert other.verify == ()
    v, spin = np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0])
    history = {"time": np.zeros(1), "drag": np.ones(1)}
    history |= {f"v.{axis}": x[None] for axis, x in zip("xyz", matrix @ v, strict=True)}
    history |= {f"spin.{axis}": x[None] for axis, x in zip("xyz", frame.determinant * matrix @ spin, strict=True)}
    found = frame.history(history, case)
    assert [float(found[f"v.{axis}"][0]) for axis in "xyz"] == [1.0, 2.0, 3.0]
    assert [float(found[f"spin.{axis}"][0]) for axis in "xyz"] == [4.0, 5.0, 6.0]
    assert found["drag"] == history["drag"]


def test_walls_with_a_dry_side():
    folder = next(Path(__file__).parents[2].glob("cases/cavity_flexible_bottom"))
    case = load_case(folder)
    changes = dict(MIRRORED.settings(case, 2))
    for name, corners in case.coupling.dry_side.items():
        assert json.loads(changes["coupling"])["dry_side"][name] == [[-x, y] for x, y in corners]
