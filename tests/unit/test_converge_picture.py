"""The picture of error against time, where all runs have one error: that of the tolerance of solvers."""

import warnings
from types import SimpleNamespace

from fsci.converge import picture


def test_one_error(tmp_path, monkeypatch):
    monkeypatch.setattr(picture, "error_of", lambda one, found: 1e-6)
    runs = [
        SimpleNamespace(run=SimpleNamespace(role="level", name=name), seconds=seconds)
        for name, seconds in (("case", 3.1), ("coarser_1.41", 3.0), ("coarser_2", 5.1))
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert picture.draw(tmp_path / "picture.png", {}, runs)
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
