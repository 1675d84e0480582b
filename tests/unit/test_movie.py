"""Movies: the same pictures by one process and by several, and an MP4 where there is a program that writes it."""

import math
import stat
import sys
from importlib import import_module

import numpy as np
import pytest
from test_picture import SI, bent_beam

from fsci.plot import movie
from fsci.plot.frames import draw_frames
from fsci.plot.movie import find_encoder, plot_movie, write_mp4
from fsci.plot.render_flow import load_state
from fsci.plot.scene import compose
from fsci.running.output import FieldWriter

#: An encoder that keeps what it is given.
KEEPS = """\
#!{python}
import sys
open(sys.argv[-1], "wb").write(" ".join(sys.argv[1:-1]).encode() + b"|" + sys.stdin.buffer.read())
"""
REFUSES = "#!/bin/sh\necho no such codec >&2\nexit 3\n"


def program(path, text):
    path.write_text(text)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


@pytest.fixture(scope="module")
def moments(tmp_path_factory):
    fields = FieldWriter(tmp_path_factory.mktemp("movie"))
    for step in range(4):
        fields.write(step, 0.1 * step, [bent_beam(0.3 * math.sin(step) + 0.5)])
    (series,) = fields.series.values()
    return [(entry,) for entry in series]


@pytest.fixture(scope="module")
def scene(moments):
    return compose((load_state([file], "displacement") for ((_, file),) in moments), "displacement", "beam", SI)


def test_two_processes_draw_what_one_does(moments, scene):
    one, two = (list(draw_frames(scene, moments, "displacement", 60, processes=count)) for count in (1, 2))
    assert len(one) == len(two) == 4
    for a, b in zip(one, two, strict=True):
        assert a.shape == (300, 480, 3)
        assert np.array_equal(a, b)
    assert not np.array_equal(one[0], one[1])


def test_a_process_that_ends_is_said(moments, scene, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(RuntimeError, match=r"^a process that draws the movie ended with exit code 1$"):
        list(draw_frames(scene, moments, "displacement", 60, processes=2))


def test_mp4_beside_gif(moments, tmp_path, monkeypatch):
    encoder = program(tmp_path / "ffmpeg", KEEPS.format(python=sys.executable))
    monkeypatch.setattr(movie, "find_encoder", lambda: encoder)
    gif, mp4 = plot_movie(tmp_path, moments, "displacement", "beam", SI)
    assert (gif.name, mp4.name) == ("movie.gif", "movie.mp4")
    told, _, pixels = mp4.read_bytes().partition(b"|")
    assert b"-f rawvideo -pix_fmt rgb24 -s 960x600 -r 20 -i -" in told
    assert told.endswith(b"-pix_fmt yuv420p -movflags +faststart -f mp4")
    assert len(pixels) == 4 * 960 * 600 * 3


def test_gif_alone_without_an_encoder(moments, tmp_path, monkeypatch):
    monkeypatch.setattr(movie.shutil, "which", lambda name: None)
    monkeypatch.setattr(movie, "find_spec", lambda name: None)
    assert find_encoder() is None
    assert plot_movie(tmp_path, moments, "displacement", "beam", SI) == [tmp_path / "movie.gif"]


def test_what_the_encoder_says(tmp_path):
    """It does not read its input. PETSc, where it is loaded, ends a process that writes to such a program."""
    import_module("petsc4py.PETSc")
    encoder = program(tmp_path / "ffmpeg", REFUSES)
    with pytest.raises(RuntimeError, match=r"ffmpeg cannot write a movie: no such codec$"):
        write_mp4(tmp_path / "movie.mp4", [np.zeros((600, 960, 3), dtype=np.uint8)], encoder)
    assert [path.name for path in tmp_path.iterdir()] == ["ffmpeg"]


@pytest.mark.skipif(find_encoder() is None, reason="no ffmpeg and no imageio-ffmpeg are installed")
def test_a_movie_of_an_odd_size(tmp_path):
    file = write_mp4(
        tmp_path / "movie.mp4", [np.full((33, 51, 3), 9 * n, dtype=np.uint8) for n in range(20)], find_encoder()
    )
    assert file.read_bytes()[4:8] == b"ftyp"
