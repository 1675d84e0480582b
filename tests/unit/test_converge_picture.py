"""The picture of error against time, where all runs have one error: that of the tolerance of solvers."""

import warnings
from types import SimpleNamespace

from fsci.converge import picture


def test_one_error(tmp_path, monkeypatch):
    from matplotlib.axes import Axes

    monkeypatch.setattr(picture, "error_of", lambda one, found: 1e-6)
    runs = [
        SimpleNamespace(run=SimpleNamespace(role="level", name=name, size=size), seconds=seconds)
        for name, size, seconds in (("case", 1.0, 3.1), ("coarser_2", 2.0, 5.1), ("coarser_1.41", 1.41, 3.0))
    ]
    joined, loglog = [], Axes.loglog
    monkeypatch.setattr(Axes, "loglog", lambda *some, **more: joined.append(some[1]) or loglog(*some, **more))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert picture.draw(tmp_path / "picture.png", {}, runs)
    assert joined == [[3.1, 3.0, 5.1]], "from level to level, whatever time they took"
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
