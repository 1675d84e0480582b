"""Surfaces of second-order bodies in a flow: what their segments and triangles enclose, and forces at their nodes."""

from __future__ import annotations

import numpy as np
import pytest
from test_coupled_run import run

import fsci
from coupling.wetted import bulge
from fsci.shapes import SHAPES
from solvers.mesh.skin import cut_out_skin
from solvers.mesh.tessellation import area_vectors
from solvers.mesh.topology import boundary_facets


def enclosed(points, facets):
    """Area or volume inside of segments or triangles."""
    corners = points[facets]
    return np.einsum("md,md->", corners.mean(axis=1), area_vectors(corners)) / points.shape[1]


def shape(name, **settings):
    return SHAPES[name][0](**settings)


def test_area_of_a_disc():
    """That of parabolas: fourth order in the number of facets, 1 / 20 of the error of segments through the nodes."""
    errors, through_nodes = [], []
    for count in (16, 32):
        skin = cut_out_skin(shape("disc", radius=1.0, cells=[count, 2], order=2))
        errors.append(abs(enclosed(bulge(skin) @ skin.points, skin.facets) - np.pi))
        through_nodes.append(abs(enclosed(skin.points, skin.facets) - np.pi))
    assert errors[1] < 0.08 * errors[0]
    assert errors[1] < 0.05 * through_nodes[1]


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("rectangle", {"size": [1.0, 0.5], "cells": [3, 2]}),
        ("box", {"size": [1.0, 0.5, 0.7], "cells": [3, 2, 1]}),
    ],
)
def test_forces_of_a_uniform_pressure(name, settings):
    """On straight facets those of the element: Simpson's rule along each direction. Moments stay what they are."""
    skin = cut_out_skin(shape(name, order=2, **settings))
    vectors = area_vectors(skin.points[skin.facets])
    at_vertices, dim = np.zeros_like(skin.points), skin.points.shape[1]
    for corner in range(dim):
        np.add.at(at_vertices, skin.facets[:, corner], vectors / dim)
    force = bulge(skin).T @ at_vertices
    top = np.isclose(skin.points[:, 1], 0.5)
    shares = np.ones(top.sum())
    for axis in [axis for axis in range(dim) if axis != 1]:
        x = skin.points[top, axis]
        h = settings["size"][axis] / settings["cells"][axis]
        middle = np.isclose((x / h) % 1.0, 0.5)
        edge = np.isclose(x, 0.0) | np.isclose(x, settings["size"][axis])
        shares = shares * h * np.where(middle, 4 / 6, np.where(edge, 1 / 6, 2 / 6))
    assert force[top, 1] == pytest.approx(shares, abs=1e-14)
    moment = np.einsum("ni,nj->ij", skin.points, force)
    assert moment == pytest.approx(np.einsum("ni,nj->ij", skin.points, at_vertices), abs=1e-14)


@pytest.mark.parametrize("size", [1.0, 1e-3])
@pytest.mark.parametrize(
    ("name", "cells", "cell"), [("disc", [16, 2], "quad"), ("sphere", [2, 1], "hex"), ("sphere", [2, 1], "tet")]
)
def test_a_uniform_pressure_on_a_curved_body_has_no_force_and_no_moment(name, cells, cell, size):
    """Turned, moved by a third, of any size: of forces at nodes, in their places, with the area of the vertices."""
    skin = cut_out_skin(shape(name, radius=size, cells=cells, cell=cell, order=2))
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((skin.points.shape[1],) * 2))[0]
    turn[0] *= np.linalg.det(turn)  # no reflection
    x = skin.points @ turn.T + size / 3
    mixture, dim = bulge(skin), x.shape[1]
    vectors = area_vectors((mixture @ x)[skin.facets])
    at_vertices = np.zeros_like(x)
    for corner in range(dim):
        np.add.at(at_vertices, skin.facets[:, corner], vectors / dim)
    force = mixture.T @ at_vertices
    area = np.linalg.norm(vectors, axis=1).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-14 * area
    moment = np.einsum("ni,nj->ij", x, force)
    assert np.abs(moment - moment.T).max() < 1e-13 * area * size
    # the work of the pressure in a growing body: its volume
    assert np.trace(moment) / dim == pytest.approx(enclosed(mixture @ x, skin.facets), rel=1e-12)


def test_forces_of_a_uniform_pressure_on_triangles():
    """Those of the element: a third of each triangle at the middles of its edges, nothing at its corners."""
    mesh = shape("box", size=[1.0, 0.5, 0.7], cells=[3, 2, 1], order=2, cell="tet")
    skin = cut_out_skin(mesh)
    vectors = area_vectors(skin.points[skin.facets])
    at_vertices, exact = np.zeros_like(skin.points), np.zeros_like(skin.points)
    for corner in range(3):
        np.add.at(at_vertices, skin.facets[:, corner], vectors / 3.0)
    vertex = np.full(len(mesh.points), -1)
    vertex[skin.nodes] = np.arange(len(skin.nodes))
    facets = vertex[boundary_facets(mesh)]
    area = area_vectors(skin.points[facets[:, :3]])
    for middle in (3, 4, 5):
        np.add.at(exact, facets[:, middle], area / 3.0)
    assert bulge(skin).T @ at_vertices == pytest.approx(exact, abs=1e-14)


COLUMN = """\
title: a column of fluid on an elastic block
time: {step: 1, end: 1}
fluid:
  density: 1000
  viscosity: 1
  element: q1q1
  scheme: steady
  flow: stokes
  gravity: [0, 0, -10]
  grid: {from: [0, 0, 0], to: [1, 0.5, 1], cells: [4, 2, 5]}
  patches:
    sides: {on: [x-, x+, y-, y+, z-], slip: true}
    top: {on: z+, traction: [0, 0, 0]}
structure:
  bodies:
    block:
      mesh: {shape: box, size: [1, 0.5, 0.43], cells: [2, 1, 1], order: 2}
      material: {law: neo_hooke, E: 1e5, nu: 0}
      kinematics: linear
      supports: [{on: bottom, displacement: [0, 0, 0]}, {on: [left, right, front, back], symmetry: true}]
coupling: {scheme: monolithic}
probes:
  middle: {quantity: displacement, at: [0.5, 0.25, 0.43]}
  corner: {quantity: displacement, at: [0, 0, 0.43]}
  side: {quantity: displacement, at: [0.25, 0, 0.43]}
solver: {newton: {residual: 1.0e-11}}
"""


@pytest.mark.parametrize("cell", ["hex", "tet"])
@pytest.mark.parametrize("scheme", ["monolithic", "partitioned"])
def test_a_plane_surface_stays_plane(tmp_path, scheme, cell):
    """u E / h = -rho g (H - h - u) at all nodes of a block in space, whatever their place in the facets."""
    history = run(
        COLUMN.replace("scheme: monolithic", f"scheme: {scheme}").replace("order: 2", f"order: 2, cell: {cell}"),
        tmp_path,
    )
    exact = -1e4 * 0.57 / (1e5 / 0.43 - 1e4)
    for name in ("middle", "corner", "side"):
        assert history[f"{name}.z"][-1] == pytest.approx(exact, rel=1e-6 if scheme == "partitioned" else 1e-8), name


#: two blocks on the floor
BLOCKS = """\
title: blocks at the bottom of a basin
time: {{step: 1, end: 1}}
fluid:
  density: 1000
  viscosity: 1
  element: q2q1
  scheme: steady
  flow: stokes
  gravity: [0, -10]
  grid: {{from: [0, 0], to: [1, 1], cells: [7, 6]}}
  patches:
    sides: {{on: [x-, x+, y-], slip: true}}
    top: {{on: y+, traction: [0, 0]}}
structure:
  bodies:
    left:
      mesh: {{shape: rectangle, size: [0.3, 0.43], cells: [2, 1], order: {left}}}
      material: {{law: neo_hooke, E: 1e5, nu: 0}}
      kinematics: linear
      supports: [{{on: bottom, displacement: [0, 0]}}, {{on: [left, right], symmetry: true}}]
    right:
      mesh: {{shape: rectangle, size: [0.3, 0.43], cells: [2, 1], order: {right}, translate: [0.7, 0]}}
      material: {{law: neo_hooke, E: 2e5, nu: 0}}
      kinematics: linear
      supports: [{{on: bottom, displacement: [0, 0]}}, {{on: [left, right], symmetry: true}}]
coupling: {{scheme: monolithic}}
probes:
  left: {{quantity: displacement, body: left, at: [0.225, 0.43]}}
  right: {{quantity: displacement, body: right, at: [0.85, 0.43]}}
solver: {{newton: {{residual: 1.0e-11}}}}
"""


@pytest.mark.parametrize(("left", "right"), [(2, 1), (1, 2), (2, 2)])
def test_bodies_of_both_orders_beside_each_other(tmp_path, left, right):
    """Each top moves by -rho g (H - h - u) h / E, as if it were alone."""
    history = run(BLOCKS.format(left=left, right=right), tmp_path)
    for name, E in (("left", 1e5), ("right", 2e5)):
        assert history[f"{name}.y"][-1] == pytest.approx(-1e4 * 0.57 / (E / 0.43 - 1e4), rel=1e-7), name


@pytest.mark.parametrize("cell", ["hex", "tet"])
def test_traction_at_all_nodes(tmp_path, cell):
    """Inside of the surface it is the pressure of the column, also at corners of triangles, which it does not load."""
    (tmp_path / "case.yaml").write_text(COLUMN.replace("[2, 1, 1], order: 2", f"[4, 2, 1], order: 2, cell: {cell}"))
    steps = fsci.build(fsci.load(tmp_path))
    assert list(steps) == [1.0]
    block = steps.fields()["block"]
    x, y, z = block.points.T
    top = (z > 0.4) & (np.abs(x - 0.5) < 0.49) & (np.abs(y - 0.25) < 0.24)  # edges belong to the sides, too
    assert top.sum() == 21
    pressure = 1e4 * (0.57 + 1e4 * 0.57 / (1e5 / 0.43 - 1e4))
    exact = np.tile([0.0, 0.0, -pressure], (21, 1))
    assert block.point_data["traction"][top] == pytest.approx(exact, rel=1e-8, abs=1e-8 * pressure)
