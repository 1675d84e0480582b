"""STEP of a CAD program through a short script: cells, named surfaces, second order, and copies for the run."""

import subprocess
import sys

import numpy as np
import pytest
from case_mistakes import load

from fsci.meshes.mesh import build_mesh
from fsci.running.kept_case import copies
from solvers.mesh.tessellation import area_vectors, tessellate

MAKE = """
import gmsh
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 2, 0.5)
gmsh.model.occ.synchronize()
gmsh.write("part.step")
"""
SCRIPT = """\
SetFactory("OpenCASCADE");
Merge "part.step";
Physical Volume("part") = {1};
ends() = Surface In BoundingBox {-1, -1, -1e-3, 1, 1, 1e-3};
Physical Surface("bottom") = {ends()};
MeshSize {:} = 0.2;
"""
CASE = """\
time: {step: 1, end: 1}
structure:
  bodies:
    rod:
      mesh: {file: part.geo, order: 2}
      material: {law: neo_hooke, E: 1, nu: 0.3}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
"""


@pytest.mark.usefixtures("in_new_folder")
def test_a_cylinder_from_step(tmp_path):
    """Nodes and midnodes of 16 edges are on the arc: the disc through them is a polygon of 32 sides."""
    pytest.importorskip("gmsh")
    subprocess.run([sys.executable, "-c", MAKE], cwd=tmp_path, check=True, capture_output=True)
    (tmp_path / "part.geo").write_text(SCRIPT)
    case = load(CASE)
    mesh = build_mesh(case.structure.bodies["rod"].mesh, case.folder)
    assert mesh.cell_type == "tetra10"
    assert np.ptp(mesh.points[:, 2]) == pytest.approx(2.0)
    facets, nodes = tessellate(mesh, ["bottom"])
    areas = area_vectors(mesh.points[nodes][facets])
    assert areas.sum(axis=0) == pytest.approx([0.0, 0.0, -16 * 0.5**2 * np.sin(np.pi / 16)], abs=1e-9)
    kept = {file.name for file, _ in copies(case)}
    assert {"part.geo", "part.step"} <= kept
