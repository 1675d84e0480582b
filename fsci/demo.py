"""The demonstration of an installed program: a case is written, computed and drawn by the commands for it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from mpi4py import MPI

from fsci.case import CaseError, load_case
from fsci.new import new_case, texts
from fsci.running.processes import ending_together
from fsci.running.run import run_case

TEMPLATE = "ball"
#: Picture -> what it shows.
SHOWN = {
    "movie.gif": "the ball falls, is pressed against the bottom and jumps; colours are the speed of the fluid",
    "story_velocity.png": "the same in six panels",
    "history_ball.png": "the centre of the ball: 1 m of fall, then jumps that the fluid makes lower",
    "history_contact.png": "the force of the bottom on the ball; zero while it flies",
    "history_energy.png": "kinetic energy becomes elastic energy and comes back",
}


class DemoError(Exception):
    """The demonstration cannot be made here; the message says why."""


def demo(folder: Path, say: Callable[[str], None]) -> int:
    """Write the case into a folder, run it, draw it and say what is seen (collective); returns the exit code.

    Raises DemoError if something else is in the folder.
    """
    comm = MPI.COMM_WORLD
    first = comm.rank == 0
    out = Path("results") / folder.absolute().name
    wrong = _write(folder) if first else ""
    if wrong := comm.bcast(wrong):
        raise DemoError(wrong) if first else SystemExit(2)
    if first:
        say(f"$ fsci new {folder} --template {TEMPLATE}\n$ fsci run {folder}")
    with ending_together(comm, CaseError):
        status = int(run_case(load_case(folder), out))
    if status or not first:
        return status
    say(f"$ fsci plot {out} --movie")
    _draw(out, say)
    say(f"Change {folder / 'case.yaml'} and run it again, or open {out / 'fields'} in ParaView.")
    return 0


def _write(folder: Path) -> str:
    """Make the case, unless it is there unchanged; returns why not, or nothing."""
    try:
        new_case(folder, TEMPLATE)
    except FileExistsError:
        path, text = next(iter(texts(folder, TEMPLATE).items()))
        if not path.is_file() or path.read_text(encoding="utf-8", errors="replace") != text:
            return f"'{folder}' is there, and is not this case as it was written: name another folder"
    except OSError as error:
        return f"cannot make the folder '{folder}': {error.strerror}"
    return ""


def _draw(out: Path, say: Callable[[str], None]) -> None:
    from fsci.plot.picture import plot_run

    for path in plot_run(out, movie=True):
        if path.name in SHOWN:
            say(f"{path}\n    {SHOWN[path.name]}")
