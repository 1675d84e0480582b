"""An animation of all output times with a fixed frame and fixed colours."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fsci.plot.render import DrawnBody, Pixels
from fsci.plot.render_flow import load_state
from fsci.plot.scene import animate, compose
from fsci.running.files import replacing

FRAMES = 200  #: at most; of a longer series every second, third, ... time is shown
MOVIE_DOTS = 120  #: pixels per inch: 960 x 600
MILLISECONDS = 50  #: per frame


def plot_movie(
    path: Path, moments: Sequence[Sequence[tuple[float, Path]]], field: str, title: str, units: Mapping[str, str]
) -> Path:
    """Animates all bodies, coloured by a field, as a GIF; `moments`: (time, file) of each body at each time."""
    shown = moments[:: -(-len(moments) // FRAMES)]

    def states() -> Iterator[tuple[float, list[DrawnBody]]]:
        for moment in shown:
            yield moment[0][0], load_state([file for _, file in moment], field)

    scene = compose((state for _, state in states()), field, title, units)
    write_gif(path, animate(scene, states(), dots=MOVIE_DOTS))
    return path


def write_gif(path: Path, frames: Iterable[Pixels]) -> None:
    """Writes a GIF that repeats for ever; all frames have the colours of the last one, the fullest in most runs."""
    from PIL import Image

    images: list[Any] = [Image.fromarray(pixels) for pixels in frames]
    palette = images[-1].quantize(256, method=Image.Quantize.MAXCOVERAGE)  # keeps white white
    images = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    options: Any = {"save_all": True, "append_images": images[1:], "duration": MILLISECONDS, "loop": 0}
    with replacing(path) as unfinished:
        images[0].save(unfinished, format="GIF", **options)
