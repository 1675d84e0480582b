"""`cases/hopper`: discs fall on an elastic flap, with friction, in a fluid."""

from itertools import combinations

import numpy as np
import pytest
from programs import fsci, warnings_of

from fsci.running.history import read_history


@pytest.mark.slow(seconds=170)
def test_hopper(tmp_path):
    """Its numbers hold and no disc enters another one; only films below a cell are warned of."""
    out = tmp_path / "out"
    done = fsci("run", "cases/hopper", "-o", out, "--set", "output.fields_every=0", timeout=1800)
    assert done.returncode == 0, done.stdout[-3000:]
    assert "verify ok" in done.stdout
    assert "repeated with" not in done.stdout
    assert all("in the gap to" in str(found) for found in warnings_of(out)), warnings_of(out)
    history = read_history(out / "history.csv")
    centres = [np.array([history[f"disc_{k}.{axis}"] for axis in "xy"]) for k in range(1, 6)]
    chord = 0.16 * np.cos(np.pi / 32)  # of two polygons with 32 sides
    for one, other in combinations(centres, 2):
        assert np.linalg.norm(one - other, axis=0).min() > chord - 1e-9
    assert history["contact.on_disc_2.y"].max() > 0.5
