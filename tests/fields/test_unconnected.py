"""Scenes that do not touch each other in one case: each gives what it gives alone, whatever lies beside it."""

from __future__ import annotations

import numpy as np
import pytest
from unconnected_scenes import Scene, case_of, computed, difference, draw_pair


AGREE = 1e-9


@pytest.mark.parametrize("seed", [*range(12), *(pytest.param(n, marks=pytest.mark.slow) for n in range(12, 120))])
def test_two_scenes_in_one_case(tmp_path, seed):
    """Statics and dynamics, contact, friction, ties, follower loads; ratios of stiffness from 1e-6 to 1e6."""
    rng = np.random.default_rng(seed)
    scenes, dynamics = draw_pair(rng), bool(rng.integers(2))
    both = computed(tmp_path / "both", case_of(scenes, dynamics=dynamics))
    for scene in scenes:
        alone = computed(tmp_path / scene.name, case_of([scene], dynamics=dynamics))
        assert difference(scene, alone, both) < AGREE
