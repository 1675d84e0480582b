"""The pictures of a movie, drawn by several processes: each draws every n-th one.

They are programs of their own, which get their work as a pickle and answer with a pickle for each picture: a copy of
this process would share its graphics library, and a module that is imported anew would run scripts of users again.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryFile

from fsci.plot.render import DrawnBody, Pixels
from fsci.plot.render_flow import load_state
from fsci.plot.scene import Scene, animate

Moment = Sequence[tuple[float, Path]]  #: (time, file) of each body
FRAMES_EACH = 8  #: pictures that take about as long as the start of a process


def draw_frames(
    scene: Scene, moments: Sequence[Moment], field: str, dots: int, processes: int | None = None
) -> Iterator[Pixels]:
    """The pictures in their order, shape (height, width, 3); by default on all cores that this process may use.

    Raises RuntimeError if a process that draws ends before it is done.
    """
    count = processes or min(len(os.sched_getaffinity(0)), len(moments) // FRAMES_EACH)
    if count <= 1:
        yield from animate(scene, _states(moments, field), dots=dots)
        return
    workers = [_start((scene, moments[first::count], field, dots)) for first in range(count)]
    try:
        for number in range(len(moments)):
            yield _next(workers[number % count])
    finally:
        for worker in workers:
            worker.kill()
            worker.communicate()


def _states(moments: Sequence[Moment], field: str) -> Iterator[tuple[float, list[DrawnBody]]]:
    for moment in moments:
        yield moment[0][0], load_state([file for _, file in moment], field)


def _start(work: tuple[Scene, Sequence[Moment], str, int]) -> subprocess.Popen[bytes]:
    program = [sys.executable, "-c", f"from {__name__} import answer; answer()"]
    with TemporaryFile() as given:  # not a pipe, as in `write_mp4`
        pickle.dump(work, given)
        given.seek(0)
        return subprocess.Popen(program, stdin=given, stdout=subprocess.PIPE)


def _next(worker: subprocess.Popen[bytes]) -> Pixels:
    assert worker.stdout is not None
    try:
        pixels: Pixels = pickle.load(worker.stdout)
    except EOFError:
        raise RuntimeError(f"a process that draws the movie ended with exit code {worker.wait()}") from None
    return pixels


def answer() -> None:
    """The program of a process that draws: work from stdin, pictures to stdout."""
    scene, moments, field, dots = pickle.load(sys.stdin.buffer)
    for pixels in animate(scene, _states(moments, field), dots=dots):
        pickle.dump(pixels, sys.stdout.buffer)
        sys.stdout.buffer.flush()
