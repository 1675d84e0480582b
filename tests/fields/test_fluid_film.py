"""Films between walls closer than a cell: where they are found, and how far the stabilisation steps back there."""

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, solve_steady, step
from mpi4py import MPI
from scipy.sparse import csr_matrix

from solvers.fluid.cut import film
from solvers.fluid.cut.cut import Cutter
from solvers.fluid.cut.extension import FREE_SHARE
from solvers.fluid.grid.box import uniform
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.settings.penalties import TRACE, Penalties
from solvers.fluid.surfaces.surface import together
from solvers.fluid.terms.boundary.patches import Patch, wall_faces
from solvers.fluid.terms.poorly_cut.ghost import Scales

H = 0.1


def scene(*bodies, element="q2q1", walls=("y-", "y+"), **settings):
    """Bodies in a box of 10 x 10 cells; the other faces are open."""
    others = tuple(face for face in ("x-", "x+", "y-", "y+") if face not in walls)
    patches = [Patch("walls", walls, "no_slip"), Patch("ends", others, "traction", field(0, 0))]
    settings = {"scheme": "steady", "convection": False} | settings
    return make_fluid(uniform([0, 0], [1, 1], [10, 10]), patches, bodies, element=element, **settings)


def plate(name, low, high, angle=0.0):
    """A plate across the box from one height to another, turned about the middle."""
    points, facets = block([0.2, low], [0.8, high])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return body(name, (points - 0.5) @ turn.T + 0.5, facets)


def expected(gap, h=H):
    return film.SHARE_OF_FILM * min(1.0, max(gap / h, film.LEAST_RATIO) ** 3 / (12.0 * Penalties().extension))


@pytest.mark.parametrize("gap", [0.09, 0.05, 0.02])
@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4, 2.0])
@pytest.mark.parametrize("low", [0.43, 0.5, 0.478])
def test_between_two_bodies(gap, angle, low):
    """The gap along the normal, wherever the grid is."""
    fluid = scene(plate("lower", low - 0.15, low, angle), plate("upper", low + gap, low + gap + 0.15, angle))
    found = fluid.cut.film
    assert found.min() == pytest.approx(expected(gap), rel=1e-6)
    if angle == 0.0:
        assert found.reshape(10, 10, order="F")[2:8, int(low / H)] == pytest.approx(expected(gap), rel=1e-6)


@pytest.mark.parametrize("gap", [0.09, 0.03])
def test_between_a_body_and_a_face_of_the_box(gap):
    assert scene(plate("plate", gap, 0.4)).cut.film.min() == pytest.approx(expected(gap), rel=1e-6)
    assert scene(plate("plate", 0.4, 1 - gap)).cut.film.min() == pytest.approx(expected(gap), rel=1e-6)
    assert scene(plate("plate", gap, 0.4), walls=("x-", "y+")).cut.film is None  # y- is open


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("size", [1.0, 1e-3])
def test_a_notch_is_no_film(angle, size):
    """A wall as long as a cell is 0.3 cells away from an opposite one, across: that has 1 % of the cell, or half."""
    grid = uniform([0, 0], [size, size], [10, 10])
    n, middle = np.array([np.cos(angle), np.sin(angle)]), np.full(2, 0.45 * size)
    cells = np.array([44, 44])
    section = H * size / np.abs(n).max()

    def factor(share):
        x = np.stack([middle, middle - 0.3 * H * size * n])
        walls = film.Walls(cells, x, np.stack([n, -n]), section * np.array([1.0, share]))
        return film.Films((), 0.1).factor(grid, walls, np.zeros(grid.size, dtype=bool))

    assert factor(0.01) is None
    assert (factor(0.5) < 1.0).sum() == 1


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2])
def test_a_film_goes_on_into_corners_of_cells(angle):
    """Walls of 1 % of a cell, 0.3 cells apart as the wide ones beside them. Two cells farther they are a notch."""
    grid = uniform([0, 0], [1, 1], [10, 10])
    n = np.array([np.cos(angle), np.sin(angle)])
    along, section = np.array([-n[1], n[0]]), H / np.abs(n).max()

    def films(cell, way):
        middles = 0.45 * np.ones(2), 0.45 * np.ones(2) + way * H * along
        x = np.concatenate([[middle, middle - 0.3 * H * n] for middle in middles])
        cells, areas = (np.repeat(some, 2) for some in ([44, cell], [section, 0.01 * section]))
        walls = film.Walls(cells, x, np.stack([n, -n, n, -n]), areas)
        return np.flatnonzero(film.Films((), 0.1).factor(grid, walls, np.zeros(grid.size, dtype=bool)) < 1.0).tolist()

    assert films(54, 0.6) == [44, 54]
    assert films(64, 1.6) == [44]


@pytest.mark.parametrize("sides", [16, 20, 24, 48])
def test_a_film_between_polygons_does_not_depend_on_rounding(sides):
    """Facets that lie in one plane of a film by the direction of their normals, however little the discs are turned."""
    angles = 2.0 * np.pi * np.arange(sides) / sides
    films = []
    for turn in (-1e-12, 0.0, 1e-12):
        ring = np.stack([np.cos(angles + turn), np.sin(angles + turn)], axis=1)
        discs = [body(name, [x, 0.513] + 0.2 * ring, loop(sides)) for name, x in (("a", 0.28), ("b", 0.72))]
        films.append(scene(*discs).cut.film)
    assert films[1].min() < 1e-3
    np.testing.assert_allclose([films[0], films[2]], [films[1]] * 2, rtol=1e-9)


def test_no_film():
    """Not across the solid of a thin body, not where walls are a cell apart, not with first order."""
    assert scene(plate("thin", 0.43, 0.46)).cut.film is None
    assert scene(plate("lower", 0.2, 0.43), plate("upper", 0.5301, 0.7)).cut.film is None
    assert scene(body("disc", circle([0.5, 0.5], 0.3, 100), loop(100))).cut.film is None
    assert scene(plate("lower", 0.2, 0.43), plate("upper", 0.45, 0.7), element="q1q1").cut.film is None


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_film_beside_a_thin_body(angle):
    """A plate of 0.3 cells has one on its lower side alone."""
    fluid = scene(plate("lower", 0.3, 0.43, angle), plate("thin", 0.46, 0.49, angle))
    assert fluid.cut.film.min() == pytest.approx(expected(0.03), rel=1e-6)


def test_poorly_cut_cells_at_the_end_of_a_film_have_its_flow():
    """They share nodes with the solid cells above it."""
    fluid = scene(body("disc", circle([0.5, 0.37], 0.35, 100), loop(100)), convection=True)
    cut, cells = fluid.cut, fluid.grid.numbers[fluid.system.cells[2]]
    ends = np.flatnonzero(cut.creeping & (cut.film == 1.0) & (cut.share > 0.0))
    assert len(ends) == 2
    assert (cut.share[ends] < FREE_SHARE[2]).all()
    assert sorted(cells) == sorted(np.flatnonzero((cut.film < 1.0) & (cut.share > 0.0)).tolist() + ends.tolist())
    poor = np.flatnonzero((cut.film == 1.0) & (cut.share > 0.0) & (cut.share < FREE_SHARE[2]))
    assert len(poor) > 2  # farther away


def test_stretched_cells():
    """The factor is one of the longest edge: jumps grow with it."""
    points, facets = block([0.1, 0.03], [0.9, 0.5])
    patches = [Patch("walls", ("y-", "y+"), "no_slip"), Patch("ends", ("x-", "x+"), "traction", field(0, 0))]
    fluid = make_fluid(uniform([0, 0], [1, 1], [5, 20]), patches, [body("b", points, facets)], element="q2q1")
    assert fluid.cut.film.min() == pytest.approx(expected(0.03, 0.2), rel=1e-6)


def test_three_dimensions():
    """The cut alone: the forms of such a flow take ten seconds to compile."""
    patches = [
        Patch("walls", ("z-", "z+"), "no_slip"),
        Patch("ends", ("x-", "x+", "y-", "y+"), "traction", field(0, 0, 0)),
    ]
    grid = uniform([0, 0, 0], [1, 1, 1], [5, 5, 5])
    plates = [body(n, *block([0.1, 0.1, a], [0.9, 0.9, b])) for n, a, b in (("l", 0.1, 0.43), ("u", 0.5, 0.7))]
    facets, motion = together([one.surface for one in plates], [one.motion(0.0) for one in plates], 3)
    cutter = Cutter(
        DistributedGrid(MPI.COMM_SELF, grid),
        np.linspace(0.0, 1.0, 5)[1:-1],
        film.Films(wall_faces(patches), Penalties().extension),
    )
    found = cutter(facets, motion, 1).film
    assert found.reshape(5, 5, 5, order="F")[1:4, 1:4, 2] == pytest.approx(expected(0.07, 0.2), rel=1e-6)
    assert found.reshape(5, 5, 5, order="F")[:, :, 0] == pytest.approx(expected(0.1, 0.2), rel=1e-6)


@pytest.mark.parametrize("gap", [0.9, 0.5, 0.2, 0.1])
def test_shares_are_below_the_tolerance(gap):
    """Those of the module's docstring, times the factor."""
    factor, penalties = expected(gap * H), Penalties()
    assert 12.0 * penalties.extension * factor / gap**3 <= film.SHARE_OF_FILM * (1 + 1e-12)
    assert 3.0 * penalties.extension * factor / gap**3 <= film.SHARE_OF_FILM


def test_least_factor():
    """It falls no more below a tenth of a cell, where Nitsche's method is still coercive by itself.

    In a film u_y is linear, u_y^2 <= 4/g int u_y^2 dy at a wall, hence 4/g < gamma C_T / h.
    """
    assert scene(plate("plate", 1e-5, 0.4)).cut.film.min() == pytest.approx(expected(0.1 * H), rel=1e-6)
    assert 4.0 / (Penalties().nitsche * TRACE[2, 2]) < film.LEAST_RATIO


def moving(speed=-0.4):
    down = np.array([0.0, speed])
    return scene(
        body("disc", circle([0.5, 0.35], 0.22, 100), loop(100), motion=lambda x, t: (x + t * down, 0 * x + down)),
        scheme="bdf2", convection=True, dt=0.02, mu=0.1,
    )  # fmt: skip


def test_flow_without_films_is_the_same_bit_for_bit():
    """As without the search, and the form that leaves out the PSPG term is not even compiled."""
    flows = []
    for films in (True, False):
        fluid = moving(speed=0.1)
        if not films:
            fluid.parts.cutter.films = None
        for number in range(3):
            step(fluid, 0.02 * number, 0.02)
        assert fluid.cut.film is None
        assert all(form.compiled is None for form in (fluid.system.forms.residuals[2], fluid.system.forms.tangents[2]))
        flows.append(fluid.flow.copy())
    assert np.array_equal(*flows)


def test_films_are_those_of_the_first_cut_of_a_step():
    fluid = moving()
    at = [fluid.moving.motions[0]]
    for number in range(8):
        step(fluid, 0.02 * number, 0.02)
        at.append(fluid.moving.motions[0])
    cutter, facets = fluid.parts.cutter, fluid.cut.facets
    cutter.begin_step()
    assert cutter(facets, at[0], 1).film is None
    assert cutter(facets, at[-1], 1).film is None
    cutter.begin_step()
    first = cutter(facets, at[-1], 1).film
    assert first.min() < 1.0
    assert np.array_equal(cutter(facets, at[-2], 1).film, first)


def test_results_do_not_depend_on_the_tolerance(monkeypatch):
    """A disc of a radius of 2.2 cells that falls on the wall, down to 0.2 cells: the force is the same to 3 %."""
    forces = []
    for share in (1e-2, 1e-3, 1e-5):
        monkeypatch.setattr(film, "SHARE_OF_FILM", share)
        fluid = moving()
        for number in range(14):
            step(fluid, 0.02 * number, 0.02)
        forces.append(fluid.force()["disc"].sum(axis=0)[1])
    assert forces == pytest.approx([forces[0]] * 3, rel=0.03)
    assert forces[0] > 0.0


def test_momentum_and_power_in_films():
    """What bodies get is what the whole fluid loses. The disc has 2.2 cells: the method takes 42 % of its power.

    It took 68 % when the stabilisation was that of other cells.
    """
    fluid = moving()
    for number in range(13):
        step(fluid, 0.02 * number, 0.02)
    assert fluid.cut.film.min() < 1e-3
    force, power, _ = fluid.balances()
    assert force == pytest.approx(fluid.force()["disc"].sum(axis=0), rel=1e-9, abs=1e-9)
    assert 0.0 < power < 0.45 * 0.4 * force[1]


def test_tangent_of_a_film():
    """Newton's method takes one step for Stokes' equations; the tangent is the derivative of the residual."""
    fluid = scene(plate("lower", 0.2, 0.43), body("disc", circle([0.5, 0.7], 0.25, 100), loop(100), velocity=[0, -1]))
    assert fluid.cut.film.min() < 1.0
    assert solve_steady(fluid).iterations == 1
    before = fluid.system.residual()
    rng = np.random.default_rng(1)
    change = np.where(fluid.iterate.held, 0.0, rng.standard_normal(fluid.unknowns.owned))
    matrix = fluid.linearise()
    u, out = matrix.createVecs()
    u.array[:] = change
    matrix.mult(u, out)
    fluid.flow[: len(change)] += change
    free = ~fluid.iterate.held
    after = fluid.system.residual()
    np.testing.assert_allclose((after - before)[free], out.array[free], atol=1e-9 * np.abs(out.array).max())


@pytest.mark.parametrize("gap", [0.05, 0.01, 0.001])
def test_films_are_coercive(gap):
    """The velocity's part of Stokes' matrix, symmetric with Nitsche's method, is positive definite.

    With the Nitsche penalty of other cells the least eigenvalue, over the matrix' diagonal, is -6 to -9 at a gap of
    0.01, and Newton's method failed in contact.
    """
    fluid = scene(
        body("disc", circle([0.517, 0.3 + gap], 0.3, 200), loop(200), velocity=np.array([0.0, -1.0])), walls=("y-",)
    )
    fluid.follow()
    fluid.residual()
    matrix = fluid.linearise()
    start, columns, values = matrix.getValuesCSR()
    dense = csr_matrix((values, columns, start), matrix.getSize()).toarray()
    free = ~fluid.iterate.held & fluid.unknowns.velocity_mask[: len(fluid.iterate.held)]
    dense = dense[free][:, free]
    size = np.sqrt(np.abs(np.diag(dense)))
    assert np.abs(dense - dense.T).max() <= 1e-9 * np.abs(dense).max()
    assert np.linalg.eigvalsh(dense / np.outer(size, size))[0] > 1e-6


def test_least_penalty_of_nitsche_in_films():
    """4 over the height of the fluid on the surface: two pieces in one cell, a sliver; none outside of films."""
    cell, area, volume = np.array([0, 0, 1, 2]), np.array([0.5, 1.0, 1.0, 1.0]), np.array([0.3, 0.3, 1e-3, 0.4])
    found = film.coercive(np.array([True, True, True, False]), cell, volume, area)
    assert found == pytest.approx([20.0, 20.0, 4e3, 0.0])


def test_penalty_in_films_has_no_convection():
    """gamma eps (g/h)^3 / (12 gamma) (mu + rho alpha h^2) at nodes with hardly any fluid, in cells of 0.1.

    The velocity of the past is 1e4 there, with which rho |a| h would be 1e3 mu; rho alpha h^2 is 10 mu.
    """
    gap, alpha = 0.02, 1e3
    penalty = scene(
        plate("plate", gap, 0.4), walls=("y-",), scheme="backward_euler", convection=True, mu=1.0
    ).system.cut_penalty
    unknowns = penalty.unknowns
    fast = np.full(len(unknowns.velocity.dofs), 1e4)
    penalty.set_scales(Scales(1.0, 1.0, alpha, np.full(len(unknowns.grid.numbers), 1e4), fast))
    nodes = unknowns.velocity
    above = np.flatnonzero(np.linalg.norm(nodes.points - [0.3, 0.1], axis=1) < 1e-9)
    wanted = Penalties().extension * expected(gap) * (1.0 + alpha * H**2)
    assert penalty.penalties()[nodes.dofs[above]] == pytest.approx(wanted, rel=1e-6)
