"""Bodies with massless surfaces move as rigid bodies with all of their mass."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from contact_setup import make_body, make_contact, turned
from scipy.spatial.transform import Rotation
from structure_setup import CELL_TYPES, block, constant
from test_contact_start import TIGHT, advance

from fsci import shapes
from solvers.algebra.blocks import times
from solvers.contact.surface import Surface
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.dynamics import Dynamics
from solvers.structure.loads import Traction
from solvers.structure.materials import NeoHooke, StVenantKirchhoff
from solvers.structure.probes import of_bodies
from solvers.structure.rayleigh import Damping

TRAPEZOIDAL = Dynamics(GeneralisedAlpha.from_rho_inf(1.0))
FAR = {
    2: Surface("wall", np.array([[99.0, 9.0], [99.0, -9.0]]), np.array([[0, 1]]), "line", None),
    3: Surface("wall", np.array([[99.0, 0, 0], [99.0, 9, 0], [99.0, 0, 9]]), np.array([[0, 2, 1]]), "triangle", None),
}
STIFF = StVenantKirchhoff(4e5, 6e5, 2.0)


def beside_a_wall(mesh, *, on="left", material=STIFF, time=TRAPEZOIDAL, **loads):
    """A structure of one body whose pair never touches."""
    body = make_body("body", mesh, material, **loads)
    return make_contact([body], [(("body", on), FAR[body.dim])], time=time, settings=TIGHT)[0]


def probe(structure, quantity):
    return np.array(list(of_bodies(structure, structure.bodies, quantity)().values()))


def spins(omega, centre, v=(0.0, 0.0, 0.0)):
    """The velocity v + omega x (X - centre) as functions of position."""
    omega = np.asarray(omega)

    def component(i, dim=len(centre)):
        def value(x, t):
            arm = np.zeros((x.shape[1], 3))
            arm[:, :dim] = x[:dim].T - np.asarray(centre)
            return v[i] + np.cross(omega, arm)[:, i]

        return value

    return tuple(component(i) for i in range(len(centre)))


@pytest.mark.parametrize("cells", [1, 3])
@pytest.mark.parametrize("cell_type", CELL_TYPES)
def test_rigid_motion_has_the_inertia_of_the_true_mass(cell_type, cells):
    """Energy and momenta of a body that has moved and turned, and moves and turns; one cell across, too."""
    mesh = block(cell_type, cells)
    mesh = replace(mesh, points=mesh.points * [1.0, 0.7, 0.5][: mesh.points.shape[1]])
    structure = beside_a_wall(mesh)
    dim, body = structure.dim, structure.bodies[0]
    X = body.points[:dim, : body.owned].T
    R = Rotation.from_rotvec([0.3, -0.7, 1.9] if dim == 3 else [0, 0, 1.9]).as_matrix()[:dim, :dim]
    x = X @ R.T + np.array([3.0, -2.0, 5.0])[:dim]
    omega = np.array([0.4, -1.1, 2.0]) * ([0, 0, 1] if dim == 2 else 1)
    arms = np.pad(x, ((0, 0), (0, 3 - dim)))
    v = (np.array([1.0, 2.0, -3.0]) + np.cross(omega, arms))[:, :dim]
    structure.now.u[:], structure.now.v[:] = (x - X).ravel(), v.ravel()
    structure._assemble_bodies()
    p = times(body.mass(), v.ravel())
    assert structure.time.kinetic_energy(structure) == pytest.approx(0.5 * p @ v.ravel(), rel=1e-12)
    assert probe(structure, "momentum") == pytest.approx(p.reshape(-1, dim).sum(axis=0), rel=1e-11, abs=1e-12)
    spin = np.cross(arms, np.pad(p.reshape(-1, dim), ((0, 0), (0, 3 - dim)))).sum(axis=0)
    assert probe(structure, "angular_momentum") == pytest.approx(spin[2:] if dim == 2 else spin, rel=1e-11, abs=1e-12)
    centre = times(body.mass(), x.ravel()).reshape(-1, dim).sum(axis=0) / probe(structure, "mass")
    assert probe(structure, "centre") == pytest.approx(centre, rel=1e-12)


def disturbed(dim, cells=2):
    """A structure in a deformed state, with velocities and accelerations, and the pieces of its random state."""
    rng = np.random.default_rng(dim)
    structure = beside_a_wall(block("quad" if dim == 2 else "hexahedron", cells), material=NeoHooke(400.0, 600.0, 2.0))
    now = structure.now
    now.u[:], now.v[:], now.a[:] = (s * rng.standard_normal(len(now.u)) for s in (0.03, 1.0, 3.0))
    structure._assemble_bodies()
    return structure


@pytest.mark.parametrize("dim", [2, 3])
def test_resultants_and_power(dim):
    structure = disturbed(dim)
    rigid, frame, now = structure.inertia.find_rigid(), structure.inertia.frame, structure.now
    rng = np.random.default_rng(7)
    force, couple = rng.standard_normal((2, 1, 3))
    if dim == 2:
        force[:, 2], couple[:, :2] = 0.0, 0.0
    f = rigid.on_nodes(frame, force, couple)
    assert not f[structure.inertia.find_massless()].any()
    in_space = np.pad(f.reshape(-1, dim), ((0, 0), (0, 3 - dim)))
    assert in_space.sum(axis=0) == pytest.approx(force[0], rel=1e-12, abs=1e-14)
    assert np.cross(frame.arms, in_space).sum(axis=0) == pytest.approx(couple[0], rel=1e-11, abs=1e-13)
    V, omega = rigid.velocities(frame, now.v)
    assert f @ now.v == pytest.approx(float(np.sum(force * V + couple * omega)), rel=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_energy_is_that_of_a_symmetric_matrix_without_negative_values(dim):
    structure = disturbed(dim, cells=1)
    rigid, frame, n = structure.inertia.find_rigid(), structure.inertia.frame, len(structure.now.u)
    matrix = np.array([times(structure.inertia.assemble_mass(), e) + rigid.times(frame, e) for e in np.eye(n)])
    values = np.linalg.eigvalsh(matrix)
    assert np.abs(matrix - matrix.T).max() < 1e-14 * values.max()
    assert values.min() > -1e-14 * values.max()
    assert np.count_nonzero(values > 1e-9 * values.max()) == n - len(structure.inertia.find_massless())
    v = structure.now.v
    assert structure.time.kinetic_energy(structure) == pytest.approx(0.5 * v @ matrix @ v, rel=1e-13)


@pytest.mark.parametrize("dim", [2, 3])
def test_force_is_the_rate_of_the_momenta(dim):
    """Both formulas, by accelerations and by momenta at both ends of a step, for a body that turns ever faster."""
    structure = disturbed(dim)
    rigid, u = structure.inertia.find_rigid(), structure.now.u.copy()
    axis = np.array([0.6, 0.0, 0.8] if dim == 3 else [0.0, 0.0, 1.0])
    X = np.concatenate([body.points[:dim, : body.owned].T for body in structure.bodies])
    x = np.pad(X + u.reshape(-1, dim), ((0, 0), (0, 3 - dim)))

    def motion(t):
        """Displacement, velocity and acceleration."""
        turned = x @ Rotation.from_rotvec((1.3 * t + 2.0 * t**2) * axis).as_matrix().T
        speed = 1.3 + 4.0 * t
        v = speed * np.cross(axis, turned)
        a = speed * np.cross(axis, v) + 4.0 * np.cross(axis, turned) + np.array([1.0, -2.0, 3.0])
        moved = turned + 0.5 * t**2 * np.array([1.0, -2.0, 3.0])
        v = v + t * np.array([1.0, -2.0, 3.0])
        return ((moved[:, :dim] - X).ravel(), v[:, :dim].ravel(), a[:, :dim].ravel())

    def exact(t):
        u, v, a = motion(t)
        return rigid.force_by_acceleration(rigid.frame(u), v, a)

    errors = []
    for h in (1e-3, 5e-4):
        u, v, a = motion(h)
        start = motion(-h)
        before = rigid.momenta(rigid.frame(start[0]), *start[1:], exact(-h))
        stepped = rigid.force(rigid.frame(u), v, a, before, 2.0 * h, 0.5)
        errors.append(np.abs(0.5 * (stepped + exact(-h)) - exact(0.0)).max() / np.abs(exact(0.0)).max())
    assert errors[1] < 1e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("rho_inf", [1.0, 0.6])
@pytest.mark.parametrize("dim", [2, 3])
def test_tangent(dim, rho_inf):
    """Against finite differences of the balance; what is left out is of first order in the rotation of a step."""
    errors = []
    for dt in (1e-2, 1e-3):
        time = Dynamics(GeneralisedAlpha.from_rho_inf(rho_inf), damping=Damping(0.3, 0.0))
        structure = beside_a_wall(block("quad" if dim == 2 else "hexahedron", 2), time=time)
        rng = np.random.default_rng(3)
        structure.now.v[:] = rng.standard_normal(len(structure.now.v))
        structure.initialise(0.0, dt)
        structure.begin_step(0.0, dt)
        structure.now.u += dt * structure.now.v
        structure.residual()
        K, added = structure.linearise(), structure.added_product()
        du, h = rng.standard_normal(len(structure.now.u)), 1e-4 * dt
        # inertia alone: internal forces have their own test
        found = times(K, du) + added(du)
        without = structure.residual_force.copy()
        u, ends = structure.now.u.copy(), []
        for s in (h, -h):
            structure.now.u[:] = u + s * du
            structure.residual()
            ends.append(structure.residual_force.copy())
        wanted = (ends[0] - ends[1]) / (2.0 * h)
        assert np.isfinite(without).all()
        errors.append(np.abs(found - wanted).max() / np.abs(added(du)).max())
    assert errors[0] < 0.2
    assert errors[1] < 0.2 * errors[0]


def test_a_disc_spins_as_without_the_pair():
    """Angular momentum of the polygon with 32 sides: int r^2 dX; it stays."""
    mesh = shapes.disc(1.0, [32, 3])
    structure = beside_a_wall(
        mesh, on="outer", material=NeoHooke(4e5, 6e5, 1.0), initial_velocity=spins([0, 0, 1.0], (0.0, 0.0))
    )
    spin = [probe(structure, "angular_momentum")[0] for _ in advance(structure, 0.01, 10)]
    assert np.array(spin) == pytest.approx(1.5507, rel=1e-4)


def euler(principal, omega, end, steps=20_000):
    """Angular velocity in the frame of a free rigid body, by Runge and Kutta, and the frame."""
    dt, R = end / steps, np.eye(3)

    def rate(w):
        return np.cross(principal * w, w) / principal

    for _ in range(steps):
        k1 = rate(omega)
        k2 = rate(omega + 0.5 * dt * k1)
        k3 = rate(omega + 0.5 * dt * k2)
        k4 = rate(omega + dt * k3)
        R = R @ Rotation.from_rotvec(dt * (omega + 0.25 * dt * (k1 + k2))).as_matrix()
        omega = omega + dt / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4)
    return omega, R


def test_a_box_tumbles_as_a_rigid_body():
    """About its middle axis, which is not stable; massless on one side, so that centre and axes of the mass move."""
    size, density = np.array([1.0, 0.7, 0.4]), 2.0
    mesh = shapes.box(list(size), [2, 2, 2])
    omega = np.array([0.3, 2.0, 0.2])
    structure = beside_a_wall(mesh, initial_velocity=spins(omega, size / 2.0))
    principal = density * size.prod() / 12.0 * np.array([s @ s - t**2 for t in size for s in [size]])
    *_, _ = advance(structure, 0.01, 100)
    _, R = euler(principal, omega, 1.0)
    start = principal * omega
    assert probe(structure, "angular_momentum") == pytest.approx(start, rel=2e-3)
    assert probe(structure, "momentum") == pytest.approx(np.zeros(3), abs=1e-8)
    assert probe(structure, "centre") == pytest.approx(size / 2.0, abs=1e-5)
    corner = structure.bodies[0].points[:, : structure.bodies[0].owned].T
    moved = corner + structure.now.u.reshape(-1, 3) - size / 2.0
    assert moved == pytest.approx((corner - size / 2.0) @ R.T, abs=0.01)


@pytest.mark.parametrize("cells", [1, 2])
def test_a_thin_block_pulled_through_its_centre_does_not_turn(cells):
    """One cell across, and its contact surface is below; the weight acts in its centre, too."""
    mesh = shapes.rectangle([1.0, 0.5], [8, cells])
    pull = Traction("right", (constant(20.0), constant(0.0)))
    gravity = (constant(0.0), constant(-3.0))
    structure = beside_a_wall(mesh, on="bottom", material=NeoHooke(4e5, 6e5, 2.0), tractions=[pull], gravity=gravity)
    *_, _ = advance(structure, 0.005, 40)
    t, force, mass = 0.2, 10.0, 1.0
    assert probe(structure, "centre") == pytest.approx([0.5 + 0.5 * force / mass * t**2, 0.25 - 1.5 * t**2], abs=1e-9)
    body = structure.bodies[0]
    ends = structure.now.u.reshape(-1, 2)[body.points[0, : body.owned] < 1e-9][[0, -1]]
    assert ends[0] == pytest.approx(ends[1], abs=2e-4)


@pytest.mark.parametrize(
    ("cell_type", "rho_inf"),
    [
        ("quad", 1.0),
        ("hexahedron", 0.5),
        *(pytest.param(*other, marks=pytest.mark.slow) for other in (("quad", 0.5), ("hexahedron", 1.0))),
    ],
)
def test_one_cell_with_contact_on_all_sides(cell_type, rho_inf):
    """No node can be massless: it keeps all of its momentum, bounces off a wall, and gains no energy."""
    dim, time = (2 if cell_type == "quad" else 3), Dynamics(GeneralisedAlpha.from_rho_inf(rho_inf))
    flies = (constant(1.0), *[constant(0.2)] * (dim - 1))
    body = make_body("body", block(cell_type, 1), NeoHooke(400.0, 600.0, 2.0), initial_velocity=flies)
    near = FAR[dim]
    points = near.points.copy()
    points[:, 0] = 1.1
    points[:, 1:] = 20.0 * (points[:, 1:] - 3.0)
    wall = replace(near, points=points)
    sides = ["left", "right", "bottom", "top", *(["front", "back"] if dim == 3 else [])]
    structure, _ = make_contact([body], [(("body", side), wall) for side in sides], time=time, settings=TIGHT)
    energies, momenta = [], []
    for _ in advance(structure, 0.005, 80):
        energies.append(structure.energy.kinetic + structure.energy.internal)
        momenta.append(probe(structure, "momentum"))
    assert not len(structure.inertia.find_massless())
    assert momenta[10] == pytest.approx([2.0, *[0.4] * (dim - 1)], rel=1e-9)
    assert -2.0 < momenta[-1][0] < -0.5
    assert momenta[-1][1:] == pytest.approx([0.4] * (dim - 1), rel=1e-9)
    assert max(energies) < energies[0] * (1.0 + 1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_pieces_move_each_for_itself(dim):
    """A body of two pieces: the one that spins does not turn the other, and each keeps its momentum."""
    first = block("quad" if dim == 2 else "hexahedron", 2)
    shift = np.array([2.0, 0.0, 0.0])[:dim]
    points = np.concatenate([first.points, first.points + shift])
    more = {name: np.concatenate([f, f + len(first.points)]) for name, f in first.surfaces.items()}
    mesh = replace(
        first, points=points, cells=np.concatenate([first.cells, first.cells + len(first.points)]), surfaces=more
    )
    turning = spins([0, 0, 2.0], (0.5,) * dim)
    only = tuple(partial(lambda f, x, t: np.where(x[0] < 1.5, f(x, t), 0.0), f) for f in turning)
    structure = beside_a_wall(mesh, initial_velocity=only)
    *_, _ = advance(structure, 0.01, 10)
    u = structure.now.u.reshape(-1, dim)
    second = structure.bodies[0].points[0, : structure.bodies[0].owned] > 1.5
    assert np.abs(u[second]).max() < 1e-13
    assert np.abs(u[~second]).max() > 0.1
    assert probe(structure, "angular_momentum")[-1] == pytest.approx(2.0 * 2.0 / 6.0, rel=1e-3)


def test_scale_does_not_matter():
    """The same block in millimetres and metres."""
    found = []
    for scale in (1.0, 1e-3):
        mesh = turned(shapes.rectangle([1.0, 0.5], [4, 1]), np.eye(2))
        mesh = replace(mesh, points=mesh.points * scale)
        material = NeoHooke(4e3, 6e3, 2.0 / scale**2)
        structure = beside_a_wall(
            mesh, on="bottom", material=material, initial_velocity=spins([0, 0, 2.0], (0.5 * scale, 0.25 * scale))
        )
        *_, _ = advance(structure, 0.01, 20)
        found.append(structure.now.u / scale)
    assert found[1] == pytest.approx(found[0], abs=1e-9)
