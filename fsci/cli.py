"""The command line. Exit codes: 0 success, 1 a run that failed, 2 a bad case or command, 3 a run that was stopped."""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from fsci.argument_types import count, duration, override, share
from fsci.failed_commands import as_far_as_it_is_read, broken, fail, with_notes

DESCRIPTION = "Fluid-structure-contact interaction from one YAML case file."
EPILOG = """\
first steps:
  fsci new beam            write a commented case into the folder beam
  fsci check beam          is it right?
  fsci run beam            compute it; results in results/beam
  fsci plot results/beam   draw it

`fsci demo` does all of this with an elastic ball that falls through a fluid.

`mpirun -n 4 fsci run CASE` runs on four processes. `fsci COMMAND --help` tells more."""


def main() -> None:
    """Entry point of the program `fsci`."""
    sys.exit(as_far_as_it_is_read(lambda: execute(sys.argv[1:])))


def execute(arguments: Sequence[str]) -> int:
    """Run one command; returns its exit code. Wrong arguments raise SystemExit(2) with the usage on stderr."""
    options = _parser().parse_args(arguments)
    if getattr(options, "trust", False):
        from fsci.case.load import TRUST

        os.environ[TRUST] = "1"  # of this program, and of those that it starts
    try:
        return int(options.command(options))
    except ImportError as error:
        from fsci.dolfinx_needed import is_dolfinx, words

        if not is_dolfinx(error):
            raise
        return fail(f"fsci: {words(error)}")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="fsci",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"fsci {_version()}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(function, words: str) -> argparse.ArgumentParser:  # type: ignore[no-untyped-def]
        name = function.__name__.strip("_")
        new = commands.add_parser(name, help=words, description=words[0].upper() + words[1:] + ".")
        new.set_defaults(command=function)
        return new

    def settings(one: argparse.ArgumentParser, words: str) -> None:
        one.add_argument(
            "--set", dest="overrides", metavar="NAME=VALUE", action="append", default=[], type=override, help=words
        )
        one.add_argument("--trust", action="store_true", help="run the code of files that the case names as laws")

    def results(one: argparse.ArgumentParser) -> None:
        one.add_argument("out", metavar="OUT", type=Path, help="folder with the results of a run")

    new = command(_new, "write a small case that runs into a new folder")
    new.add_argument("name", metavar="NAME", type=Path, help="folder to make")
    new.add_argument(
        "--template",
        choices=("beam", "channel", "ball"),
        default="beam",
        help="what it computes: a swinging beam (default), flow past a cylinder in a channel, or a ball that falls "
        "through a fluid and bounces",
    )

    demo = command(_demo, "write, compute and draw a case in about a minute: a ball that falls through a fluid")
    demo.add_argument(
        "name", metavar="NAME", type=Path, nargs="?", default=Path("ball"), help="folder of the case (default: ball)"
    )

    for function, words in (
        (_check, "check a case: mistakes, warnings, size and cost"),
        (_run, "compute a case"),
    ):
        one = command(function, words)
        one.add_argument("case", metavar="CASE", type=Path, help="case file, or folder with a case.yaml")
        settings(one, "replace a setting: --set time.end=2 --set structure.bodies.beam.supports.0.on=top")
        if function is _run:
            one.add_argument(
                "-o", "--out", metavar="OUT", type=Path, help="folder for the results (default: results/NAME_OF_CASE)"
            )
            one.add_argument(
                "--force",
                action="store_true",
                help="take a results folder with other files in it; those in the way are renamed to NAME.old",
            )

    preview = command(_preview, "draw a case before it is computed: bodies, grid, supports, loads, pairs, probes")
    preview.add_argument("case", metavar="CASE", type=Path, help="case file, or folder with a case.yaml")
    settings(preview, "replace a setting")
    preview.add_argument(
        "-o",
        "--out",
        metavar="FILE",
        type=Path,
        default=Path("preview.png"),
        help="the picture (default: preview.png), or a page that turns: FILE.html",
    )

    resume = command(_resume, "continue a run from its last checkpoint")
    results(resume)
    settings(
        resume, "change a setting with which a run may continue: --set time.end=2 --set solver.newton.max_iterations=50"
    )

    plot = command(_plot, "draw the results of a run")
    results(plot)
    plot.add_argument(
        "--field", metavar="FIELD", help="field to colour by (default: displacement; of a flow velocity and pressure)"
    )
    plot.add_argument(
        "--time",
        dest="times",
        metavar="T",
        action="append",
        default=[],
        type=float,
        help="draw only the output nearest to this time; may be repeated",
    )
    plot.add_argument("--movie", action="store_true", help="make an animation too")
    plot.add_argument(
        "--scale", metavar="FACTOR", type=float, default=1.0, help="draw displacements times a factor (default: 1)"
    )
    plot._negative_number_matcher = re.compile(r"-[\d.]")  # coordinates may be negative: --line -1,0:1,0
    for name, metavar, words in (
        ("mirror", "PLANE", "draw both sides of a plane of symmetry, of which one was computed: --mirror y=0"),
        ("line", "FROM:TO", "only fields along a line, as a table and curves: --line 0,0.2:2.5,0.2"),
        ("surface", "BODY", "only fields along the surface of a body, as a table and, in 2D, curves"),
    ):
        plot.add_argument(
            f"--{name}", dest=f"{name}s", metavar=metavar, action="append", default=[], help=f"{words}; may be repeated"
        )

    report = command(_report, "write one page of a run: pictures, curves, balances, verification, time")
    results(report)

    explain = command(_explain, "explain why a step failed, or which parts of a run took the time")
    results(explain)
    explain.add_argument(
        "--replay",
        metavar="FOLDER",
        type=Path,
        help="make a folder from which fsci resume computes the failed step alone",
    )

    twin = command(_twin, "run a case with changes that must not change its answer, and show what they change")
    twin.add_argument("case", metavar="CASE", type=Path, help="case file, or folder with a case.yaml")
    settings(twin, "replace a setting of the case and of all twins")
    twin.add_argument("-o", "--out", metavar="OUT", type=Path, required=True, help="folder for the runs and twin.json")
    twin.add_argument("--quick", action="store_true", help="only the two twins that find most for their cost")
    twin.add_argument(
        "--only", metavar="NAME", action="append", default=[], help="only this twin, such as element; may be repeated"
    )

    converge = command(_converge, "run a case with coarser and finer levels, and estimate the errors of its values")
    converge.add_argument("case", metavar="CASE", type=Path, help="case file, or folder with a case.yaml")
    settings(converge, "replace a setting of the case and of all runs")
    converge.add_argument(
        "-o",
        "--out",
        metavar="OUT",
        type=Path,
        required=True,
        help="folder for the runs, converge.json and report.html",
    )
    converge.add_argument(
        "--probe",
        metavar="NAME",
        action="append",
        default=[],
        help="only the values of this probe, column or check, such as drag.x; may be repeated",
    )
    converge.add_argument(
        "--tolerance",
        metavar="SHARE",
        type=share,
        help="go to finer levels until all errors are smaller, and write the cheapest case for it: --tolerance 2%%",
    )
    converge.add_argument(
        "--budget", metavar="TIME", type=duration, help="leave out runs that would not end within it: --budget 20min"
    )

    sweep = command(_sweep, "run a case with several values of settings, and compare what comes out")
    sweep.add_argument("case", metavar="CASE", type=Path, help="case file, or folder with a case.yaml")
    settings(sweep, "values with commas between them: --set fluid.viscosity=1,2,3; one value is the same for all runs")
    sweep.add_argument(
        "-o", "--out", metavar="OUT", type=Path, required=True, help="folder for the runs, sweep.csv and pictures"
    )

    diff = command(_diff, "show what runs differ in from the first one: settings, values, curves")
    diff.add_argument("outs", metavar="OUT", nargs="+", type=Path, help="folders with the results of two or more runs")
    diff.add_argument(
        "-o",
        "--pictures",
        metavar="FOLDER",
        type=Path,
        default=Path("diff"),
        help="folder for pictures (default: diff)",
    )

    bench = command(_bench, "measure run time against error, in a copy of the repository")
    bench.add_argument(
        "names",
        metavar="NAME",
        nargs="*",
        help="a benchmark, a file of families, results (.json), 'all', or none: list them",
    )
    bench.add_argument("-o", "--out", metavar="FILE", type=Path, help="write the results as JSON")
    bench.add_argument("--against", metavar="FILE", type=Path, help="compare with the results in this file")
    bench.add_argument("--plot", metavar="FOLDER", type=Path, help="draw error against time, unknowns and memory")

    stress = command(_stress, "run random hard cases, each against its twin, and count wrong results")
    stress.add_argument("draws", metavar="N", type=count, nargs="?", default=20, help="number of cases (default: 20)")
    stress.add_argument("--seed", metavar="S", type=count, default=0, help="seed of the first case (default: 0)")
    stress.add_argument("-o", "--out", metavar="FILE", type=Path, help="write all results as JSON")
    stress.add_argument("--scenes", metavar="FILE", type=Path, help="draw from scenes of your own, a YAML file")
    stress.add_argument("--keep", metavar="FOLDER", type=Path, help="keep the cases with wrong results")
    stress.add_argument(
        "--steps",
        metavar="STEPS",
        type=count,
        help="instead: number of steps of one case, to see whether results drift",
    )

    schema = command(_schema, "print the JSON schema of case files, for editors")
    schema.add_argument("--markdown", action="store_true", help="print the input reference instead")
    return parser


def _version() -> str:
    try:
        return version("fsci")
    except PackageNotFoundError:
        return "(not installed)"


def _new(options: argparse.Namespace) -> int:
    from fsci.new import new_case

    try:
        files = new_case(options.name, options.template)
    except OSError as error:
        return fail(f"fsci new: cannot make the folder '{options.name}': {error.strerror}")
    print(f"wrote {' and '.join(str(path) for path in files)}; next: fsci run {options.name}")
    return 0


def _demo(options: argparse.Namespace) -> int:
    from fsci.demo import DemoError, demo

    try:
        return demo(options.name, lambda line: print(line, flush=True))
    except DemoError as error:
        return fail(f"fsci demo: {error}")
    except (OSError, MemoryError, KeyboardInterrupt) as error:
        return broken("demo", error)


def _check(options: argparse.Namespace) -> int:
    from fsci.case import CaseError, load_case
    from fsci.check.check import summary
    from fsci.check.cost import in_words, memory_of_machine, too_much_memory
    from fsci.check.meshes import check_meshes

    try:
        case = load_case(options.case, options.overrides)
        found = check_meshes(case)
        if found.problems:
            raise CaseError(found.problems)
    except CaseError as error:
        return fail(str(error))
    print(f"{case.path}\n{summary(case, found.meshes, found.pairs, found.walls)}")
    if cost := in_words(case, found.meshes):
        print(f"  estimate: {cost}")
    warnings = [*case.warnings, *found.warnings, *too_much_memory(case, found.meshes, memory_of_machine())]
    for kind, lines in (("note", found.notes), ("warning", warnings)):
        for line in lines:
            print(f"{kind}: {line}", file=sys.stderr)
    print("ok")
    return 0


def _run(options: argparse.Namespace) -> int:
    from mpi4py import MPI

    from fsci.case import CaseError, load_case

    first = MPI.COMM_WORLD.rank == 0
    try:
        case = load_case(options.case, options.overrides)
        for warning in case.warnings if first else ():
            print(f"warning: {warning}", file=sys.stderr)
        from fsci.running.processes import ending_together
        from fsci.running.run import run_case

        out = options.out or Path("results") / case.name
        with ending_together(MPI.COMM_WORLD, CaseError):
            return int(run_case(case, out, force=options.force))
    except CaseError as error:
        return fail(with_notes(error)) if first else 2
    except (OSError, MemoryError, KeyboardInterrupt) as error:
        return broken("run", error)


def _preview(options: argparse.Namespace) -> int:
    from fsci.preview.preview import preview

    return _printed("preview", lambda: preview(options.case, options.overrides, options.out))


def _resume(options: argparse.Namespace) -> int:
    from mpi4py import MPI

    from fsci.case import CaseError
    from fsci.running.processes import ending_together
    from fsci.running.run import resume_run

    try:
        with ending_together(MPI.COMM_WORLD, CaseError, FileNotFoundError):
            return int(resume_run(options.out, options.overrides))
    except CaseError as error:
        return fail(with_notes(error)) if MPI.COMM_WORLD.rank == 0 else 2
    except FileNotFoundError as error:
        if MPI.COMM_WORLD.rank == 0:
            print(f"fsci resume: {error}", file=sys.stderr)
        return 1
    except (OSError, MemoryError, KeyboardInterrupt) as error:
        return broken("resume", error)


def _plot(options: argparse.Namespace) -> int:
    from fsci.plot.picture import plot_run

    if not options.out.is_dir():
        return fail(f"fsci plot: there is no folder '{options.out}'")
    return _printed(
        "plot",
        lambda: plot_run(
            options.out,
            movie=options.movie,
            field=options.field,
            times=options.times,
            scale=options.scale,
            mirrors=options.mirrors,
            lines=options.lines,
            surfaces=options.surfaces,
        ),
    )


def _report(options: argparse.Namespace) -> int:
    from fsci.report.report import write_report

    return _printed("report", lambda: [write_report(options.out)])


def _explain(options: argparse.Namespace) -> int:
    from fsci.explain.explain import explain

    return _printed("explain", lambda: [explain(options.out, options.replay)])


def _twin(options: argparse.Namespace) -> int:
    from fsci.twin.twin import run_twins

    overrides = tuple(options.overrides)
    return _several(
        "twin", lambda: run_twins(options.case, overrides, options.out, only=options.only, quickly=options.quick)
    )


def _converge(options: argparse.Namespace) -> int:
    from fsci.converge.converge import converge

    def right() -> bool:
        return converge(
            options.case,
            tuple(options.overrides),
            options.out,
            only=options.probe,
            tolerance=options.tolerance,
            budget=options.budget,
            say=lambda line: print(line, flush=True),
        )

    return _several("converge", right)


def _sweep(options: argparse.Namespace) -> int:
    from fsci.sweep.sweep import sweep

    return _several(
        "sweep", lambda: sweep(options.case, options.overrides, options.out, lambda line: print(line, flush=True))
    )


def _several(name: str, right: Callable[[], bool]) -> int:
    """A command that makes several runs; those that are there are not repeated."""
    from fsci.case import CaseError

    try:
        return int(not right())
    except CaseError as error:
        return fail(str(error))
    except KeyboardInterrupt:
        return fail("stopped; the same command goes on from here") + 1
    except OSError as error:
        return fail(f"fsci {name}: {error}")


def _diff(options: argparse.Namespace) -> int:
    from fsci.diff import diff

    if len(options.outs) < 2:
        return fail("fsci diff: give the folders of two or more runs")
    return _printed("diff", lambda: diff(options.outs, options.pictures))


def _printed(name: str, make: Callable[[], Iterable[object]]) -> int:
    """A command that prints lines or the files that it has made."""
    from fsci.case import CaseError

    try:
        print("\n".join(str(line) for line in make()), flush=True)
    except BrokenPipeError:
        raise
    except CaseError as error:
        return fail(str(error))
    except (OSError, ValueError, RuntimeError) as error:
        return fail(f"fsci {name}: {error}")
    return 0


def _bench(options: argparse.Namespace) -> int:
    try:
        from fsci.bench.run import BenchmarkError, describe, run
    except ModuleNotFoundError as error:
        if error.name != "fsci.bench":
            raise
        return fail("fsci bench: the benchmarks are in the repository of fsci, not in what is installed here")
    if not options.names:
        print(describe())
        return 0
    try:
        run(options.names, options.out, options.against, options.plot)
    except BenchmarkError as error:
        return fail(f"fsci bench: {error}")
    return 0


def _stress(options: argparse.Namespace) -> int:
    from fsci.expression import ExpressionError
    from fsci.stress.frame import FrameError
    from fsci.stress.run import stress, stress_long, table, write
    from fsci.stress.scene import SCENES, SceneError

    if options.steps is not None:
        return stress_long(options.steps, options.out)
    seeds, scenes = range(options.seed, options.seed + options.draws), options.scenes or SCENES
    try:
        outcomes = stress(seeds, lambda line: print(line, flush=True), options.keep, scenes)
    except (SceneError, FrameError, ExpressionError, OSError) as error:
        return fail(f"fsci stress: {error}")
    print(table(outcomes))
    if options.out is not None:
        write(outcomes, options.out)
    return int(any(outcome.verdict == "wrong" for outcome in outcomes))


def _schema(options: argparse.Namespace) -> int:
    from fsci.schema import json_schema, reference_markdown

    return _printed("schema", lambda: [reference_markdown() if options.markdown else json_schema()])
