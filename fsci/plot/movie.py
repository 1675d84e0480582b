"""An animation of all output times with a fixed frame and fixed colours."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from fsci.plot.frames import Moment, draw_frames
from fsci.plot.render import DrawnBody, Pixels
from fsci.plot.render_flow import load_state
from fsci.plot.scene import compose
from fsci.running.files import replacing

FRAMES = 200  #: at most; of a longer series every second, third, ... time is shown
MOVIE_DOTS = 120  #: pixels per inch: 960 x 600
MILLISECONDS = 50  #: per frame


def plot_movie(folder: Path, moments: Sequence[Moment], field: str, title: str, units: Mapping[str, str]) -> list[Path]:
    """Animates all bodies, coloured by a field, as movie.gif, and as movie.mp4 where there is a program that writes it.

    `moments`: (time, file) of each body at each time. Returns the files.
    """
    shown = moments[:: -(-len(moments) // FRAMES)]

    def extents() -> Iterator[list[DrawnBody]]:
        for moment in shown:
            yield load_state([file for _, file in moment], field, lines=False)

    scene = compose(extents(), field, title, units)
    frames = []
    for pixels in draw_frames(scene, shown, field, MOVIE_DOTS):
        frames.append(pixels)
        say_progress(len(frames), len(shown))
    files = [write_gif(folder / "movie.gif", frames)]
    if (encoder := find_encoder()) is not None:
        files.append(write_mp4(folder / "movie.mp4", frames, encoder))
    return files


def say_progress(done: int, count: int) -> None:
    """One line of a terminal, written over again."""
    if sys.stderr.isatty():
        print(f"\rmovie: frame {done} of {count}", end="\n" if done == count else "", file=sys.stderr, flush=True)


def write_gif(path: Path, frames: Sequence[Pixels]) -> Path:
    """Writes a GIF that repeats for ever; all frames have the colours of the last one, the fullest in most runs."""
    from PIL import Image

    images: list[Any] = [Image.fromarray(pixels) for pixels in frames]
    palette = images[-1].quantize(256, method=Image.Quantize.MAXCOVERAGE)  # keeps white white
    images = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    options: Any = {"save_all": True, "append_images": images[1:], "duration": MILLISECONDS, "loop": 0}
    with replacing(path) as unfinished:
        images[0].save(unfinished, format="GIF", **options)
    return path


def find_encoder() -> str | None:
    """The program ffmpeg, installed or that of the package imageio-ffmpeg; None without both."""
    if (found := shutil.which("ffmpeg")) is None and find_spec("imageio_ffmpeg") is not None:
        import imageio_ffmpeg

        found = imageio_ffmpeg.get_ffmpeg_exe()
    return found


def write_mp4(path: Path, frames: Sequence[Pixels], encoder: str) -> Path:
    """Writes an MP4 by ffmpeg, with a white row or column more where its format needs an even number of them.

    Raises RuntimeError with what ffmpeg says.
    """
    height, width, _ = frames[0].shape
    given = [
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-s",
        f"{width}x{height}",
        "-r",
        f"{1000 / MILLISECONDS:g}",
        "-i",
        "-",
    ]
    even = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    with TemporaryFile() as pixels, replacing(path) as unfinished:
        # not a pipe: where PETSc is loaded, a program that does not read one to its end would end this process
        for frame in frames:
            pixels.write(frame.tobytes())
        pixels.seek(0)
        program = [encoder, "-loglevel", "error", "-y", *given, *even, "-f", "mp4", str(unfinished)]
        done = subprocess.run(program, stdin=pixels, capture_output=True)
        if done.returncode:
            raise RuntimeError(f"{encoder} cannot write a movie: {done.stderr.decode(errors='replace').strip()}")
    return path
