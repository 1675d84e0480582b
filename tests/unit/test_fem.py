"""The functions of `solvers.fem`, each on a small mesh with a known answer: the same on every version of DOLFINx."""

from itertools import pairwise

import numpy as np
import pytest
import ufl
from mpi4py import MPI

from fsci import shapes
from solvers import fem
from solvers.fem import calls

CELLS = {
    "triangle": (2, "tri", 1),
    "triangle6": (2, "tri", 2),
    "quad": (2, "quad", 1),
    "quad9": (2, "quad", 2),
    "tetra": (3, "tet", 1),
    "tetra10": (3, "tet", 2),
    "hexahedron": (3, "hex", 1),
    "hexahedron27": (3, "hex", 2),
}


def make_domain(cell_type):
    """[0, 2] x [0, 1] (x [0, 1]) with surfaces on its sides."""
    dim, cell, order = CELLS[cell_type]
    make = shapes.rectangle if dim == 2 else shapes.box
    mesh = make(size=(2.0, 1.0, 1.0)[:dim], cells=(2, 1, 1)[:dim], cell=cell, order=order)
    return fem.distribute(MPI.COMM_SELF, mesh)


@pytest.fixture(params=CELLS)
def domain(request):
    return make_domain(request.param)


@pytest.fixture
def square():
    return make_domain("quad")


def test_nodes_are_found_again(domain):
    """Each block is at the point of the mesh that its number names."""
    space = fem.vector_space(domain)
    points = fem.block_points(space)[: domain.dim].T
    assert np.allclose(points, domain.source.points[fem.node_of_block(domain, space)])
    blocks = fem.cell_blocks(space)
    assert blocks.shape == domain.source.cells.shape
    nodes = fem.node_of_block(domain, space)[blocks]
    there = domain.source.cells[fem.input_cells(domain)]
    assert np.array_equal(np.sort(nodes, axis=1), np.sort(there, axis=1))


def test_surfaces(domain):
    space = fem.vector_space(domain)
    x = fem.block_points(space)[0]
    assert set(fem.surface_blocks(domain, space, "right")) == set(np.flatnonzero(np.isclose(x, 2.0)))
    middles = fem.facet_midpoints(domain, domain.surfaces["right"])
    assert np.allclose(middles[:, 0], 2.0)
    facets, cells = fem.boundary_facets(domain)
    assert np.array_equal(facets, np.sort(fem.exterior_facets(domain)))
    assert set(cells) <= set(range(fem.owned_cells(domain)))
    inside, pairs = fem.interior_facets(domain)
    assert not set(inside) & set(facets)
    assert np.all(pairs[:, 0] != pairs[:, 1])


def test_quadrature_of_cells_and_facets(domain):
    """Volume 2, area of the right side 1, its normal along x, and the first moments."""
    space = fem.vector_space(domain)
    (cells,) = fem.cell_quadrature(domain, space, 2)
    assert cells.weights.sum() == pytest.approx(2.0)
    assert cells.weights.ravel() @ cells.positions[0] == pytest.approx(2.0)
    facets = fem.facet_quadrature(domain, space, "right", 2)
    assert sum(part.weights.sum() for part in facets) == pytest.approx(1.0)
    x = fem.block_points(space)[: domain.dim].T
    for part in facets:
        normals = part.area_vectors(x)
        assert np.all(normals[..., 0] > 0.0)
        assert np.allclose(normals[..., 1:], 0.0)


def test_points(domain):
    """A linear function of the position, from nodal values, at a point."""
    space = fem.vector_space(domain)
    point = np.array([1.3, 0.6, 0.2])[: domain.dim]
    cell, reference = fem.locate_point(domain, point)
    x = fem.block_points(space)[: domain.dim].T[fem.cell_blocks(space)[cell]]
    assert np.allclose(fem.tabulate(domain, reference) @ x, point)
    assert fem.locate_point(domain, point + 5.0) is None
    assert len(fem.reference_nodes(domain)) == fem.cell_blocks(space).shape[1]
    middles = fem.cell_midpoints(domain)[0]
    assert middles.mean() == pytest.approx(1.0)


def test_integrals_over_chosen_entities(square):
    """A form whose cells and facets are chosen later: areas and lengths are those of the chosen ones."""
    one = fem.constant(square, 1.0)
    space = fem.scalar_space(square)
    v = ufl.TestFunction(space)

    def total(kind, **entities):
        form = fem.Integral(square, one * (ufl.avg(v) if kind == "dS" else v) * fem.measure(square, kind, 2))
        out = np.zeros(len(fem.block_points(space).T))
        fem.assemble_vector(form.on(**entities), out)
        return out.sum()

    cells = np.arange(2, dtype=np.int32)
    assert total("dx", cell=cells) == pytest.approx(2.0)
    assert total("dx", cell=cells[:1]) == pytest.approx(1.0)
    assert total("dx", cell=cells[:0]) == 0.0
    right = square.surfaces["right"]
    assert total("ds", exterior_facet=right) == pytest.approx(1.0)
    inside, _ = fem.interior_facets(square)
    assert total("dS", interior_facet=inside) == pytest.approx(1.0)


def test_coefficients_that_derivatives_do_not_have(square):
    """At u = 3 the derivative of c + a u + b u^2 is a + 2 b u: it has no c, and u is not its first coefficient."""
    space = fem.scalar_space(square)
    c, a, b, u = (fem.function(space) for _ in range(4))
    for function, value in ((c, 11.0), (a, 5.0), (b, 7.0), (u, 3.0)):
        function.x.array[:] = value
    dx = fem.measure(square, "dx", 4)
    v, du = ufl.TestFunction(space), ufl.TrialFunction(space)
    tangent = ufl.derivative((c + a * u + b * u**2) * v * dx, u, du)
    form = fem.Integral(square, tangent).on(cell=np.arange(2, dtype=np.int32))
    matrix = fem.create_matrix(form)
    fem.assemble_matrix(matrix, form)
    matrix.assemble()
    ones, sums = matrix.createVecs()
    ones.set(1.0)
    matrix.mult(ones, sums)
    assert sums.sum() == pytest.approx(2.0 * (5.0 + 2.0 * 7.0 * 3.0))


@pytest.mark.parametrize(("shape", "element"), [("rectangle", "quad"), ("box", "hex")])
def test_forms_over_cells_along_the_axes(shape, element):
    """Compiled for diagonal Jacobians they have the same values, in cells and across facets; for others they do not."""
    dim = 2 if shape == "rectangle" else 3
    make = getattr(shapes, shape)
    plain, sheared = (make(size=(2.0, 0.3, 5.0)[:dim], cells=(2, 3, 2)[:dim], cell=element) for _ in range(2))
    sheared.points[:, 0] += 0.2 * sheared.points[:, 1]

    def entries(mesh, *, axis_aligned):
        domain = fem.distribute(MPI.COMM_SELF, mesh, axis_aligned=axis_aligned)
        space = fem.vector_space(domain)
        f = fem.function(space)
        f.x.array[:] = np.random.default_rng(5).standard_normal(len(f.x.array))
        u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
        n = ufl.FacetNormal(domain.mesh)
        dx, dS = (fem.measure(domain, kind, 3) for kind in ("dx", "dS"))
        across = ufl.dot(ufl.avg(ufl.grad(u)) * n("+"), ufl.jump(v)) * dS
        form = ufl.inner(ufl.grad(u) * f, ufl.grad(v) * f + v) * dx + ufl.div(u) * ufl.div(v) * dx + across
        every = np.arange(fem.owned_cells(domain), dtype=np.int32)
        integral = fem.Integral(domain, form).on(cell=every, interior_facet=fem.interior_facets(domain)[0])
        matrix = fem.create_matrix(integral)
        fem.assemble_matrix(matrix, integral)
        matrix.assemble()
        return matrix.getValuesCSR()[2]

    expected = entries(plain, axis_aligned=False)
    assert np.abs(entries(plain, axis_aligned=True) - expected).max() < 1e-13 * np.abs(expected).max()
    expected = entries(sheared, axis_aligned=False)
    assert np.abs(entries(sheared, axis_aligned=True) - expected).max() > 1e-3 * np.abs(expected).max()


def test_weights_at_quadrature_points(square):
    """A coefficient at the points of a rule turns an integral into a weighted sum of the points."""
    weight = fem.function(fem.quadrature_space(square, 4))
    v = ufl.TestFunction(fem.scalar_space(square))
    form = fem.Integral(square, weight * v * fem.measure(square, "dx", 4))
    points, rule = fem.quadrature_points(square, 4)
    values = np.random.default_rng(1).random((2, len(rule)))
    weight.x.array[fem.cell_blocks(weight.function_space)] = values
    out = np.zeros(6)
    fem.assemble_vector(form.on(cell=np.arange(2, dtype=np.int32)), out)
    assert out.sum() == pytest.approx((values @ rule).sum())
    tensor = fem.quadrature_space(square, 4, (2, 2))
    assert fem.cell_blocks(tensor).shape == (2, len(points))


def test_forms_constants_and_scalars(square):
    number = fem.constant(square, 3.0)
    form = fem.compile_form(number * fem.volume_measure(square, 1))
    assert fem.assemble_scalar(form, square.comm) == pytest.approx(6.0)
    number.value = 5.0
    assert fem.assemble_scalar(form, square.comm) == pytest.approx(10.0)
    side = fem.compile_form(number * fem.surface_measure(square, "top", 1))
    assert fem.assemble_scalar(side, square.comm) == pytest.approx(10.0)


def test_the_same_form_has_one_name_whatever_was_made_before(square):
    """The cache finds it by its signature, in which constants stand in a fixed order."""
    dx = fem.volume_measure(square, 1)
    constants = [fem.constant(square, 1.0) for _ in range(1200)]
    pairs = pairwise(constants)
    assert len({(a * b * dx).signature() for a, b in pairs}) == 1


def test_matrices(square):
    """The mass matrix of scalars: the sum of its entries is the area."""
    space = fem.scalar_space(square)
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    form = fem.compile_form(u * v * fem.volume_measure(square, 2))
    matrix = fem.create_matrix(form)
    fem.assemble_matrix(matrix, form)
    matrix.assemble()
    ones, sums = matrix.createVecs()
    ones.set(1.0)
    matrix.mult(ones, sums)
    assert sums.sum() == pytest.approx(2.0)


def test_expressions(square):
    """The gradient of x^2 y, averaged at the nodes of a bilinear interpolant, and in cells."""
    space = fem.scalar_space(square)
    u = fem.function(space)
    x, y, _ = fem.block_points(space)
    u.x.array[:] = x * y
    expression = fem.compile_expression(ufl.grad(u), fem.reference_nodes(square))
    values = fem.evaluate_cells(square, expression)
    assert values.shape == (2, 8)
    gradient = fem.average_at_nodes(square, space, expression, components=2)
    assert np.allclose(gradient, np.stack([y, x], axis=1))


@pytest.mark.parametrize("degree", [1, 2])
def test_values_at_points_for_test_functions(square, degree):
    """Their sum with the weights of a rule is the assembled form; given values replace those of a function."""
    space, factor = fem.flow_space(square, degree), fem.function(fem.cellwise_space(square))
    flow, test = fem.function(space), ufl.TestFunction(space)
    flow.x.array[:] = np.random.default_rng(1).normal(size=len(flow.x.array))
    factor.x.array[:] = 3.0, -2.0
    integrand = fem.constant(square, 2.0) * factor * ufl.dot(flow, test) + ufl.inner(ufl.grad(flow), ufl.grad(test))
    points, weights = fem.quadrature_points(square, 4)
    pointwise, cells = fem.Pointwise(square, integrand, points, "a test"), np.array([1, 0, 1], dtype=np.int32)
    values = pointwise.on(cells)
    dofs = fem.cell_blocks(space)[:, :, None] * space.dofmap.index_map_bs + np.arange(space.dofmap.index_map_bs)
    exact, total = np.zeros(len(flow.x.array)), np.zeros(len(flow.x.array))
    fem.assemble_vector(fem.compile_form(integrand * fem.volume_measure(square, 4)), exact)
    np.add.at(total, dofs[cells[:2]].reshape(2, -1), np.einsum("q,cqa->ca", weights, values[:2]))
    np.testing.assert_allclose(total, exact, atol=1e-13)
    np.testing.assert_array_equal(values[2], values[0])
    given = pointwise.on(cells[2:], {factor: np.array([[-2.0]])})
    np.testing.assert_array_equal(given, values[2:])
    assert np.abs(pointwise.on(cells[2:], {factor: np.array([[3.0]])}) - given).max() > 0.1
    assert pointwise.on(cells[:0]).shape == (0, *values.shape[1:])


def test_numbers_of_cells_that_recur(square):
    """Form compilers of DOLFINx 0.5 cannot name the tenth coefficient by its text."""
    numbers = [fem.numbers_of_cells(square, 5) for _ in range(11)][-1]
    moment = fem.Pointwise(square, numbers[2] * ufl.SpatialCoordinate(square.mesh)[0], np.array([[0.5, 0.5]]), "a test")
    given = {numbers: np.arange(15.0).reshape(3, 5)}
    middle = fem.cell_midpoints(square)[0]
    found = moment.on(np.array([0, 1, 1], dtype=np.int32), given)
    np.testing.assert_allclose(found[:, 0], [2.0 * middle[0], 7.0 * middle[1], 12.0 * middle[1]])


@pytest.mark.parametrize("cell_type", ["quad", "hexahedron"])
def test_tensors_of_two_cells(cell_type):
    """Of cells that meet, they are the assembled form; and of cells that meet once one is moved by a period."""
    domain = make_domain(cell_type)
    space, factor = fem.flow_space(domain, 1), fem.function(fem.cellwise_space(domain))
    flow, test, trial = fem.function(space), ufl.TestFunction(space), ufl.TrialFunction(space)
    flow.x.array[:], factor.x.array[:] = np.random.default_rng(1).normal(size=len(flow.x.array)), (3.0, -2.0)
    normal, dS = ufl.FacetNormal(domain.mesh), fem.measure(domain, "dS", 2)
    slopes = [ufl.jump(ufl.grad(some), normal) for some in (test, trial, flow)]
    weight = fem.constant(domain, 2.0) * factor("+") ** 2 * factor("-") ** 2
    left, right = (np.array([k], dtype=np.int32) for k in np.argsort(fem.cell_midpoints(domain)[0]))
    size = space.dofmap.index_map_bs
    dofs = (fem.cell_blocks(space)[:, :, None] * size + np.arange(size)).reshape(2, -1)
    both = np.concatenate([dofs[right], dofs[left]], axis=1)[0]
    faces = fem.interior_facets(domain)[0]

    linear = fem.Integral(domain, weight * ufl.inner(slopes[0], slopes[2]) * dS)
    exact, total = np.zeros(len(flow.x.array)), np.zeros(len(flow.x.array))
    fem.assemble_vector(linear.on(interior_facet=faces), exact)
    facewise = fem.Facewise(domain, linear)
    np.add.at(total, both, facewise.between(facewise.data(right), facewise.data(left), 0, 0.0)[0])
    assert np.abs(exact).max() > 1.0
    np.testing.assert_allclose(total, exact, atol=1e-12)

    bilinear = fem.Integral(domain, weight * ufl.inner(slopes[0], slopes[1]) * dS)
    facewise = fem.Facewise(domain, bilinear)
    one, other = facewise.data(right), facewise.data(left)
    met = facewise.between(one, other, 0, 0.0)
    total[:] = 0.0
    np.add.at(total, both, met[0] @ flow.x.array[both])
    np.testing.assert_allclose(total, exact, atol=1e-12)
    np.testing.assert_allclose(facewise.between(other, one, 0, -2.0), met, atol=1e-12)
    assert facewise.between(one[:0], other[:0], 0, 0.0).shape == (0, *met.shape[1:])


@pytest.mark.parametrize("degree", [1, 2])
def test_flow_spaces(square, degree):
    """Velocity and pressure dofs are all different, together all there are, and lie at the nodes of the lattice."""
    space = fem.flow_space(square, degree)
    velocity, at = fem.component_dofs(square, space, [0, 1], degree)
    pressure, below = fem.component_dofs(square, space, [2], 1)
    count = (2 * degree + 1) * (degree + 1)
    assert velocity.shape == (count, 2)
    assert len(pressure) == 6
    everything = np.concatenate([velocity.ravel(), pressure.ravel()])
    assert np.array_equal(np.sort(everything), np.arange(2 * count + 6))
    assert np.array_equal(np.unique(at[:, 0].round(9)), np.linspace(0.0, 2.0, 2 * degree + 1))
    assert np.array_equal(np.unique(below[:, 1].round(9)), [0.0, 1.0])
    right = fem.facet_dofs(space, 0, square.surfaces["right"])
    assert np.allclose(at[np.isin(velocity[:, 0], right), 0], 2.0)
    assert len(right) == degree + 1
    cells = fem.component_cell_dofs(space, 0)
    assert cells.shape == (2, (degree + 1) ** 2)


def test_blocks_that_are_identified(square):
    """The right side gets the blocks of the left one."""
    space = fem.flow_space(square, 1)
    x, y, _ = fem.block_points(space).round(9)
    right = np.flatnonzero(x == 2.0).astype(np.int32)
    left = np.array([np.flatnonzero((x == 0.0) & (y == y[i]))[0] for i in right], dtype=np.int64)
    same, place = fem.identify_blocks(space, right, left, np.zeros(len(right), dtype=np.int32))
    assert np.array_equal(place[right], place[left])
    assert np.array_equal(fem.cell_blocks(same), place[fem.cell_blocks(space)])
    assert np.array_equal(np.unique(fem.cell_blocks(same)), np.arange(6 - len(right)))
    assert same.dofmap.index_map.size_global == 6 - len(right)


def test_spaces_of_one_number_per_cell(square):
    assert len(fem.function(fem.cellwise_space(square)).x.array) == 2
    assert len(fem.function(fem.pressure_space(square)).x.array) == 2
    second = make_domain("quad9")
    assert len(fem.function(fem.pressure_space(second)).x.array) == 2 * 3


def test_sums_on_one_process(square):
    space = fem.scalar_space(square)
    values = np.arange(6.0)
    assert np.array_equal(fem.sum_ghosts(space, values), values)
    assert np.array_equal(fem.share_owned(space, values), values)
    fem.add_ghosts(space, values)
    assert np.array_equal(values, np.arange(6.0))


def test_both_generations_have_the_same_functions():
    from ast import FunctionDef, parse
    from pathlib import Path

    folder = Path(calls.__file__).parent
    names = []
    for module in ("pybind", "nanobind"):
        body = parse((folder / f"{module}.py").read_text()).body
        names.append({part.name for part in body if isinstance(part, FunctionDef) and not part.name.startswith("_")})
    assert names[0] == names[1]


@pytest.mark.parametrize("cell_type", CELLS)
def test_heights_at_nodes(cell_type):
    """Cells of 1 x 1 beside one of 1e-6 x 1: at its nodes its height counts; simplices have half of their squares."""
    domain = make_domain(cell_type)
    space = fem.vector_space(domain)
    even = fem.node_heights(domain, space)
    assert (even <= 1.0 + 1e-12).all()
    assert (even >= 0.5).all()
    x = domain.mesh.geometry.x
    x[:, 0] = np.interp(x[:, 0], [0.0, 1.0, 2.0], [0.0, 1.0, 1.0 + 1e-6])
    points = space.tabulate_dof_coordinates()
    heights = fem.node_heights(domain, space)
    flat = points[:, 0] > 1.0 - 1e-9
    np.testing.assert_allclose(heights[~flat], even[~flat], rtol=1e-12)
    assert (heights[flat] <= 1.01e-6).all()
    assert (heights[flat] >= 0.5e-6).all()
