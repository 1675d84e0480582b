"""A solid scene beside a flow with a body, outside of its box, in one case: each gives what it gives alone."""

from __future__ import annotations

import numpy as np
import pytest
from unconnected_scenes import case_of, computed, coupled, difference, draw_beside_flow

AGREE = 1e-9


@pytest.mark.parametrize("scheme", ["monolithic", "partitioned"])
@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(1, 40))])
def test_a_scene_beside_a_flow(tmp_path, scheme, seed):
    """In steady and unsteady flow; supports that move the other scene, its accelerations and its way do not count."""
    rng = np.random.default_rng(seed)
    in_flow, beside = draw_beside_flow(rng)
    dynamics = bool(rng.integers(2))
    times, settings = {"dynamics": dynamics, "end": 0.3 if dynamics else 1.0}, coupled(scheme, dynamics=dynamics)
    both = computed(tmp_path / "both", case_of([in_flow, beside], **times, **settings))
    with_flow = computed(tmp_path / "flow", case_of([in_flow], **times, **settings))
    alone = computed(tmp_path / "solid", case_of([beside], **times))
    assert difference(in_flow, with_flow, both) < AGREE
    assert difference(beside, alone, both) < AGREE
