"""Tangents that are assembled by blocks of nodes have the entries of PETSc's own assembly, bit for bit."""

import numpy as np
import pytest
import ufl
from structure_setup import CELL_TYPES, block, constant, distort, make_structure

from solvers import fem
from solvers.algebra.blocks import block_diagonal
from solvers.algebra.petsc_blocks import block_rows, join_entries
from solvers.structure import forms
from solvers.structure.block_assembly import BlockAssembly
from solvers.structure.body import Pressure
from solvers.structure.materials import NeoHooke
from solvers.structure.springs import Spring

NEO_HOOKE = NeoHooke(3.0, 5.0)


def tangent_form(body):
    v, du = ufl.TestFunction(body.space), ufl.TrialFunction(body.space)
    dx = fem.volume_measure(body.domain, body.stiffness_degree)
    return fem.compile_form(forms.tangent(body.u, body.element, v, du, dx))


def assembled(matrix, form):
    matrix.zeroEntries()
    fem.assemble_matrix(matrix, form)
    matrix.assemble()
    return matrix.getValuesCSR()


@pytest.mark.parametrize("cell_type", [name for name in CELL_TYPES if name != "hexahedron27"])
def test_entries(cell_type):
    body = make_structure(distort(block(cell_type, 2), 0.05), NEO_HOOKE).bodies[0]
    form, rng = tangent_form(body), np.random.default_rng(1)
    assembly, expected = BlockAssembly(form), body.create_tangent()
    matrices = [body.create_tangent()] * 3 + [body.create_tangent()]  # the last one has no entries yet
    for matrix in matrices:
        body.set_displacement(0.02 * rng.standard_normal(body.size))
        assembly.assemble(matrix)
        matrix.assemble()
        assert all(map(np.array_equal, matrix.getValuesCSR(), assembled(expected, form)))


def test_blocks_are_used():
    body = make_structure(block("hexahedron", 2), NEO_HOOKE).bodies[0]
    assembly, matrix = BlockAssembly(tangent_form(body)), body.create_tangent()
    assert assembly.blocks is None
    assembly.assemble(matrix)
    assert block_rows(assembly.blocks).values.shape == (7**3, 3, 3)
    assert not block_rows(assembly.blocks).values.any()
    assembly.assemble(matrix)
    assert block_rows(assembly.blocks).values.any()


@pytest.mark.parametrize(
    "more",
    [
        {"pressures": [Pressure("top", constant(2.0))]},
        {"springs": [Spring("bottom", constant(7.0))]},
        {"element": "mixed"},
    ],
    ids=["pressure", "spring", "mixed"],
)
def test_what_else_is_in_a_tangent(more):
    """It is added to the blocks' entries: two tangents at one displacement are equal."""
    body = make_structure(distort(block("quad", 2), 0.05), NEO_HOOKE, **more).bodies[0]
    matrix = body.create_tangent()
    found = []
    for _ in range(2):
        body.set_displacement(0.01 * np.sin(np.arange(body.size)))
        body.element.begin_step(1.0)
        body.assemble_tangent(matrix, 0.0)
        found.append(matrix.getValuesCSR()[2])
    assert np.array_equal(*found)


def test_entries_side_by_side():
    """diag(A, B) in a matrix that is there is that of a new one; with another pattern its entries are not touched."""
    bodies = [make_structure(block(cell_type, 2), NEO_HOOKE).bodies[0] for cell_type in ("quad", "triangle")]
    matrices = [body.create_tangent() for body in bodies]
    out = None
    for scale in (0.01, 0.02):
        for body, matrix in zip(bodies, matrices, strict=True):
            body.set_displacement(scale * np.cos(np.arange(body.size)))
            body.assemble_tangent(matrix, 0.0)
        out = block_diagonal(matrices, out)
        new = block_diagonal(matrices)
        assert all(map(np.array_equal, out.getValuesCSR(), new.getValuesCSR()))
    assert join_entries(matrices, out)
    assert not join_entries(matrices[:1], out)
    assert np.array_equal(out.getValuesCSR()[2], new.getValuesCSR()[2])
