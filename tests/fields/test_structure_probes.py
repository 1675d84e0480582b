"""What is measured is what was applied: resultants, means and integrals with known values, and errors of probes."""

from dataclasses import replace

import numpy as np
import pytest
from advised import require_advice
from structure_setup import TIGHT, block, constant, load_step, make_structure, vector

from fsci import shapes
from solvers import fem
from solvers.api import FailureKind, StepFailed
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure import probes
from solvers.structure.body import Pressure, Support, Symmetry, Traction
from solvers.structure.dynamics import Dynamics
from solvers.structure.materials import NeoHooke, StVenantKirchhoff
from solvers.structure.supports import SupportError

MATERIAL = NeoHooke(30.0, 50.0, 2.0)


def body_probe(structure, quantity):
    return probes.of_bodies(structure, structure.bodies, quantity)()


def surface_probe(structure, quantity, surface):
    return probes.on_surface(structure, structure.bodies[0], quantity, surface)()


def test_reaction_is_the_load():
    structure = make_structure(
        block("hexahedron", 2),
        MATERIAL,
        supports=[Support("bottom", vector(0, 0, 0))],
        tractions=[Traction("top", vector(0.5, 0.2, -1.0))],
        body_force=vector(0.0, 0.1, 0.0),
    )
    load_step(structure)
    reaction = surface_probe(structure, "reaction", "bottom")
    assert list(reaction.values()) == pytest.approx([-0.5, -0.3, 1.0], abs=1e-10)


def test_traction_is_the_load():
    """int P N dA over the loaded end of a bar in uniaxial tension, and over the free side."""
    structure = make_structure(
        block("quad9", 2),
        MATERIAL,
        supports=[Support("left", (constant(0), None)), Support("bottom", (None, constant(0)))],
        tractions=[Traction("right", vector(3.0, 0.0))],
    )
    load_step(structure)
    assert surface_probe(structure, "traction", "right")["x"] == pytest.approx(3.0, rel=1e-10)
    assert surface_probe(structure, "traction", "left")["x"] == pytest.approx(-3.0, rel=1e-10)
    assert abs(surface_probe(structure, "traction", "top")["y"]) < 1e-10


def test_all_directions_share_a_form(monkeypatch):
    """A mean has one for the area besides."""
    structure = make_structure(block("tetra10", 2), MATERIAL)
    compiled, original = [], fem.compile_form
    monkeypatch.setattr(fem, "compile_form", lambda form, *more: compiled.append(form) or original(form, *more))
    surface_probe(structure, "displacement", "top")
    surface_probe(structure, "traction", "top")
    assert len(compiled) == 3


def test_homogeneous_deformation():
    """u = G x: mean displacement, volume, centre and values between nodes follow from G alone."""
    structure = make_structure(block("tetra10", 2), MATERIAL)
    gradient = np.array([[0.1, 0.2, 0.0], [0.0, -0.1, 0.3], [0.1, 0.0, 0.2]])
    body = structure.bodies[0]
    structure.now.u[:] = (body.points[:, : body.owned].T @ gradient.T).ravel()
    body.set_displacement(structure.now.u)
    assert list(surface_probe(structure, "displacement", "top").values()) == pytest.approx(gradient @ [0.5, 0.5, 1.0])
    assert surface_probe(structure, "area", "top")[""] == pytest.approx(1.0)
    assert body_probe(structure, "volume")[""] == pytest.approx(np.linalg.det(np.eye(3) + gradient))
    assert body_probe(structure, "mass")[""] == pytest.approx(2.0)
    middle = np.array([0.5, 0.5, 0.5])
    assert list(body_probe(structure, "centre").values()) == pytest.approx(middle + gradient @ middle)
    point = np.array([0.31, 0.77, 0.12])
    at_point = probes.at_point(structure, body, "displacement", point)
    assert list(at_point().values()) == pytest.approx(gradient @ point)


def test_rigid_spin():
    """v = omega x r: momentum m v_c, angular momentum about the origin, kinetic energy, point velocity."""
    omega, square = 3.0, block("quad", 4)
    structure = make_structure(
        square,
        StVenantKirchhoff(30.0, 50.0, 2.0),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)),
        initial_velocity=(lambda x, t: -omega * x[1], lambda x, t: omega * x[0]),
    )
    structure.initialise(0.0, 0.1)
    inertia = 2.0 * (1 / 3 + 1 / 3)  # of the unit square about its corner
    assert list(body_probe(structure, "momentum").values()) == pytest.approx([-omega * 1.0, omega * 1.0])
    assert body_probe(structure, "angular_momentum")[""] == pytest.approx(inertia * omega)
    assert body_probe(structure, "energy")["kinetic"] == pytest.approx(0.5 * inertia * omega**2)
    velocity = probes.at_point(structure, structure.bodies[0], "velocity", [0.3, 0.9])()
    assert list(velocity.values()) == pytest.approx([-omega * 0.9, omega * 0.3])


def test_point_outside():
    structure = make_structure(block("triangle6", 2), MATERIAL)
    with pytest.raises(probes.PointOutside, match=r"the point \(1.5, 0.5\) is not in body 'body'"):
        probes.at_point(structure, structure.bodies[0], "displacement", [1.5, 0.5])


def test_symmetry_needs_a_plane():
    ring = shapes.ring(1.0, 2.0, [8, 1])
    with pytest.raises(SupportError, match="body 'body', surface 'outer': a plane of symmetry must be plane"):
        make_structure(ring, MATERIAL, supports=[Symmetry("outer")])


def test_symmetry_holds_the_normal_component():
    """A quarter of a plate under uniaxial tension: planes of symmetry let it slide along themselves."""
    mesh = block("quad", 3)
    structure = make_structure(
        mesh,
        MATERIAL,
        supports=[Symmetry("left"), Symmetry("bottom")],
        tractions=[Traction("right", vector(3.0, 0.0))],
        settings=TIGHT,
    )
    load_step(structure)
    left = surface_probe(structure, "displacement", "left")
    assert left["x"] == pytest.approx(0.0, abs=1e-14)
    assert left["y"] < -1e-3
    assert surface_probe(structure, "traction", "right")["x"] == pytest.approx(3.0, rel=1e-10)


def test_reaction_to_pressure():
    """Follower pressure all around cancels on the deformed closed surface, whatever its shape."""
    mesh = shapes.box([2, 1, 1], [4, 2, 2])
    structure = make_structure(
        mesh,
        MATERIAL,
        supports=[Support("left", vector(0, 0, 0))],
        tractions=[Traction("right", vector(0, 0, -1))],
        pressures=[Pressure(name, constant(2.0)) for name in mesh.surfaces],
    )
    load_step(structure)
    assert np.abs(structure.now.u).max() > 0.2
    reaction = surface_probe(structure, "reaction", "left")
    assert list(reaction.values()) == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)


def test_area_of_a_curved_surface():
    """A circle of 32 parabolas."""
    structure = make_structure(shapes.disc(1.5, [32, 4], order=2), MATERIAL)
    assert surface_probe(structure, "area", "outer")[""] == pytest.approx(2 * np.pi * 1.5, rel=2e-6)


def moving(mesh, velocity, density=2.0, displacement=None):
    structure = make_structure(
        mesh,
        StVenantKirchhoff(1.0, 1.0, density),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)),
        initial_velocity=velocity,
        initial_displacement=displacement,
    )
    structure.initialise(0.0, 0.1)
    return structure


def test_mass_of_a_graded_body():
    """The density 1 + x is taken at the middle of cells: exact for a linear one."""
    structure = moving(shapes.box([2, 1, 1], [5, 2, 2]), vector(1, 0, 0), density=lambda x, t: 1.0 + x[0])
    assert body_probe(structure, "mass")[""] == pytest.approx(4.0, rel=1e-13)
    assert body_probe(structure, "momentum")["x"] == pytest.approx(4.0, rel=1e-13)


def test_rigid_spin_in_space():
    """L = I w + m c x v of a box of 1 x 2 x 3 that turns about its centre and flies, away from where it was meshed."""
    w, v, shift = np.array([0.5, -1.0, 2.0]), np.array([1.0, 3.0, -2.0]), np.array([3.0, -1.0, 2.0])
    middle, mass = np.array([0.5, 1.0, 1.5]), 12.0
    structure = moving(
        shapes.box([1, 2, 3], [2, 2, 2]),
        tuple(lambda x, t, i=i: v[i] + np.cross(w, x.T - middle)[:, i] for i in range(3)),
        displacement=vector(*shift),
    )
    inertia = mass / 12.0 * np.array([2**2 + 3**2, 1 + 3**2, 1 + 2**2])
    expected = inertia * w + mass * np.cross(middle + shift, v)
    assert list(body_probe(structure, "momentum").values()) == pytest.approx(mass * v, rel=1e-12)
    assert list(body_probe(structure, "centre").values()) == pytest.approx(middle + shift, rel=1e-12)
    assert list(body_probe(structure, "angular_momentum").values()) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("cell_type", ["triangle6", "quad9"])
def test_points_between_nodes(cell_type):
    """Corners, edges and inside of cells: a quadratic motion is met exactly."""
    u = (lambda x, t: 0.1 * x[0] ** 2 - 0.2 * x[1], lambda x, t: 0.3 * x[0] * x[1] + 0.05)
    v = (lambda x, t: x[1] ** 2 + x[0], lambda x, t: 2.0 - x[0] * x[1])
    structure = moving(block(cell_type, 4), v, displacement=u)
    for point in np.array([[0, 0], [1, 1], [0.5, 0.25], [0.123, 0.877], [0.999, 0.001], [1, 0.4321], [0.25, 0.5]]):
        for quantity, field in (("displacement", u), ("velocity", v)):
            expected = [component(point[:, None], 0.0)[0] for component in field]
            value = probes.at_point(structure, structure.bodies[0], quantity, point)()
            assert list(value.values()) == pytest.approx(expected, rel=1e-12, abs=1e-13)


def test_acceleration_of_a_falling_body():
    structure = make_structure(
        block("tetra", 1), MATERIAL, time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)), gravity=vector(0, 0, -9.81)
    )
    structure.initialise(0.0, 0.1)
    value = probes.at_point(structure, structure.bodies[0], "acceleration", [0.2, 0.3, 0.4])()
    assert list(value.values()) == pytest.approx([0, 0, -9.81], rel=1e-10, abs=1e-10)


def test_hole_is_outside():
    structure = make_structure(shapes.tube(1.0, 2.0, 1.0, [12, 1, 1]), MATERIAL)
    with pytest.raises(probes.PointOutside):
        probes.at_point(structure, structure.bodies[0], "displacement", (0.1, 0.0, 0.5))


@pytest.mark.parametrize("cell_type", ["quad", "hexahedron"])
@pytest.mark.parametrize("law", [MATERIAL, StVenantKirchhoff(30.0, 50.0, 2.0)])
def test_a_body_that_nothing_holds(cell_type, law):
    """A static problem without supports has no solution: the message asks for them, whatever rounding makes of it."""
    mesh = block(cell_type, 2)
    load = vector(*[0.1] * mesh.points.shape[1])
    structure = make_structure(mesh, law, tractions=[Traction("top", load)])
    with pytest.raises(StepFailed, match="is a body not supported") as failed:
        load_step(structure)
    require_advice(failed.value, FailureKind.UNSUPPORTED)


@pytest.mark.parametrize("scale", [1e-5, 1e-8])
def test_point_of_a_tiny_body(scale):
    """Lengths are relative to the body: an absolute distance once lost the points of a body of 1e-5 m."""
    mesh = block("quad", 2)
    structure = make_structure(replace(mesh, points=scale * mesh.points), MATERIAL)
    structure.now.u[:] = structure.bodies[0].points[:2].T.ravel()
    for point in ([0.3, 0.9], [1.0, 1.0], [0.25, 0.5]):
        found = probes.at_point(structure, structure.bodies[0], "displacement", scale * np.array(point))()
        assert list(found.values()) == pytest.approx(scale * np.array(point), rel=1e-12)
    with pytest.raises(probes.PointOutside):
        probes.at_point(structure, structure.bodies[0], "displacement", [1.01 * scale, 0.5 * scale])
