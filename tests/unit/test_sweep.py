"""Volumes that facets sweep, and the velocities whose flux they are."""

import numpy as np
import pytest

from solvers.fluid.flow.conservation.cavities import enclosed
from solvers.fluid.settings.time_scheme import SCHEMES
from solvers.fluid.surfaces.sweep import Sweep, swept
from solvers.mesh.tessellation import area_vectors

STEPS = (0.1, 0.07, 0.13)


def body(dim, rng):
    """A closed surface: vertices, facets."""
    if dim == 2:
        angles = np.linspace(0.0, 2.0 * np.pi, 7, endpoint=False)
        points = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        facets = np.stack([np.arange(7), np.roll(np.arange(7), -1)], axis=1)
    else:
        points = np.concatenate([np.eye(3), -np.eye(3)])
        facets = np.array([[i, j, k] for i in (0, 3) for j in (1, 4) for k in (2, 5)])
        inward = np.einsum("fk,fk->f", area_vectors(points[facets]), points[facets].mean(axis=1)) < 0.0
        facets[inward] = facets[inward][:, ::-1]
    return points + 0.1 * rng.normal(size=points.shape), facets


def moved(dim, scheme, rng):
    """(sweep, facets, positions now, their velocity, difference formula, volumes newest first)."""
    x, facets = body(dim, rng)
    difference = SCHEMES[scheme].difference(0.1, STEPS)
    positions = [x + 0.2 * rng.normal(size=x.shape) for _ in range(1 + SCHEMES[scheme].times)]
    sweep = Sweep(SCHEMES[scheme].times)
    for earlier in reversed(positions[1:]):
        sweep.begin_step(earlier)
    return sweep, facets, positions, difference


def rate(difference, values):
    return difference.alpha * values[0] - sum(b * v for b, v in zip(difference.beta, values[1:], strict=False))


@pytest.mark.parametrize("dim", [2, 3])
def test_swept_volume_is_the_change_of_the_enclosed_one(dim):
    rng = np.random.default_rng(1)
    x, facets = body(dim, rng)
    later = x + 0.5 * rng.normal(size=x.shape)
    change = enclosed(later, facets) - enclosed(x, facets)
    assert swept(x[facets], later[facets]).sum() == pytest.approx(change, rel=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("scheme", ["backward_euler", "bdf2", "bdf2_optimized"])
def test_flux_is_the_rate_of_the_volume(dim, scheme):
    rng = np.random.default_rng(2)
    sweep, facets, positions, difference = moved(dim, scheme, rng)
    for v in (rate(difference, positions), rng.normal(size=positions[0].shape)):  # coupled and prescribed bodies
        g = v[facets].mean(axis=1) + sweep.velocity(facets, positions[0], v, difference)
        flux = (area_vectors(positions[0][facets]) * g).sum()
        volumes = [enclosed(x, facets) for x in positions]
        assert flux == pytest.approx(rate(difference, volumes), rel=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("scheme", ["backward_euler", "bdf2", "bdf2_optimized"])
def test_derivative_by_the_motion(dim, scheme):
    rng = np.random.default_rng(3)
    sweep, facets, positions, difference = moved(dim, scheme, rng)

    def velocity(x):
        return sweep.velocity(facets, x, rate(difference, [x, *positions[1:]]), difference)

    x, way = positions[0], rng.normal(size=positions[0].shape)
    slope = sweep.by_motion(facets, x, rate(difference, positions), difference)
    found = np.einsum("fkcj,fcj->fk", slope, way[facets])
    expected = (velocity(x + 1e-6 * way) - velocity(x - 1e-6 * way)) / 2e-6
    assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()


@pytest.mark.parametrize("scheme", ["backward_euler", "bdf2"])
def test_translation_needs_no_correction(scheme):
    rng = np.random.default_rng(4)
    x, facets = body(2, rng)
    difference = SCHEMES[scheme].difference(0.1, STEPS)
    positions = [x + rng.normal(size=2) for _ in range(3)]
    sweep = Sweep(SCHEMES[scheme].times)
    for earlier in reversed(positions[1:]):
        sweep.begin_step(earlier)
    correction = sweep.velocity(facets, positions[0], rate(difference, positions), difference)
    assert np.abs(correction).max() < 1e-12


def test_surfaces_at_rest_and_without_a_past_keep_their_velocity():
    x, facets = body(2, np.random.default_rng(5))
    difference, sweep = SCHEMES["bdf2"].difference(0.1, STEPS), Sweep(2)
    assert sweep.velocity(facets, x, np.ones_like(x), difference) is None
    sweep.begin_step(x)
    assert sweep.velocity(facets, x, np.ones_like(x), difference) is None


def test_facets_without_extent_have_no_velocity():
    facets, x = np.array([[0, 1], [1, 2]]), np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
    difference, sweep = SCHEMES["backward_euler"].difference(0.1, ()), Sweep(1)
    sweep.begin_step(x - np.array([0.0, 0.1]))
    assert np.isfinite(sweep.velocity(facets, x, np.zeros_like(x), difference)).all()
